"""The official `carla` package's side of `bench carla-client`.

Usage: carla_client.py PORT JOB COUNT. Prints the seconds of each measurement as one JSON list. A job of a
client that does not tick names an actor: `actor:24`.
"""

import json
import os
import queue
import sys
import tempfile
import time

os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")

import carla


def measure(work, count, pause=0.0):
    times = []
    for _ in range(count):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
        if pause:
            time.sleep(pause)
    return times


def measure_calls(client, world, job, count):
    """Calls of a client that does not tick, about one actor, a few milliseconds apart."""
    job, actor = job.split(":")
    car = world.get_actor(int(actor))
    if job == "actor":
        return measure(car.get_physics_control, count, 0.003)
    manager = client.get_trafficmanager()
    return measure(lambda: manager.vehicle_percentage_speed_difference(car, 10.0), count, 0.003)


def main():
    port, job, count = int(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(20.0)
    world = client.get_world()
    if ":" in job:
        print(json.dumps(measure_calls(client, world, job, count)))
        sys.stdout.flush()
        os._exit(0)
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = 0.05
    world.apply_settings(settings)
    for _ in range(count // 10):
        world.tick()
    if job == "tick":
        times = measure(world.tick, count)
    elif job == "call":
        times = measure(client.get_server_version, count)
    elif job == "batch":
        cars = [actor.id for actor in world.get_actors().filter("vehicle.*")]
        control = carla.VehicleControl(throttle=0.3)
        controls = [carla.command.ApplyVehicleControl(car, control) for car in cars]
        times = measure(lambda: client.apply_batch_sync(controls), count)
    else:
        blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
        view = carla.Transform(carla.Location(z=20.0), carla.Rotation(pitch=-20.0))
        camera = world.spawn_actor(blueprint, view)
        images = queue.Queue()
        camera.listen(images.put)

        def tick_to_image():
            frame = world.tick()
            while images.get(timeout=20.0).frame != frame:
                pass

        measure(tick_to_image, count // 10)
        times = measure(tick_to_image, count)
    print(json.dumps(times))
    sys.stdout.flush()
    # The package aborts now and then while its threads end.
    os._exit(0)


if __name__ == "__main__":
    main()
