"""gym-carla: its environment, reset and stepped, with camera, lidar and bird's-eye observations."""

import os
import random
import sys

import kit
from kit import carla

import numpy

# The environment was written for numpy 1.18.
for name, kind in (("int", int), ("float", float), ("bool", bool)):
    setattr(numpy, name, kind)
# And for package 0.9.6, whose lidar points had coordinates of their own.
for axis in "xyz":
    setattr(carla.LidarDetection, axis, property(lambda hit, axis=axis: getattr(hit.point, axis)))


def main():
    port, folder, out, quick = kit.arguments()
    sys.path.insert(0, folder)
    random.seed(1)
    numpy.random.seed(1)
    from gym_carla.envs.carla_env import CarlaEnv
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    there = kit.towns()
    town = "Town03" if "Town03" in there else "Town01"
    # The values of its test.py.
    environment = CarlaEnv({
        "number_of_vehicles": 100, "number_of_walkers": 10, "display_size": 256, "max_past_step": 1,
        "dt": 0.1, "discrete": False, "discrete_acc": [-3.0, 0.0, 3.0],
        "discrete_steer": [-0.2, 0.0, 0.2], "continuous_accel_range": [-3.0, 3.0],
        "continuous_steer_range": [-0.3, 0.3], "ego_vehicle_filter": "vehicle.lincoln*", "port": port,
        "town": town, "task_mode": "random", "max_time_episode": 1000, "max_waypt": 12,
        "obs_range": 32, "lidar_bin": 0.125, "d_behind": 12, "out_lane_thres": 2.0,
        "desired_speed": 8, "max_ego_spawn_times": 200, "display_route": True, "pixor_size": 64,
        "pixor": True})
    episodes, steps, fastest, ends = 0, 0, 0.0, []
    spread = {}
    for _ in range(2 if quick else 5):
        seen = environment.reset()
        episodes += 1
        for _ in range(40 if quick else 150):
            seen, _, done, _ = environment.step([2.0, 0.0])
            steps += 1
            fastest = max(fastest, float(seen["state"][2]))
            for name in ("camera", "lidar", "birdeye", "roadmap", "vh_clas"):
                spread[name] = max(spread.get(name, 0.0), float(numpy.std(seen[name])))
            if done:
                break
        ends.append(environment.time_step)
    import cv2
    cv2.imwrite(os.path.join(out, "gym-camera.png"), seen["camera"][:, :, ::-1])
    cv2.imwrite(os.path.join(out, "gym-birdeye.png"), seen["birdeye"][:, :, ::-1])
    cv2.imwrite(os.path.join(out, "gym-lidar.png"), seen["lidar"][:, :, ::-1])
    blank = [name for name, value in spread.items() if value == 0.0]
    kit.report(town, not blank and fastest > 3.0,
               f"{episodes} episodes of {', '.join(map(str, ends))} steps, top speed {fastest:.1f} m/s, "
               f"observations blank: {', '.join(blank) or 'none'}")
    environment._set_synchronous_mode(False)


main()
kit.end()
