#!/usr/bin/env python3
"""Drives three episodes of 300 frames; optionally writes the sensor data.

The program of CARLA 0.8, with its flags and its files:
_out/episode_0000/CameraRGB/000001.png etc.
"""

import argparse
import logging
import random

from carla08.client import make_carla_client
from carla08.sensor import Camera, Lidar
from carla08.settings import CarlaSettings
from carla08.util import print_over_same_line, retry_until_served


def settings_of(args):
    """Returns the settings of the episode, from a file if one is given."""
    if args.carla_settings is not None:
        with open(args.carla_settings, encoding="utf-8") as file:
            return file.read()
    settings = CarlaSettings()
    settings.set(
        SynchronousMode=True,
        SendNonPlayerAgentsInfo=True,
        NumberOfVehicles=20,
        NumberOfPedestrians=40,
        WeatherId=random.choice([1, 3, 7, 8, 14]),
        QualityLevel=args.quality_level)
    settings.randomize_seeds()
    width, height = args.size
    for name, shown in (("CameraRGB", "SceneFinal"), ("CameraDepth", "Depth")):
        camera = Camera(name, PostProcessing=shown)
        camera.set_image_size(width, height)
        camera.set_position(0.30, 0, 1.30)
        settings.add_sensor(camera)
    if args.lidar:
        lidar = Lidar("Lidar32")
        lidar.set_position(0, 0, 2.50)
        lidar.set_rotation(0, 0, 0)
        lidar.set(Channels=32, Range=50, PointsPerSecond=100000, RotationFrequency=10,
                  UpperFovLimit=10, LowerFovLimit=-30)
        settings.add_sensor(lidar)
    return settings


def run_carla_client(args):
    """Runs all episodes in one connection."""
    with make_carla_client(args.host, args.port) as client:
        print("CarlaClient connected")
        for episode in range(args.episodes):
            scene = client.load_settings(settings_of(args))
            player_start = random.randrange(len(scene.player_start_spots))
            print(f"Starting new episode at {scene.map_name}, spot {player_start}...")
            client.start_episode(player_start)
            for frame in range(args.frames):
                measurements, sensor_data = client.read_data()
                print_measurements(measurements)
                if args.save_images_to_disk:
                    for name, measurement in sensor_data.items():
                        filename = args.out_filename_format.format(episode, name, frame)
                        measurement.save_to_disk(filename)
                if args.autopilot:
                    # autopilot_control is the control of the autopilot; sending it back lets it
                    # drive. Noise adds variety to the data.
                    control = measurements.player_measurements.autopilot_control
                    control.steer += random.uniform(-0.1, 0.1)
                    client.send_control(control)
                else:
                    client.send_control(steer=random.uniform(-1.0, 1.0), throttle=0.5, brake=0.0,
                                        hand_brake=False, reverse=False)
            print()


def print_measurements(measurements):
    """Prints one line over the previous one."""
    player = measurements.player_measurements
    print_over_same_line(
        f"Vehicle at ({player.transform.location.x:.1f}, {player.transform.location.y:.1f}), "
        f"{player.forward_speed * 3.6:.0f} km/h, Collision: "
        f"{{vehicles={player.collision_vehicles:.0f}, "
        f"pedestrians={player.collision_pedestrians:.0f}, other={player.collision_other:.0f}}}, "
        f"{100 * player.intersection_otherlane:.0f}% other lane, "
        f"{100 * player.intersection_offroad:.0f}% off-road, "
        f"({len(measurements.non_player_agents)} non-player agents in the scene)")


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
    parser.add_argument("-a", "--autopilot", action="store_true", help="enable autopilot")
    parser.add_argument("-l", "--lidar", action="store_true", help="enable Lidar")
    parser.add_argument("-q", "--quality-level", choices=["Low", "Epic"], default="Epic",
                        type=lambda s: s.title(), help="graphics quality level")
    parser.add_argument("-i", "--images-to-disk", action="store_true",
                        dest="save_images_to_disk", help="save images (and Lidar data) to disk")
    parser.add_argument("-c", "--carla-settings", metavar="PATH", default=None,
                        help="path to a 'CarlaSettings.ini' file")
    parser.add_argument("--episodes", metavar="N", default=3, type=int,
                        help="number of episodes (default: 3)")
    parser.add_argument("--frames", metavar="N", default=300, type=int,
                        help="frames of an episode (default: 300)")
    parser.add_argument("--size", metavar="WxH", default=(800, 600), type=size,
                        help="size of an image (default: 800x600)")
    args = parser.parse_args()
    args.out_filename_format = "_out/episode_{:0>4d}/{:s}/{:0>6d}"
    logging.basicConfig(format="%(levelname)s: %(message)s",
                        level=logging.DEBUG if args.debug else logging.INFO)
    logging.info("connecting to %s:%s", args.host, args.port)
    retry_until_served(lambda: run_carla_client(args), logging)
    print("Done.")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("\nCancelled by user. Bye!")
