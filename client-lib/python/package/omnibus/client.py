"""The connection to a running simulator."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from types import TracebackType

from ._omnibus import Cancel, Measurement, Reading, World
from ._omnibus import Client as Connection
from .pose import Vector


@dataclass(frozen=True)
class Blueprint:
    """Something that can be spawned. An actor's ``blueprint`` is an index into ``Client.blueprints``."""

    #: As ``vehicle.tesla.model3``.
    id: str
    #: The semantic tag's code, as in images of tags.
    tag: int
    #: Half extents of the bounding box.
    half_extents_m: Vector
    #: Centre of the bounding box in actor space.
    center_m: Vector


@dataclass(frozen=True)
class Weather:
    """Sun, clouds, rain and fog. The defaults are a clear afternoon."""

    #: 0 to 100.
    cloudiness: float = 10.0
    #: 0 to 100.
    precipitation: float = 0.0
    #: Puddles, 0 to 100.
    precipitation_deposits: float = 0.0
    #: 0 to 100.
    wind_intensity: float = 10.0
    #: Azimuth of the sun, counter-clockwise from x.
    sun_azimuth_rad: float = 0.6
    #: Altitude of the sun above the horizon.
    sun_altitude_rad: float = 0.85
    #: 0 to 100.
    fog_density: float = 2.0
    #: Distance at which fog begins.
    fog_distance_m: float = 0.75
    #: 0 to 100.
    wetness: float = 0.0


@dataclass(frozen=True)
class Settings:
    """How time passes."""

    #: Simulated time of one tick: 0.0001 to 10.
    delta_secs: float = 0.05
    #: The longest substep of physics: 0.0001 to 0.1.
    substep_max_secs: float = 0.01
    #: Whether the client that holds the tick starts the frames.
    synchronous: bool = False
    #: Simulated seconds per real second of an asynchronous world; None: as fast as possible.
    real_time_factor: float | None = 1.0
    #: How many frames rendering may trail behind the world: 0 (strict) to 3.
    pipeline: int = 0
    #: Whether sensors are rendered.
    rendering: bool = True


class Frame:
    """What a tick returned: the world at one frame, and what every bundle measured at that frame.

    ``frame["front"]`` is the reading of the sensor of that name, in whatever bundle it is.
    """

    __slots__ = ("measurements", "number", "world")

    number: int
    world: World
    #: By the bundle's name; None if all its sensors rested, or rendering trails behind (pipelined).
    measurements: dict[str, Measurement | None]

    def __init__(
        self, number: int, world: World, measurements: dict[str, Measurement | None]
    ) -> None:
        self.number = number
        self.world = world
        self.measurements = measurements

    def __getitem__(self, sensor: str) -> Reading:
        for measurement in self.measurements.values():
            if measurement is not None and sensor in measurement:
                return measurement[sensor]
        known = [
            name for measured in self.measurements.values() if measured for name in measured.keys()
        ]
        raise KeyError(
            f"sensor {sensor!r} has no reading at frame {self.number}; measured bundles have "
            f"{', '.join(known) or 'none'}. A sensor with a period rests between its measurements"
        )

    def get(self, sensor: str) -> Reading | None:
        """Returns the reading of a sensor; None if it did not measure at this frame."""
        for measurement in self.measurements.values():
            if measurement is not None and sensor in measurement:
                return measurement[sensor]
        return None

    def __contains__(self, sensor: str) -> bool:
        return self.get(sensor) is not None

    def __reduce__(self) -> tuple[type[Frame], tuple[object, ...]]:
        return (Frame, (self.number, self.world, self.measurements))

    def __repr__(self) -> str:
        return f"Frame({self.number}, actors={len(self.world)}, bundles={list(self.measurements)})"


class Client(Connection):
    """A connection to a running simulator. Any number of threads may use it; waits let the others
    run. A forked process cannot use it and connects a client of its own.
    """

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def blueprints(self) -> list[Blueprint]:
        """What can be spawned."""
        return [Blueprint(*blueprint) for blueprint in self._blueprints()]

    @property
    def settings(self) -> Settings:
        """How time passes now."""
        return Settings(**self._settings())

    def apply_settings(self, settings: Settings) -> None:
        """Sets how time passes; it holds when this returns."""
        self._apply_settings(**asdict(settings))

    def tick(self, timeout_secs: float | None = None, *, cancel: Cancel | None = None) -> Frame:
        """Advances the world by one tick and returns the frame with all its measurements.

        It waits until every part of the simulator has done its work for the frame. Measurements of
        earlier frames that were not received are dropped and counted (``Bundle.missed``).
        """
        number, world, measured = self._tick(timeout_secs, cancel)
        return Frame(number, world, dict(measured))

    def ticks(self, count: int | None = None) -> Iterator[Frame]:
        """Ticks ``count`` times, or without end, and yields each frame."""
        done = 0
        while count is None or done < count:
            yield self.tick()
            done += 1

    def frames(self, timeout_secs: float | None = None) -> Iterator[World]:
        """Yields the newest world whenever there is a newer one, without ticking: for agents beside
        the client that ticks, and for a world on its own clock. Frames that pass meanwhile are
        skipped."""
        while True:
            yield self.await_frame(timeout_secs)
