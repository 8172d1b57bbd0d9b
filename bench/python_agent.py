"""Latency of a Python agent: reading poses and images, and from the snapshot to a control.

    python bench/python_agent.py MAP [VEHICLES] [TICKS]

Beside it, the Rust client's figure for the last: `cargo run --release -p omnibus-client-lib --example
drive_ego` prints it.
"""

import math
import os
import sys
import time
from collections.abc import Callable

import numpy as np

import omnibus
from omnibus.sensors import Camera


def percentiles(nanos: list[int]) -> str:
    p50, p99 = np.percentile(np.array(nanos) * 1e-3, [50, 99])
    return f"p50 {p50:.1f} us, p99 {p99:.1f} us, of {len(nanos)}"


def timed(count: int, call: Callable[[], object]) -> list[int]:
    nanos: list[int] = []
    for _ in range(count):
        begun = time.perf_counter_ns()
        call()
        nanos.append(time.perf_counter_ns() - begun)
    return nanos


def main(map: str, vehicles: int = 1000, ticks: int = 1000) -> None:
    print(f"load {os.getloadavg()[0]:.2f}, {os.cpu_count()} cores, {omnibus.__build__}")
    front = Camera("front", 1920, 1080, math.radians(90), omnibus.Pose((1.5, 0.0, 1.5)))
    with omnibus.launch(map, ego="vehicle.tesla.model3", device="null") as simulator:
        client, ego = simulator.client, simulator.ego
        assert ego is not None
        places = client.map.spawn_points
        for index in range(vehicles - 1):
            place = places[index % len(places)]
            x, y, z = place.position_m
            above = omnibus.Pose((x, y, z + 5.0 * (1 + index // len(places))), place.rotation_xyzw)
            client.spawn("vehicle.audi.a2", above, kinematic=True)
        print(f"{len(client.tick().world)} actors, {vehicles} of them vehicles")

        def poses() -> object:
            actors = client.snapshot().actors
            return actors["position_m"], actors["rotation_xyzw"]

        def copied() -> object:
            actors = client.snapshot().actors
            return actors["position_m"].copy(), actors["rotation_xyzw"].copy()

        def fresh(read: Callable[[], object]) -> list[int]:
            nanos: list[int] = []
            for _ in range(ticks):
                client.tick()
                nanos += timed(1, read)
            return nanos

        print(f"poses as views, of a new frame: {percentiles(fresh(poses))}")
        print(f"poses copied out, of a new frame: {percentiles(fresh(copied))}")

        reaction: list[int] = []
        for _ in range(ticks):
            frame = client.tick()
            car = frame.world.actor(ego)
            speed_mps = math.hypot(*car["velocity_mps"])
            client.control(ego, throttle=min(max(0.2 * (8.0 - speed_mps), 0.0), 0.8))
            reaction.append(client.clock_nanos() - frame.world.published_nanos)
        print(f"snapshot to control sent, in a tick: {percentiles(reaction)}")

        client.create_bundle("eye", [front], ego)
        frame = client.tick()
        print(f"1080p image as a view: {percentiles(timed(ticks, lambda: frame['front'].color))}")


if __name__ == "__main__":
    arguments = sys.argv[1:]
    main(arguments[0], *(int(argument) for argument in arguments[1:]))
