"""What an environment observes, does and rewards. Every class can be pickled and compared."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, field
from typing import Literal

from ..pose import Pose


def _check(what: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ValueError(f"{what} is {value}, must be {low:g} to {high:g}")


@dataclass(frozen=True)
class State:
    """The state vector: 24 numbers, each −10 to 10 (docs/gym.md has the table)."""

    key = "state"


@dataclass(frozen=True)
class Lidar:
    """A planar lidar: for each ray the distance to the next object as a fraction of the range."""

    #: Rays of a full turn, the first straight ahead, then to the left. 1 to 4096.
    rays: int = 240
    #: Metres, 1 to 500.
    range_m: float = 50.0

    key = "lidar"

    def __post_init__(self) -> None:
        _check("Lidar.rays", self.rays, 1, 4096)
        _check("Lidar.range_m", self.range_m, 1, 500)


@dataclass(frozen=True)
class BirdsEye:
    """What is around the vehicle, from above: six images of bytes, 0 or 255, straight ahead upwards.
    They are where vehicles drive, road markings, the route, other actors, solid objects, and the ego
    vehicle, which is in the middle."""

    #: Pixels along an edge, 8 to 512.
    size_px: int = 84
    #: Edge of a pixel. Metres, 0.1 to 4.
    pixel_m: float = 0.5

    key = "birds_eye"

    def __post_init__(self) -> None:
        _check("BirdsEye.size_px", self.size_px, 8, 512)
        _check("BirdsEye.pixel_m", self.pixel_m, 0.1, 4)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: an image of bytes (red, green, blue; sRGB) or of semantic tags, height ×
    width × 3 or 1, or of depths in metres along the optical axis, at most 1000. Pixels are square."""

    #: Pixels across and down, 8 to 2048.
    width_px: int = 84
    height_px: int = 84
    #: Horizontal field of view, 0.1 to 3.
    fov_rad: float = math.pi / 2
    #: In the space of the vehicle: x forward, y left, z up. By default above the windscreen, looking
    #: straight ahead.
    pose: Pose = Pose((1.5, 0.0, 2.0))
    output: Literal["color", "tags", "depth"] = "color"

    key = "camera"

    def __post_init__(self) -> None:
        _check("Camera.width_px", self.width_px, 8, 2048)
        _check("Camera.height_px", self.height_px, 8, 2048)
        _check("Camera.fov_rad", self.fov_rad, 0.1, 3)
        if self.output not in ("color", "tags", "depth"):
            raise ValueError(f"Camera.output is {self.output!r}, must be 'color', 'tags' or 'depth'")


Observation = State | Lidar | BirdsEye | Camera


@dataclass(frozen=True)
class Continuous:
    """Two numbers, −1 to 1: the steering wheel (1: full left), and the brake (−1) or throttle (1)."""


@dataclass(frozen=True)
class Discrete:
    """A grid of steering wheel positions and pedals: action ``i`` is
    ``steer[i // len(pedal)], pedal[i % len(pedal)]``."""

    #: Each −1 (full right) to 1 (full left).
    steer: tuple[float, ...] = (-0.5, -0.15, 0.0, 0.15, 0.5)
    #: Each −1 (full brake) to 1 (full throttle).
    pedal: tuple[float, ...] = (-0.5, 0.0, 0.5)

    def __post_init__(self) -> None:
        for name, values in (("steer", self.steer), ("pedal", self.pedal)):
            if not values:
                raise ValueError(f"Discrete.{name} is empty, must have at least one value")
            for value in values:
                _check(f"a value of Discrete.{name}", value, -1, 1)


@dataclass(frozen=True)
class Waypoint:
    """Two numbers, −1 to 1: a place beside the middle of the lane, as a fraction of ``left_max_m``
    (1: to the left), and a speed, from 0 (−1) to ``speed_max_mps`` (1). A controller follows them in
    every frame."""

    #: Metres, above 0 to 10.
    left_max_m: float = 1.5
    #: Metres per second, above 0 to 60.
    speed_max_mps: float = 15.0

    def __post_init__(self) -> None:
        _check("Waypoint.left_max_m", self.left_max_m, 1e-3, 10)
        _check("Waypoint.speed_max_mps", self.speed_max_mps, 1e-3, 60)


Actions = Continuous | Discrete | Waypoint


@dataclass(frozen=True)
class Rewards:
    """The parts of the reward of a step."""

    #: For each metre of the route that was not reached before.
    per_metre: float = 1.0
    #: Times the speed as a fraction of the speed limit, at most 1.
    speed: float = 0.1
    #: Times the speed above the limit, as a fraction of the limit.
    speeding: float = -5.0
    #: Times the distance from the middle of the lane, as a fraction of half its width, at most 1.
    off_centre: float = -0.1
    #: Times the change of the steering wheel since the step before, 0 to 2.
    steering: float = -0.1
    #: At the end of the route.
    arrival: float = 10.0
    #: At a collision.
    collision: float = -5.0
    #: Beside the route.
    off_route: float = -5.0

    def _values(self) -> tuple[float, ...]:
        return astuple(self)


@dataclass(frozen=True)
class Terminations:
    """When an episode ends, beside the end of the route and collisions."""

    #: How far beside its lane the vehicle's middle may be. Metres.
    off_route_m: float = 0.5
    #: Steps after which the episode is truncated; 0: never.
    steps_max: int = 1000

    def __post_init__(self) -> None:
        _check("Terminations.steps_max", self.steps_max, 0, 2**32 - 1)


@dataclass(frozen=True)
class Route:
    """Where an episode takes place."""

    #: A name that ``omnibus maps`` lists or an OpenDRIVE file; None: the map that ships.
    map: str | None = None
    #: How the town beside the roads is furnished; each episode draws one of these seeds.
    map_seeds: tuple[int, ...] = (1,)
    #: Length of the route. Metres, 10 to 10 000.
    length_m: float = 300.0

    def __post_init__(self) -> None:
        if not self.map_seeds:
            raise ValueError("Route.map_seeds is empty, must have at least one seed")
        for seed in self.map_seeds:
            _check("a seed of Route.map_seeds", seed, 0, 2**63)


@dataclass(frozen=True)
class DriveConfig:
    """What decides an episode beside its seed and the actions."""

    #: One observation, which is the observation itself, or several, which are a dictionary with the
    #: keys ``"state"``, ``"lidar"``, ``"birds_eye"`` and ``"camera"``.
    observations: Observation | tuple[Observation, ...] = (State(), Lidar())
    actions: Actions = field(default_factory=Continuous)
    rewards: Rewards = field(default_factory=Rewards)
    terminations: Terminations = field(default_factory=Terminations)
    route: Route = field(default_factory=Route)
    #: Other vehicles, driven by traffic. 0 to 1000.
    vehicles: int = 12
    #: Whether other vehicles move exactly as traffic means, without wheels and engine: faster, and
    #: other state hashes than those of a simulator.
    kinematic_traffic: bool = False
    #: Length of a frame. Seconds, 0.005 to 0.1.
    frame_s: float = 0.05
    #: Frames for each step. 1 to 100.
    frames_per_step: int = 2

    def __post_init__(self) -> None:
        _check("vehicles", self.vehicles, 0, 1000)
        _check("frames_per_step", self.frames_per_step, 1, 100)
        if not math.isfinite(self.frame_s):
            raise ValueError(f"frame_s is {self.frame_s}, must be 0.005 to 0.1")
        several = self.observations
        if isinstance(several, tuple):
            keys = [one.key for one in several]
            if not keys or len(set(keys)) < len(keys):
                raise ValueError(f"observations are {keys}, must be different ones and at least one")
