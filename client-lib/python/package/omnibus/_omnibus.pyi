"""The compiled part of the package."""

import os
from collections.abc import Iterator, Sequence
from typing import Any, Literal, Self, final

import numpy as np
from numpy.typing import NDArray

from . import sensors
from .client import Weather
from .gym.config import Camera
from .pose import Pose, Vector
from .sensors import Sensor

#: The package's version.
VERSION: str
#: Version and build, as ``omnibus --version`` prints them.
BUILD: str

#: The names of COCO's keypoints in their order, and the pairs of them that its skeleton connects, counted
#: from 1.
KEYPOINTS: tuple[str, ...]
KEYPOINT_LINKS: tuple[tuple[int, int], ...]

def lidar_model(model: str, period_secs: float) -> dict[str, Any]:
    """Returns the fields of a ``Lidar`` of this model."""

@final
class Cancel:
    """Ends a wait of another thread, within 50 ms: the wait raises ``CancelledError``."""

    def __new__(cls) -> Self: ...
    def set(self) -> None: ...
    def is_set(self) -> bool: ...

@final
class Memory:
    """The owner of an array's memory: the array's ``base``."""

@final
class Projection:
    """The projection of a camera, with its lens: sensor space is x forward, y left, z up."""

    def __new__(cls, camera: sensors.Camera) -> Self: ...
    def project(self, point: Vector) -> tuple[float, float] | None:
        """Column and row of a point in sensor space, which may lie outside of the image; None where the lens
        shows nothing. The centre of pixel (0, 0) lies at (0.5, 0.5)."""
    def unproject(self, pixel: tuple[float, float], depth_m: float) -> Vector | None:
        """The point in sensor space that a pixel shows at a depth of the depth image; None where the lens
        shows nothing."""
    @property
    def focal_px(self) -> tuple[float, float]:
        """fx and fy."""
    @property
    def center_px(self) -> tuple[float, float]:
        """cx and cy."""

@final
class World:
    """A snapshot: the world at one frame. Picklable; a pickled or copied one owns its memory."""

    @property
    def frame(self) -> int: ...
    @property
    def sim_time_nanos(self) -> int:
        """Simulated time since the world was loaded."""
    @property
    def sim_time_secs(self) -> float: ...
    @property
    def delta_nanos(self) -> int:
        """Simulated time of this frame."""
    @property
    def episode(self) -> int:
        """The number of the world, from 1; loading a map raises it."""
    @property
    def state_hash(self) -> int:
        """A hash of everything that decides the future."""
    @property
    def published_nanos(self) -> int:
        """When the snapshot was published, nanoseconds of ``Client.clock_nanos``."""
    @property
    def is_view(self) -> bool:
        """Whether it lies in the simulator's memory; False for a copy."""
    @property
    def actors(self) -> NDArray[Any]:
        """All actors, sorted by id: one read-only structured array (docs/python.md has its fields)."""
    def actor(self, actor_id: int) -> Any:
        """Returns one actor: a record of ``actors``. Raises KeyError if it does not exist."""
    def __contains__(self, actor_id: int, /) -> bool: ...
    def __len__(self) -> int:
        """The number of actors."""
    def copy(self) -> World:
        """Returns the same world in memory of its own."""

@final
class Keypoints:
    """COCO's 17 keypoints of a walker at one frame, in the order of ``omnibus.KEYPOINTS``."""

    @property
    def actor_id(self) -> int: ...
    @property
    def in_world(self) -> NDArray[np.float32]:
        """17 × 3; positions in world space (metres)."""
    def in_sensor(self, reading: Reading) -> NDArray[np.float32]:
        """17 × 3; positions in the space of a camera (x forward, y left, z up; metres)."""
    def in_image(self, reading: Reading) -> NDArray[np.float32]:
        """17 × 3; column and row in the image of a camera, and COCO's visibility: 0 outside of the image
        (zeros), 1 occluded, 2 visible. The camera measures instances, and depth to tell what the walker's own
        body hides."""

@final
class Reading:
    """What one sensor measured at one frame. Arrays are read-only views that stay valid while they
    are referenced. Picklable."""

    @property
    def name(self) -> str: ...
    @property
    def frame(self) -> int: ...
    @property
    def world_from_sensor(self) -> Pose | None: ...
    @property
    def first_azimuth_rad(self) -> float | None:
        """Lidar: azimuth of column 0, positive to the left."""
    @property
    def color(self) -> NDArray[np.uint8]:
        """Camera: height × width × 4; red, green, blue, 255, sRGB."""
    @property
    def depth(self) -> NDArray[np.float32]:
        """Camera: height × width; metres along the optical axis, of a fisheye from the camera."""
    @property
    def tags(self) -> NDArray[np.uint8]:
        """Camera: height × width; semantic tags."""
    @property
    def instances(self) -> NDArray[np.uint32]:
        """Camera: height × width; actor ids, static objects with the top bit set, 0 for the sky."""
    @property
    def normals(self) -> NDArray[np.float32]:
        """Camera: height × width × 3; surface normals in sensor space."""
    @property
    def flow(self) -> NDArray[np.float32]:
        """Camera: height × width × 2; pixels to the right and down since the frame before."""
    @property
    def points(self) -> NDArray[np.float32]:
        """Lidar: columns × channels × 4; x, y, z in sensor space (metres) and the point attribute;
        zeros where nothing was hit."""
    @property
    def labels(self) -> NDArray[np.uint32]:
        """Lidar: columns × channels × 2; instance and semantic tag."""
    @property
    def last_points(self) -> NDArray[np.float32]:
        """Lidar: as ``points``, of the last return of each ray, or of the second strongest if the last
        is the strongest; zeros where there is one return or none."""
    @property
    def last_labels(self) -> NDArray[np.uint32]:
        """Lidar: as ``labels``, of the returns of ``last_points``."""
    def detections(self, world: World) -> NDArray[Any]:
        """Radar: what it met in its random directions, with the velocities of the world of the same frame; a
        structured array with ``velocity_mps`` (range rate, negative for what comes nearer), ``azimuth_rad``,
        ``altitude_rad``, ``depth_m``, ``instance`` and ``tag``."""
    def targets(self, world: World) -> NDArray[Any]:
        """Radar with a receiver: the cells that it detected, in the order of distance, azimuth and range rate,
        ghosts last; the fields of ``detections``, and ``power_dbm``, ``snr_db``, ``cross_section_dbsm`` and
        ``is_ghost``."""
    @property
    def readings(self) -> NDArray[Any]:
        """Physics sensors: structured records (docs/python.md has their fields)."""

@final
class Measurement:
    """What a bundle measured at one frame, by the names of its sensors. Picklable; a pickled or
    copied one owns its memory."""

    @property
    def frame(self) -> int: ...
    @property
    def sim_time_nanos(self) -> int: ...
    @property
    def episode(self) -> int: ...
    @property
    def state_hash(self) -> int:
        """That of the measured world: ``World.state_hash``."""
    @property
    def parent(self) -> int | None:
        """The actor that carries the bundle; None if it is fixed in the world."""
    @property
    def world_from_parent(self) -> Pose: ...
    @property
    def is_view(self) -> bool:
        """Whether it lies in the simulator's memory; False for a copy."""
    @property
    def nbytes(self) -> int: ...
    def keys(self) -> list[str]:
        """The names of the bundle's sensors."""
    def get(self, key: str | int) -> Reading | None:
        """Returns the reading of a sensor; None if it did not measure at this frame."""
    def __getitem__(self, key: str | int, /) -> Reading: ...
    def __contains__(self, key: str | int, /) -> bool: ...
    def __len__(self) -> int: ...
    def copy(self) -> Measurement:
        """Returns the same measurement in memory of its own."""

@final
class Bundle:
    """Sensors that are measured together, and the stream of their measurements. It is destroyed by
    ``close()``, or with its client, its actor or its world. Iterating it waits for each measurement.
    """

    @property
    def name(self) -> str: ...
    @property
    def sensors(self) -> list[str]: ...
    @property
    def views_held(self) -> int:
        """Measurements in the simulator's memory that are referenced."""
    @property
    def views_max(self) -> int:
        """The most such measurements, from ``view_mib``: 1 to 7."""
    @property
    def missed(self) -> int:
        """Frames that were not received."""
    def receive(self) -> Measurement | None:
        """Returns the oldest measurement that was not received; None if there is none."""
    def latest(self) -> Measurement | None:
        """Returns the newest measurement that was not received and drops older ones."""
    def wait(
        self, timeout_secs: float | None = None, *, cancel: Cancel | None = None
    ) -> Measurement:
        """Waits for the next measurement: for pipelined worlds, and those on their own clock."""
    def close(self) -> None: ...
    def __iter__(self) -> Iterator[Measurement]: ...
    def __next__(self) -> Measurement: ...

@final
class LanePoint:
    """A point on a lane's centre."""

    @property
    def road_id(self) -> str: ...
    @property
    def section(self) -> int: ...
    @property
    def lane_id(self) -> int:
        """OpenDRIVE's signed id."""
    @property
    def s_m(self) -> float: ...
    @property
    def lane_type(self) -> str: ...
    @property
    def is_junction(self) -> bool: ...
    @property
    def width_m(self) -> float: ...
    @property
    def speed_limit_mps(self) -> float | None: ...
    @property
    def curvature_per_m(self) -> float:
        """In driving direction; positive turns left."""
    @property
    def position_m(self) -> Vector: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def pose(self) -> Pose:
        """``world_from_lane``: x along the lane, y to its left."""
    def advance(self, distance_m: float) -> list[LanePoint]:
        """Returns the points that lie so far ahead, one for each way."""
    @property
    def left(self) -> LanePoint | None:
        """The point beside it on the lane to the left, of any type and direction."""
    @property
    def right(self) -> LanePoint | None: ...

@final
class Map:
    """The roads of the running map."""

    @property
    def name(self) -> str: ...
    @property
    def spawn_points(self) -> list[Pose]:
        """Poses for vehicles, half a metre above the road."""
    @property
    def bounds_m(self) -> tuple[Vector, Vector]:
        """Smallest and largest coordinates of the roads."""
    def nearest(self, position_m: Sequence[float], *, drivable: bool = True) -> LanePoint | None:
        """Returns the point of the nearest lane centre; with ``drivable`` of lanes that cars use."""
    def route(
        self, from_point: LanePoint, to_point: LanePoint, every_m: float
    ) -> list[LanePoint]:
        """Returns points along the shortest way; an empty list if there is none."""

@final
class Traffic:
    """Vehicles and walkers on autopilot, and traffic lights."""

    def set_autopilot(self, actor_id: int, on: bool = True) -> None: ...
    def set(
        self,
        actor_id: int | None = None,
        *,
        speed_reduction: float | None = None,
        speed_mps: float | None = None,
        gap_m: float | None = None,
        offset_left_m: float | None = None,
        changes_lanes: bool | None = None,
        keep_right: float | None = None,
        change_left: float | None = None,
        change_right: float | None = None,
        ignore_lights: float | None = None,
        ignore_signs: float | None = None,
        ignore_vehicles: float | None = None,
        ignore_walkers: float | None = None,
        driver_spread: float | None = None,
        automatic_lights: bool | None = None,
        cross_factor: float | None = None,
        hybrid_physics: bool | None = None,
        hybrid_radius_m: float | None = None,
        walks_with: int | None = None,
    ) -> None:
        """Sets how a vehicle on autopilot drives or a walker walks; without ``actor_id`` all that were told nothing
        themselves. Shares and probabilities are 0 to 1; a speed reduction of 0.3 is 30 % slower.
        ``driver_spread``, by how much drivers differ, holds for all: 0 not at all, 1 as in the field.
        ``speed_mps`` of a walker is its speed; ``walks_with`` is the id of the walker with which it goes,
        0 for none. ``cross_factor``, the share of walkers that cross quiet streets away from crosswalks,
        holds for all, and so do ``hybrid_physics`` and ``hybrid_radius_m``: vehicles farther than that from
        every hero, every actor with sensors and every vehicle that a client drives are moved by a kinematic
        model."""
    def change_lane(self, actor_id: int, side: Literal["left", "right"]) -> None:
        """Changes lanes once, as soon as there is one."""
    def ignore_actor(self, actor_id: int, other: int, on: bool = True) -> None: ...
    def set_seed(self, seed: int) -> None:
        """Sets the seed of all random decisions of vehicles, 0 to 2^24."""
    def set_walker_seed(self, seed: int) -> None:
        """Sets the seed of all random decisions of walkers, 0 to 2^24."""
    def set_route(self, actor_id: int, steps: Sequence[str | Sequence[float]]) -> None:
        """Gives a walker positions in metres to walk to, or a vehicle a route: positions in metres that it passes, and turns at the junctions
        that come next: left, right, straight, lane_left, lane_right."""
    def hold_light(
        self, actor_id: int, phase: Literal["red", "yellow", "green", "off"]
    ) -> None: ...
    def release_light(self, actor_id: int) -> None: ...
    def light_group(self, actor_id: int) -> list[int]:
        """The traffic lights that are switched together with this one."""

@final
class Recorder:
    """Recordings: written and replayed. A name without a slash lies in the folder for recordings."""

    def start(
        self,
        name: str | os.PathLike[str],
        *,
        profile: Literal["state", "inputs", "compact"] = "state",
    ) -> os.PathLike[str]:
        """Records from the next frame on; returns the path of the file."""
    def stop(self) -> int:
        """Closes the recording; returns how many frames it has."""
    def replay(
        self,
        name: str | os.PathLike[str],
        *,
        from_secs: float = 0.0,
        duration_secs: float = 0.0,
        time_factor: float = 1.0,
        ignore_hero: bool = False,
    ) -> None:
        """Replays a recording; its first frame is shown by the next tick."""
    def stop_replay(self, *, keep_actors: bool = False) -> None: ...

class Client:
    """The base of ``omnibus.Client``."""

    def __new__(
        cls,
        name: str = "python",
        instance: str | None = None,
        *,
        wait_strategy: Literal["latency", "balanced", "batch"] | None = None,
    ) -> Self:
        """Connects to the simulator named ``instance``, or to the only one that runs. ``name`` is the
        client's own: commands of one frame are carried out in the order of names."""
    @property
    def name(self) -> str: ...
    @property
    def instance(self) -> str: ...
    @property
    def is_open(self) -> bool: ...
    def close(self) -> None:
        """Ends the connection; arrays and frames that are held stay valid."""
    @property
    def frame(self) -> int:
        """The newest frame that was taken in."""
    @property
    def episode(self) -> int: ...
    @property
    def world(self) -> World:
        """The world that was taken in last: by ``tick``, ``await_frame`` or ``snapshot``."""
    def snapshot(self) -> World:
        """Takes the newest world in and returns it. Never waits."""
    def await_frame(
        self, timeout_secs: float | None = None, *, cancel: Cancel | None = None
    ) -> World:
        """Waits for a newer frame than the last one and returns the newest world."""
    def synchronise(self, delta_secs: float) -> None:
        """Takes the tick and makes the world wait for it."""
    def take_tick(self) -> None: ...
    @property
    def holds_tick(self) -> bool: ...
    def leave_tick(self) -> None: ...
    def hand_tick_to(self, name: str) -> None: ...
    def join_barrier(self) -> None:
        """Makes every tick of another client wait until this one has called ``arrive()``."""
    def leave_barrier(self) -> None: ...
    def arrive(self) -> None:
        """Reports that this client's work for the newest frame is done."""
    def spawn(
        self,
        blueprint: str,
        pose: Pose,
        *,
        autopilot: bool = False,
        kinematic: bool = False,
        color: tuple[int, int, int] | None = None,
        role: str | None = None,
    ) -> int:
        """Spawns an actor and returns its id; the next frame shows it."""
    def destroy(self, actor_id: int) -> None: ...
    def teleport(self, actor_id: int, pose: Pose) -> None: ...
    def set_velocity(
        self,
        actor_id: int,
        velocity_mps: Vector,
        angular_velocity_radps: Vector = ...,
    ) -> None: ...
    def set_kinematic(self, actor_id: int, on: bool) -> None: ...
    def control(
        self,
        actor_id: int,
        *,
        throttle: float = 0.0,
        brake: float = 0.0,
        steer: float = 0.0,
        handbrake: bool = False,
        reverse: bool = False,
        gear: int | None = None,
    ) -> None:
        """Sets pedals (0 to 1) and wheel (-1, full right, to 1, full left) from the next frame on;
        the latest hold. Does not wait."""
    def keypoints(self, actor_id: int) -> Keypoints:
        """Returns the keypoints of a walker in the world that was taken in last."""
    def set_weather(self, weather: Weather) -> None: ...
    def create_bundle(
        self,
        name: str,
        sensors: Sequence[Sensor],
        parent: int | None = None,
        *,
        view_mib: float = 64.0,
        when_full: Literal["copy", "error"] = "copy",
    ) -> Bundle:
        """Mounts sensors on an actor, or without ``parent`` in the world. At most ``view_mib`` of the
        simulator's memory may be held by views; then measurements are copied, or with
        ``when_full="error"`` refused."""
    @property
    def bundles(self) -> list[Bundle]: ...
    @property
    def map(self) -> Map: ...
    def available_maps(self) -> list[str]: ...
    def load_map(self, name: str = "", *, seed: int | None = None) -> World:
        """Loads a map in the place of the world, or the running one again. All actors and bundles are
        destroyed."""
    def save_state(self) -> bytes:
        """Returns everything that decides the future."""
    def load_state(self, state: bytes) -> None: ...
    @property
    def traffic(self) -> Traffic: ...
    @property
    def recorder(self) -> Recorder: ...
    @staticmethod
    def clock_nanos() -> int:
        """The clock of ``World.published_nanos``, nanoseconds."""
    def _blueprints(self) -> list[tuple[str, int, Vector, Vector]]: ...
    def _settings(self) -> dict[str, Any]: ...
    def _apply_settings(
        self,
        delta_secs: float,
        substep_max_secs: float,
        synchronous: bool,
        real_time_factor: float | None,
        pipeline: int,
        rendering: bool,
    ) -> None: ...
    def _tick(
        self, timeout_secs: float | None, cancel: Cancel | None
    ) -> tuple[int, World, list[tuple[str, Measurement | None]]]: ...

@final
class EnvironmentMap:
    """A map for environments in this process; several environments may share it. It is loaded from
    the cache where possible."""

    def __new__(cls, map: str | None = None, *, seed: int = 1) -> Self:
        """``map`` is a name or an OpenDRIVE file as in ``omnibus.launch``; ``seed`` decides how the
        town is furnished."""
    @property
    def name(self) -> str: ...
    @property
    def seed(self) -> int: ...

@final
class Environment:
    """Ego vehicles in a world in this process: what ``omnibus.gym`` is made of.

    Calls release the interpreter's lock while they work. Two threads cannot use one environment at
    the same time: the later call raises ``NotAllowedError``. Arrays are writable and own their
    memory: nothing writes into them later.
    """

    def __new__(
        cls,
        map: EnvironmentMap,
        *,
        seed: int = 1,
        waypoints: bool = False,
        egos: int = 1,
        vehicles: int = 12,
        kinematic_traffic: bool = False,
        frame_s: float = 0.05,
        frames_per_step: int = 2,
        route_m: float = 300.0,
        steps_max: int = 1000,
        lidar_rays: int = 0,
        lidar_range_m: float = 50.0,
        birds_eye_px: int = 84,
        birds_eye_pixel_m: float = 0.5,
        camera: Camera | None = None,
        off_route_m: float = 0.5,
        rewards: Sequence[float] | None = None,
    ) -> Self:
        """``camera`` is an ``omnibus.gym.Camera``; ``rewards`` has the eight numbers of
        ``omnibus.gym.Rewards`` in their order."""
    def reset(self, seed: int) -> None:
        """Begins another episode. The same seed gives the same episode."""
    def step(
        self, actions: Sequence[tuple[float, float]]
    ) -> list[tuple[float, Literal["arrival", "collision", "off_route", "steps"] | None]]:
        """Advances by one step; an action is steering wheel and pedal, or with ``waypoints`` metres
        to the left of the lane's middle and metres per second. Returns reward and ending of each ego
        vehicle."""
    def state(self, ego: int = 0) -> NDArray[np.float32]:
        """Returns the state vector, 24 numbers (docs/gym.md)."""
    def lidar(self, ego: int = 0) -> NDArray[np.float32]:
        """Returns for each ray the distance to the next object as a fraction of the range."""
    def birds_eye(self, ego: int = 0) -> NDArray[np.uint8]:
        """Returns what is around an ego vehicle from above: 6 × size × size, 0 or 255; where vehicles
        drive, road markings, the route, other actors, solid objects, the ego vehicle. Straight ahead
        is up."""
    def camera(self, ego: int = 0) -> NDArray[Any]:
        """Returns the image of the camera: height × width × 3 bytes of red, green and blue, × 1 byte of
        semantic tags, or × 1 depth in metres. The first one of a map loads what cameras see."""
    def progress(self, ego: int = 0) -> tuple[float, float, float, float]:
        """Returns the distance along the route, its length (metres), the forward speed (metres per
        second) and the distance to the left of the lane's middle (metres)."""
    @property
    def state_hash(self) -> int:
        """A hash of everything that decides the future, as ``World.state_hash``."""
