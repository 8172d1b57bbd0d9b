"""carla-roach: the bird's-eye observation of its reinforcement-learning expert (chauffeurnet).

Its maps are named after the town alone; the observation looks for them under the name that the world's
map has in 0.9.16, so that they are linked there in a scratch folder.
"""

import os
import pathlib
import random
import sys
import types

import kit
from kit import carla

import numpy

# The program was written for numpy 1.18.
for name, kind in (("int", int), ("float", float), ("bool", bool)):
    setattr(numpy, name, kind)


def add_old_label():
    """Adds the label `Vehicles` of package 0.9.10, which newer packages divide into five."""
    labels, boxes = carla.CityObjectLabel, carla.World.get_level_bbs
    parts = (labels.Car, labels.Truck, labels.Bus, labels.Motorcycle, labels.Bicycle)
    labels.Vehicles = "Vehicles"

    def get_level_bbs(world, label=labels.Any):
        if label == labels.Vehicles:
            return [box for part in parts for box in boxes(world, part)]
        return boxes(world, label)

    carla.World.get_level_bbs = get_level_bbs


def main():
    port, folder, out, quick = kit.arguments()
    sys.path.insert(0, folder)
    add_old_label()
    import cv2
    from carla_gym.core.obs_manager.birdview import chauffeurnet
    # OpenCV 4.2 accepted the ends of a line as floating point numbers.
    line = cv2.line
    chauffeurnet.cv.line = lambda mask, a, b, **options: line(
        mask, tuple(map(int, a)), tuple(map(int, b)), **options)
    from carla_gym.core.task_actor.common.criteria.run_stop_sign import RunStopSign
    from carla_gym.utils.traffic_light import TrafficLightHandler
    maps = pathlib.Path(folder, "carla_gym/core/obs_manager/birdview/maps")
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    there = kit.towns()
    towns = [t for t in ("Town01", "Town02", "Town04", "Town06") if t in there and (maps / f"{t}.h5").exists()]
    if not towns:
        kit.report("maps", None, "no town has both a map here and an .h5 file there")
    for town in towns[:1 if quick else 4]:
        world = kit.load(client, town)
        linked = pathlib.Path(out, "maps", world.get_map().name + ".h5")
        linked.parent.mkdir(parents=True, exist_ok=True)
        if not linked.exists():
            linked.symlink_to(maps / f"{town}.h5")
        vehicles = kit.spawn_traffic(client, world, 40, random.Random(1))
        walkers = []
        for _ in range(60):
            at = world.get_random_location_from_navigation()
            walker = world.try_spawn_actor(
                world.get_blueprint_library().find("walker.pedestrian.0002"), carla.Transform(at))
            walkers += [walker] if walker is not None else []
        world.tick()
        TrafficLightHandler.reset(world)
        ego = vehicles[0]
        route, point = [], world.get_map().get_waypoint(ego.get_location())
        for _ in range(80):
            route.append((point, None))
            point = (point.next(1.0) or [point])[0]
        actor = types.SimpleNamespace(vehicle=ego, route_plan=route, criteria_stop=RunStopSign(world))
        observation = chauffeurnet.ObsManager({
            "width_in_pixels": 192, "pixels_ev_to_bottom": 40, "pixels_per_meter": 5.0,
            "history_idx": [-16, -11, -6, -1], "scale_bbox": True, "scale_mask_col": 1.0})
        observation._map_dir = pathlib.Path(out, "maps")
        observation.attach_ego_vehicle(actor)
        most = numpy.zeros(15)
        for _ in range(100 if quick else 600):
            world.tick()
            masks = observation.get_observation()
            most = numpy.maximum(most, (masks["masks"] > 0).sum(axis=(1, 2)))
        cv2.imwrite(os.path.join(out, f"chauffeurnet-{town}.png"), masks["rendered"][:, :, ::-1])
        parts = {"road": most[0], "route": most[1], "lanes": most[2], "vehicles": most[6],
                 "walkers": most[10], "lights": most[14]}
        empty = [name for name, count in parts.items() if count == 0 and name != "walkers"]
        kit.report(town, not empty, ", ".join(f"{n} {c:.0f}" for n, c in parts.items())
                   + " pixels at most" + (f"; empty: {', '.join(empty)}" if empty else ""))
        kit.destroy(client, vehicles + walkers)


main()
kit.end()
