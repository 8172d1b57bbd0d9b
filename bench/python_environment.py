"""Steps of ``Omnibus/Drive-v0``: the workload of ``omnibus-bench environment``, from Python.

    python bench/python_environment.py [STEPS] [lidar|camera]

One core: ego and 12 cars with full physics, one frame of 50 ms for each step, state vector, and a lidar
of 240 rays or a camera of 84 x 84 pixels.
"""

import math
import sys
import time

import numpy as np


def rates(nanos: list[int]) -> str:
    """Returns a distribution of times as rates."""
    p50, p90, p99 = (1e9 / np.percentile(nanos, p) for p in (50, 90, 99))
    return f"p50 {p50:.0f} p90 {p90:.0f} p99 {p99:.0f} n {len(nanos)}"


def main(steps: int, sensor: str) -> None:
    """Measures and prints."""
    begin = time.perf_counter()
    from omnibus.gym import Camera, DriveConfig, DriveEnv, Lidar, State

    imported_ms = (time.perf_counter() - begin) * 1e3
    seen = (State(), {"lidar": Lidar(), "camera": Camera()}[sensor])
    env = DriveEnv(DriveConfig(frames_per_step=1, observations=seen))
    observation, _ = env.reset(seed=1)
    first_ms = (time.perf_counter() - begin) * 1e3
    nanos: list[int] = []
    resets: list[int] = []
    while len(nanos) < steps:
        state = observation["state"].tolist()
        steer = max(-1.0, min(1.0, 2.0 * math.atan2(state[11], state[10])))
        pedal = max(-1.0, min(1.0, 0.5 * (5.0 - state[0] * 30.0)))
        begin_nanos = time.perf_counter_ns()
        observation, _, terminated, truncated, _ = env.step((steer, pedal))
        nanos.append(time.perf_counter_ns() - begin_nanos)
        if terminated or truncated:
            begin_nanos = time.perf_counter_ns()
            observation, _ = env.reset()
            resets.append(time.perf_counter_ns() - begin_nanos)
    print(f"first observation after {first_ms:.0f} ms, {imported_ms:.0f} ms of it for the import")
    print(f"steps/s: {rates(nanos)}")
    if resets:
        print(f"reset: p50 {np.percentile(resets, 50) / 1e6:.2f} ms n {len(resets)}")


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 25_000,
        sys.argv[2] if len(sys.argv) > 2 else "lidar",
    )
