"""Reads OpenDRIVE files with ASAM's checker, CARLA's own client and SUMO's netconvert.

A JSON line for each file:

    python judge_maps.py FILE...

contains the result of each reader: `asam` has the issues of level error, `waypoints` the number of
waypoints of `carla.Map` at every 5 m, `topology` the number of its road links, `netconvert` the
lines that are errors.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

import carla

BIN = pathlib.Path(sys.executable).parent
CONFIG = """<?xml version="1.0" encoding="UTF-8"?>
<Config>
  <Param name="InputFile" value="{map}"/>
  <CheckerBundle application="xodrBundle">
    <Param name="resultFile" value="{result}"/>
  </CheckerBundle>
</Config>
"""


def asam(path, folder):
    """Returns the issues of the ASAM checker; those of level 1 are errors."""
    config, result = folder / "config.xml", folder / "result.xqar"
    config.write_text(CONFIG.format(map=path, result=result))
    ended = subprocess.run(
        [BIN / "qc_opendrive", "-c", config], capture_output=True, text=True, cwd=folder
    )
    if ended.returncode or not result.exists():
        return [f"it ended with {ended.returncode}: {ended.stderr[-300:]}"]
    found = []
    for issue in re.findall(r"<Issue [^>]*>.*?</Issue>|<Issue [^>]*/>", result.read_text(), re.S):
        head = issue.split(">")[0]
        if 'level="1"' in head:
            where = re.search(r'<Locations description="([^"]*)"', issue)
            rule = re.search(r'ruleUID="([^"]*)"', head)
            found.append(f"{rule and rule.group(1)}: {where and where.group(1)}")
    # After an error the checker skips rules; without errors it must have applied all.
    if not found and "lane.link" not in ended.stdout + ended.stderr:
        found.append("it did not get as far as the lanes")
    return found


def netconvert(path, folder):
    """Returns the errors of netconvert."""
    ended = subprocess.run(
        [BIN / "netconvert", "--opendrive-files", path, "-o", folder / "net.xml"],
        capture_output=True,
        text=True,
    )
    errors = [line for line in ended.stderr.splitlines() if line.startswith("Error")]
    if ended.returncode and not errors:
        errors.append(f"it ended with {ended.returncode}")
    return errors


def judge(path):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        # `carla.Map` does not report a map that it cannot read; it raises or is empty.
        try:
            there = carla.Map(path.stem, path.read_text())
            waypoints, topology = there.generate_waypoints(5.0), there.get_topology()
        except RuntimeError as e:
            waypoints, topology = [], str(e)
        return {
            "map": path.stem,
            "asam": asam(path, folder),
            "netconvert": netconvert(path, folder),
            "waypoints": len(waypoints),
            "topology": len(topology),
        }


for file in sys.argv[1:]:
    print(json.dumps(judge(pathlib.Path(file).resolve())), flush=True)
