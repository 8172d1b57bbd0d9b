"""Sensors of a bundle, described by their parameters.

Each one has a ``name``, unique in its bundle; its ``pose`` in the space of the actor that carries it,
or in the world; ``period_secs``, the simulated time between two measurements (0: every frame); and
``seed``, that of its noise. Sensor space is right-handed: x forward, y left, z up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from .pose import Pose, Vector

if TYPE_CHECKING:
    from ._omnibus import Projection

CameraOutput = Literal["color", "depth", "tags", "instances", "normals", "flow"]
LidarOutput = Literal["points", "labels", "last_points", "last_labels"]
LidarModel = Literal["vlp-16", "hdl-64e", "os1-128", "livox-mid-40"]

_ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class BrownConrady:
    """Radial and tangential distortion, with the coefficients of OpenCV's ``calib3d``."""

    k1: float
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    model: ClassVar[str] = "brown_conrady"


@dataclass(frozen=True)
class Fisheye:
    """A fisheye up to more than 180°, with the coefficients of OpenCV's ``fisheye``. Depth is the
    distance from the camera."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    #: Largest angle between ray and optical axis, at most π; the image is black beyond. None: as far as the
    #: formula holds.
    max_angle_rad: float | None = None
    model: ClassVar[str] = "fisheye"


@dataclass(frozen=True)
class CameraEffects:
    """What optics, sensor and processing of a camera do to its color image; without parameters, nothing.
    docs/sensors.md has the formulas."""

    #: What the brightness follows: the weather, the image itself, or ``iso``, ``shutter_secs`` and
    #: ``f_number``.
    exposure: Literal["weather", "automatic", "manual"] = "weather"
    #: Stops; an image is twice as bright with each.
    compensation_ev: float = 0.0
    #: Automatic exposure: smallest and largest exposure value at ISO 100.
    ev_limits: tuple[float, float] = (11.0, 17.0)
    #: Manual exposure.
    iso: float = 100.0
    shutter_secs: float = 0.001
    f_number: float = 5.6
    #: Share of the natural vignetting, cos⁴ of the angle from the axis.
    vignette: float = 0.0
    #: Share of the light that the lens scatters around each point.
    bloom: float = 0.0
    #: Standard deviation of the inner part of that light, as a share of the width of the image.
    bloom_radius: float = 0.01
    #: Share by which the red image is larger than the green one, and that than the blue one.
    chromatic_aberration: float = 0.0
    #: Electrons in a pixel of exposed radiance 1 at ISO 100; None: no noise.
    white_electrons: float | None = None
    #: Standard deviation of the noise of reading a pixel, in electrons.
    read_electrons: float = 0.0
    #: Color temperature of the light that is shown white, and its offset towards magenta, −1 to 1.
    temperature_k: float = 6500.0
    tint: float = 0.0
    #: Encoding with the power 1 / gamma; None: the curve of sRGB.
    gamma: float | None = None
    #: Slope, toe, shoulder, black clip and white clip of Unreal's filmic tone curve; None: that of cameras
    #: without effects.
    filmic: tuple[float, float, float, float, float] | None = None
    #: Rolling shutter: time from the reading of the first row to that of the last, which is the time of the
    #: frame. It bends every image of the camera.
    readout_secs: float = 0.0
    #: Motion blur: time before that of the frame during which each row is exposed.
    blur_secs: float = 0.0
    #: Depth of field: diameter of the entrance pupil (0: everything is sharp), and distance of what is sharp.
    aperture_m: float = 0.0
    focus_m: float = 0.0


@dataclass(frozen=True)
class Camera:
    """A camera; without ``lens`` a pinhole."""

    name: str
    width: int
    height: int
    #: Horizontal field of view from edge to edge: above 0 and below π, of a fisheye below 2π; pixels are
    #: square. Without effect if ``intrinsics_px`` are given.
    fov_rad: float = math.pi / 2
    pose: Pose = field(default_factory=Pose)
    outputs: Sequence[CameraOutput] = ("color",)
    #: Rays per pixel of the color image: 1, 4 or 16; default: that of the simulator (``--quality``).
    quality: Literal["default", "low", "standard", "epic"] = "default"
    period_secs: float = 0.0
    seed: int = 0
    #: Distortion; None: a pinhole.
    lens: BrownConrady | Fisheye | None = None
    #: fx, fy, cx, cy of a calibration. The centre of pixel (0, 0) lies at (0.5, 0.5): add 0.5 to cx and cy of
    #: OpenCV and ROS. None: by ``fov_rad``, with the principal point in the middle of the image.
    intrinsics_px: tuple[float, float, float, float] | None = None
    #: Effects on the color image; None: none.
    effects: CameraEffects | None = None
    kind: ClassVar[str] = "camera"

    @property
    def projection(self) -> Projection:
        """From points in sensor space to pixels and back."""
        from ._omnibus import Projection

        return Projection(self)

    @property
    def focal_px(self) -> float:
        """The focal length along the rows in pixels."""
        return self.projection.focal_px[0]


@dataclass(frozen=True)
class Lidar:
    """A lidar; without ``elevations_rad`` its channels are spaced equally between two elevations."""

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
    #: Elevation of each channel, the highest first, at most 128. If given, ``channels``, ``lower_rad`` and
    #: ``upper_rad`` have no effect.
    elevations_rad: Sequence[float] | None = None
    #: Turns per second of the two prisms of a Risley scanner, whose beams draw a rosette with the diameter
    #: ``fov_rad``; None: columns and channels. The beams are in the order of time.
    prism_hz: tuple[float, float] | None = None
    #: Whether each column starts where the sensor was at its time, so that points are in sensor space at that
    #: time. Needs ``rotation_rate_hz`` or ``prism_hz``.
    sweep: bool = False
    #: Full angle of the cone of a beam, at most 0.1; 0: a ray. A wide beam can have several returns.
    divergence_rad: float = 0.0
    #: Whether fog, rain and spray of the simulated weather attenuate pulses and reflect them.
    weather: bool = False
    #: The fourth number of a point.
    point_attribute: Literal["intensity", "cos_incidence"] = "intensity"
    outputs: Sequence[LidarOutput] = ("points", "labels")
    period_secs: float = 0.0
    seed: int = 0
    kind: ClassVar[str] = "lidar"

    @classmethod
    def of_model(cls, model: LidarModel, name: str, frame_secs: float, **fields: Any) -> Lidar:
        """A lidar of a maker, with as many columns as it fires in ``frame_secs``: its ``period_secs``, or
        the time step of the world. ``fields`` replace those of the data sheet."""
        from ._omnibus import lidar_model

        return cls(name, **{**lidar_model(model, frame_secs), **fields})


@dataclass(frozen=True)
class RadarReceiver:
    """The receiver of a radar, which detects cells by the radar equation. docs/sensors.md has the formulas.

    The defaults are a long-range radar of 77 GHz: a car of 10 m² is detected up to 280 m.
    """

    #: Carrier frequency.
    frequency_hz: float = 77e9
    #: Transmitted power.
    transmit_power_dbm: float = 12.0
    #: Gain of each of the two antennas.
    antenna_gain_db: float = 25.0
    #: Noise of a cell, with the losses and after integration.
    noise_dbm: float = -120.0
    #: Least ratio of signal to noise of a detection.
    snr_min_db: float = 13.0
    #: Size of a cell: distance in metres, azimuth in radians, range rate in metres per second.
    cell: tuple[float, float, float] = (0.4, 0.028, 0.1)
    #: Whether walls that mirror the beam show ghosts of actors behind them.
    has_ghosts: bool = False


@dataclass(frozen=True)
class Radar:
    """A radar. ``Reading.detections`` is that of CARLA: random directions in an elliptic cone;
    ``Reading.targets`` is that of its receiver. Its rays are those of a lidar, so that ``Reading.points`` and
    ``Reading.labels`` are there, too."""

    name: str
    #: Horizontal and vertical field of view, 1° to 170°.
    horizontal_fov_rad: float = math.radians(30)
    vertical_fov_rad: float = math.radians(30)
    range_m: float = 100.0
    pose: Pose = field(default_factory=Pose)
    #: Directions of ``Reading.detections``; those that meet nothing give no detection.
    points: int = 75
    #: None: there are no ``Reading.targets``.
    receiver: RadarReceiver | None = None
    period_secs: float = 0.0
    #: Of the directions.
    seed: int = 0
    kind: ClassVar[str] = "radar"


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
RenderedSensor = Camera | Lidar | Radar
#: Measured by physics. A bundle has either rendered or physics sensors.
PhysicsSensor = Imu | Gnss | Odometry | Collision | LaneInvasion | Obstacle
Sensor = RenderedSensor | PhysicsSensor
