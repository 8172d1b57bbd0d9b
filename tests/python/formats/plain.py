"""The data sets of `omnibus collect`, read as docs/data-set.md describes them."""

import json
import pathlib

import numpy as np
from PIL import Image

# The classes of COCO by semantic tag; what has none of them is no object of COCO.
COCO_OF_TAG = {
    "Pedestrian": "person",
    "Bicycle": "bicycle",
    "Car": "car",
    "Motorcycle": "motorcycle",
    "Bus": "bus",
    "Train": "train",
    "Truck": "truck",
    "TrafficLight": "traffic light",
}
# Vans have the tag of trucks, as in CARLA, but are cars in COCO.
VANS = ("sprinter", "ambulance", "volkswagen.t2")


class Scene:
    """A data set of `omnibus collect`."""

    def __init__(self, folder: pathlib.Path):
        self.folder = folder
        self.name = folder.name
        self.metadata = json.loads((folder / "metadata.json").read_text())
        self.sensors = {s["name"]: s for s in self.metadata["settings"]["sensors"]}
        self.cameras = {name: s for name, s in self.sensors.items() if "camera" in s}
        self.lidars = {name: s for name, s in self.sensors.items() if "lidar" in s}
        self.lines = [json.loads(line) for line in (folder / "frames.jsonl").open()]

    def boxes(self, frame: int) -> list[dict]:
        """Returns the boxes of a frame, those of the town's objects as of actors at rest."""
        boxes = json.loads((self.folder / f"boxes/{frame:06}.json").read_text())
        at_rest = {"blueprint": "", "velocity_mps": [0.0, 0.0, 0.0]}
        objects = [{**at_rest, "actor_id": o["object_id"], **o} for o in boxes["objects"]]
        return boxes["actors"] + objects

    def image(self, camera: str, output: str, frame: int) -> np.ndarray:
        """Returns an image of a camera as an array."""
        return np.array(Image.open(self.folder / f"{camera}/{output}/{frame:06}.png"))

    def ids(self, camera: str, frame: int) -> np.ndarray:
        """Returns the instance ids of an image, H x W."""
        rgb = self.image(camera, "instance", frame).astype(np.uint32)
        return rgb @ np.array([1, 256, 65536], np.uint32)

    def points(self, lidar: str, frame: int) -> np.ndarray:
        """Returns the points of a lidar, N x 4."""
        path = self.folder / f"{lidar}/points/{frame:06}.bin"
        return np.fromfile(path, "<f4").reshape(-1, 4)

    def labels(self, lidar: str, frame: int) -> np.ndarray:
        """Returns the id and the tag of each point of a lidar, N x 2."""
        path = self.folder / f"{lidar}/labels/{frame:06}.bin"
        return np.fromfile(path, "<u4").reshape(-1, 2)


def slack_px(actor: dict, height_px: float) -> float:
    """Returns how far pixels of an actor may leave its box: steered wheels a little, limbs more."""
    return 1.5 + (0.25 * height_px if actor["tag_name"] == "Pedestrian" else 0)


def views(scene: Scene, camera: str, frame: int) -> dict[int, dict]:
    """Returns what the boxes of a frame say of a camera's image, by the id of the actor or object."""
    boxes = scene.boxes(frame)
    return {box["actor_id"]: box["cameras"][camera] for box in boxes if camera in box["cameras"]}


def scenes(folder: str) -> list[Scene]:
    """Returns the data sets in `scene-*` of a folder."""
    found = [Scene(path) for path in sorted(pathlib.Path(folder).glob("scene-*"))]
    assert len(found) > 1, folder
    return found


def coco_name(actor: dict) -> str | None:
    """Returns the class of an actor in COCO."""
    name = COCO_OF_TAG.get(actor["tag_name"])
    is_van = any(van in actor["blueprint"] for van in VANS)
    return "car" if name in ("truck", "car") and is_van else name
