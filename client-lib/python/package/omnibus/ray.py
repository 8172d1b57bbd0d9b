"""Collections on a Ray cluster: each scene of a plan is a task of an actor with one simulator.

Measurements never pass through Ray: the simulators write data sets into one folder, which every node
and the caller see under the same path. ``pip install omnibus-sim[ray]``.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from .errors import OmnibusError
from .simulator import find_program

#: How long a worker waits for the end of the process of a worker that died in the same scene.
_FOLDER_SECS = 60.0
_PROGRESS_SECS = 1.0


class _Worker:
    """Collects scenes, one at a time, with a simulator in a process of its own."""

    def __init__(self, program: str | None, options: list[str]) -> None:
        self._program = program
        self._options = options

    def pid(self) -> int:
        return os.getpid()

    def collect(self, plan: str, scene: int, folder: str) -> dict[str, Any]:
        """Collects a scene, or continues it, and returns the last line of ``--json``."""
        program = self._program or str(find_program())
        command = [program, "collect", plan, "--scene", str(scene), "--out", folder, "--resume"]
        command += ["--json", "--parent", str(os.getpid()), *_device(), *self._options]
        end = time.monotonic() + _FOLDER_SECS
        while True:
            ended = subprocess.run(
                command, stdin=subprocess.DEVNULL, capture_output=True, text=True
            )
            if ended.returncode == 0:
                result: dict[str, Any] = json.loads(ended.stdout.splitlines()[-1])
                return {**result, "scene": scene, "worker_pid": os.getpid()}
            said = ended.stderr.strip().splitlines()
            why = said[-1].removeprefix("omnibus: ") if said else f"exit code {ended.returncode}"
            # The process of a worker that was killed takes a moment to end.
            if "is being written by another" not in why or time.monotonic() > end:
                raise OmnibusError(f"scene {scene}: {why}")
            time.sleep(0.2)


def _device() -> list[str]:
    """The GPU that Ray has assigned to this worker; Vulkan does not read CUDA_VISIBLE_DEVICES."""
    ray: Any = importlib.import_module("ray")
    gpus = ray.get_gpu_ids()
    return ["--device", f"gpu:{int(gpus[0])}"] if gpus else []


def collect(
    plan: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    workers: int | None = None,
    cpus: float = 1.0,
    gpus: float = 0.0,
    options: Sequence[str] = (),
    plan_options: Sequence[str] = (),
    program: str | os.PathLike[str] | None = None,
    attempts: int = 3,
    on_progress: Callable[[str], None] | None = None,
    on_workers: Callable[[list[int]], None] | None = None,
) -> list[dict[str, Any]]:
    """Collects every scene of ``plan`` into ``out`` and returns the result of each, by scene.

    ``workers`` actors run at a time, by default as many as the cluster has room for; each takes ``cpus``
    and ``gpus``. ``plan_options`` replace values of the plan (``["--frames", "100"]``), ``options`` are of
    the simulators (``["--pipeline", "2"]``). A worker that dies is started again, and its scene continues
    where it ended, ``attempts`` times at most. Scenes that are complete are not collected again.
    ``on_progress`` receives a line a second, by default on standard error; ``on_workers`` the process ids
    of the actors.

    Raises ``OmnibusError`` with the scene and the cause; the same call continues there.
    """
    ray: Any = importlib.import_module("ray")
    if not ray.is_initialized():
        ray.init(include_dashboard=False)
    path = os.fspath(program) if program is not None else None
    known = _prepare(path or str(find_program()), plan, out, plan_options)
    folders: list[str] = known["folders"]
    waiting = [scene for scene in range(known["scenes"]) if not _is_complete(folders[scene])]
    results = {
        scene: _result(folders[scene], scene)
        for scene in range(known["scenes"])
        if scene not in waiting
    }
    count = min(workers or _room(ray, cpus, gpus), max(len(waiting), 1))
    remote = ray.remote(max_restarts=-1, max_task_retries=attempts, num_cpus=cpus, num_gpus=gpus)(
        _Worker
    )
    actors = [remote.remote(path, list(options)) for _ in range(count)]
    running: dict[Any, Any] = {}
    report = on_progress or _print
    began, before = time.monotonic(), _frames(folders)
    try:
        if on_workers is not None:
            on_workers(ray.get([actor.pid.remote() for actor in actors]))
        idle = list(actors)
        while waiting or running:
            while waiting and idle:
                scene, actor = waiting.pop(0), idle.pop()
                task = actor.collect.remote(
                    os.path.abspath(known["plan"]), scene, os.path.abspath(folders[scene])
                )
                running[task] = actor
            done, _ = ray.wait(list(running), timeout=_PROGRESS_SECS)
            for task in done:
                idle.append(running.pop(task))
                try:
                    result = ray.get(task)
                except ray.exceptions.RayTaskError as error:
                    raise OmnibusError(str(error.cause)) from error
                except ray.exceptions.RayActorError as error:
                    raise OmnibusError(f"a worker died {attempts + 1} times: {error}") from error
                results[result["scene"]] = result
            frames = _frames(folders)
            rate = (frames - before) / max(time.monotonic() - began, 1e-3)
            total = known["scenes"] * known["frames"]
            report(
                f"{len(results)}/{known['scenes']} scenes, {frames}/{total} frames, {rate:.1f} frames/s, "
                f"{(total - frames) / max(rate, 1e-3):.0f} s left, {len(running)} workers"
            )
    finally:
        for actor in actors:
            ray.kill(actor)
    return [results[scene] for scene in sorted(results)]


def _prepare(
    program: str,
    plan: str | os.PathLike[str],
    out: str | os.PathLike[str],
    plan_options: Sequence[str],
) -> dict[str, Any]:
    command = [
        program,
        "collect",
        os.fspath(plan),
        "--out",
        os.path.abspath(out),
        "--prepare",
        *plan_options,
    ]
    ended = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if ended.returncode != 0:
        raise OmnibusError(ended.stderr.strip().removeprefix("omnibus: "))
    known: dict[str, Any] = json.loads(ended.stdout)
    return known


def _room(ray: Any, cpus: float, gpus: float) -> int:
    resources = ray.cluster_resources()
    room = [resources.get("CPU", 0.0) / cpus] if cpus > 0 else []
    room += [resources.get("GPU", 0.0) / gpus] if gpus > 0 else []
    return max(int(min(room, default=1.0)), 1)


def _metadata(folder: str) -> dict[str, Any] | None:
    try:
        metadata: dict[str, Any] = json.loads((Path(folder) / "metadata.json").read_text())
    except FileNotFoundError:
        return None
    return metadata


def _is_complete(folder: str) -> bool:
    metadata = _metadata(folder)
    return metadata is not None and metadata["complete"]


def _result(folder: str, scene: int) -> dict[str, Any]:
    metadata = _metadata(folder) or {}
    return {
        "event": "complete",
        "dir": folder,
        "scene": scene,
        "frames": metadata["frames_complete"],
    }


def _frames(folders: list[str]) -> int:
    """The number of complete frames of all scenes."""

    def lines(folder: str) -> int:
        try:
            return (Path(folder) / "frames.jsonl").read_bytes().count(b"\n")
        except FileNotFoundError:
            return 0

    return sum(lines(folder) for folder in folders)


def _print(line: str) -> None:
    print(line, file=sys.stderr)
