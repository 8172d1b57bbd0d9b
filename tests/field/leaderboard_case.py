"""The CARLA leaderboard 2: its evaluator with its own agents, on routes through the towns that are there.

Its own routes lie in Town12 and Town13. Each of ours leads over 300 to 700 m between two spawn points, with
three scenarios of its own kinds beside the route, and its own background traffic.

Its NpcAgent looks up the lane of each point of the route by position. Where lanes overlap in a junction it
may find another lane, and then plans a detour of hundreds of metres; this happens in the package alone, without
a server. Routes on which it happens are not chosen.
"""

import json
import os
import random
import subprocess
import sys
import xml.etree.ElementTree as xml

import kit
from kit import carla

LIMIT_S = 900
SCENARIOS = [("ControlLoss", {}), ("DynamicObjectCrossing", {"distance": "30"}), ("HardBreakRoute", {})]


def length_of(points):
    return sum(a.distance(b) for a, b in zip(points, points[1:]))


def is_planned_without_detour(town_map, planner, way):
    """Whether the plan that NpcAgent makes of a route is about as long as the route."""
    points = []
    lanes = [town_map.get_waypoint(waypoint.transform.location) for waypoint in way]
    for a, b in zip(lanes, lanes[1:]):
        part = planner.trace_route(a.transform.location, b.transform.location)
        points += [waypoint.transform.location for waypoint, _ in part]
    return length_of(points) < 1.2 * length_of([w.transform.location for w in way]) + 20.0


def write_route(world, town, number, path):
    """Writes a routes file with one route; returns the length of the route in metres."""
    from agents.navigation.global_route_planner import GlobalRoutePlanner
    town_map = world.get_map()
    planner, fine = GlobalRoutePlanner(town_map, 2.0), GlobalRoutePlanner(town_map, 1.0)
    points = town_map.get_spawn_points()
    rng = random.Random(f"{town} {number}")
    for _ in range(500):
        start, end = rng.sample(points, 2)
        way = [waypoint for waypoint, _ in fine.trace_route(start.location, end.location)]
        if 300 <= len(way) <= 700 and is_planned_without_detour(town_map, planner, way):
            break
    else:
        raise RuntimeError(f"{town}: no route without a detour")
    routes = xml.Element("routes")
    route = xml.SubElement(routes, "route", id=str(number), town=town)
    weathers = xml.SubElement(route, "weathers")
    for percentage, altitude in (("0", "60.0"), ("100", "15.0")):
        xml.SubElement(weathers, "weather", route_percentage=percentage, cloudiness="5.0",
                       precipitation="0.0", precipitation_deposits="0.0", wetness="0.0",
                       wind_intensity="10.0", sun_azimuth_angle="-1.0", sun_altitude_angle=altitude,
                       fog_density="2.0")
    waypoints = xml.SubElement(route, "waypoints")

    def place(parent, tag, waypoint, **more):
        at = waypoint.transform.location
        return xml.SubElement(parent, tag, x=f"{at.x:.1f}", y=f"{at.y:.1f}", z=f"{at.z:.1f}", **more)

    for waypoint in [*way[::50], way[-1]]:
        place(waypoints, "position", waypoint)
    scenarios = xml.SubElement(route, "scenarios")
    straight = [i for i in range(40, len(way) - 80)
                if not any(w.is_junction for w in way[i:i + 60])]
    for share, (kind, values) in enumerate(SCENARIOS):
        if not straight:
            break
        waypoint = way[straight[(2 * share + 1) * len(straight) // (2 * len(SCENARIOS))]]
        scenario = xml.SubElement(scenarios, "scenario", name=f"{kind}_1", type=kind)
        place(scenario, "trigger_point", waypoint, yaw=f"{waypoint.transform.rotation.yaw:.1f}")
        for tag, value in values.items():
            xml.SubElement(scenario, tag, value=value)
    xml.ElementTree(routes).write(path)
    return len(way)


def main():
    port, folder, out, quick = kit.arguments()
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    there = [t for t in ("Town01", "Town03", "Town04", "Town10HD") if t in kit.towns()]
    cases = [(town, "npc_agent", number) for town in there for number in range(1 if quick else 2)]
    # The dummy agent does not move; it is there for its sensors, and blocked in the end.
    cases += [(town, "dummy_agent", 0) for town in there[:1]]
    for town, agent, number in cases[:2] if quick else cases:
        routes = os.path.join(out, f"route-{town}-{number}.xml")
        results = os.path.join(out, f"leaderboard-{town}-{number}-{agent}.json")
        try:
            length = write_route(client.load_world(town), town, number, routes)
        except Exception as error:
            kit.report(f"{town}, route {number}", False, f"no route: {type(error).__name__}: {error}")
            continue
        command = [sys.executable, os.path.join(folder, "leaderboard/leaderboard_evaluator.py"),
                   "--host", "127.0.0.1", "--port", str(port), "--timeout", "120", "--routes", routes,
                   "--agent", os.path.join(folder, f"leaderboard/autoagents/{agent}.py"),
                   "--track", "MAP" if agent == "dummy_agent" else "SENSORS",
                   "--checkpoint", results, "--debug-checkpoint", results + ".txt"]
        label = f"{town}, route {number} ({length} m), {agent}"
        beside = os.path.join(os.path.dirname(folder), "scenario_runner")
        environment = dict(os.environ, LEADERBOARD_ROOT=folder, SCENARIO_RUNNER_ROOT=beside)
        try:
            done = subprocess.run(command, cwd=out, env=environment, capture_output=True, text=True,
                                  timeout=LIMIT_S, check=False)
        except subprocess.TimeoutExpired:
            kit.report(label, False, f"no end after {LIMIT_S} s")
            continue
        with open(results + ".log", "w", encoding="utf-8") as log:
            log.write(done.stdout + done.stderr)
        try:
            record = json.load(open(results, encoding="utf-8"))["_checkpoint"]["records"][0]
        except (OSError, KeyError, IndexError):
            lines = [line for line in done.stderr.splitlines() if "Error" in line]
            kit.report(label, False, f"no record: {lines[-1] if lines else f'exit {done.returncode}'}")
            continue
        faults = {name: len(found) for name, found in record["infractions"].items()
                  if found and name != "min_speed_infractions"}
        scores = record["scores"]
        if agent == "dummy_agent":
            good = faults == {"vehicle_blocked": 1}
        else:
            good = scores["score_route"] > 99.0 and not faults
        kit.report(label, good,
                   f"{record['status']}; route {scores['score_route']:.0f} %, penalty "
                   f"{scores['score_penalty']:.2f}; " + (", ".join(f"{n} {c}" for n, c in faults.items())
                                                       or "no infractions"))


main()
kit.end()
