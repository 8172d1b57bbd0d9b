#!/usr/bin/env python3
"""Compares `omnibus map` with CARLA's own client, point by point.

    tests/carla/compare_map.py [--omnibus PATH] [--venv DIR] MAP.xodr ...

The `carla` wheel parses OpenDRIVE without a server. If it is not installed, this program
installs version 0.9.16 into a virtual environment (--venv) and continues there.

Each difference belongs to a class; docs/map-parity.md describes the classes and their origins.
Differences without a class are "unexplained": more than 0.1 % of them on a map fails the run.
"""
import argparse
import collections
import json
import math
import os
import random
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
VERSION = "0.9.16"

POSITION_M = 0.01
ANGLE_DEG = 0.1
# Roads of a junction that are farther apart in height cross on a bridge.
OVERLAP_M = 0.6
STEP_M = 2.0
UNEXPLAINED_MAX = 0.001

# Class: (origin, description). The order is that of the report.
CLASSES = {
    "joint": ("neither", "a place at a joint has the name of the other of two lanes there"),
    "pitch": ("CARLA", "slope of the reference line, not of the lane beside it"),
    "yaw": ("CARLA", "heading of the reference line, not of the lane beside it"),
    "change": ("CARLA", "laneChange increase and decrease are interpreted as right and left"),
    "bank": ("CARLA", "superelevation and crossfall are ignored"),
    "height": ("CARLA", "the road's own height where roads of a junction contradict each other"),
    "moved": ("CARLA", "signal moved off the road, by fifths of a lane's width"),
    "tilted": ("CARLA", "crosswalk tilted with the slope, although the file gives heights"),
    "offset": ("CARLA", "crosswalk measured from the lane offset, not the reference line"),
    "coarse": ("CARLA", "the foot of a point on a lane is computed on a chord"),
    "far": ("CARLA", "a farther lane is returned as the nearest"),
    "unexplained": ("?", "none of these"),
}


def carla_module(venv):
    """Imports the package, from here or from the virtual environment."""
    try:
        import carla
        return carla
    except ImportError:
        pass
    python = os.path.join(venv, "bin", "python")
    if sys.executable == python or os.environ.get("COMPARE_MAP_IN_VENV"):
        sys.exit(f"{venv} has no carla {VERSION}; remove the folder to install it again")
    if not os.path.exists(python):
        subprocess.run([sys.executable, "-m", "venv", venv], check=True)
        subprocess.run([python, "-m", "pip", "install", "-q", f"carla=={VERSION}"], check=True)
    os.environ["COMPARE_MAP_IN_VENV"] = "1"
    os.execv(python, [python, os.path.abspath(__file__), *sys.argv[1:]])


def turn_deg(a, b):
    """Returns the angle between two directions."""
    return abs((a - b + 180.0) % 360.0 - 180.0)


class Ours:
    """Runs `omnibus map` on one file."""

    def __init__(self, program, path):
        self.program, self.path = program, path

    def lines(self, verb, *arguments, text=None):
        ended = subprocess.run(
            [self.program, "map", verb, self.path, *arguments],
            input=text, capture_output=True, text=True, check=False,
        )
        if ended.returncode != 0:
            sys.exit(f"omnibus map {verb} {self.path}: {ended.stderr.strip()}")
        return [json.loads(line) for line in ended.stdout.splitlines()]


class Tally:
    """The number of compared points, and of differences by class."""

    def __init__(self):
        self.points = 0
        self.differing = 0
        self.classes = collections.Counter()
        self.examples = []
        self.worst_m = 0.0
        self.worst_deg = 0.0

    def point(self, found, what):
        """Adds a point with its differences, as (class, description)."""
        self.points += 1
        if not found:
            return
        self.differing += 1
        for name in {name for name, _ in found}:
            self.classes[name] += 1
        for name, words in found:
            if name == "unexplained" and len(self.examples) < 8:
                self.examples.append(f"{what}: {words}")

    def unexplained(self):
        return self.classes["unexplained"]


def key(road, section, lane, s):
    return int(road), section, lane, round(s, 4)


def place_of(waypoint):
    """Returns a position in our axes."""
    at = waypoint.transform.location
    return at.x, -at.y, at.z


def own_directions(world, waypoint):
    """Returns headings and pitches of the path of CARLA's positions in driving direction, in
    degrees, with their uncertainties: behind and ahead of the point, and over both."""
    def near(s):
        found = world.get_waypoint_xodr(waypoint.road_id, waypoint.lane_id, s) if s >= 0 else None
        return found if found and found.section_id == waypoint.section_id else None
    reach = 0.1
    here, before, after = waypoint, near(waypoint.s - reach), near(waypoint.s + reach)
    if waypoint.lane_id > 0:
        before, after = after, before
    directions = []
    for a, b in ((before, here), (here, after), (before, after)):
        if a is None or b is None:
            continue
        (x0, y0, z0), (x1, y1, z1) = place_of(a), place_of(b)
        level = math.hypot(x1 - x0, y1 - y0)
        if level > 0.02:
            # Positions are f32.
            blur = math.degrees(1e-4 / level)
            heading = math.degrees(math.atan2(y1 - y0, x1 - x0))
            directions.append((heading, math.degrees(math.atan2(z1 - z0, level)), blur))
    return directions


def same_places(world, theirs, ours):
    """Returns whether two lists of waypoints contain the same positions."""
    def points(found):
        places = []
        for item in found:
            if isinstance(item, dict):
                s = min(max(item["s_m"], 1e-6), 1e9)
                item = nearby(world, int(item["road"]), item["lane"], s)
            places.append(None if item is None else place_of(item))
        return places
    a, b = points(theirs), points(ours)
    if None in a or None in b:
        return False
    covers = lambda p, q: all(any(math.dist(x, y) <= POSITION_M for y in q) for x in p)
    return covers(a, b) and covers(b, a)


def nearby(world, road, lane, s):
    """Returns the waypoint at s or next to it."""
    for at in (s, s - 1e-4, s + 1e-4, s - 1e-3, s + 1e-3):
        if at >= 0.0:
            found = world.get_waypoint_xodr(road, lane, at)
            if found is not None:
                return found
    return None


def plain(word):
    return str(word).lower().replace(" ", "").replace("standard", "white")


KINDS = {"custom": "other", "edge": "other"}


def mark_words(mark):
    if mark is None:
        return None
    if isinstance(mark, dict):
        kind = plain(mark["type"])
        color = plain(mark["color"])
        kind = KINDS.get(kind, kind)
        # CARLA has no other colors.
        color = color if color in ("white", "blue", "green", "red", "yellow") else "other"
        width = mark["width_m"]
    else:
        kind, color, width = plain(mark.type), plain(mark.color), mark.width
    # A marking that is not painted has neither color nor width.
    return ("none",) if kind == "none" else (kind, color, round(width, 3))


def compare_waypoint(world, theirs, ours, tally, with_walk):
    """Compares a waypoint with CARLA's at the same road, section, lane and s."""
    found = []
    x, y, z = place_of(theirs)
    away = math.dist((x, y, z), (ours["x_m"], ours["y_m"], ours["z_m"]))
    if away > POSITION_M:
        # Our waypoints are on the surface, which has one height where roads of a junction overlap.
        is_height = (ours["junction"] is not None and abs(z - ours["z_m"]) < OVERLAP_M
                     and math.hypot(x - ours["x_m"], y - ours["y_m"]) <= POSITION_M)
        is_bank = abs(ours["roll_rad"]) > 1e-6
        name = "bank" if is_bank else "height" if is_height else "unexplained"
        found.append((name, f"{away:.4f} m apart"))
    else:
        tally.worst_m = max(tally.worst_m, away)

    rotation = theirs.transform.rotation
    yaw, pitch = math.degrees(ours["heading_rad"]), -math.degrees(ours["pitch_rad"])
    for name, their_deg, our_deg in (("yaw", -rotation.yaw, yaw), ("pitch", rotation.pitch, pitch)):
        off = turn_deg(their_deg, our_deg)
        if off > ANGLE_DEG:
            part = 0 if name == "yaw" else 1
            agrees = any(
                turn_deg(own[part], our_deg) < max(ANGLE_DEG, min(own[2], 0.5 * off))
                for own in own_directions(world, theirs))
            found.append((name if agrees else "unexplained",
                          f"{name} {their_deg % 360:.3f}, ours {our_deg % 360:.3f}"))
        else:
            tally.worst_deg = max(tally.worst_deg, off)

    if abs(theirs.lane_width - ours["width_m"]) > 0.001:
        found.append(("unexplained", f"width {theirs.lane_width}, ours {ours['width_m']}"))
    if plain(theirs.lane_type) != plain(ours["type"]):
        found.append(("unexplained", f"type {theirs.lane_type}, ours {ours['type']}"))
    junction = str(theirs.junction_id) if theirs.is_junction else None
    if junction != ours["junction"]:
        found.append(("unexplained", f"junction {junction}, ours {ours['junction']}"))
    for side, lane in (("left", theirs.get_left_lane()), ("right", theirs.get_right_lane())):
        lane = None if lane is None else lane.lane_id
        if lane != ours[side]:
            found.append(("unexplained", f"{side} lane {lane}, ours {ours[side]}"))
    if theirs.id != ours["id"] and with_walk:
        found.append(("unexplained", f"id {theirs.id}, ours {ours['id']}"))

    beside = None
    def at_joint(pick, ours_value):
        """Returns whether CARLA's answer a millimetre before or after is the same."""
        nonlocal beside
        if beside is None:
            near = [world.get_waypoint_xodr(theirs.road_id, theirs.lane_id, theirs.s + step)
                    for step in (-1e-3, 1e-3) if theirs.s + step >= 0.0]
            beside = [w for w in near if w is not None]
        return any(pick(w) == ours_value for w in beside)

    for side in ("left", "right"):
        pick = lambda w: mark_words(getattr(w, f"{side}_lane_marking"))
        mark = mark_words(ours[f"{side}_mark"])
        if pick(theirs) != mark:
            name = "joint" if at_joint(pick, mark) else "unexplained"
            found.append((name, f"{side} mark {pick(theirs)}, ours {mark}"))
    pick = lambda w: plain(w.lane_change)
    if pick(theirs) != ours["lane_change"]:
        sides = [ours["left_mark"], ours["right_mark"]]
        one_way = any(m and m["change"] in ("increase", "decrease") for m in sides)
        name = "change" if one_way else "unexplained"
        if at_joint(pick, ours["lane_change"]):
            name = "joint"
        found.append((name, f"change {theirs.lane_change}, ours {ours['lane_change']}"))

    if with_walk:
        for name, walk in (("next", theirs.next(STEP_M)), ("previous", theirs.previous(STEP_M))):
            a = sorted((w.road_id, w.section_id, w.lane_id, w.s) for w in walk)
            b = sorted((int(w["road"]), w["section"], w["lane"], w["s_m"]) for w in ours[name])
            same = len(a) == len(b) and all(
                p[:3] == q[:3] and abs(p[3] - q[3]) <= POSITION_M for p, q in zip(a, b))
            if not same:
                is_joint = same_places(world, walk, ours[name])
                found.append(("joint" if is_joint else "unexplained", f"{name} {a}, ours {b}"))
    return found


def compare_waypoints(world, ours):
    """Compares all properties of every waypoint of CARLA's generate_waypoints."""
    tally = Tally()
    listed = ours.lines("waypoints", "--every", str(STEP_M), "--step", str(STEP_M))
    ours_at = {key(w["road"], w["section"], w["lane"], w["s_m"]): w for w in listed}
    theirs = world.generate_waypoints(STEP_M)
    seen = set()
    for waypoint in theirs:
        name = key(waypoint.road_id, waypoint.section_id, waypoint.lane_id, waypoint.s)
        seen.add(name)
        own = ours_at.get(name)
        if own is None:
            tally.point([("unexplained", "not among ours")], name)
        else:
            tally.point(compare_waypoint(world, waypoint, own, tally, True), name)
    for name in ours_at.keys() - seen:
        tally.point([("unexplained", "not among theirs")], name)
    return tally


def compare_other_lanes(world, ours):
    """Compares points on all lanes that are not driving lanes."""
    tally = Tally()
    for own in ours.lines("waypoints", "--every", str(STEP_M), "--types", "any"):
        if own["type"] == "driving":
            continue
        name = key(own["road"], own["section"], own["lane"], own["s_m"])
        theirs = nearby(world, name[0], name[2], own["s_m"])
        if theirs is None or theirs.section_id != name[1]:
            continue  # CARLA has no query for the shorter of two sections that begin together.
        tally.point(compare_waypoint(world, theirs, own, tally, False), name)
    return tally


def compare_topology(world, ours):
    tally = Tally()
    lane = lambda w: (w.road_id, w.section_id, w.lane_id)
    own_lane = lambda w: (int(w["road"]), w["section"], w["lane"])
    theirs = collections.Counter((lane(a), lane(b)) for a, b in world.get_topology())
    own = collections.Counter(
        (own_lane(w["from"]), own_lane(w["to"] or w["from"])) for w in ours.lines("topology"))
    for edge in theirs | own:
        differs = theirs[edge] != own[edge]
        words = f"{theirs[edge]} times, ours {own[edge]}"
        tally.point([("unexplained", words)] if differs else [], edge)
    return tally


def compare_landmarks(world, ours):
    tally = Tally()
    own = collections.defaultdict(list)
    for line in ours.lines("landmarks"):
        own[(line["id"], int(line["road"]), round(line["s_m"], 2))].append(line)
    for theirs in world.get_all_landmarks():
        name = (theirs.id, theirs.road_id, round(theirs.s, 2))
        lines = own.get(name) or own.get((name[0], name[1], round(theirs.s + 0.01, 2)))
        if not lines:
            tally.point([("unexplained", "not among ours")], name)
            continue
        ranges = sorted((low, high) for low, high in theirs.get_lane_validities())
        validity = lambda line: sorted(tuple(r) for r in line["validity"])
        line = next((l for l in lines if validity(l) == ranges), lines[0])
        lines.remove(line)
        found = []
        for word, mine in (
            ("name", line["name"]), ("type", line["type"]), ("sub_type", line["subtype"]),
            ("country", line["country"]), ("unit", line["unit"]), ("text", line["text"]),
            ("is_dynamic", line["is_dynamic"]),
        ):
            if getattr(theirs, word) != mine:
                found.append(("unexplained", f"{word} {getattr(theirs, word)!r}, ours {mine!r}"))
        for word, mine in (
            ("t", line["t_m"]), ("width", line["width_m"]), ("height", line["height_m"]),
            ("z_offset", line["z_offset_m"]), ("h_offset", line["h_offset_rad"]),
            ("value", line["value"] or 0.0),
        ):
            if abs(getattr(theirs, word) - mine) > 1e-3:
                found.append(("unexplained", f"{word} {getattr(theirs, word)}, ours {mine}"))
        if line["validity"] and ranges != validity(line):
            found.append(("unexplained", f"lanes {ranges}, ours {validity(line)}"))
        found += compare_signal_place(theirs, line["signal"])
        tally.point(found, name)
    for name, lines in own.items():
        for _ in lines:
            tally.point([("unexplained", "not among theirs")], name)
    return tally


def compare_signal_place(theirs, mine):
    """Compares signals. CARLA's face in driving direction, ours face the drivers."""
    at, rotation = theirs.transform.location, theirs.transform.rotation
    x, y, z = at.x, -at.y, at.z
    yaw = -rotation.yaw
    is_light = theirs.type == "1000001"
    if is_light:
        # CARLA places light boxes 0.25 m before their pole.
        x -= 0.25 * math.cos(math.radians(yaw))
        y -= 0.25 * math.sin(math.radians(yaw))
    away = math.dist((x, y, z), (mine["x_m"], mine["y_m"], mine["z_m"]))
    face = math.degrees(mine["heading_rad"])
    off = min(turn_deg(yaw, face), turn_deg(yaw, face + 180.0))
    found = []
    if away > POSITION_M:
        # The steps are fifths of a lane's width to the right.
        found.append(("moved" if away < 12.0 else "unexplained", f"{away:.3f} m apart"))
    elif off > ANGLE_DEG:
        found.append(("unexplained", f"heading {yaw:.3f}, ours {face:.3f}"))
    return found


def compare_crosswalks(world, ours):
    """Compares crosswalks. CARLA returns one list of corners; each outline repeats its first one."""
    tally = Tally()
    outlines, outline = [], []
    for corner in world.get_crosswalks():
        at = (corner.x, -corner.y, corner.z)
        outline.append(at)
        if len(outline) > 2 and math.dist(outline[0], at) < 1e-3:
            outlines.append(outline[:-1])
            outline = []
    if outline:
        outlines.append(outline)
    own = [w["corners_m"] for w in ours.lines("crosswalks")]
    middle = lambda points: [sum(p[axis] for p in points) / len(points) for axis in range(3)]
    for theirs in outlines:
        near = [w for w in own if len(w) == len(theirs)]
        best = min(near, key=lambda w: math.dist(middle(w)[:2], middle(theirs)[:2]), default=None)
        if best is None:
            tally.point([("unexplained", "not among ours")], middle(theirs))
            continue
        own.remove(best)
        shift = [t - o for t, o in zip(middle(theirs), middle(best))]
        gaps = [math.dist([a[0] - shift[0], a[1] - shift[1]], b[:2]) for a, b in zip(theirs, best)]
        found = []
        if math.hypot(*shift[:2]) > POSITION_M:
            found.append(("offset", f"shifted by {shift[:2]} m"))
        if max(gaps) > POSITION_M:
            found.append(("unexplained", f"corners {gaps} m apart"))
        rise = max(abs(a[2] - b[2]) for a, b in zip(theirs, best))
        if rise > POSITION_M:
            # Slopes are below a tenth, crosswalks shorter than 40 m.
            found.append(("tilted" if rise < 2.0 else "unexplained", f"{rise:.3f} m higher"))
        tally.point(found, middle(theirs))
    for outline in own:
        tally.point([("unexplained", "not among theirs")], middle(outline))
    return tally


def compare_nearest(world, ours, carla):
    """Compares the nearest driving lane of points all over the map and beside lanes."""
    tally = Tally()
    rng = random.Random(1)
    lanes = world.generate_waypoints(5.0)
    points = []
    for waypoint in rng.sample(lanes, min(len(lanes), 2000)):
        x, y, z = place_of(waypoint)
        points.append((x + rng.gauss(0, 1.5), y + rng.gauss(0, 1.5), z))
    text = "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in points)
    for (x, y, z), own in zip(points, ours.lines("query", "--points", "-", text=text)):
        theirs = world.get_waypoint(carla.Location(x, -y, z))
        mine = own["waypoint"]
        name = (theirs.road_id, theirs.lane_id, round(theirs.s, 2))
        here = (mine["x_m"], mine["y_m"], mine["z_m"])
        if math.dist(place_of(theirs), here) <= 0.05:
            tally.point([], name)
            continue
        # The nearer lane is correct; where several are equally near, each one is.
        gap = math.dist(place_of(theirs), (x, y, z)) - math.dist(here, (x, y, z))
        same_lane = (str(theirs.road_id), theirs.lane_id) == (mine["road"], mine["lane"])
        kind = "coarse" if same_lane else "far"
        if gap <= -0.01:
            # Ours is on the surface, which has one height where roads of a junction overlap.
            level = math.dist(place_of(theirs)[:2], (x, y)) - math.dist(here[:2], (x, y))
            kind = "height" if mine["junction"] is not None and level > -0.01 else "unexplained"
        found = [(kind, f"ours is {-gap:.3f} m farther")]
        tally.point(found, name)
    return tally


def mercator(latitude, longitude, x, y):
    """CARLA's formula, reconstructed from the answers of its client."""
    radius = 6378137.0 * 0.9996
    north = y / radius + math.radians(latitude)
    east = x / radius
    return (math.degrees(math.asin(math.sin(north) / math.cosh(east))),
            longitude + math.degrees(math.atan2(math.sinh(east), math.cos(north))))


def compare_geo(world, carla, text):
    """Compares the formula of road::CarlaMercator with CARLA's answers."""
    tally = Tally()
    number = lambda name: float(text.split(f"+{name}=")[1].split()[0].split("]")[0])
    try:
        origin = number("lat_0"), number("lon_0")
    except (IndexError, ValueError):
        origin = 42.0, 2.0
    rng = random.Random(2)
    for _ in range(500):
        x, y = rng.uniform(-2000, 2000), rng.uniform(-2000, 2000)
        theirs = world.transform_to_geolocation(carla.Location(x, y, 1.0))
        latitude, longitude = mercator(*origin, x, y)
        off = max(abs(theirs.latitude - latitude), abs(theirs.longitude - longitude))
        # A location is f32; this many degrees are a tenth of a millimetre.
        tally.point([("unexplained", f"{off} degrees apart")] if off > 2e-9 else [], (x, y))
    return tally


def compare(carla, program, path):
    """Returns the tallies of one map, by what was compared."""
    text = open(path, encoding="utf-8").read()
    name = os.path.basename(path).removesuffix(".xodr").split("__")[-1]
    begun = time.perf_counter()
    world = carla.Map(name, text)
    took = time.perf_counter() - begun
    ours = Ours(program, path)
    return name, took, {
        "waypoints": compare_waypoints(world, ours),
        "other lanes": compare_other_lanes(world, ours),
        "topology": compare_topology(world, ours),
        "landmarks": compare_landmarks(world, ours),
        "crosswalks": compare_crosswalks(world, ours),
        "nearest": compare_nearest(world, ours, carla),
        "geo": compare_geo(world, carla, text),
    }


def main():
    parser = argparse.ArgumentParser(description="Compares omnibus map with CARLA's own client.")
    parser.add_argument("maps", nargs="+", metavar="MAP.xodr")
    parser.add_argument("--omnibus", default=os.path.join(ROOT, "target/release/omnibus"))
    parser.add_argument("--venv", default=os.path.join(ROOT, "target/carla-venv"))
    arguments = parser.parse_args()
    carla = carla_module(arguments.venv)
    failed = []
    print("| map | what | points | differing | unexplained | classes |")
    print("|---|---|--:|--:|--:|---|")
    for path in arguments.maps:
        name, took, tallies = compare(carla, arguments.omnibus, path)
        for what, tally in tallies.items():
            classes = ", ".join(f"{c} {tally.classes[c]}" for c in CLASSES if tally.classes[c])
            share = 100.0 * tally.differing / max(tally.points, 1)
            print(f"| {name} | {what} | {tally.points} | {tally.differing} ({share:.2f} %) "
                  f"| {tally.unexplained()} | {classes} |", flush=True)
            for example in tally.examples:
                print(f"  {example}", file=sys.stderr)
            if tally.unexplained() > UNEXPLAINED_MAX * tally.points:
                failed.append(f"{name} {what}")
        worst = tallies["waypoints"]
        print(f"{name}: worst of those that agree {worst.worst_m * 1e3:.2f} mm, "
              f"{worst.worst_deg:.4f} deg; carla.Map took {took * 1e3:.0f} ms", file=sys.stderr)
    if failed:
        sys.exit("more than 0.1 % unexplained: " + "; ".join(failed))


if __name__ == "__main__":
    main()
