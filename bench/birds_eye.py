"""Strips of bird's-eye images: a busy junction and a crosswalk, eight images two seconds apart.

The junction is that with the most vehicles after WARMUP_SECS of traffic (on a map without traffic lights, the
place with the most vehicles), the crosswalk the place with the most walkers on the road. Writes
OUT/junction.jpg and OUT/crosswalk.jpg. Needs the packages omnibus (./run wheel) and pillow.

    python bench/birds_eye.py OUT [MAP]
"""

import contextlib
import math
import os
import sys

import numpy as np
import omnibus
from omnibus.sensors import Camera
from PIL import Image

WARMUP_SECS, IMAGES, EVERY_SECS, DELTA_SECS = 90.0, 8, 2.0, 0.05
SIDE_PX, FOV_RAD = 400, math.radians(40.0)
VEHICLE, WALKER, LIGHT = 1, 2, 3
OPTIONS = ["--vehicles", "450", "--walkers", "500", "--quality", "standard"]


def busiest(places: list[np.ndarray] | np.ndarray, actors: np.ndarray, within_m: float) -> np.ndarray:
    """Returns the place with the most actors within a distance."""
    offsets = np.array(places)[:, None, :2] - actors[None, :, :2]
    return places[(np.linalg.norm(offsets, axis=2) < within_m).sum(axis=1).argmax()]


def of_kind(world: omnibus.World, kind: int) -> np.ndarray:
    return world.actors[world.actors["kind"] == kind]


def junctions(client: omnibus.Client) -> list[np.ndarray]:
    """Returns the centres of the groups of traffic lights."""
    lights = of_kind(client.world, LIGHT)
    groups = {tuple(client.traffic.light_group(int(light))) for light in lights["actor_id"]}
    of = lambda group: lights["position_m"][np.isin(lights["actor_id"], group)].mean(axis=0)
    return [of(group) for group in groups]


def on_road(client: omnibus.Client) -> np.ndarray:
    """Returns the positions of walkers on lanes of vehicles."""
    found = []
    for walker in of_kind(client.world, WALKER)["position_m"]:
        lane = client.map.nearest(walker.tolist())
        if lane and np.linalg.norm(np.subtract(lane.position_m, walker)[:2]) < lane.width_m / 2.0:
            found.append(walker)
    return np.array(found)


def strip(client: omnibus.Client, at: np.ndarray, side_m: float, path: str) -> None:
    """Writes images of a square around a place from above, in two rows."""
    height_m = side_m / 2.0 / math.tan(FOV_RAD / 2.0)
    down = (0.0, math.sin(math.pi / 4.0), 0.0, math.cos(math.pi / 4.0))
    pose = omnibus.Pose((float(at[0]), float(at[1]), float(at[2]) + height_m), down)
    name = os.path.splitext(os.path.basename(path))[0]
    images = []
    camera = Camera(name, SIDE_PX, SIDE_PX, FOV_RAD, pose)
    with contextlib.closing(client.create_bundle(name, [camera])):
        for index in range(IMAGES):
            for frame in client.ticks(round(EVERY_SECS / DELTA_SECS) if index else 1):
                image = frame[name].color
            images.append(image[..., :3].copy())
    rows = [np.concatenate(images[row : row + IMAGES // 2], axis=1) for row in (0, IMAGES // 2)]
    Image.fromarray(np.concatenate(rows)).save(path, quality=85)


def main(out: str, map_name: str = "Millbrook") -> None:
    os.makedirs(out, exist_ok=True)
    with omnibus.launch(map_name, delta_secs=DELTA_SECS, options=OPTIONS) as simulator:
        client = simulator.client
        crossing = np.empty((0, 3))
        for _ in client.ticks(round(WARMUP_SECS / DELTA_SECS)):
            pass
        vehicles = of_kind(client.world, VEHICLE)["position_m"]
        junction = busiest(junctions(client) or vehicles, vehicles, 25.0)
        strip(client, junction, 50.0, os.path.join(out, "junction.jpg"))
        while len(crossing) < 2:
            for _ in client.ticks(10):
                pass
            crossing = on_road(client)
        strip(client, busiest(crossing, crossing, 8.0), 24.0, os.path.join(out, "crosswalk.jpg"))


if __name__ == "__main__":
    main(*sys.argv[1:3])
