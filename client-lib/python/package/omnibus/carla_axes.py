"""CARLA's axes: left-handed, x forward, y right, z up; degrees. The only module that speaks them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .pose import Pose, Vector


@dataclass(frozen=True)
class CarlaTransform:
    """A pose as CARLA writes it."""

    #: x, y to the right, z.
    location_m: Vector = (0.0, 0.0, 0.0)
    #: Nose up positive.
    pitch_deg: float = 0.0
    #: Clockwise seen from above.
    yaw_deg: float = 0.0
    #: Right side down positive.
    roll_deg: float = 0.0


def to_pose(transform: CarlaTransform) -> Pose:
    """Returns a pose of CARLA in the axes and units of this package."""
    x, y, z = transform.location_m
    return Pose.from_euler(
        (x, -y, z),
        yaw_rad=-math.radians(transform.yaw_deg),
        pitch_rad=-math.radians(transform.pitch_deg),
        roll_rad=math.radians(transform.roll_deg),
    )


def from_pose(pose: Pose) -> CarlaTransform:
    """Returns a pose in CARLA's axes; angles are greater than -180° and at most 180°."""
    x, y, z = pose.position_m
    matrix = pose.rotation_matrix()
    pitch = math.asin(max(-1.0, min(1.0, -float(matrix[2, 0]))))
    yaw = math.atan2(float(matrix[1, 0]), float(matrix[0, 0]))
    roll = math.atan2(float(matrix[2, 1]), float(matrix[2, 2]))
    return CarlaTransform((x, -y, z), _degrees(-pitch), _degrees(-yaw), _degrees(roll))


def _degrees(angle_rad: float) -> float:
    # Never -0.
    degrees = math.degrees(angle_rad) + 0.0
    return degrees + 360.0 if degrees <= -180.0 else degrees


def mirrored(vectors: ArrayLike) -> NDArray[np.float64]:
    """Returns positions, velocities or accelerations (… × 3) with y negated: from CARLA's axes to
    those of this package, or back. Angular velocities are axial: negate the result too."""
    turned: NDArray[np.float64] = np.asarray(vectors, np.float64) * np.array([1.0, -1.0, 1.0])
    return turned
