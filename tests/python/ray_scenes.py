"""A collection on a local Ray cluster of two workers, one of which is killed: the bytes are those of one
process that collects scene after scene."""

import os
import pathlib
import signal
import subprocess
import threading
import time
import warnings

# Ray's own.
warnings.simplefilter("ignore")

import omnibus  # noqa: E402
import omnibus.ray  # noqa: E402
import ray  # noqa: E402
from omnibus.simulator import find_program  # noqa: E402

PLAN = f"""
maps = ["{os.environ["OMNIBUS_TEST_MAP"]}"]
scenes = 4
frames = 30
warmup = 5
[traffic]
vehicles = 4
walkers = 3
radius_m = 60.0
[[sensor]]
name = "front"
kind = "camera"
position_m = [1.5, 0.0, 1.6]
width_px = 160
height_px = 120
outputs = ["color", "depth", "instance"]
"""


def files(folder: pathlib.Path) -> dict[str, bytes]:
    found = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def kill_one(pids: list[int]) -> None:
    """Kills the first worker as soon as one of its frames is complete."""

    def is_begun() -> bool:
        lists = pathlib.Path("cluster").glob("scene-*/frames.jsonl")
        return any(path.stat().st_size > 0 for path in lists)

    def wait() -> None:
        while not is_begun():
            time.sleep(0.005)
        os.kill(pids[0], signal.SIGKILL)
        killed.append(pids[0])

    threading.Thread(target=wait).start()


killed: list[int] = []
pathlib.Path("plan.toml").write_text(PLAN)
alone = subprocess.run(
    [find_program(), "collect", "plan.toml", "--out", "alone", "--device", "cpu"], check=False
)
assert alone.returncode == 0

ray.init(num_cpus=2, include_dashboard=False, logging_level="ERROR", log_to_driver=False)
lines: list[str] = []
options = ["--device", "cpu", "--threads", "1"]
results = omnibus.ray.collect(
    "plan.toml",
    "cluster",
    workers=2,
    options=options,
    on_progress=lines.append,
    on_workers=kill_one,
)
assert killed, "no worker was killed"
assert [result["scene"] for result in results] == [0, 1, 2, 3]
assert all(result["frames"] == 30 for result in results), results
pids = {result["worker_pid"] for result in results}
assert killed[0] not in pids or len(pids) > 1, "the killed worker was replaced"
assert "4/4 scenes, 120/120 frames" in lines[-1], lines[-1]
one, other = files(pathlib.Path("alone")), files(pathlib.Path("cluster"))
assert one.keys() == other.keys(), one.keys() ^ other.keys()
for name, content in one.items():
    assert content == other[name], name

# Everything is there: nothing is collected again.
again = omnibus.ray.collect(
    "plan.toml", "cluster", workers=2, options=options, on_progress=lines.append
)
assert [result["frames"] for result in again] == [30] * 4

# A scene that cannot be collected is named with its cause.
try:
    omnibus.ray.collect("plan.toml", "none", options=["--device", "tpu"], on_progress=lines.append)
except omnibus.OmnibusError as error:
    assert "scene " in str(error) and "--device" in str(error), error
else:
    raise AssertionError("an unknown device was accepted")
try:
    omnibus.ray.collect(
        "plan.toml", "cluster", plan_options=["--frames", "31"], on_progress=lines.append
    )
except omnibus.OmnibusError as error:
    assert "has frames 30, this command has 31" in str(error), error
else:
    raise AssertionError("another plan was accepted")
ray.shutdown()
print("two workers, one killed: the bytes of one process")
