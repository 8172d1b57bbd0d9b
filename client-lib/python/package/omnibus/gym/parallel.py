"""Several ego vehicles in one world, for PettingZoo."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv  # type: ignore[import-untyped,unused-ignore]

from .config import DriveConfig
from .world import RENDER_MODES, World, action_space, check_render_mode, observation_space


class DriveParallelEnv(ParallelEnv[str, Any, Any]):  # type: ignore[misc,unused-ignore]
    """Several ego vehicles in one world, each with its route, its rewards and its ending.

    Agents are called ``ego_0``, ``ego_1`` and so on. An agent whose episode has ended leaves
    ``agents``; its vehicle is there for its last observation and is removed from the world with the
    next step. Infos and options are those of ``DriveEnv``.
    """

    metadata: dict[str, Any] = {
        "name": "Omnibus/Drive-v0",
        "render_modes": RENDER_MODES,
        "is_parallelizable": True,
        "render_fps": 10,
    }

    def __init__(
        self, egos: int, config: DriveConfig | None = None, render_mode: str | None = None
    ) -> None:
        check_render_mode(render_mode)
        if egos < 1:
            raise ValueError(f"egos is {egos}, must be 1 to 64")
        self.config = config or DriveConfig()
        self.render_mode = render_mode
        self.possible_agents = [f"ego_{index}" for index in range(egos)]
        self.agents: list[str] = []
        self._index = {agent: index for index, agent in enumerate(self.possible_agents)}
        self.observation_spaces = {
            agent: observation_space(self.config) for agent in self.possible_agents
        }
        self.action_spaces = {agent: action_space(self.config) for agent in self.possible_agents}
        self._random: np.random.Generator | None = None
        self._world = World(self.config, egos)
        self._idle = [(0.0, 0.0)] * egos

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's observations: the same object each time."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Returns the space of an agent's actions: the same object each time."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Begins another episode. The same seed gives the same episodes."""
        if seed is not None or self._random is None:
            self._random = np.random.default_rng(seed)
        drawn = self._world.reset(self._random, options)
        self.agents = list(self.possible_agents)
        observations = {agent: self._world.observe(self._index[agent]) for agent in self.agents}
        infos = {
            agent: {**self._world.info(self._index[agent], None), **drawn} for agent in self.agents
        }
        return observations, infos

    def step(
        self, actions: dict[str, Any]
    ) -> tuple[
        dict[str, Any],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Advances by one step. ``actions`` has one for each of ``agents``."""
        missing = [agent for agent in self.agents if agent not in actions]
        if missing:
            raise ValueError(f"actions lacks {missing}; give one to each of agents")
        given = list(self._idle)
        for agent in self.agents:
            given[self._index[agent]] = self._world.action(actions[agent])
        results = self._world.environment.step(given)
        observations: dict[str, Any] = {}
        rewards: dict[str, float] = {}
        terminations: dict[str, bool] = {}
        truncations: dict[str, bool] = {}
        infos: dict[str, dict[str, Any]] = {}
        for agent in self.agents:
            index = self._index[agent]
            rewards[agent], ending = results[index]
            truncations[agent] = ending == "steps"
            terminations[agent] = ending is not None and not truncations[agent]
            observations[agent] = self._world.observe(index)
            infos[agent] = self._world.info(index, ending)
        self.agents = [agent for agent in self.agents if infos[agent]["ending"] is None]
        return observations, rewards, terminations, truncations, infos

    def render(self) -> Any:
        """Returns a picture of the surroundings of the first agent of ``agents``, as
        ``DriveEnv.render``."""
        if self.render_mode is None:
            return None
        return self._world.image(self._index[self.agents[0]] if self.agents else 0)

    @property
    def state_hash(self) -> int:
        """A hash of everything that decides the future, as ``World.state_hash`` of a simulator."""
        return self._world.environment.state_hash
