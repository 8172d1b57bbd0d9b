"""Agents, which return a control for each frame of a benchmark."""

import abc

from ..measurements import Control


class Agent(abc.ABC):
    """Base class of agents."""

    @abc.abstractmethod
    def run_step(self, measurements, sensor_data, directions, target):
        """Returns a control. `directions` is a command of the planner, `target` the goal's pose."""

    def reset(self):
        """Called when a new episode begins."""


class ForwardAgent(Agent):
    """Always drives straight ahead."""

    def run_step(self, measurements, sensor_data, directions, target):
        return Control(throttle=0.9)


class AutopilotAgent(Agent):
    """Returns the control of the autopilot, which follows the route."""

    def run_step(self, measurements, sensor_data, directions, target):
        return measurements.player_measurements.autopilot_control


__all__ = ["Agent", "AutopilotAgent", "ForwardAgent"]
