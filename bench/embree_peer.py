"""Casts the rays of the example cpu_time of sensor-render with Embree, for comparison.

    omnibus map export MAP --out town.obj
    EACH=1 cargo run --release -p omnibus-sensor-render --example cpu_time -- 2 4 lidar > poses.txt
    python bench/embree_peer.py town.obj poses.txt THREADS ROUNDS

Needs Open3D, which casts rays with Embree. The scene is the town without vehicles and walkers, of which
cpu_time has 100, and rays find the distance and the triangle alone. Poses are those that cpu_time prints.
Prints the median of the rounds, each over all poses.
"""

import re
import statistics
import sys
import time

import numpy
import open3d

NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"


def poses(path):
    """Yields position and rotation matrix of each pose."""
    for line in open(path, encoding="utf-8"):
        if not line.startswith("  pose "):
            continue
        values = [float(text) for text in re.findall(NUMBER, line.split(" at ")[1])]
        x, y, z, w = values[3:7]
        yield numpy.array(values[:3]), numpy.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )


def camera(width, height):
    """Directions of a camera with a horizontal field of view of 90 degrees; x is ahead, z up."""
    right = (numpy.arange(width) + 0.5 - width / 2) / (width / 2)
    down = (numpy.arange(height) + 0.5 - height / 2) / (width / 2)
    right, down = numpy.meshgrid(right, down)
    return numpy.stack([numpy.ones_like(right), -right, -down], -1).reshape(-1, 3)


def lidar(columns, channels):
    """Directions of the lidar of cpu_time."""
    azimuth = numpy.arange(columns) / columns * 2 * numpy.pi
    elevation = numpy.radians(numpy.linspace(10, -30, channels))
    azimuth, elevation = numpy.meshgrid(azimuth, elevation, indexing="ij")
    level = numpy.cos(elevation)
    return numpy.stack(
        [level * numpy.cos(azimuth), level * numpy.sin(azimuth), numpy.sin(elevation)], -1
    ).reshape(-1, 3)


def main(mesh, path, threads, rounds):
    town = open3d.io.read_triangle_mesh(mesh)
    scene = open3d.t.geometry.RaycastingScene(nthreads=threads)
    scene.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(town))
    print(f"{len(town.triangles)} triangles, {threads} threads")
    for name, directions in [
        ("lidar 32x1800", lidar(1800, 32)),
        ("camera 800x600", camera(800, 600)),
        ("camera 84x84", camera(84, 84)),
    ]:
        rays = []
        for position, rotation in poses(path):
            turned = directions @ rotation.T
            both = numpy.concatenate([numpy.broadcast_to(position, turned.shape), turned], 1)
            rays.append(open3d.core.Tensor(both.astype(numpy.float32)))
        seconds = []
        for number in range(rounds + 1):
            begin = time.perf_counter()
            for of_pose in rays:
                scene.cast_rays(of_pose, nthreads=threads)
            if number > 0:
                seconds.append((time.perf_counter() - begin) / len(rays))
        median = statistics.median(seconds)
        print(
            f"{name:<16} {median * 1e3:8.2f} ms, {len(directions) / median / 1e6:6.2f} Mrays/s, "
            f"{1 / median:7.1f} a second"
        )


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
