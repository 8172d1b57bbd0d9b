"""Positions and rotations."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class Pose:
    """A rigid transform ``outer_from_inner``: metres, and a unit quaternion x, y, z, w.

    Right-handed: x forward, y left, z up.
    """

    position_m: Vector = (0.0, 0.0, 0.0)
    rotation_xyzw: Quaternion = (0.0, 0.0, 0.0, 1.0)

    @staticmethod
    def level(position_m: Vector, yaw_rad: float = 0.0) -> Pose:
        """Returns a pose without pitch and roll; ``yaw_rad`` turns x towards y, to the left."""
        half = yaw_rad / 2
        return Pose(position_m, (0.0, 0.0, math.sin(half), math.cos(half)))

    @staticmethod
    def from_euler(
        position_m: Vector, *, yaw_rad: float = 0.0, pitch_rad: float = 0.0, roll_rad: float = 0.0
    ) -> Pose:
        """Returns a pose that is turned about z by yaw (to the left), then about the new y by pitch
        (nose down positive), then about the new x by roll (left side up positive)."""
        cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
        cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
        cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
        rotation = (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )
        return Pose(position_m, rotation)

    @property
    def yaw_rad(self) -> float:
        """The angle from the outer x axis to the inner one, seen from above; to the left positive."""
        x, y, z, w = self.rotation_xyzw
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    def rotation_matrix(self) -> NDArray[np.float64]:
        """Returns the rotation as a 3 × 3 matrix."""
        x, y, z, w = self.rotation_xyzw
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def matrix(self) -> NDArray[np.float64]:
        """Returns the transform as a 4 × 4 matrix."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation_matrix()
        matrix[:3, 3] = self.position_m
        return matrix

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Returns points of inner space (… × 3, metres) in outer space."""
        moved: NDArray[np.float64] = np.asarray(points, np.float64) @ self.rotation_matrix().T
        moved += np.asarray(self.position_m)
        return moved

    def inverse(self) -> Pose:
        """Returns ``inner_from_outer``."""
        x, y, z, w = self.rotation_xyzw
        back = Pose((0.0, 0.0, 0.0), (-x, -y, -z, w))
        px, py, pz = back.apply(self.position_m)
        return Pose((-float(px), -float(py), -float(pz)), back.rotation_xyzw)

    def then(self, deeper: Pose) -> Pose:
        """Returns ``outer_from_inner * inner_from_deeper``."""
        ax, ay, az, aw = self.rotation_xyzw
        bx, by, bz, bw = deeper.rotation_xyzw
        rotation = (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
        px, py, pz = self.apply(deeper.position_m)
        return Pose((float(px), float(py), float(pz)), rotation)
