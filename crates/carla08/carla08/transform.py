"""Transforms of 0.8: 4x4 matrices."""

import math

import numpy

from .measurements import Record
from .measurements import Transform as Pose


class Translation(Record):
    """Metres."""

    FIELDS = {"x": float, "y": float, "z": float}

    def __init__(self, x=0.0, y=0.0, z=0.0):
        super().__init__(x=x, y=y, z=z)


class Rotation(Record):
    """Degrees."""

    FIELDS = {"pitch": float, "yaw": float, "roll": float}

    def __init__(self, pitch=0.0, yaw=0.0, roll=0.0):
        super().__init__(pitch=pitch, yaw=yaw, roll=roll)


class Scale(Record):
    """Factors."""

    FIELDS = {"x": float, "y": float, "z": float}

    def __init__(self, x=1.0, y=1.0, z=1.0):
        super().__init__(x=x, y=y, z=z)


class Transform:
    """A transform from a pose of a measurement, or from translation, rotation and scale in any
    order."""

    def __init__(self, *parts):
        self.matrix = numpy.identity(4)
        if len(parts) == 1 and isinstance(parts[0], Transform):
            self.matrix = parts[0].matrix.copy()
            return
        if len(parts) == 1 and isinstance(parts[0], Pose):
            at, turn = parts[0].location, parts[0].rotation
            parts = (Translation(at.x, at.y, at.z), Rotation(turn.pitch, turn.yaw, turn.roll))
        turn, scale = Rotation(), Scale()
        for part in parts:
            if isinstance(part, Rotation):
                turn = part
            elif isinstance(part, Scale):
                scale = part
            elif isinstance(part, Translation):
                self.matrix[:3, 3] = (part.x, part.y, part.z)
            else:
                raise TypeError(f"{part!r} is not a translation, rotation or scale")
        self.matrix[:3, :3] = _turned(turn) * (scale.x, scale.y, scale.z)

    def transform_points(self, points):
        """Returns transformed points, N x 3."""
        points = numpy.asarray(points)
        return points @ self.matrix[:3, :3].T + self.matrix[:3, 3]

    def inverse(self):
        """Returns the inverse transform."""
        back = Transform()
        back.matrix = numpy.linalg.inv(self.matrix)
        return back

    def __mul__(self, other):
        chained = Transform()
        chained.matrix = self.matrix @ other.matrix
        return chained

    def __str__(self):
        return str(self.matrix)


def _turned(turn):
    """Returns the rotation matrix of a left-handed space with z up from roll, pitch and yaw."""
    cr, sr = math.cos(math.radians(turn.roll)), math.sin(math.radians(turn.roll))
    cp, sp = math.cos(math.radians(turn.pitch)), math.sin(math.radians(turn.pitch))
    cy, sy = math.cos(math.radians(turn.yaw)), math.sin(math.radians(turn.yaw))
    return numpy.array([
        [cp * cy, cy * sp * sr - sy * cr, -cy * sp * cr - sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, cy * sr - sy * sp * cr],
        [sp, -cp * sr, cp * cr],
    ])
