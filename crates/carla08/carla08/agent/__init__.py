"""Agents: what a benchmark asks for a control at each frame."""

import abc

from ..measurements import Control


class Agent(abc.ABC):
    """Derive from it."""

    @abc.abstractmethod
    def run_step(self, measurements, sensor_data, directions, target):
        """A control. `directions` is one of the planner's commands, `target` the goal's pose."""

    def reset(self):
        """A new episode begins."""


class ForwardAgent(Agent):
    """Goes straight on, whatever comes."""

    def run_step(self, measurements, sensor_data, directions, target):
        return Control(throttle=0.9)


class AutopilotAgent(Agent):
    """Does what the server's autopilot would do, which knows the route."""

    def run_step(self, measurements, sensor_data, directions, target):
        return measurements.player_measurements.autopilot_control


__all__ = ["Agent", "AutopilotAgent", "ForwardAgent"]
