"""Reads an export with pycocotools: every mask is the pixels of its instance, amodal masks hold them,
and keypoints are those of the data set.

Arguments: the export, the folder of its scenes.
"""

import contextlib
import io
import pathlib
import sys

import numpy as np
from PIL import Image
from plain import coco_name, scenes, views
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval
from pycocotools.mask import decode

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


def judged(coco: COCO, detected: list[dict], kind: str, categories: list[int]) -> float:
    """Returns the mean precision that the evaluator finds for detections."""
    with contextlib.redirect_stdout(io.StringIO()):
        judge = COCOeval(coco, coco.loadRes(detected), kind)
        judge.params.catIds = categories
        judge.evaluate()
        judge.accumulate()
        judge.summarize()
    return judge.stats[0]


def check_keypoints(annotation: dict, view: dict, ids: np.ndarray) -> None:
    """Visible keypoints are among the pixels of their walker, and all those of the data set."""
    found = np.array(annotation["keypoints"]).reshape(17, 3)
    stated = view["keypoints"]
    assert np.array_equal(found[:, 2], stated["visibility"])
    assert np.abs(found[:, :2] - stated["px"]).max() <= 0.0051
    assert annotation["num_keypoints"] == (found[:, 2] > 0).sum()
    assert not found[found[:, 2] == 0].any()
    # Two decimals may be those of the next pixel.
    for x, y in np.array(stated["px"])[found[:, 2] == 2].astype(int):
        around = ids[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        assert (around == annotation["instance_id"]).any(), (x, y)


split = {}
joints = amodal = hidden = 0
for part in ("train", "val"):
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO(root / f"annotations/instances_{part}.json")
    names = {c["id"]: c["name"] for c in coco.loadCats(coco.getCatIds())}
    (person,) = coco.loadCats(coco.getCatIds(catNms=["person"]))
    assert person["keypoints"][0] == "nose" and person["keypoints"][16] == "right_ankle"
    assert len(person["keypoints"]) == 17 and len(person["skeleton"]) == 19
    for image in coco.loadImgs(coco.getImgIds()):
        scene = by_name[image["scene"]]
        split.setdefault(scene.name, set()).add(part)
        with Image.open(root / "images" / part / image["file_name"]) as shown:
            assert shown.size == (image["width"], image["height"])
        ids = scene.ids(image["camera"], image["frame"])
        labelled = views(scene, image["camera"], image["frame"])
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
            view = labelled[instance]
            whole = decode(annotation["amodal_segmentation"]).astype(bool)
            assert whole.shape == pixels.shape and whole[pixels].all(), key
            assert annotation["amodal_area"] == whole.sum() == view["unoccluded_px"], key
            rows, columns = np.nonzero(whole)
            box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
            assert annotation["amodal_bbox"] == [int(value) for value in box], key
            amodal += 1
            hidden += int(whole.sum() > 1.5 * pixels.sum())
            is_person = annotation["category_id"] == person["id"]
            assert ("keypoints" in annotation) == is_person, key
            if is_person:
                check_keypoints(annotation, view, ids)
                joints += (np.array(annotation["keypoints"][2::3]) == 2).sum()
    # The evaluator finds that the truth agrees with itself.
    truth = coco.loadAnns(coco.getAnnIds())
    detected = [{**a, "score": 1.0} for a in truth]
    assert detected, part
    assert judged(coco, detected, "segm", coco.getCatIds()) > 0.999
    people = [
        {**{k: a[k] for k in ("image_id", "category_id", "keypoints")}, "score": 1.0}
        for a in truth
        if a.get("num_keypoints")
    ]
    if people:
        assert judged(coco, people, "keypoints", [person["id"]]) > 0.999
assert joints > 20 and amodal > 50 and hidden > 5, (joints, amodal, hidden)
assert not wanted, f"not in the export: {list(wanted)[:5]}"
assert all(len(parts) == 1 for parts in split.values()), f"scenes in both parts: {split}"
assert {part for parts in split.values() for part in parts} == {"train", "val"}
