"""The agent of `bench latency` in Python: ticks, reads the snapshot and answers with a control.

Usage: loop_agent.py INSTANCE ACTOR. It prints "ready". For each line "JOB COUNT" on standard input it
prints COUNT lines: the frame, and when it was read, in nanoseconds of the monotonic clock; with the
job "poses", how long reading took.
"""

import math
import sys
from collections.abc import Callable

import omnibus
from omnibus.sensors import Camera


def main(instance: str, car: int) -> None:
    client = omnibus.Client("agent", instance)
    client.synchronise(0.05)
    turns = 0

    def loop() -> tuple[int, int]:
        nonlocal turns
        turns += 1
        # Each answer differs from the one before.
        steer = (turns % 512) / 1024
        client.control(car, brake=1.0, steer=steer)
        frame = client.tick()
        actor = frame.world.actor(car)
        position_m, found = actor["position_m"], actor["steer"]
        nanos = client.clock_nanos()
        if found != steer or position_m.shape != (3,):
            sys.exit(f"loop_agent.py: frame {frame.number} shows steer {found}, not {steer}")
        return frame.number, nanos

    def poses() -> tuple[int, int]:
        number = client.tick().number
        begun = client.clock_nanos()
        actors = client.snapshot().actors
        poses = actors["position_m"], actors["rotation_xyzw"]
        nanos = client.clock_nanos() - begun
        if len(poses[0]) < 1000:
            sys.exit(f"loop_agent.py: frame {number} has {len(poses[0])} actors")
        return number, nanos

    def image() -> tuple[int, int]:
        if not client.bundles:
            above = omnibus.Pose((0.0, 0.0, 20.0))
            client.create_bundle("eye", [Camera("front", 1920, 1080, math.pi / 2, above)])
        frame = client.tick()
        image = frame["front"].color
        first = image[0, 0, 0]
        nanos = client.clock_nanos()
        if image.shape != (1080, 1920, 4) or first > 255:
            sys.exit(f"loop_agent.py: frame {frame.number} has an image of {image.shape}")
        return frame.number, nanos

    jobs: dict[str, Callable[[], tuple[int, int]]] = {"loop": loop, "poses": poses, "image": image}
    print("ready", flush=True)
    for line in sys.stdin:
        job, count = line.split()
        measured = [jobs[job]() for _ in range(int(count))]
        print("\n".join(f"{number} {nanos}" for number, nanos in measured), flush=True)
    client.close()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
