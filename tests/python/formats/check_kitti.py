"""Reads an export as the readme of KITTI's object development kit describes the format.

Arguments: the export, the folder of its scenes. A point x in the lidar's space is projected by
P2 * R0_rect * Tr_velo_to_cam * x. A box stands on `location`, is turned by `rotation_y` about the
camera's y axis, which points down, and has the dimensions height, width, length.
"""

import pathlib
import sys

import numpy as np
from PIL import Image
from plain import scenes, slack_px

root = pathlib.Path(sys.argv[1])
by_name = {scene.name: scene for scene in scenes(sys.argv[2])}
KINDS = {
    "Car": ("Car", "Van"),
    "Truck": ("Truck", "Van"),
    "Bus": ("Misc",),
    "Motorcycle": ("Misc",),
    "Bicycle": ("Cyclist",),
    "Pedestrian": ("Pedestrian",),
}


def rigid(values: str) -> np.ndarray:
    """Returns a 4 x 4 matrix from the text of its upper rows."""
    return np.vstack([np.array(values.split(), float).reshape(3, 4), [0, 0, 0, 1]])


def matrix(transform: dict) -> np.ndarray:
    """Returns the matrix of a transform of a plain data set."""
    x, y, z, w = transform["rotation_xyzw"]
    made = np.eye(4)
    made[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    made[:3, 3] = transform["position_m"]
    return made


def project(p2: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Returns the pixels of points in camera space, N x 3."""
    seen = np.c_[points, np.ones(len(points))] @ p2.T
    return seen[:, :2] / seen[:, 2:]


lines = [line.split() for line in (root / "frames.txt").read_text().splitlines()]
parts = [(root / f"ImageSets/{p}.txt").read_text().split() for p in ("train", "val")]
assert sorted(parts[0] + parts[1]) == [index for index, *_ in lines] and all(parts)
counts = dict.fromkeys(("labels", "boxes", "points", "hits", "on_image"), 0)
poses = {}
for index, name, frame, camera in lines:
    scene, frame = by_name[name], int(frame)
    text = (root / f"training/calib/{index}.txt").read_text()
    calibration = dict(line.split(": ", 1) for line in text.splitlines())
    p2 = np.array(calibration["P2"].split(), float).reshape(3, 4)
    r0 = np.eye(4)
    r0[:3, :3] = np.array(calibration["R0_rect"].split(), float).reshape(3, 3)
    rect_from_lidar = r0 @ rigid(calibration["Tr_velo_to_cam"])
    (imu,) = (s for s in scene.sensors.values() if s["kind"] == "imu")
    mounts = [np.array(s["vehicle_from_sensor"]) for s in (scene.lidars["lidar"], imu)]
    lidar_from_imu = np.linalg.inv(mounts[0]) @ mounts[1]
    assert np.allclose(rigid(calibration["Tr_imu_to_velo"]), lidar_from_imu), calibration
    with Image.open(root / f"training/image_2/{index}.png") as image:
        width, height = image.size
    cloud = np.fromfile(root / f"training/velodyne/{index}.bin", "<f4").reshape(-1, 4)
    assert 0 <= cloud[:, 3].min() and cloud[:, 3].max() <= 1
    points = (np.c_[cloud[:, :3], np.ones(len(cloud))] @ rect_from_lidar.T)[:, :3]
    ids, labels = scene.ids(camera, frame), scene.labels("lidar", frame)[:, 0]

    # Points of actors lie on the pixels of their actor, save where the lidar sees over an edge.
    actors = {actor["actor_id"]: actor for actor in scene.boxes(frame)}
    ahead = np.isin(labels, list(actors)) & (points[:, 2] > 1)
    pixels = np.rint(project(p2, points[ahead])).astype(int)
    is_seen = np.all((pixels >= 0) & (pixels < [width, height]), axis=1)
    shown = ids[pixels[is_seen, 1], pixels[is_seen, 0]]
    counts["on_image"] += is_seen.sum()
    counts["hits"] += (shown == labels[ahead][is_seen]).sum()

    wanted = {
        key: actor
        for key, actor in actors.items()
        if camera in actor["cameras"] and actor["tag_name"] in KINDS
    }
    for line in (root / f"training/label_2/{index}.txt").read_text().splitlines():
        kind, *values = line.split()
        truncated, occluded, alpha, *box, h, w, l, x, y, z, turn = map(float, values)
        counts["labels"] += 1
        if kind == "DontCare":
            assert values[:3] == ["-1", "-1", "-10"] and values[7:] == ["-1"] * 3 + ["-1000"] * 3 + ["-10"]
            continue
        middle = np.array([x, y - h / 2, z])
        away = {
            key: np.linalg.norm(middle - a["cameras"][camera]["optical_from_box"]["position_m"])
            for key, a in wanted.items()
        }
        key = min(away, key=away.get)
        assert away[key] < 1e-3, line
        actor = wanted.pop(key)
        view = actor["cameras"][camera]
        assert kind in KINDS[actor["tag_name"]] and np.allclose([l, w, h], actor["size_m"], atol=1e-4)
        assert occluded in (0, 1, 2) and abs(truncated - view["truncated_fraction"]) < 0.01
        turned = turn - alpha - np.arctan2(x, z)
        assert abs((turned + np.pi) % (2 * np.pi) - np.pi) < 1e-3, line
        corners = np.array([[a, b, c] for a in (-l / 2, l / 2) for b in (-h, 0) for c in (-w / 2, w / 2)])
        sine, cosine = np.sin(turn), np.cos(turn)
        rotation = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
        corners = corners @ rotation.T + [x, y, z]
        if corners[:, 2].min() > 0.5:
            drawn = project(p2, corners)
            edges = np.r_[drawn.min(0), drawn.max(0)].clip(-0.5, [width - 0.5, height - 0.5] * 2)
            # The camera tilts with the ego and boxes do not: a few pixels where an object is near. Limbs
            # leave their box, and may be all of a walker that the edge of the image leaves.
            slack = slack_px(actor, np.ptp(drawn[:, 1])) + 0.06 * (box[3] - box[1])
            # Of a box that leaves the image, corners outside may lie higher or lower than what is inside.
            beyond = (edges - box) * [1, 1, -1, -1]
            assert beyond.max() < slack, (line, edges)
            assert truncated > 0 or beyond.min() > -slack, (line, edges)
            counts["boxes"] += 1
        local = (points - [x, y, z]) @ rotation
        # Wheels and mirrors leave the box by centimetres, the legs of a walker by more.
        out_m = 0.35 if kind == "Pedestrian" else 0.1
        reach = np.array([l, h, w]) / 2 + out_m
        is_inside = np.all(np.abs(local - [0, -h / 2, 0]) < reach, axis=1)
        is_actor = labels == key
        assert is_actor.sum() == actor["lidar_points"].get("lidar", 0)
        assert (is_inside & is_actor).sum() >= 0.9 * is_actor.sum() - 1, line
        counts["points"] += is_actor.sum()
    assert all(a["cameras"][camera]["visible_px"] < 10 for a in wanted.values()), wanted
    (line,) = (line for line in scene.lines if line["frame"] == frame)
    (pose,) = (s["world_from_sensor"] for s in line["sensors"] if s["name"] == camera)
    optical = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    poses.setdefault(name, []).append(matrix(pose) @ optical)

assert counts["boxes"] > 10 and counts["points"] > 100, counts
assert counts["hits"] > 0.7 * counts["on_image"] > 0, counts
for name, wanted in poses.items():
    found = [rigid(line) for line in (root / f"poses/{name}.txt").read_text().splitlines()]
    assert len(found) == len(wanted)
    for pose, world in zip(found, wanted, strict=True):
        assert np.allclose(pose, np.linalg.inv(wanted[0]) @ world, atol=2e-3), name
print(counts)
