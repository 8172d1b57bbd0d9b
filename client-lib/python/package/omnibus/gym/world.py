"""What both kinds of environments share: maps, spaces, actions, observations, episodes."""

from __future__ import annotations

import weakref
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from .._omnibus import Environment, EnvironmentMap
from .config import (
    BirdsEye,
    Camera,
    Continuous,
    Discrete,
    DriveConfig,
    Lidar,
    Observation,
    State,
    Waypoint,
)

RENDER_MODES = ["rgb_array"]
_STATE = 24
#: The depth of a pixel where nothing is hit. Metres.
_DEPTH_FAR_M = 1000.0
#: The raster of images that are rendered where it is not observed, and the least edge of an image.
_RENDERED = BirdsEye(size_px=256, pixel_m=0.25)
_IMAGE_PX = 256
_GROUND = (222, 226, 214)
#: The color of each channel of the raster, from below to above.
_COLORS = (
    (118, 120, 124),  # where vehicles drive
    (240, 240, 240),  # road markings
    (120, 170, 220),  # the route
    (205, 60, 50),  # other actors
    (150, 128, 105),  # solid objects
    (30, 140, 70),  # the ego vehicle
)
#: The order in which the channels are painted: markings are visible on the route.
_PAINTED = (0, 2, 1, 4, 3, 5)
#: The maps of this process, as long as an environment uses them.
_maps: weakref.WeakValueDictionary[tuple[object, ...], EnvironmentMap] = (
    weakref.WeakValueDictionary()
)


def load_map(name: str | None, seed: int) -> EnvironmentMap:
    """Returns a map that all environments of this process share."""
    version: object = None
    if name is not None and Path(name).is_file():
        path = Path(name).resolve()
        status = path.stat()
        name, version = str(path), (status.st_mtime_ns, status.st_size)
    key = (name, version, seed)
    found = _maps.get(key)
    if found is None:
        found = _maps[key] = EnvironmentMap(name, seed=seed)
    return found


def check_render_mode(mode: str | None) -> None:
    """Checks that a render mode exists."""
    if mode is not None and mode not in RENDER_MODES:
        raise ValueError(f"render_mode is {mode!r}, must be None or one of {RENDER_MODES}")


def observation_space(config: DriveConfig) -> spaces.Space[Any]:
    """Returns the space of an ego vehicle's observations."""
    if isinstance(config.observations, tuple):
        return spaces.Dict({one.key: _space(one) for one in config.observations})
    return _space(config.observations)


def _space(observation: Observation) -> spaces.Space[Any]:
    match observation:
        case State():
            return spaces.Box(-10.0, 10.0, (_STATE,), np.float32)
        case Lidar(rays=rays):
            return spaces.Box(0.0, 1.0, (rays,), np.float32)
        case BirdsEye(size_px=size_px):
            return spaces.Box(0, 255, (len(_COLORS), size_px, size_px), np.uint8)
        case Camera(width_px=width_px, height_px=height_px, output="depth"):
            return spaces.Box(0.0, _DEPTH_FAR_M, (height_px, width_px, 1), np.float32)
        case Camera(width_px=width_px, height_px=height_px, output=output):
            return spaces.Box(0, 255, (height_px, width_px, 3 if output == "color" else 1), np.uint8)


def action_space(config: DriveConfig) -> spaces.Space[Any]:
    """Returns the space of an ego vehicle's actions."""
    match config.actions:
        case Continuous() | Waypoint():
            return spaces.Box(-1.0, 1.0, (2,), np.float32)
        case Discrete(steer=steer, pedal=pedal):
            return spaces.Discrete(len(steer) * len(pedal))


class World:
    """Episodes of one or several ego vehicles."""

    def __init__(self, config: DriveConfig, egos: int) -> None:
        self.config = config
        several = config.observations
        self._observed = several if isinstance(several, tuple) else (several,)
        self._single = several if not isinstance(several, tuple) else None
        self._egos = egos
        # The first seed's map, so that an error of the map is one of the constructor.
        self._map = load_map(config.route.map, config.route.map_seeds[0])
        #: Maps that episodes have used, kept for the next ones.
        self._kept = {config.route.map_seeds[0]: self._map}
        self._environment = self._begin(self._map, 0, {})
        #: Whether the running episode has other vehicles or another length than the configuration.
        self._changed = False

    @property
    def environment(self) -> Environment:
        """The environment of the compiled module."""
        return self._environment

    def _begin(
        self, map: EnvironmentMap, seed: int, options: Mapping[str, Any]
    ) -> Environment:
        config = self.config
        lidar = next((one for one in self._observed if isinstance(one, Lidar)), None)
        eye = next((one for one in self._observed if isinstance(one, BirdsEye)), _RENDERED)
        camera = next((one for one in self._observed if isinstance(one, Camera)), Camera())
        return Environment(
            map,
            seed=seed,
            waypoints=isinstance(config.actions, Waypoint),
            egos=self._egos,
            vehicles=int(options.get("vehicles", config.vehicles)),
            kinematic_traffic=config.kinematic_traffic,
            frame_s=config.frame_s,
            frames_per_step=config.frames_per_step,
            route_m=float(options.get("route_m", config.route.length_m)),
            steps_max=config.terminations.steps_max,
            lidar_rays=lidar.rays if lidar else 0,
            lidar_range_m=lidar.range_m if lidar else 50.0,
            birds_eye_px=eye.size_px,
            birds_eye_pixel_m=eye.pixel_m,
            camera=camera,
            off_route_m=config.terminations.off_route_m,
            rewards=config.rewards._values(),  # pyright: ignore[reportPrivateUsage]
        )

    def reset(
        self, random: np.random.Generator, options: Mapping[str, Any] | None
    ) -> dict[str, int]:
        """Begins another episode; returns what decides it."""
        options = options or {}
        # Both are drawn always, so that options do not change what is drawn later.
        drawn = int(random.integers(2**63))
        chosen = int(random.integers(len(self.config.route.map_seeds)))
        seed = int(options.get("episode_seed", drawn))
        map_seed = int(options.get("map_seed", self.config.route.map_seeds[chosen]))
        map = self._kept.get(map_seed)
        if map is None:
            map = self._kept[map_seed] = load_map(self.config.route.map, map_seed)
        if map is self._map and not options.keys() & {"vehicles", "route_m"} and not self._changed:
            self._environment.reset(seed)
        else:
            self._environment = self._begin(map, seed, options)
            self._map = map
            self._changed = bool(options.keys() & {"vehicles", "route_m"})
        return {"episode_seed": seed, "map_seed": map_seed}

    def observe(self, ego: int) -> Any:
        """Returns the observation of an ego vehicle, in arrays of its own."""
        if self._single is not None:
            return self._measure(self._single, ego)
        return {one.key: self._measure(one, ego) for one in self._observed}

    def _measure(self, observation: Observation, ego: int) -> NDArray[Any]:
        match observation:
            case State():
                return self._environment.state(ego)
            case Lidar():
                return self._environment.lidar(ego)
            case BirdsEye():
                return self._environment.birds_eye(ego)
            case Camera():
                return self._environment.camera(ego)

    def image(self, ego: int) -> NDArray[np.uint8]:
        """Returns a picture of the surroundings from above, height × width × 3."""
        raster = self._environment.birds_eye(ego)
        image = np.full((*raster.shape[1:], 3), _GROUND, np.uint8)
        for channel in _PAINTED:
            image[raster[channel] > 0] = _COLORS[channel]
        scale = -(-_IMAGE_PX // image.shape[0])
        return image.repeat(scale, axis=0).repeat(scale, axis=1)

    def action(self, action: Any) -> tuple[float, float]:
        """Returns the two numbers of an action."""
        kind = self.config.actions
        if isinstance(kind, Discrete):
            steer, pedal = divmod(int(action), len(kind.pedal))
            if not 0 <= steer < len(kind.steer):
                count = len(kind.steer) * len(kind.pedal)
                raise ValueError(f"the action is {action}, must be 0 to {count - 1}")
            return kind.steer[steer], kind.pedal[pedal]
        try:
            first, second = action.tolist() if isinstance(action, np.ndarray) else action
        except (TypeError, ValueError):
            raise ValueError(f"the action is {action!r}, must be two numbers") from None
        if isinstance(kind, Waypoint):
            for number in (first, second):
                if not -1 <= number <= 1:
                    raise ValueError(f"the action is {action!r}, must be numbers from -1 to 1")
            return first * kind.left_max_m, (second + 1) / 2 * kind.speed_max_mps
        return first, second

    def info(self, ego: int, ending: str | None) -> dict[str, Any]:
        """Returns what is known of an ego vehicle beside its observation."""
        progress_m, route_m, speed_mps, left_m = self._environment.progress(ego)
        return {
            "ending": ending,
            "progress_m": progress_m,
            "route_m": route_m,
            "speed_mps": speed_mps,
            "left_m": left_m,
        }
