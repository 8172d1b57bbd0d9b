"""Reads an export with pycocotools: every mask is the pixels of its instance.

Arguments: the export, the folder of its scenes.
"""

import contextlib
import io
import pathlib
import sys

import numpy as np
from PIL import Image
from plain import coco_name, scenes
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

root = pathlib.Path(sys.argv[1])
by_name = {scene.name: scene for scene in scenes(sys.argv[2])}
wanted = {
    (scene.name, camera, line["frame"], actor["actor_id"]): coco_name(actor)
    for scene in by_name.values()
    for line in scene.lines
    for actor in scene.boxes(line["frame"])
    for camera in actor["cameras"]
    if coco_name(actor)
}
split = {}
for part in ("train", "val"):
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO(root / f"annotations/instances_{part}.json")
    names = {c["id"]: c["name"] for c in coco.loadCats(coco.getCatIds())}
    for image in coco.loadImgs(coco.getImgIds()):
        scene = by_name[image["scene"]]
        split.setdefault(scene.name, set()).add(part)
        with Image.open(root / "images" / part / image["file_name"]) as shown:
            assert shown.size == (image["width"], image["height"])
        ids = scene.ids(image["camera"], image["frame"])
        for annotation in coco.loadAnns(coco.getAnnIds(imgIds=[image["id"]])):
            instance = annotation["instance_id"]
            key = (scene.name, image["camera"], image["frame"], instance)
            assert names[annotation["category_id"]] == wanted.pop(key), key
            pixels = ids == instance
            assert np.array_equal(coco.annToMask(annotation), pixels), key
            assert annotation["area"] == pixels.sum(), key
            rows, columns = np.nonzero(pixels)
            box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
            assert annotation["bbox"] == [int(value) for value in box], key
    # The evaluator finds that the truth agrees with itself.
    detected = [{**a, "score": 1.0} for a in coco.loadAnns(coco.getAnnIds())]
    assert detected, part
    with contextlib.redirect_stdout(io.StringIO()):
        judge = COCOeval(coco, coco.loadRes(detected), "segm")
        judge.evaluate()
        judge.accumulate()
        judge.summarize()
    assert judge.stats[0] > 0.999, judge.stats
assert not wanted, f"not in the export: {list(wanted)[:5]}"
assert all(len(parts) == 1 for parts in split.values()), f"scenes in both parts: {split}"
assert {part for parts in split.values() for part in parts} == {"train", "val"}
