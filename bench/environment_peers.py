"""Driving environments of other projects: steps per second, the first observation, memory.

    python environment_peers.py metadrive|metadrive-camera|highway-env [STEPS]

Prints one JSON line: steps per second in each of five rounds, the mean number of other vehicles,
seconds from before the import until the first observation, and resident megabytes after it. An
ego vehicle drives straight ahead among about twelve others and measures a lidar of 240 rays, 50 m
far, and the state vector of the project. `null` stands for a package that is not installed.

`metadrive-camera` has a camera of 84 x 84 pixels in the place of the lidar. It needs
panda3d-gltf 0.13 and panda3d-simplepbr 0.10, OpenGL (a software one is enough: libgl1-mesa-dri) and
an X server, such as that of `xvfb-run`.

One step simulates 50 ms in highway-env (one step of physics), and 60 ms in MetaDrive (three of its
default 20 ms).
"""

import contextlib
import json
import os
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

ROUNDS = 5
RAYS = 240
RANGE_M = 50


def metadrive(**more):
    from metadrive import MetaDriveEnv

    config = {
        **more,
        "map": "SSS",
        "start_seed": 5,
        "traffic_density": 1.0,
        "traffic_mode": "respawn",
        "decision_repeat": 3,
        "horizon": 1000,
        "vehicle_config": {
            "lidar": {"num_lasers": RAYS, "distance": RANGE_M, "num_others": 0},
            "side_detector": {"num_lasers": 0},
            "lane_line_detector": {"num_lasers": 0},
            "image_source": "rgb_camera",
            "rgb_camera": (84, 84),
        },
    }
    env = MetaDriveEnv(config)

    def others():
        return len(env.engine.traffic_manager.traffic_vehicles)

    return env, [0.0, 0.2], others


def metadrive_camera():
    # The window beside the camera is as small as the camera's image, and shows nothing of its own.
    return metadrive(
        image_observation=True,
        rgb_clip=False,
        window_size=(84, 84),
        show_interface=False,
        show_fps=False,
        show_logo=False,
    )


def highway_env():
    import gymnasium
    import highway_env  # noqa: F401, registers the environments

    config = {
        "observation": {
            "type": "LidarObservation",
            "cells": RAYS,
            "maximum_range": RANGE_M,
            "normalize": True,
        },
        "action": {"type": "ContinuousAction"},
        "vehicles_count": 12,
        "simulation_frequency": 20,
        "policy_frequency": 20,
        "duration": 1000,
        "offroad_terminal": True,
    }
    env = gymnasium.make("highway-v0", config=config)

    def others():
        return len(env.unwrapped.road.vehicles) - 1

    return env, [0.0, 0.0], others


def resident_mb():
    with open("/proc/self/status") as status:
        line = next(line for line in status if line.startswith("VmRSS:"))
    return int(line.split()[1]) / 1e3 * 1.024


def measure(make, steps):
    import numpy

    begin = time.perf_counter()
    try:
        env, action, others = make()
    except ImportError:
        return None
    action = numpy.asarray(action, dtype=numpy.float32)
    env.reset()
    first_s = time.perf_counter() - begin
    memory_mb = resident_mb()
    rates, vehicles = [], []
    for _ in range(ROUNDS):
        spent = 0.0
        for _ in range(steps):
            begin = time.perf_counter()
            result = env.step(action)
            spent += time.perf_counter() - begin
            vehicles.append(others())
            # Four values of gym, five of Gymnasium.
            if result[2] or (len(result) == 5 and result[3]):
                env.reset()
        rates.append(steps / spent)
    env.close()
    return {
        "steps_per_s": rates,
        "others": sum(vehicles) / len(vehicles),
        "first_observation_s": first_s,
        "resident_mb": memory_mb,
    }


def main():
    makers = {
        "metadrive": metadrive,
        "metadrive-camera": metadrive_camera,
        "highway-env": highway_env,
    }
    make = makers[sys.argv[1]]
    steps = int(sys.argv[2]) if len(sys.argv) > 2 else 500
    # Packages print greetings.
    with contextlib.redirect_stdout(sys.stderr):
        report = measure(make, steps)
    print(json.dumps(report))


main()
