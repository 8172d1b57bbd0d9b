"""Shortest ways over the lanes, and what 0.8's planner says at each place of them."""

import collections
import heapq
import math

import carla

REACH_GOAL, LANE_FOLLOW, TURN_LEFT, TURN_RIGHT, GO_STRAIGHT = 0.0, 2.0, 3.0, 4.0, 5.0

STEP_M = 2.0
# Degrees that a way through a junction turns before it is called a turn.
TURN_DEG = 30.0
# Metres before a junction at which its command is told.
TELL_M = 30.0


def key_of(waypoint):
    """The lane piece that it lies on."""
    return waypoint.road_id, waypoint.section_id, waypoint.lane_id


class Planner:
    """Over one map."""

    def __init__(self, road_map):
        self.map = road_map
        self.after = collections.defaultdict(list)
        self.entry = {}
        for before, behind in road_map.get_topology():
            self.entry.setdefault(key_of(before), before)
            self.entry.setdefault(key_of(behind), behind)
            self.after[key_of(before)].append(key_of(behind))
        self._shape = {}

    def shape(self, key):
        """Length in metres and turn in degrees, positive to the right."""
        if key not in self._shape:
            points = self.entry[key].next_until_lane_end(STEP_M)
            first, last = self.entry[key], points[-1] if points else self.entry[key]
            turn = _turn(first.transform.rotation.yaw, last.transform.rotation.yaw)
            self._shape[key] = max(STEP_M * len(points), 0.5), turn
        return self._shape[key]

    def turns(self, key):
        """Whether this piece is a turn in a junction."""
        return self.entry[key].is_junction and abs(self.shape(key)[1]) > TURN_DEG

    def tree(self, start):
        """Shortest ways from a piece to all: key -> (metres, turns, key before)."""
        found, heap = {}, [(0.0, 0, start, None)]
        while heap:
            metres, turns, key, before = heapq.heappop(heap)
            if key in found or key not in self.entry:
                continue
            found[key] = metres, turns, before
            for behind in sorted(self.after[key]):
                if behind not in found:
                    heapq.heappush(heap, (metres + self.shape(key)[0],
                                          turns + self.turns(behind), behind, key))
        return found

    def route(self, start, goal):
        """Waypoints 2 m apart from start to goal (locations); empty if there is no way."""
        begin, end = self.map.get_waypoint(start), self.map.get_waypoint(goal)
        tree = self.tree(key_of(begin))
        if key_of(end) not in tree:
            return []
        keys, key = [], key_of(end)
        while key is not None:
            keys.append(key)
            key = tree[key][2]
        keys.reverse()
        return self._walk(begin, end, keys)

    def _walk(self, begin, end, keys):
        route, at, place = [begin], 0, begin
        while True:
            if at == len(keys) - 1 and _is_beside(place, end):
                return route + [end]
            ahead = {key_of(w): w for w in place.next(STEP_M)}
            step = next((i for i in range(at, min(at + 4, len(keys))) if keys[i] in ahead), None)
            if step is None:
                return []
            at, place = step, ahead[keys[step]]
            route.append(place)

    def command(self, route, location):
        """What to do here, on the way along a route."""
        if not route:
            return REACH_GOAL
        near = min(range(len(route)), key=lambda i: route[i].transform.location.distance(location))
        if route[-1].transform.location.distance(location) < 2.0:
            return REACH_GOAL
        for i in range(near, min(near + int(TELL_M / STEP_M), len(route))):
            if route[i].is_junction:
                last = i
                while last + 1 < len(route) and route[last].is_junction:
                    last += 1
                turn = _turn(route[max(i - 1, 0)].transform.rotation.yaw,
                             route[last].transform.rotation.yaw)
                if abs(turn) <= TURN_DEG:
                    return GO_STRAIGHT
                return TURN_RIGHT if turn > 0 else TURN_LEFT
        return LANE_FOLLOW


def length_m(route):
    """Of a route, in metres."""
    return STEP_M * max(len(route) - 1, 0)


def location(transform):
    """Today's location of one of 0.8's transforms."""
    at = transform.location
    return carla.Location(at.x, at.y, at.z)


def _turn(before_deg, after_deg):
    return (after_deg - before_deg + 180.0) % 360.0 - 180.0


def _is_beside(place, end):
    """Whether the goal is reached: within a step, or passed by less than one."""
    offset = end.transform.location - place.transform.location
    along = offset.dot(place.transform.get_forward_vector())
    return -STEP_M < along <= STEP_M and math.hypot(offset.x, offset.y) < 2.0 * STEP_M
