"""The context of the checks, and functions to compare measurements."""

import os
import queue
import tempfile

# The package caches map files without limit; a test must not use those of another run.
os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")

import carla
import numpy as np

DELTA = 0.05
# Bounds a hang, not how fast a loaded machine loads a map.
TIMEOUT = 120.0


class Context:
    """A client, its world, and the state that checks share."""

    def __init__(self, port):
        self.port = port
        self.client = carla.Client("127.0.0.1", port)
        self.client.set_timeout(TIMEOUT)
        self.world = self.client.get_world()
        self.map = self.world.get_map()
        self.library = self.world.get_blueprint_library()
        self.points = self.map.get_spawn_points()
        self.next_point = 0

    def synchronise(self):
        settings = self.world.get_settings()
        settings.synchronous_mode = True
        settings.fixed_delta_seconds = DELTA
        self.world.apply_settings(settings)

    def ticks(self, count):
        for _ in range(count):
            frame = self.world.tick()
        return frame

    def car(self, blueprint="vehicle.tesla.model3", **attributes):
        """Spawns a vehicle at a spawn point that no check has used yet."""
        found = self.library.find(blueprint)
        for name, value in attributes.items():
            found.set_attribute(name, value)
        while True:
            point = self.points[self.next_point % len(self.points)]
            self.next_point += 7
            car = self.world.try_spawn_actor(found, point)
            if car is not None:
                self.world.tick()
                return car

    def sensor(self, blueprint, carrier, transform=None, **attributes):
        found = self.library.find(blueprint)
        for name, value in attributes.items():
            found.set_attribute(name, str(value))
        transform = transform or carla.Transform(carla.Location(x=1.0, z=2.2))
        sensor = self.world.spawn_actor(found, transform, attach_to=carrier)
        measured = queue.Queue()
        sensor.listen(measured.put)
        return sensor, measured


def arrived(measured, at_least=0):
    """Returns what has been measured, at least so many: a listener receives measurements on a
    thread of its own, on a loaded machine some time after the tick has ended."""
    measurements = [measured.get(timeout=TIMEOUT) for _ in range(at_least)]
    while True:
        try:
            measurements.append(measured.get(timeout=1.0))
        except queue.Empty:
            return measurements


def of_frame(measured, frame):
    """Waits for the measurement of this frame, and returns it."""
    while True:
        measurement = measured.get(timeout=TIMEOUT)
        if measurement.frame == frame:
            return measurement


def pixels(image):
    return np.frombuffer(image.raw_data, dtype=np.uint8).reshape(image.height, image.width, 4)


def near(a, b, tolerance):
    assert abs(a - b) <= tolerance, f"{a} differs from {b} by more than {tolerance}"
