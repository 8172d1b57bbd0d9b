"""Arrays over shared memory: valid while referenced, read-only, bounded, deleted in any order."""

import copy
import gc
import math
import pickle
import random
import sys

import numpy as np
from kit import launch, shared_memory

import omnibus
from omnibus.sensors import Camera, Collision, Gnss, Imu, LaneInvasion, Lidar, Obstacle, Odometry

OUTPUTS = ("color", "depth", "tags", "instances", "normals", "flow")
FRONT = Camera("front", 64, 48, math.radians(90), omnibus.Pose((1.5, 0.0, 1.5)), OUTPUTS)
LIDAR = Lidar("lidar", 8, 90, pose=omnibus.Pose((0.0, 0.0, 2.0)))
HDL = Lidar.of_model(
    "hdl-64e",
    "hdl",
    0.05,
    pose=omnibus.Pose((0.0, 0.0, 2.0)),
    outputs=("points", "labels", "last_points", "last_labels"),
    divergence_rad=0.002,
    sweep=True,
    weather=True,
)


def every_output_is_a_read_only_view() -> None:
    physics = [Imu("imu"), Gnss("gnss"), Odometry("odometry"), Collision("hits")]
    physics += [LaneInvasion("lanes"), Obstacle("obstacle")]
    with launch(sensors=[FRONT, LIDAR, HDL, *physics]) as simulator:
        frame = simulator.client.tick()
        front, lidar = frame["front"], frame["lidar"]
        images = {name: getattr(front, name) for name in OUTPUTS}
        shapes = {name: image.shape for name, image in images.items()}
        assert shapes == {
            "color": (48, 64, 4),
            "depth": (48, 64),
            "tags": (48, 64),
            "instances": (48, 64),
            "normals": (48, 64, 3),
            "flow": (48, 64, 2),
        }, shapes
        assert lidar.points.shape == (90, 8, 4) and lidar.labels.shape == (90, 8, 2)
        hdl = frame["hdl"]
        assert len(HDL.elevations_rad or ()) == 64 and HDL.rotation_rate_hz == 10.0
        assert hdl.points.shape == hdl.last_points.shape == (1042, 64, 4)
        assert hdl.labels.shape == hdl.last_labels.shape == (1042, 64, 2)
        assert hdl.points.any() and hdl.last_points.any()
        arrays = [*images.values(), lidar.points, lidar.labels, frame.world.actors]
        arrays += [frame[name].readings for name in ("imu", "gnss", "odometry", "hits", "lanes")]
        for array in arrays:
            assert not array.flags.writeable and not array.flags.owndata
            assert array.flags.c_contiguous and array.flags.aligned and type(array) is np.ndarray
            try:
                array[...] = 0
            except ValueError:
                pass
            else:
                raise AssertionError("a view was written")
        # Two accesses are the same memory.
        assert np.shares_memory(front.color, front.color)
        imu = frame["imu"].readings[0]
        assert abs(imu["over_secs"] - 0.05) < 1e-6, imu
        assert frame["odometry"].readings["distance_m"].shape == (1,)
        ego = frame.world.actor(simulator.ego)
        assert ego["kind"] == 1 and np.linalg.norm(ego["rotation_xyzw"]) - 1 < 1e-3
        taken = np.from_dlpack(images["color"])
        assert taken.ctypes.data == images["color"].ctypes.data and not taken.flags.writeable
        capsule = images["depth"].__dlpack__(max_version=(1, 0), copy=False)
        assert "dltensor_versioned" in repr(capsule), capsule


def an_array_gives_back_what_it_refers_to() -> None:
    with launch(sensors=[FRONT]) as simulator:
        frame = simulator.client.tick()
        front, world = frame["front"], frame.world
        kept = front.color, front.depth, world.actors

        def references() -> list[int]:
            return [sys.getrefcount(array.dtype) for array in kept]

        before = references()
        for _ in range(1000):
            assert front.color.shape == kept[0].shape and front.depth.shape == kept[1].shape
            assert world.copy().actors.shape == kept[2].shape
        assert references() == before, (references(), before)


def a_thousand_views_are_held() -> None:
    with launch(sensors=[FRONT]) as simulator:
        (bundle,) = simulator.bundles
        kept = [frame for frame in simulator.client.ticks(1000)]
        means = [int(frame["front"].depth.sum(dtype=np.float64)) for frame in kept]
        memory = shared_memory(simulator.name)
        assert bundle.views_held == bundle.views_max == 7, bundle.views_held
        views = sum(m.is_view for frame in kept for m in frame.measurements.values() if m)
        assert views == 7, views
        assert [frame.number for frame in kept] == list(range(kept[0].number, kept[0].number + 1000))
        worlds = sum(frame.world.is_view for frame in kept)
        assert worlds == 2, worlds
        # What is held did not change, and shared memory did not grow.
        for frame in simulator.client.ticks(200):
            pass
        assert means == [int(frame["front"].depth.sum(dtype=np.float64)) for frame in kept]
        assert shared_memory(simulator.name) <= memory, (shared_memory(simulator.name), memory)
        del frame, kept
        gc.collect()
        assert bundle.views_held == 0
        again = simulator.client.tick()
        assert again.measurements["rendered"].is_view and again.world.is_view


def a_bundle_that_does_not_copy_says_so() -> None:
    with launch(sensors=[FRONT], view_mib=0.0, when_full="error") as simulator:
        client = simulator.client
        first = client.tick()
        number = client.frame
        try:
            client.tick()
        except omnibus.ViewLimitError as error:
            assert "1 measurements" in str(error) and "view_mib" in str(error), error
        else:
            raise AssertionError("the limit was passed")
        assert client.frame == number, "the world stood still"
        del first
        assert client.tick()["front"].color.any()


def everything_is_deleted_in_any_order() -> None:
    for seed in range(3):
        simulator = launch(sensors=[FRONT])
        other = omnibus.Client("other", simulator.name)
        bundle = other.create_bundle("eye", [LIDAR])
        frame = simulator.client.tick()
        measurement = bundle.wait(30)
        image, points, actors = frame["front"].color, measurement["lidar"].points, frame.world.actors
        ends = [simulator.close, other.close, bundle.close]
        objects = {
            "frame": frame,
            "measurement": measurement,
            "bundle": bundle,
            "client": simulator.client,
            "simulator": simulator,
            "other": other,
        }
        del frame, measurement, bundle, other, simulator
        steps = [*ends, *objects]
        random.Random(seed).shuffle(steps)
        sums = int(image.sum()), float(points.sum()), int(actors["actor_id"].sum())
        for step in steps:
            if isinstance(step, str):
                del objects[step]
            else:
                step()
            gc.collect()
            now = int(image.sum()), float(points.sum()), int(actors["actor_id"].sum())
            assert now == sums, (seed, step)
        ends.clear()
        steps.clear()
        del step
        del image, points, actors
        gc.collect()


def values_are_pickled_and_copied() -> None:
    with launch(sensors=[FRONT, Imu("imu")]) as simulator:
        frame = simulator.client.tick()
        for again in (pickle.loads(pickle.dumps(frame)), copy.deepcopy(frame)):
            assert again.number == frame.number
            assert (again["front"].color == frame["front"].color).all()
            assert (again.world.actors == frame.world.actors).all()
            assert again.world.state_hash == frame.world.state_hash
            assert not again.world.is_view and not again.measurements["rendered"].is_view
        world, reading = copy.copy(frame.world), pickle.loads(pickle.dumps(frame["imu"]))
        assert (world.actors == frame.world.actors).all()
        assert (reading.readings == frame["imu"].readings).all()
        plain = [FRONT, LIDAR, Imu("i"), simulator.client.settings, omnibus.Weather()]
        plain += [simulator.client.blueprints[0], frame["front"].world_from_sensor]
        plain += [omnibus.RefusedError("why", "Other"), omnibus.FrameIncompleteError("why", 3)]
        for value in plain:
            assert repr(pickle.loads(pickle.dumps(value))) == repr(value)
    try:
        pickle.loads(pickle.dumps(world).replace(b"_from_bytes", b"_from_bytez"))
    except AttributeError:
        pass
    try:
        omnibus.Measurement._from_bytes(b"", b"", b"")
    except ValueError as error:
        assert "no Measurement of this build" in str(error)
    else:
        raise AssertionError("it was taken")


every_output_is_a_read_only_view()
an_array_gives_back_what_it_refers_to()
a_thousand_views_are_held()
a_bundle_that_does_not_copy_says_so()
everything_is_deleted_in_any_order()
values_are_pickled_and_copied()
