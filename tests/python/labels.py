"""Keypoints of walkers, against the images of a camera that sees them."""

import math

import numpy as np
from kit import launch

import omnibus
from omnibus.sensors import Camera

INDEX = {name: index for index, name in enumerate(omnibus.KEYPOINTS)}


def seen(frame: omnibus.Frame, walker: int, camera: str, points: omnibus.Keypoints) -> np.ndarray:
    """Returns the keypoints in an image, of which visible ones are among the walker's pixels."""
    found = points.in_image(frame[camera])
    assert found.shape == (17, 3) and found.dtype == np.float32
    ids = frame[camera].instances
    for x, y in found[found[:, 2] == 2, :2].astype(int):
        assert (ids[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2] == walker).any(), (x, y)
    return found


def keypoints_are_those_of_the_walker_that_the_camera_sees() -> None:
    names = omnibus.KEYPOINTS
    assert len(names) == 17 and names[0] == "nose" and names[16] == "right_ankle"
    assert len(omnibus.KEYPOINT_LINKS) == 19 and (16, 14) in omnibus.KEYPOINT_LINKS
    with launch() as simulator:
        client = simulator.client
        walker = client.spawn("walker.pedestrian.0002", client.map.spawn_points[0])
        turned = omnibus.Pose((2.5, 0.0, 0.9), (0.0, 0.0, 1.0, 0.0))
        behind = omnibus.Pose((-2.5, 0.0, 0.9))
        outputs = ("instances", "depth")
        sensors = [
            Camera("before", 240, 320, 0.9, turned, outputs),
            Camera("behind", 240, 320, 0.9, behind, outputs),
            Camera("ids", 240, 320, 0.9, behind, ("instances",)),
            Camera("color", 24, 32, 0.9, behind),
        ]
        client.create_bundle("eyes", sensors, walker)
        client.tick()
        frame = client.tick()
        points = client.keypoints(walker)
        assert points.actor_id == walker and "Keypoints" in repr(points)
        world = points.in_world
        assert world.shape == (17, 3)
        actor = frame.world.actor(walker)
        heights = world[:, 2] - actor["position_m"][2]
        assert abs(heights[INDEX["left_shoulder"]] - 0.808 * 1.82) < 0.02, heights
        assert heights[INDEX["left_ankle"]] < 0.2 < 1.6 < heights[INDEX["nose"]], heights
        before = seen(frame, walker, "before", points)
        away = seen(frame, walker, "behind", points)
        assert (before[:, 2] == 2).all(), before
        for name in ("nose", "left_eye", "right_eye"):
            assert away[INDEX[name], 2] == 1, (name, away)
        # Left and right change sides with the camera.
        left, right = INDEX["left_shoulder"], INDEX["right_shoulder"]
        assert before[left, 0] > before[right, 0] and away[left, 0] < away[right, 0]
        # In the space of the camera, and without depth.
        in_sensor = points.in_sensor(frame["before"])
        shown = Camera("", 240, 320, 0.9).projection.project(tuple(in_sensor[left].tolist()))
        assert shown is not None and math.dist(shown, before[left, :2]) < 0.01, shown
        assert (points.in_image(frame["ids"])[:, 2] == 2).all()
        for camera, said in (("color", "does not measure instances"),):
            try:
                points.in_image(frame[camera])
            except AttributeError as error:
                assert said in str(error), error
            else:
                raise AssertionError("it had no instances")
        try:
            client.keypoints(walker + 1000)
        except omnibus.OmnibusError as error:
            assert str(walker + 1000) in str(error), error
        else:
            raise AssertionError("there is no such walker")


keypoints_are_those_of_the_walker_that_the_camera_sees()
