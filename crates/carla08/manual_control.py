#!/usr/bin/env python3
"""Drives a vehicle with the keyboard, in a window.

    W or up     : throttle            Q     : toggle reverse
    S or down   : brake               Space : hand brake
    A/D or left/right : steer         P     : toggle autopilot
    R           : restart the episode Escape: end

The program of CARLA 0.8, with its flags and keys; needs pygame.
"""

import argparse
import logging
import random
import time

import numpy

try:
    import pygame
except ImportError:
    raise SystemExit("manual_control.py needs pygame; install it: pip install pygame") from None

from carla08 import image_converter
from carla08.client import VehicleControl, make_carla_client
from carla08.sensor import Camera, Lidar
from carla08.settings import CarlaSettings
from carla08.util import retry_until_served

WINDOW = (800, 600)
MINI = (200, 150)
# Metres at the edge of the small lidar and map images.
LIDAR_M, MAP_M = 50.0, 120.0


def settings_of(args):
    """Returns the settings of a town with traffic, and the sensors of the window."""
    settings = CarlaSettings()
    settings.set(SynchronousMode=False, SendNonPlayerAgentsInfo=True, NumberOfVehicles=15,
                 NumberOfPedestrians=30, WeatherId=random.choice([1, 3, 7, 8, 14]),
                 QualityLevel=args.quality_level)
    settings.randomize_seeds()
    for name, shown, size in (("CameraRGB", "SceneFinal", WINDOW),
                              ("CameraDepth", "Depth", MINI),
                              ("CameraSemSeg", "SemanticSegmentation", MINI)):
        camera = Camera(name, PostProcessing=shown)
        camera.set_image_size(*size)
        camera.set_position(2.0, 0.0, 1.4)
        settings.add_sensor(camera)
    if args.lidar:
        lidar = Lidar("Lidar32")
        lidar.set_position(0, 0, 2.5)
        lidar.set(Channels=32, Range=LIDAR_M, PointsPerSecond=100000, RotationFrequency=10,
                  UpperFovLimit=10, LowerFovLimit=-30)
        settings.add_sensor(lidar)
    return settings


class Game:
    """The window of one client."""

    def __init__(self, client, args):
        self._client, self._args = client, args
        self._autopilot = args.autopilot
        self._reverse = False
        self._window = self._lanes = None
        self._images = {}
        self._told = 0.0

    def run(self):
        """Runs until the escape key is pressed."""
        pygame.init()
        try:
            self._window = pygame.display.set_mode(WINDOW)
            pygame.display.set_caption("CARLA 0.8: manual control")
            if self._args.map:
                self._lanes = numpy.array([
                    (w.transform.location.x, w.transform.location.y)
                    for w in self._client.map.generate_waypoints(4.0)])
            self._new_episode()
            frame = 0
            while self._frame() and frame != self._args.frames - 1:
                frame += 1
        finally:
            pygame.quit()

    def _new_episode(self):
        scene = self._client.load_settings(settings_of(self._args))
        self._client.start_episode(random.randrange(len(scene.player_start_spots)))
        self._reverse = False
        self._images = {}

    def _frame(self):
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                return False
            if event.type == pygame.KEYDOWN:
                if event.key == pygame.K_ESCAPE:
                    return False
                if event.key == pygame.K_r:
                    self._new_episode()
                elif event.key == pygame.K_q:
                    self._reverse = not self._reverse
                elif event.key == pygame.K_p:
                    self._autopilot = not self._autopilot
        measurements, sensor_data = self._client.read_data()
        self._images.update(sensor_data)
        player = measurements.player_measurements
        if self._autopilot:
            self._client.send_control(player.autopilot_control)
        else:
            self._client.send_control(self._control(pygame.key.get_pressed()))
        self._draw(measurements)
        if time.monotonic() - self._told > 1.0:
            self._told = time.monotonic()
            print(f"({player.transform.location.x:.1f}, {player.transform.location.y:.1f}) "
                  f"{3.6 * player.forward_speed:.0f} km/h, "
                  f"{100 * player.intersection_otherlane:.0f}% other lane, "
                  f"{100 * player.intersection_offroad:.0f}% off-road")
        return True

    def _control(self, keys):
        control = VehicleControl()
        if keys[pygame.K_LEFT] or keys[pygame.K_a]:
            control.steer = -1.0
        if keys[pygame.K_RIGHT] or keys[pygame.K_d]:
            control.steer = 1.0
        if keys[pygame.K_UP] or keys[pygame.K_w]:
            control.throttle = 1.0
        if keys[pygame.K_DOWN] or keys[pygame.K_s]:
            control.brake = 1.0
        control.hand_brake = bool(keys[pygame.K_SPACE])
        control.reverse = self._reverse
        return control

    def _draw(self, measurements):
        images, gap = self._images, 8
        if "CameraRGB" in images:
            self._show(image_converter.to_rgb_array(images["CameraRGB"]), (0, 0))
        small = []
        if "CameraDepth" in images:
            small.append(image_converter.depth_to_logarithmic_grayscale(images["CameraDepth"]))
        if "CameraSemSeg" in images:
            small.append(image_converter.labels_to_cityscapes_palette(images["CameraSemSeg"]))
        if "Lidar32" in images:
            points = images["Lidar32"].data[:, :2]
            # Forward is up.
            small.append(dots(numpy.stack([points[:, 1], -points[:, 0]], 1), LIDAR_M))
        if self._lanes is not None:
            at = measurements.player_measurements.transform.location
            small.append(dots(self._lanes - (at.x, at.y), MAP_M))
        for i, picture in enumerate(small):
            self._show(picture, (gap + i * (MINI[0] - gap), WINDOW[1] - MINI[1] - gap)
                       if len(small) > 3 else
                       (gap + i * (MINI[0] + gap), WINDOW[1] - MINI[1] - gap))
        pygame.display.flip()

    def _show(self, picture, at):
        turned = numpy.ascontiguousarray(picture.swapaxes(0, 1).astype(numpy.uint8))
        self._window.blit(pygame.surfarray.make_surface(turned), at)


def dots(points, reach_m):
    """Returns the points around the vehicle as a small image."""
    picture = numpy.zeros((MINI[1], MINI[0], 3), numpy.uint8)
    scale = MINI[1] / 2.0 / reach_m
    x = (points[:, 0] * scale + MINI[0] / 2.0).astype(int)
    y = (points[:, 1] * scale + MINI[1] / 2.0).astype(int)
    inside = (x >= 0) & (x < MINI[0]) & (y >= 0) & (y < MINI[1])
    picture[y[inside], x[inside]] = 255
    picture[MINI[1] // 2 - 1: MINI[1] // 2 + 2, MINI[0] // 2 - 1: MINI[0] // 2 + 2] = (255, 0, 0)
    return picture


def main():
    """Parses the flags, and retries until the server is up."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
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
    parser.add_argument("-m", "--map", nargs="?", const=True, default=None,
                        help="show the map around the vehicle")
    parser.add_argument("--frames", metavar="N", default=0, type=int,
                        help="frames after which to end (default: never)")
    args = parser.parse_args()
    logging.basicConfig(format="%(levelname)s: %(message)s",
                        level=logging.DEBUG if args.debug else logging.INFO)
    print(__doc__)

    def work():
        with make_carla_client(args.host, args.port) as client:
            Game(client, args).run()

    retry_until_served(work, logging)
    print("Done.")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("\nCancelled by user. Bye!")
