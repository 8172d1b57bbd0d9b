"""The agent of `bench latency` with the official `carla` package: ticks, reads the snapshot and answers
with a control.

Usage: loop_agent_carla.py PORT ACTOR; otherwise as loop_agent.py.
"""

import os
import queue
import sys
import tempfile
import time

os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")

import carla


def main(port, car):
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(20.0)
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = 0.05
    world.apply_settings(settings)
    world.tick()
    car = world.get_actor(car)
    turns = 0
    cameras, images = [], queue.Queue()

    def loop():
        nonlocal turns
        turns += 1
        # Each answer differs from the one before.
        steer = (turns % 512) / 1024
        car.apply_control(carla.VehicleControl(brake=1.0, steer=steer))
        frame = world.tick()
        transform, found = world.get_snapshot().find(car.id).get_transform(), car.get_control().steer
        nanos = time.monotonic_ns()
        if found != steer or transform.location.x != transform.location.x:
            sys.exit(f"loop_agent_carla.py: frame {frame} shows steer {found}, not {steer}")
        return frame, nanos

    def poses():
        frame = world.tick()
        begun = time.monotonic_ns()
        poses = [(actor.id, actor.get_transform()) for actor in world.get_snapshot()]
        nanos = time.monotonic_ns() - begun
        if len(poses) < 1000:
            sys.exit(f"loop_agent_carla.py: frame {frame} has {len(poses)} actors")
        return frame, nanos

    def image():
        if not cameras:
            blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
            blueprint.set_attribute("image_size_x", "1920")
            blueprint.set_attribute("image_size_y", "1080")
            cameras.append(world.spawn_actor(blueprint, carla.Transform(carla.Location(z=20.0))))
            cameras[0].listen(images.put)
        frame = world.tick()
        image = images.get(timeout=20.0)
        while image.frame != frame:
            image = images.get(timeout=20.0)
        first = image.raw_data[0]
        nanos = time.monotonic_ns()
        if len(image.raw_data) != 1080 * 1920 * 4 or first > 255:
            sys.exit(f"loop_agent_carla.py: frame {frame} has {len(image.raw_data)} bytes")
        return frame, nanos

    jobs = {"loop": loop, "poses": poses, "image": image}
    print("ready", flush=True)
    for line in sys.stdin:
        job, count = line.split()
        measured = [jobs[job]() for _ in range(int(count))]
        print("\n".join(f"{number} {nanos}" for number, nanos in measured), flush=True)
    for camera in cameras:
        camera.destroy()
    # The package aborts now and then while its threads end.
    os._exit(0)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
