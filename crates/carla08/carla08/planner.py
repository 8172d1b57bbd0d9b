"""Shortest routes over the lanes, and the commands of 0.8's planner along them."""

import collections
import heapq
import math

import carla

REACH_GOAL, LANE_FOLLOW, TURN_LEFT, TURN_RIGHT, GO_STRAIGHT = 0.0, 2.0, 3.0, 4.0, 5.0

STEP_M = 2.0
# Degrees from which a route through a junction is a turn.
TURN_DEG = 30.0
# Metres before a junction at which its command begins.
TELL_M = 30.0


def key_of(waypoint):
    """Returns the key of the lane segment of a waypoint."""
    return waypoint.road_id, waypoint.section_id, waypoint.lane_id


class Planner:
    """A planner for one map."""

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
        """Returns the length in metres and the turn in degrees, positive to the right."""
        if key not in self._shape:
            points = self.entry[key].next_until_lane_end(STEP_M)
            first, last = self.entry[key], points[-1] if points else self.entry[key]
            turn = _turn(first.transform.rotation.yaw, last.transform.rotation.yaw)
            self._shape[key] = max(STEP_M * len(points), 0.5), turn
        return self._shape[key]

    def turns(self, key):
        """Returns whether a lane segment is a turn in a junction."""
        return self.entry[key].is_junction and abs(self.shape(key)[1]) > TURN_DEG

    def tree(self, start):
        """Returns shortest routes from a lane segment: key -> (metres, turns, previous key)."""
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
        """Returns waypoints 2 m apart from start to goal (locations); empty if there is no
        route."""
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
        """Returns the command at this place of a route."""
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
    """Returns the length of a route in metres."""
    return STEP_M * max(len(route) - 1, 0)


def location(transform):
    """Converts the location of a transform of 0.8."""
    at = transform.location
    return carla.Location(at.x, at.y, at.z)


def _turn(before_deg, after_deg):
    return (after_deg - before_deg + 180.0) % 360.0 - 180.0


def _is_beside(place, end):
    """Returns whether the goal is reached or was passed within one step."""
    offset = end.transform.location - place.transform.location
    along = offset.dot(place.transform.get_forward_vector())
    return -STEP_M < along <= STEP_M and math.hypot(offset.x, offset.y) < 2.0 * STEP_M
