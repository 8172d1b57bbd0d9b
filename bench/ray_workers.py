"""One against two workers of omnibus.ray.collect on a local cluster, each on a core of its own.

usage: ray_workers.py PROGRAM [--scenes N] [--frames N] [--rounds N]

Each worker runs its simulators on one core (Linux, taskset), so that two workers have twice the cores of one.
Rounds alternate. Prints the medians of scenes per minute, their ratio, and the seconds from the start of a
worker to the first frame that is complete.
"""

import argparse
import pathlib
import statistics
import stat
import subprocess
import tempfile
import threading
import time

import omnibus.ray
import ray

PLAN = """
scenes = {scenes}
frames = {frames}
warmup = 5
[traffic]
vehicles = 10
vehicles_near = 5
walkers = 5
[[sensor]]
name = "front"
kind = "camera"
position_m = [1.5, 0.0, 1.6]
width_px = 400
height_px = 300
outputs = ["color", "depth", "instance"]
"""

# The first core that no other worker has; the lock is held for the life of the program.
ON_A_CORE = """#!/bin/sh
exec 8>{folder}/core0 9>{folder}/core1
case "$*" in *--prepare*) exec {program} "$@" ;; esac
flock -n 8 && exec taskset -c 0 {program} "$@"
flock 9 && exec taskset -c 1 {program} "$@"
"""


def collect(folder: pathlib.Path, program: str, workers: int, scenes: int, frames: int) -> tuple[float, float]:
    """Collects all scenes and returns the seconds, and those to the first complete frame."""
    plan = folder / "plan.toml"
    plan.write_text(PLAN.format(scenes=scenes, frames=frames))
    wrapper = folder / "omnibus"
    wrapper.write_text(ON_A_CORE.format(folder=folder, program=program))
    wrapper.chmod(wrapper.stat().st_mode | stat.S_IXUSR)
    out, first = folder / "out", []
    begin = time.monotonic()

    def watch() -> None:
        while not first:
            if any(path.stat().st_size for path in out.glob("scene-*/frames.jsonl")):
                first.append(time.monotonic() - begin)
            time.sleep(0.005)

    threading.Thread(target=watch, daemon=True).start()
    omnibus.ray.collect(
        plan, out, workers=workers, program=wrapper, on_progress=lambda line: None,
        options=["--threads", "1", "--writers", "1", "--device", "cpu"],
    )  # fmt: skip
    return time.monotonic() - begin, first[0]


def main() -> None:
    """Measures, and prints a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", help="the omnibus program")
    parser.add_argument("--scenes", type=int, default=6)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=3)
    args = parser.parse_args()
    program = str(pathlib.Path(args.program).resolve())
    subprocess.run([program, "--version"], check=True, stdout=subprocess.DEVNULL)
    ray.init(num_cpus=2, include_dashboard=False, logging_level="error")
    seconds: dict[int, list[float]] = {1: [], 2: []}
    first: list[float] = []
    for _ in range(args.rounds):
        for workers in (1, 2):
            with tempfile.TemporaryDirectory(prefix="omnibus-ray-") as folder:
                all_s, first_s = collect(pathlib.Path(folder), program, workers, args.scenes, args.frames)
            seconds[workers].append(all_s)
            first.append(first_s)
    one, two = (statistics.median(seconds[workers]) for workers in (1, 2))
    print(f"{args.scenes} scenes of {args.frames} frames, {args.rounds} rounds, medians")
    for workers, value in ((1, one), (2, two)):
        print(f"{workers} workers: {value:.1f} s, {60 * args.scenes / value:.1f} scenes a minute")
    print(f"ratio {one / two:.2f}; from the call to the first complete frame {statistics.median(first):.1f} s")


if __name__ == "__main__":
    main()
