"""The driver that scenario_runner's single scenarios need: CARLA's BehaviorAgent, without a goal.

scenario_runner leaves the ego vehicle to a person, who looks for walkers and vehicles; so does this agent,
while BasicAgent does not look for walkers.
"""

import carla
from agents.navigation.behavior_agent import BehaviorAgent
from srunner.autoagents.autonomous_agent import AutonomousAgent
from srunner.scenariomanager.carla_data_provider import CarlaDataProvider


class EgoAgent(AutonomousAgent):
    """Drives the vehicle whose role is hero; at junctions its planner chooses at random."""

    def setup(self, path_to_conf_file):
        self.driver = None

    def sensors(self):
        return []

    def run_step(self, input_data, timestamp):
        if self.driver is None:
            for vehicle in CarlaDataProvider.get_world().get_actors().filter("vehicle.*"):
                if vehicle.attributes.get("role_name") == "hero":
                    self.driver = BehaviorAgent(vehicle, "normal", opt_dict={})
                    break
            else:
                return carla.VehicleControl()
        return self.driver.run_step()
