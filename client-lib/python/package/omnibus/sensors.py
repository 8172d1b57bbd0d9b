"""Sensors of a bundle, described by their parameters.

Each one has a ``name``, unique in its bundle; its ``pose`` in the space of the actor that carries it,
or in the world; ``period_secs``, the simulated time between two measurements (0: every frame); and
``seed``, that of its noise. Sensor space is right-handed: x forward, y left, z up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from .pose import Pose, Vector

CameraOutput = Literal["color", "depth", "tags", "instances", "normals", "flow"]
LidarOutput = Literal["points", "labels"]

_ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera without distortion; pixels are square."""

    name: str
    width: int
    height: int
    #: Horizontal field of view, above 0 and below π.
    fov_rad: float = math.pi / 2
    pose: Pose = field(default_factory=Pose)
    outputs: Sequence[CameraOutput] = ("color",)
    #: Rays per pixel of the color image: 1, 4 or 16; default: that of the simulator (``--quality``).
    quality: Literal["default", "low", "standard", "epic"] = "default"
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "camera"

    @property
    def focal_px(self) -> float:
        """The focal length in pixels; the principal point is the middle of the image."""
        return self.width / (2 * math.tan(self.fov_rad / 2))


@dataclass(frozen=True)
class Lidar:
    """A lidar; channels are spaced equally between two elevations."""

    name: str
    channels: int = 32
    #: Azimuth steps in one frame.
    columns: int = 1024
    lower_rad: float = -0.436
    upper_rad: float = 0.175
    range_m: float = 100.0
    pose: Pose = field(default_factory=Pose)
    #: Horizontal field of view; 2π is a full turn.
    fov_rad: float = 2 * math.pi
    #: Standard deviation of the range along the ray.
    noise_m: float = 0.0
    #: Share of the returns that are dropped at random, 0 to 1.
    dropoff: float = 0.0
    #: The intensity falls as exp(-attenuation_per_m · distance).
    attenuation_per_m: float = 0.004
    #: Revolutions per second; None: the whole field of view at one instant in every frame.
    rotation_rate_hz: float | None = None
    #: The fourth number of a point.
    point_attribute: Literal["intensity", "cos_incidence"] = "intensity"
    outputs: Sequence[LidarOutput] = ("points", "labels")
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "lidar"


@dataclass(frozen=True)
class Imu:
    """An inertial measurement unit; without parameters an ideal one on the earth."""

    name: str
    pose: Pose = field(default_factory=Pose)
    accelerometer_stddev_mps2: Vector = _ZERO
    gyroscope_stddev_radps: Vector = _ZERO
    gyroscope_bias_radps: Vector = _ZERO
    #: Random walk of the accelerometer's bias: standard deviation after one second, m/s².
    accelerometer_walk: float = 0.0
    #: Random walk of the gyroscope's bias: standard deviation after one second, rad/s.
    gyroscope_walk: float = 0.0
    #: Specific force at rest, upwards.
    gravity_mps2: float = 9.81
    #: Measurement range along each axis; None: unlimited.
    accelerometer_max_mps2: float | None = None
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "imu"


@dataclass(frozen=True)
class Gnss:
    """A GNSS receiver; without parameters an ideal one."""

    name: str
    pose: Pose = field(default_factory=Pose)
    latitude_stddev_deg: float = 0.0
    latitude_bias_deg: float = 0.0
    longitude_stddev_deg: float = 0.0
    longitude_bias_deg: float = 0.0
    altitude_stddev_m: float = 0.0
    altitude_bias_m: float = 0.0
    #: Standard deviation of a slowly varying error, east and north.
    wander_m: float = 0.0
    #: Standard deviation of the slowly varying error, upwards.
    wander_up_m: float = 0.0
    #: Correlation time of the slowly varying error.
    wander_secs: float = 0.0
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "gnss"


@dataclass(frozen=True)
class Odometry:
    """A speedometer and odometer."""

    name: str
    pose: Pose = field(default_factory=Pose)
    #: Relative scale error of speeds; worn tyres read high.
    scale_error: float = 0.0
    stddev_mps: float = 0.0
    #: Quantisation step of speeds; None: not quantised.
    step_mps: float | None = None
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "odometry"


@dataclass(frozen=True)
class Collision:
    """Contacts of the carrier with actors and static objects, in the frame in which they happen."""

    name: str
    pose: Pose = field(default_factory=Pose)
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "collision"


@dataclass(frozen=True)
class LaneInvasion:
    """Lane markings that the carrier crosses, in the frame in which it crosses them."""

    name: str
    pose: Pose = field(default_factory=Pose)
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "lane_invasion"


@dataclass(frozen=True)
class Obstacle:
    """The nearest obstacle ahead: a sphere that is moved along the sensor's x axis."""

    name: str
    pose: Pose = field(default_factory=Pose)
    distance_m: float = 5.0
    hit_radius_m: float = 0.5
    only_actors: bool = False
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "obstacle"


#: Measured by the renderer.
RenderedSensor = Camera | Lidar
#: Measured by physics. A bundle has either rendered or physics sensors.
PhysicsSensor = Imu | Gnss | Odometry | Collision | LaneInvasion | Obstacle
Sensor = RenderedSensor | PhysicsSensor
