"""Reads an export with Open3D: points, labels and poses of the lidars, which fit together.

Arguments: the export, the folder of its scenes.
"""

import pathlib
import sys

import numpy as np
import open3d
from plain import scenes

root = pathlib.Path(sys.argv[1])
for scene in scenes(sys.argv[2]):
    assert scene.lidars
    for lidar in scene.lidars:
        folder = root / scene.name / lidar
        poses = {}
        trajectory = open3d.io.read_pinhole_camera_trajectory(f"{folder}.log").parameters
        lines = [line for line in scene.lines if any(s["name"] == lidar for s in line["sensors"])]
        assert len(trajectory) == len(lines) == len(list(folder.glob("*.ply")))
        ground = []
        for line, pose in zip(lines, trajectory):
            path = folder / f"{line['frame']:06}.ply"
            cloud = open3d.t.io.read_point_cloud(str(path))
            points, labels = scene.points(lidar, line["frame"]), scene.labels(lidar, line["frame"])
            assert np.array_equal(cloud.point.positions.numpy(), points[:, :3])
            assert np.array_equal(cloud.point.intensity.numpy()[:, 0], points[:, 3])
            assert np.array_equal(cloud.point.instance.numpy()[:, 0], labels[:, 0])
            assert np.array_equal(cloud.point.tag.numpy()[:, 0], labels[:, 1])
            # The older reader knows positions only.
            plain = open3d.io.read_point_cloud(str(path))
            assert np.array_equal(np.asarray(plain.points, np.float32), points[:, :3])
            stated = next(s for s in line["sensors"] if s["name"] == lidar)["world_from_sensor"]
            world_from_sensor = np.linalg.inv(pose.extrinsic)
            assert np.allclose(world_from_sensor[:3, 3], stated["position_m"], atol=1e-4)
            plain.transform(world_from_sensor)
            road = scene.metadata["tags"]
            road = next(int(code) for code, name in road.items() if name == "Roads")
            ground.append(plain.select_by_index(np.flatnonzero(labels[:, 1] == road)))
        # What one measurement shows of the road lies on the road of the next, in world space.
        for first, second in zip(ground, ground[1:]):
            distances = np.asarray(first.compute_point_cloud_distance(second))
            near = np.linalg.norm(np.asarray(first.points) - first.get_center(), axis=1) < 15
            assert near.sum() > 100 and np.median(distances[near]) < 0.5, np.median(distances[near])
