"""Non-player agents: vehicles on autopilot, and pedestrians on sidewalks."""

import logging
import random

import carla

from . import measurements

COLOURS = {
    carla.TrafficLightState.Green: measurements.TrafficLight.GREEN,
    carla.TrafficLightState.Yellow: measurements.TrafficLight.YELLOW,
    carla.TrafficLightState.Red: measurements.TrafficLight.RED,
}


class Crowd:
    """The vehicles and pedestrians of an episode, which the seeds determine."""

    def __init__(self, client, world, road_map, settings, spots, taken, manager_port):
        self._client, self._world, self._map = client, world, road_map
        self._vehicles = self._spawn_vehicles(settings, spots, taken, manager_port)
        self._walkers = self._spawn_walkers(settings, spots, manager_port)
        self._known = {}
        self._boxes = {}

    def _spawn_vehicles(self, settings, spots, taken, manager_port):
        if settings.NumberOfVehicles < 1:
            return []
        chance = random.Random(settings.SeedVehicles)
        blueprints = [
            b for b in self._world.get_blueprint_library().filter("vehicle.*")
            if not settings.DisableTwoWheeledVehicles
            or b.get_attribute("number_of_wheels").as_int() == 4]
        # Positions near the player first, so that a large map does not look empty.
        free = [s for s in spots if s.location.distance(taken.location) > 8.0]
        chance.shuffle(free)
        free.sort(key=lambda s: s.location.distance(taken.location) > 400.0)
        manager = self._client.get_trafficmanager(manager_port)
        commands = []
        for spot in free[: settings.NumberOfVehicles]:
            blueprint = chance.choice(blueprints)
            blueprint.set_attribute("role_name", "carla08")
            place = carla.Transform(spot.location + carla.Location(z=0.3), spot.rotation)
            commands.append(carla.command.SpawnActor(blueprint, place).then(
                carla.command.SetAutopilot(
                    carla.command.FutureActor, True, manager.get_port())))
        return self._spawned(commands, "vehicles")

    def _spawn_walkers(self, settings, spots, manager_port):
        if settings.NumberOfPedestrians < 1:
            return []
        chance = random.Random(settings.SeedPedestrians)
        blueprints = list(self._world.get_blueprint_library().filter("walker.pedestrian.*"))
        manager = self._client.get_trafficmanager(manager_port)
        commands = []
        for _ in range(20 * settings.NumberOfPedestrians):
            if len(commands) == settings.NumberOfPedestrians:
                break
            lane = self._map.get_waypoint(
                chance.choice(spots).location, lane_type=carla.LaneType.Sidewalk)
            on = lane.next(chance.uniform(0.5, 15.0)) if lane is not None else []
            if on:
                place = carla.Transform(
                    on[0].transform.location + carla.Location(z=1.0), on[0].transform.rotation)
                blueprint = chance.choice(blueprints)
                blueprint.set_attribute("role_name", "carla08")
                commands.append(carla.command.SpawnActor(blueprint, place).then(
                    carla.command.SetAutopilot(
                        carla.command.FutureActor, True, manager.get_port())))
        return self._spawned(commands, "pedestrians")

    def _spawned(self, commands, what):
        answers = self._client.apply_batch_sync(commands, False)
        found = [answer.actor_id for answer in answers if not answer.has_error()]
        if len(found) < len(commands):
            logging.info("%d of %d %s found a place", len(found), len(commands), what)
        return found

    def others(self, snapshot):
        """Returns the poses and speeds of the vehicles and pedestrians, for the autopilot."""
        states = (snapshot.find(ident) for ident in self._vehicles + self._walkers)
        return [state for state in states if state is not None]

    def agents(self, snapshot, player):
        """Returns all non-player agents, traffic lights and signs."""
        fresh = [s for s in snapshot if s.id != player and s.id not in self._known]
        if fresh:
            self._known.update((a.id, a) for a in self._world.get_actors([s.id for s in fresh]))
        found = []
        for state in snapshot:
            actor = self._known.get(state.id)
            if actor is not None and state.id != player:
                agent = self._agent(actor, state)
                if agent is not None:
                    found.append(agent)
        return found

    def _agent(self, actor, state):
        kind = actor.type_id
        pose = state.get_transform()
        where = measurements.transform_of(pose)
        if kind.startswith(("vehicle.", "walker.")):
            if actor.id not in self._boxes:
                self._boxes[actor.id] = measurements.box_of(actor.bounding_box)
            speed = state.get_velocity().dot(pose.get_forward_vector())
            name, make = (("vehicle", measurements.Vehicle) if kind.startswith("vehicle.")
                          else ("pedestrian", measurements.Pedestrian))
            return measurements.Agent(actor.id, name, make(
                transform=where, bounding_box=self._boxes[actor.id], forward_speed=speed))
        if kind == "traffic.traffic_light":
            colour = COLOURS.get(actor.get_state(), measurements.TrafficLight.RED)
            return measurements.Agent(actor.id, "traffic_light",
                              measurements.TrafficLight(transform=where, state=colour))
        if kind.startswith("traffic.speed_limit."):
            return measurements.Agent(actor.id, "speed_limit_sign", measurements.SpeedLimitSign(
                transform=where, speed_limit=float(kind.rsplit(".", 1)[1]) / 3.6))
        return None

    def destroy(self):
        """Destroys the vehicles and pedestrians."""
        gone = [carla.command.DestroyActor(i) for i in self._vehicles + self._walkers]
        if gone:
            self._client.apply_batch_sync(gone, False)
        self._vehicles, self._walkers = [], []
