"""Reads the labels of YOLO as their description says: every box encloses its instance.

Arguments: the export, the folder of its scenes. https://docs.ultralytics.com/datasets/detect/
describes the format: class, centre, width and height, divided by those of the image.
"""

import pathlib
import sys

import numpy as np
import yaml
from PIL import Image
from plain import coco_name, scenes

root = pathlib.Path(sys.argv[1])
description = yaml.safe_load((root / "data.yaml").read_text())
names = description["names"]
assert sorted(names) == list(range(len(names)))
count = 0
for scene in scenes(sys.argv[2]):
    for line in scene.lines:
        frame = line["frame"]
        for camera in scene.cameras:
            stem = f"{scene.name}_{camera}_{frame:06}"
            (labels,) = root.glob(f"labels/*/{stem}.txt")
            # Readers find the labels of an image by this replacement.
            image = pathlib.Path(str(labels).replace("/labels/", "/images/")).with_suffix(".png")
            assert str(image.parent.relative_to(root)) in (description["train"], description["val"])
            size = np.array(Image.open(image).size)
            found = []
            for text in labels.read_text().splitlines():
                number, *box = text.split()
                x, y, w, h = np.array(box, float) * [*size, *size]
                edges = [x - w / 2, y - h / 2, x + w / 2, y + h / 2]
                found.append((names[int(number)], *np.rint(edges).astype(int)))
                assert np.allclose(edges, np.rint(edges), atol=0.01), edges
            ids = scene.ids(camera, frame)
            wanted = []
            for actor in scene.boxes(frame):
                if camera in actor["cameras"] and coco_name(actor):
                    rows, columns = np.nonzero(ids == actor["actor_id"])
                    edges = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
                    wanted.append((coco_name(actor), *edges))
            assert sorted(found) == sorted(wanted), stem
            count += len(found)
assert count > 0
