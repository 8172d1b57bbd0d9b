"""The driver that scenario_runner's single scenarios need: CARLA's BehaviorAgent.

scenario_runner leaves the ego vehicle to a person, who looks for walkers and vehicles and turns where the
scenario's name says; so does this agent. BasicAgent does not look for walkers.
"""

import carla
from agents.navigation.behavior_agent import BehaviorAgent
from srunner.autoagents.autonomous_agent import AutonomousAgent
from srunner.scenariomanager.carla_data_provider import CarlaDataProvider
from srunner.tools.scenario_helper import generate_target_waypoint

BEYOND_TURN_M = 100.0


class EgoAgent(AutonomousAgent):
    """Drives the vehicle whose role is hero. At the first junction it goes as its configuration says, `left`,
    `straight` or `right`; at others, and without a configuration, its planner chooses at random."""

    def setup(self, path_to_conf_file):
        self.turn = {"left": -1, "straight": 0, "right": 1}.get(path_to_conf_file)
        self.driver = self.vehicle = None

    def sensors(self):
        return []

    def run_step(self, input_data, timestamp):
        if self.driver is None:
            for vehicle in CarlaDataProvider.get_world().get_actors().filter("vehicle.*"):
                if vehicle.attributes.get("role_name") == "hero":
                    self.vehicle = vehicle
                    self.driver = self.new_driver()
                    self.plan()
                    break
            else:
                return carla.VehicleControl()
        elif self.driver.done():
            # At the end of its route, which it may also have set itself to evade, it has nothing to follow.
            self.driver = self.new_driver()
        return self.driver.run_step()

    def new_driver(self):
        return BehaviorAgent(self.vehicle, "normal", opt_dict={})

    def plan(self):
        """Sets the end of the route, if there is a turn to take."""
        if self.turn is None:
            return
        start = CarlaDataProvider.get_map().get_waypoint(self.vehicle.get_location())
        exit_lane = generate_target_waypoint(start, self.turn)
        end = (exit_lane.next(BEYOND_TURN_M) or [exit_lane])[0]
        self.driver.set_destination(end.transform.location, start.transform.location)
