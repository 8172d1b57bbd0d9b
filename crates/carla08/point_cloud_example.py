#!/usr/bin/env python3
"""Converts depth images to point clouds in world space; writes one per 100 frames as PLY.

The program of CARLA 0.8, with its flags; writes _out/episode_0000/00000.ply etc.
"""

import argparse
import logging
import random

from carla08.client import make_carla_client
from carla08.image_converter import depth_to_local_point_cloud, to_rgb_array
from carla08.sensor import Camera
from carla08.settings import CarlaSettings
from carla08.transform import Transform
from carla08.util import StopWatch, print_over_same_line, retry_until_served


def run_carla_client(args):
    """Runs one episode."""
    width, height = args.size
    with make_carla_client(args.host, args.port) as client:
        print("CarlaClient connected")
        settings = CarlaSettings()
        settings.set(SynchronousMode=True, SendNonPlayerAgentsInfo=False, NumberOfVehicles=20,
                     NumberOfPedestrians=40,
                     WeatherId=random.choice([1, 3, 7, 8, 14]))
        settings.randomize_seeds()
        depth = Camera("CameraDepth", PostProcessing="Depth", FOV=69.0)
        colour = Camera("CameraRGB", PostProcessing="SceneFinal", FOV=69.0)
        for camera in (depth, colour):
            camera.set_image_size(width, height)
            camera.set_position(2.20, 0, 1.30)
            camera.set_rotation(0.0, 0.0, 0.0)
            settings.add_sensor(camera)
        scene = client.load_settings(settings)
        client.start_episode(random.randrange(len(scene.player_start_spots)))
        car_from_camera = depth.get_unreal_transform()
        for frame in range(args.frames):
            measurements, sensor_data = client.read_data()
            player = measurements.player_measurements
            if frame % args.every == args.every - 1:
                watch = StopWatch()
                # max_depth excludes the sky and distant points.
                cloud = depth_to_local_point_cloud(
                    sensor_data["CameraDepth"], to_rgb_array(sensor_data["CameraRGB"]),
                    max_depth=args.far)
                cloud.apply_transform(Transform(player.transform) * car_from_camera)
                watch.stop()
                cloud.save_to_disk(f"_out/episode_{0:0>4d}/{frame:0>5d}.ply")
                print_over_same_line(
                    f"frame {frame}: {len(cloud)} points in {watch.milliseconds():.0f} ms")
            client.send_control(player.autopilot_control)
        print()


def size(text):
    """Parses WIDTHxHEIGHT."""
    width, height = (int(part) for part in text.split("x"))
    return width, height


def main():
    """Parses the flags, and retries until the server is up."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("-v", "--verbose", action="store_true", dest="debug",
                        help="print debug information")
    parser.add_argument("--host", metavar="H", default="localhost",
                        help="IP of the host server (default: localhost)")
    parser.add_argument("-p", "--port", metavar="P", default=2000, type=int,
                        help="TCP port to listen to (default: 2000)")
    parser.add_argument("--frames", metavar="N", default=3000, type=int,
                        help="number of episodes (default: 3000)")
    parser.add_argument("--every", metavar="N", default=100, type=int,
                        help="frames between two files (default: 100)")
    parser.add_argument("--far", metavar="D", default=0.07, type=float,
                        help="depth at which points end, of 1000 m (default: 0.07)")
    parser.add_argument("--size", metavar="WxH", default=(800, 600), type=size,
                        help="size of an image (default: 800x600)")
    args = parser.parse_args()
    logging.basicConfig(format="%(levelname)s: %(message)s",
                        level=logging.DEBUG if args.debug else logging.INFO)
    retry_until_served(lambda: run_carla_client(args), logging)
    print("Done.")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("\nClient stopped by user.")
