"""scenario_runner's own scenarios: its XML examples, OpenSCENARIO 1 and 2, each in a process of its own.

A scenario passes when all its required criteria do. `timeout` is scenario_runner's word for a scenario that
did not reach its end in the time it allows itself.
"""

import glob
import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as xml

import kit
from kit import carla

HERE = os.path.dirname(os.path.abspath(__file__))
LIMIT_S = 400
# FreeRide runs until it is interrupted, ChangingWeather until 10 000 000 s, LaneOffsetActionExample over 10 km.
ENDLESS = ("FreeRide", "ChangingWeather.xosc", "LaneOffsetActionExample.xosc")


def town_of(path):
    """The town that an OpenSCENARIO file names."""
    text = open(path, encoding="utf-8").read()
    found = re.search(r'LogicFile\s+filepath="([^"]+)"', text) or \
        re.search(r'set_map(?:_file)?\("([^"]+)"\)', text)
    return os.path.basename(found.group(1)).removesuffix(".xodr") if found else None


def cases(folder, quick):
    """Name, group and town of every scenario."""
    found = []
    for path in sorted(glob.glob(f"{folder}/srunner/examples/*.xml")):
        of_kind = {}
        for scenario in xml.parse(path).getroot().iter("scenario"):
            of_kind.setdefault(scenario.get("type"), []).append(
                (scenario.get("name"), os.path.basename(path), scenario.get("town")))
        for kind, group in of_kind.items():
            if kind not in ENDLESS:
                found += group[:1] if quick else group
    for ending in ("xosc", "osc"):
        for path in sorted(glob.glob(f"{folder}/srunner/examples/*.{ending}")):
            if os.path.basename(path) not in ENDLESS:
                found.append((os.path.relpath(path, folder), os.path.basename(path), town_of(path)))
    return found


def run(port, folder, out, name):
    """Runs one scenario; returns whether it passed, and what it reported."""
    command = [sys.executable, os.path.join(HERE, "scenario_case.py"), str(port), folder, out, name]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    except subprocess.TimeoutExpired:
        return False, f"no end after {LIMIT_S} s"
    text = done.stdout + done.stderr
    result = re.search(r"Results of Scenario: .* ---- (\w+)", text)
    if result is None:
        lines = [line.strip() for line in text.splitlines() if re.match(r"\s*(\w+Error|\w+Exception|\w*Error:)", line)
                 or "Traceback" not in line and "rror" in line]
        return False, "did not run: " + (lines[-1] if lines else f"exit {done.returncode}")[:200]
    failed = [f"{m.group(1).strip()} {m.group(2).strip()}" for m in re.finditer(
        r"│ [^│]*│ ([^│(]+)(?:\(Req\.\))? *│ (?:FAILURE) *│ ([^│]*)│", text)]
    outcome = result.group(1).lower()
    return outcome == "success", outcome + (f": {', '.join(failed)}" if failed else "")


def main():
    port, folder, out, quick = kit.arguments()
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    there = kit.towns()
    del client
    absent = {}
    for name, group, town in cases(folder, quick):
        if town not in there:
            absent.setdefault(town, []).append(os.path.basename(name))
            continue
        ok, observed = run(port, folder, out, name)
        label = group if name.endswith(group) else f"{group}: {name}"
        kit.report(f"{label} ({town})", ok, observed)
    for town, names in sorted(absent.items(), key=str):
        kit.report(f"not run, because {town} is not there", None, f"{len(names)} scenarios")


main()
kit.end()
