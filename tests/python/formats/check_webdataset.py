"""Reads an export with webdataset: a sample has the files of its frame.

Arguments: the export, the folder of its scenes.
"""

import json
import pathlib
import sys

import numpy as np
import webdataset
from plain import scenes

shards = sorted(str(path) for path in pathlib.Path(sys.argv[1]).glob("shard-*.tar"))
assert len(shards) > 1, shards
reader = webdataset.WebDataset(shards, shardshuffle=False, empty_check=False).decode("rgb8")
samples = {sample["__key__"]: sample for sample in reader}
for scene in scenes(sys.argv[2]):
    for line in scene.lines:
        frame = line["frame"]
        sample = samples.pop(f"{scene.name}_{frame:06}")
        for camera in scene.cameras:
            color = sample[f"{camera}.color.png"]
            assert np.array_equal(color, scene.image(camera, "color", frame))
            assert sample[f"{camera}.instance.png"].shape == color.shape
            assert {f"{camera}.depth.png", f"{camera}.tag.png"} <= set(sample)
        for lidar in scene.lidars:
            points, labels = sample[f"{lidar}.points.npy"], sample[f"{lidar}.labels.npy"]
            assert points.dtype == np.float32 and labels.dtype == np.uint32
            assert len(points) > 0 and np.array_equal(points, scene.points(lidar, frame))
            assert np.array_equal(labels, scene.labels(lidar, frame))
        text = (scene.folder / f"boxes/{frame:06}.json").read_text()
        assert sample["boxes.json"] == json.loads(text)
        text = (scene.folder / f"lanes/{frame:06}.json").read_text()
        assert sample["lanes.json"] == json.loads(text)
        assert sample["frame.json"] == line
        assert sample["sensors.json"] == scene.metadata["settings"]["sensors"]
assert not samples, list(samples)
