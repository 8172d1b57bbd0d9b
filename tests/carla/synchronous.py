"""A data collection loop: ticks, and a queue for each sensor.

Usage: synchronous.py PORT TICKS.
"""

import os
import queue
import sys
import tempfile
import time

os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")

import carla

DELTA = 0.05
TIMEOUT = 20.0


def main():
    port, ticks = int(sys.argv[1]), int(sys.argv[2])
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(TIMEOUT)
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = DELTA
    world.apply_settings(settings)
    library = world.get_blueprint_library()
    manager = client.get_trafficmanager()
    manager.set_synchronous_mode(True)
    points = world.get_map().get_spawn_points()
    cars = [world.try_spawn_actor(library.find("vehicle.tesla.model3"), point)
            for point in points[::9][:6]]
    cars = [car for car in cars if car is not None]
    world.tick()
    for car in cars:
        car.set_autopilot(True, manager.get_port())
    mounts = carla.Transform(carla.Location(x=1.0, z=2.2))
    kinds = [("sensor.camera.rgb", {"image_size_x": "320", "image_size_y": "240"})] * 2
    kinds += [("sensor.camera.depth", {"image_size_x": "320", "image_size_y": "240"})] * 2
    kinds += [("sensor.lidar.ray_cast", {"range": "50"})] * 2
    kinds += [("sensor.other.radar", {}), ("sensor.other.imu", {}), ("sensor.other.gnss", {})]
    sensors = []
    for name, attributes in kinds:
        blueprint = library.find(name)
        for key, value in attributes.items():
            blueprint.set_attribute(key, value)
        sensor = world.spawn_actor(blueprint, mounts, attach_to=cars[0])
        measured = queue.Queue()
        sensor.listen(measured.put)
        sensors.append((sensor, measured))
    start = cars[0].get_location()
    last = world.get_snapshot().frame
    begun = time.perf_counter()
    for _ in range(ticks):
        frame = world.tick()
        assert frame == last + 1, f"frame {frame} came after frame {last}"
        last = frame
        for sensor, measured in sensors:
            data = measured.get(timeout=TIMEOUT)
            assert data.frame == frame, f"{sensor.type_id}: measured frame {data.frame} at frame {frame}"
            assert abs(data.timestamp - world.get_snapshot().timestamp.elapsed_seconds) < 1e-6
    seconds = time.perf_counter() - begun
    assert all(measured.empty() for _, measured in sensors)
    assert cars[0].get_location().distance(start) > 3.0
    for sensor, _ in sensors:
        sensor.stop()
        sensor.destroy()
    print(f"{ticks} ticks, {len(sensors)} sensors: {1e3 * seconds / ticks:.2f} ms per tick")
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    try:
        main()
    except BaseException:
        import traceback

        traceback.print_exc()
        os._exit(1)
