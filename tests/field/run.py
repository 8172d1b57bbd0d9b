"""Runs third-party programs against a simulator, and prints a table of what was observed.

Usage: run.py OMNIBUS FOLDER OUT [--quick] [--only NAME[,NAME...]] [--table FILE]. FOLDER holds the programs,
each under its repository's name; a program that is not there is listed as such. OMNIBUS_MAPS names the folder
of CARLA's maps. With --table, the rows of the programs that ran replace those in FILE.
"""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))

# Name, the folder that its driver is given, and the driver.
PROGRAMS = [
    ("agents", "carla/PythonAPI/carla", "agents_case.py"),
    ("scenario_runner", "scenario_runner", "scenarios_case.py"),
    ("leaderboard", "leaderboard", "leaderboard_case.py"),
    ("Co-Simulation/Sumo", "carla/Co-Simulation/Sumo", "sumo_case.py"),
    ("carla-birdeye-view", "carla-birdeye-view", "birdeye_case.py"),
    ("gym-carla", "gym-carla", "gym_case.py"),
    ("carla-roach", "carla-roach", "chauffeurnet_case.py"),
]
HEAD = "| program | case | passes | observed |\n|---|---|---|---|\n"


class Simulator:
    """A running simulator, ended with the block."""

    def __init__(self, program, name, log):
        self.log = open(log, "w", encoding="utf-8")
        self.process = subprocess.Popen(
            [program, "run", "--map", "Town01", "--carla-port", "0", "--name", name],
            stdout=self.log, stderr=subprocess.STDOUT)
        self.port = self.wait_for_port(log)

    def wait_for_port(self, log):
        for _ in range(600):
            found = re.search(r"connect to \S+:(\d+)", open(log, encoding="utf-8").read())
            if found:
                return int(found.group(1))
            if self.process.poll() is not None:
                break
            time.sleep(0.1)
        sys.exit(f"the simulator did not start: {open(log, encoding='utf-8').read()}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        ended = self.process.poll()
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
        if ended is not None:
            print(f"the simulator ended before the program: exit {ended}, log {self.log.name}")


def run(program, folder, out, options):
    """Runs one program; returns its results."""
    name, place, driver = program
    own = os.path.join(out, name.replace("/", "-"))
    os.makedirs(own, exist_ok=True)
    place = os.path.join(folder, place)
    if not os.path.isdir(place):
        return [{"case": "–", "ok": None, "observed": f"not there: {os.path.relpath(place, folder)}"}]
    paths = [os.path.join(folder, p) for p in ("carla/PythonAPI/carla", "scenario_runner", "leaderboard")]
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(paths), FIELD_TOWNS=" ".join(towns()))
    results = []
    log = os.path.join(own, "driver.log")
    with Simulator(options.omnibus, "field-" + driver[:8].replace("_", "-"), os.path.join(own, "simulator.log")) as sim, \
            open(log, "w", encoding="utf-8") as errors:
        command = [sys.executable, os.path.join(HERE, driver), str(sim.port), place, own,
                   "quick" if options.quick else "full"]
        child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True, env=environment)
        for line in child.stdout:
            try:
                result = json.loads(line)
                result["observed"], result["case"], result["ok"]
            except (ValueError, TypeError, KeyError):
                errors.write(line)
                continue
            results.append(result)
            print(row(name, result), flush=True)
        code = child.wait()
    if not results and not code:
        results.append({"case": "–", "ok": None, "observed": "no town of CARLA in OMNIBUS_MAPS"})
    if code:
        lines = open(log, encoding="utf-8").read().strip().splitlines()
        last = lines[-1][:200] if lines else ""
        results.append({"case": "driver", "ok": False, "observed": f"exit {code}: {last}"})
        print(row(name, results[-1]), flush=True)
    return results


def towns():
    """The towns of CARLA in OMNIBUS_MAPS."""
    folder = os.environ.get("OMNIBUS_MAPS")
    names = os.listdir(folder) if folder and os.path.isdir(folder) else []
    found = (re.search(r"(?:^|__)(Town\w+)\.xodr$", name) for name in sorted(names))
    return [match.group(1) for match in found if match]


def row(program, result):
    passes = {True: "yes", False: "**no**", None: "–"}[result["ok"]]
    cells = [program, result["case"], passes, result["observed"]]
    return "| " + " | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def update(path, results):
    """Replaces the rows of these programs in the table of a page; the others stay."""
    text = open(path, encoding="utf-8").read()
    above, below = text.split(HEAD)
    kept = {}
    for line in below.strip().splitlines():
        kept.setdefault(line.split("|")[1].strip(), []).append(line)
    for name, found in results.items():
        if any(r["ok"] is not None for r in found) or name not in kept:
            kept[name] = [row(name, r) for r in found]
    lines = [line for name, _, _ in PROGRAMS for line in kept.get(name, [])]
    with open(path, "w", encoding="utf-8") as page:
        page.write(above + HEAD + "\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("omnibus")
    parser.add_argument("folder")
    parser.add_argument("out")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--table")
    options = parser.parse_args()
    folder, out = os.path.abspath(options.folder), os.path.abspath(options.out)
    wanted = [name for name in options.only.split(",") if name]
    unknown = set(wanted) - {name for name, _, _ in PROGRAMS}
    if unknown:
        parser.error(f"unknown program {', '.join(sorted(unknown))}; "
                     f"there are {', '.join(name for name, _, _ in PROGRAMS)}")
    results = {}
    print(HEAD, end="")
    for program in PROGRAMS:
        if not wanted or program[0] in wanted:
            results[program[0]] = run(program, folder, out, options)
            if results[program[0]][0]["case"] == "–":
                print(row(program[0], results[program[0]][0]))
    if options.table:
        update(options.table, results)
    flat = [r["ok"] for found in results.values() for r in found]
    print(f"field: {flat.count(True)} passed, {flat.count(False)} failed, {flat.count(None)} not run")


main()
