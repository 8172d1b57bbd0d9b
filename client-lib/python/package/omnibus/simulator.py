"""Simulators that Python starts and ends."""

from __future__ import annotations

import itertools
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
import weakref
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Literal

from ._omnibus import BUILD, Bundle
from .client import Client
from .errors import BuildError, OmnibusError, RefusedError, SimulatorTimeoutError
from .sensors import Camera, Lidar, Radar, Sensor

#: Time that a simulator has to end before it is killed.
_END_SECS = 10.0
_EGO = "vehicle.tesla.model3"
_counter = itertools.count(1)


class Simulator:
    """A simulator that ``launch`` has started, and a client that ticks it. A context manager: the
    simulator ends with the block, and however Python ends."""

    #: The name of the instance, for ``Client(instance=…)`` in other processes.
    name: str
    #: Connected, and holds the tick.
    client: Client
    #: The vehicle that carries the sensors.
    ego: int | None
    #: The bundles of the sensors: one for rendered sensors, one for those of physics.
    bundles: list[Bundle]

    def __init__(self, process: subprocess.Popen[bytes], log: IO[bytes], name: str) -> None:
        self.name = name
        self.ego = None
        self.bundles = []
        self._process = process
        self._log = log
        self._owner = os.getpid()
        self._end = weakref.finalize(self, _end, process, self._owner)
        weakref.finalize(self, log.close)

    @property
    def pid(self) -> int:
        """The process of the host."""
        return self._process.pid

    @property
    def is_running(self) -> bool:
        """Whether the host's process runs."""
        return self._process.poll() is None

    @property
    def log(self) -> str:
        """What the simulator has printed so far."""
        return _read(self._log)

    def close(self) -> None:
        """Ends the simulator and waits for its end. Arrays and frames that are held stay valid."""
        if os.getpid() == self._owner:
            if hasattr(self, "client"):
                self.client.close()
            self._end()

    def __enter__(self) -> Simulator:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Simulator({self.name!r}, pid={self.pid}, is_running={self.is_running})"


def _end(process: subprocess.Popen[bytes], owner: int) -> None:
    if os.getpid() != owner:
        # A forked child leaves the simulator to its parent; without a code Popen warns.
        process.returncode = 0
    elif process.poll() is None:
        process.terminate()
        try:
            process.wait(_END_SECS)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _read(log: IO[bytes]) -> str:
    size = os.fstat(log.fileno()).st_size
    return os.pread(log.fileno(), size, 0).decode(errors="replace")


def find_program() -> Path:
    """Returns the ``omnibus`` program: the one that was installed with this package, else that of the
    environment variable OMNIBUS_PROGRAM, else the first on PATH."""
    folders = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")]
    for folder in [*folders, os.path.dirname(sys.executable)]:
        program = Path(folder) / "omnibus"
        if os.access(program, os.X_OK):
            return program
    given = os.environ.get("OMNIBUS_PROGRAM")
    if given:
        if not os.access(given, os.X_OK):
            raise OmnibusError(f"OMNIBUS_PROGRAM is {given}, which is no program that can be started")
        return Path(given)
    found = shutil.which("omnibus")
    if found is None:
        raise OmnibusError(
            f"no program omnibus in {folders[0]}, in OMNIBUS_PROGRAM or on PATH; install the wheel "
            "again: pip install --force-reinstall omnibus-sim"
        )
    return Path(found)


def _check_build(program: Path) -> None:
    try:
        asked = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=60)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise OmnibusError(f"{program} --version: {error}") from error
    theirs = asked.stdout.strip().removeprefix("omnibus ")
    if theirs != BUILD:
        raise BuildError(
            f"this package is omnibus-sim {BUILD}, and {program} is {theirs or 'no omnibus'}; use "
            "the program of the wheel that this package came from, or install the wheel of that "
            "program"
        )


def launch(
    map: str | os.PathLike[str] | None = None,
    sensors: Sequence[Sensor] = (),
    *,
    ego: str | None = None,
    autopilot: bool = True,
    seed: int = 1,
    delta_secs: float = 0.05,
    name: str | None = None,
    device: str = "auto",
    carla_port: int | None = None,
    view_mib: float = 64.0,
    when_full: Literal["copy", "error"] = "copy",
    options: Sequence[str] = (),
    program: str | os.PathLike[str] | None = None,
    timeout_secs: float = 180.0,
) -> Simulator:
    """Starts a simulator, connects a client that ticks it, and returns both.

    ``map`` is a name (``omnibus maps`` lists them) or an OpenDRIVE file. With ``sensors`` or ``ego`` a
    vehicle of that blueprint is spawned at a spawn point and carries the sensors; traffic drives it
    while ``autopilot`` holds. ``options`` are further options of ``omnibus run``; the road users
    of ``--vehicles`` and ``--walkers`` are in the world on return. CARLA's clients are served on
    ``carla_port`` and the two ports after it, if that is given.
    """
    path = Path(program) if program is not None else find_program()
    _check_build(path)
    name = name or f"py{os.getpid() % 100_000}-{next(_counter)}"
    command = [str(path), "run", "--synchronous", "--name", name, "--parent", str(os.getpid())]
    command += ["--seed", str(seed), "--fixed-delta", str(delta_secs), "--device", device]
    command += ["--no-carla"] if carla_port is None else ["--carla-port", str(carla_port)]
    command += [] if map is None else ["--map", os.fspath(map)]
    command += options
    log: IO[bytes] = tempfile.TemporaryFile(prefix="omnibus-log-")
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=log,
        stderr=subprocess.STDOUT,
        # Ctrl-C on the terminal reaches Python alone, which ends the simulator.
        start_new_session=True,
    )
    simulator = Simulator(process, log, name)
    try:
        _await_start(simulator, timeout_secs)
        simulator.client = Client("launch", name)
        simulator.client.take_tick()
        if sensors or ego is not None:
            _mount(simulator, sensors, ego or _EGO, autopilot, view_mib, when_full)
    except BaseException:
        simulator.close()
        raise
    return simulator


def _await_start(simulator: Simulator, timeout_secs: float) -> None:
    end = time.monotonic() + timeout_secs
    line = f'simulator "{simulator.name}" runs'
    while line not in simulator.log:
        if not simulator.is_running:
            said = simulator.log.strip().splitlines()[-5:]
            raise OmnibusError("the simulator did not start: " + ("\n".join(said) or "no reason"))
        if time.monotonic() > end:
            raise SimulatorTimeoutError(
                f"timeout: the simulator did not start within {timeout_secs} s; a large map needs "
                f"longer when it is loaded first (timeout_secs). It printed: {simulator.log.strip()}"
            )
        time.sleep(0.005)


def _mount(
    simulator: Simulator,
    sensors: Sequence[Sensor],
    ego: str,
    autopilot: bool,
    view_mib: float,
    when_full: Literal["copy", "error"],
) -> None:
    client = simulator.client
    places = client.map.spawn_points
    for place in places:
        try:
            simulator.ego = client.spawn(ego, place, autopilot=autopilot, role="hero")
            break
        except RefusedError as error:
            if error.code != "SpawnCollision":
                raise
    if simulator.ego is None:
        raise OmnibusError(f"none of the {len(places)} spawn points of the map has room for {ego}")
    rendered = [sensor for sensor in sensors if isinstance(sensor, Camera | Lidar | Radar)]
    physics = [sensor for sensor in sensors if not isinstance(sensor, Camera | Lidar | Radar)]
    for bundle, members in (("rendered", rendered), ("physics", physics)):
        if members:
            made = client.create_bundle(
                bundle, members, simulator.ego, view_mib=view_mib, when_full=when_full
            )
            simulator.bundles.append(made)
