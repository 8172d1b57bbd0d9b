"""CARLA's `agents` on routes through traffic.

For each town and kind of agent, the same routes are driven among thirty vehicles on autopilot. A route
ends when the agent is done (arrived), at the first collision, after 90 s without moving 1 m (stuck),
or after 300 s. A red light is run when the rear of the vehicle enters the junction from a stop waypoint's
lane while the light is red, as in scenario_runner's RunningRedLightTest.
"""

import random
import sys

import kit
from kit import carla

TOWNS = ["Town01", "Town02", "Town03", "Town10HD"]
VEHICLES = 30
LIMIT_S, STUCK_S = 300.0, 90.0


class StopLines:
    """The places where lanes with a traffic light enter their junction."""

    def __init__(self, world):
        self.lines = []
        for light in world.get_actors().filter("traffic.traffic_light"):
            for point in light.get_stop_waypoints():
                while not point.is_junction:
                    following = point.next(0.5)
                    if not following or following[0].is_junction:
                        break
                    point = following[0]
                at, ahead = point.transform.location, point.transform.get_forward_vector()
                self.lines.append((light, at, ahead, point.lane_width))

    def passed(self, before, after):
        """The states of the lights whose place lies between two positions of a vehicle."""
        states = []
        for light, at, ahead, width in self.lines:
            if abs(at.x - after.x) + abs(at.y - after.y) > 15.0:
                continue
            along = [(p.x - at.x) * ahead.x + (p.y - at.y) * ahead.y for p in (before, after)]
            across = (after.y - at.y) * ahead.x - (after.x - at.x) * ahead.y
            if along[0] < 0.0 <= along[1] and abs(across) < width / 2.0:
                states.append(light.state)
        return states


def rear(vehicle):
    pose = vehicle.get_transform()
    return pose.location - pose.get_forward_vector() * vehicle.bounding_box.extent.x


def how(agent, ego, kind, others):
    """The agent's part in a collision with another vehicle."""
    from agents.navigation.local_planner import RoadOption
    option = agent.get_local_planner().target_road_option
    if option in (RoadOption.CHANGELANELEFT, RoadOption.CHANGELANERIGHT):
        return " while it changes lanes"
    pose = ego.get_transform()
    ahead = pose.get_forward_vector()
    near = [o for o in others if o.is_alive and o.type_id == kind and o.get_location().distance(pose.location) < 12.0]
    for other in near:
        to = other.get_location() - pose.location
        along, across = to.dot(ahead), abs(to.x * ahead.y - to.y * ahead.x)
        if across < 1.5 and other.get_transform().get_forward_vector().dot(ahead) > 0.7:
            return " from behind" if along > 0.0 else ", which drives into it from behind"
    return ""


def routes(world, planner, count, rng):
    """Pairs of spawn points between which the planner's route is 150 to 500 m long."""
    points = world.get_map().get_spawn_points()
    found = []
    for _ in range(400):
        start, end = rng.sample(points, 2)
        try:
            route = planner.trace_route(start.location, end.location)
        except Exception as error:
            kit.report("planner", False, f"{type(error).__name__}: {error}")
            continue
        locations = [waypoint.transform.location for waypoint, _ in route]
        length = sum(a.distance(b) for a, b in zip(locations, locations[1:]))
        if 150.0 <= length <= 500.0:
            found.append((start, end, length))
            if len(found) == count:
                break
    return found


def make_agent(kind, ego, town_map, planner):
    from agents.navigation.basic_agent import BasicAgent
    from agents.navigation.behavior_agent import BehaviorAgent
    from agents.navigation.constant_velocity_agent import ConstantVelocityAgent
    if kind == "BasicAgent":
        return BasicAgent(ego, 30, opt_dict={}, map_inst=town_map, grp_inst=planner)
    if kind == "ConstantVelocityAgent":
        # Its constructor passes km/h where m/s are meant.
        agent = ConstantVelocityAgent(ego, 30, opt_dict={}, map_inst=town_map, grp_inst=planner)
        agent.restart_constant_velocity()
        return agent
    behavior = kind.removeprefix("BehaviorAgent ")
    return BehaviorAgent(ego, behavior, opt_dict={}, map_inst=town_map, grp_inst=planner)


def drive(client, world, lines, kind, route, town_map, planner, seed):
    """Drives one route; returns how it ended, and the counts of collisions and lights."""
    rng = random.Random(seed)
    start, end, _ = route
    model = world.get_blueprint_library().find("vehicle.tesla.model3")
    model.set_attribute("role_name", "hero")
    ego = world.spawn_actor(model, start)
    others = kit.spawn_traffic(client, world, VEHICLES, rng)
    hits = []
    sensor = world.spawn_actor(world.get_blueprint_library().find("sensor.other.collision"),
                               carla.Transform(), attach_to=ego)
    sensor.listen(lambda event: hits.append(event.other_actor.type_id))
    world.tick()
    agent = make_agent(kind, ego, town_map, planner)
    agent.set_destination(end.location, start.location)
    ended, red, lights = "time", 0, 0
    last, rest, rest_since = rear(ego), ego.get_location(), 0.0
    try:
        for tick in range(int(LIMIT_S / kit.DELTA)):
            if agent.done():
                ended = "arrived"
                break
            ego.apply_control(agent.run_step())
            world.tick()
            here, now = ego.get_location(), tick * kit.DELTA
            behind = rear(ego)
            for state in lines.passed(last, behind):
                lights += 1
                red += state == carla.TrafficLightState.Red
            last = behind
            if hits:
                ended = "collision"
                hits[0] += how(agent, ego, hits[0], others)
                break
            if here.distance(rest) > 1.0:
                rest, rest_since = here, now
            elif now - rest_since > STUCK_S:
                ended = "stuck"
                break
    finally:
        extra = getattr(agent, "_collision_sensor", None)
        kit.destroy(client, [a for a in (extra, sensor, ego, *others) if a is not None])
        world.tick()
    return ended, hits[:1], red, lights


def main():
    port, folder, _, quick = kit.arguments()
    sys.path.insert(0, folder)
    from agents.navigation.global_route_planner import GlobalRoutePlanner
    kinds = ["BasicAgent", "BehaviorAgent cautious", "BehaviorAgent normal",
             "BehaviorAgent aggressive", "ConstantVelocityAgent"]
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    count = 2 if quick else 10
    there = kit.towns()
    for town in [t for t in TOWNS if t in there]:
        world = kit.load(client, town)
        town_map = world.get_map()
        try:
            planner = GlobalRoutePlanner(town_map, 2.0)
        except Exception as error:
            kit.report(f"{town}: GlobalRoutePlanner", False, f"{type(error).__name__}: {error}")
            continue
        lines = StopLines(world)
        chosen = routes(world, planner, count, random.Random(town))
        for kind in kinds:
            ends = {"arrived": 0, "collision": 0, "stuck": 0, "time": 0, "error": 0}
            reds = passed = 0
            notes = []
            for number, route in enumerate(chosen):
                try:
                    ended, hit, red, lights = drive(
                        client, world, lines, kind, route, town_map, planner, number)
                except Exception as error:
                    ended, hit, red, lights = "error", [], 0, 0
                    notes.append(f"route {number}: {type(error).__name__}: {error}")
                ends[ended] += 1
                reds += red
                passed += lights
                cause = f" with {hit[0]}" if hit else ""
                if red or ended not in ("arrived", "error"):
                    notes.append(f"route {number}: {ended}{cause}" + (f", {red} red" if red else ""))
            text = ", ".join(f"{n} {name}" for name, n in ends.items() if n)
            note = f" ({'; '.join(notes)})" if notes else ""
            good = ends["arrived"] == len(chosen) and reds == 0
            kit.report(f"{town}: {kind}", good,
                       f"{len(chosen)} routes: {text}; {reds} of {passed} lights run at red{note}")


main()
kit.end()
