"""One ego vehicle: ``Omnibus/Drive-v0``."""

from __future__ import annotations

from typing import Any

import gymnasium

from .config import DriveConfig
from .world import RENDER_MODES, World, action_space, check_render_mode, observation_space


class DriveEnv(gymnasium.Env[Any, Any]):
    """Drive along a route among vehicles in traffic, in this process.

    An episode terminates at the end of the route, at a collision and beside the route; it is
    truncated after ``steps_max`` steps. ``info`` has ``ending`` (``"arrival"``, ``"collision"``,
    ``"off_route"``, ``"steps"`` or None), ``progress_m``, ``route_m``, ``speed_mps`` and ``left_m``,
    and that of ``reset`` also ``episode_seed`` and ``map_seed``.

    Options of ``reset``: ``episode_seed`` and ``map_seed`` begin the episode of another one's
    ``info``; ``vehicles`` and ``route_m`` hold for one episode. Other keys are ignored.
    """

    metadata = {"render_modes": RENDER_MODES, "render_fps": 10}

    def __init__(self, config: DriveConfig | None = None, render_mode: str | None = None) -> None:
        check_render_mode(render_mode)
        self.config = config or DriveConfig()
        self.render_mode = render_mode
        self.observation_space = observation_space(self.config)
        self.action_space = action_space(self.config)
        self._world = World(self.config, 1)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begins another episode. The same seed gives the same episodes."""
        super().reset(seed=seed)
        drawn = self._world.reset(self.np_random, options)
        return self._world.observe(0), {**self._world.info(0, None), **drawn}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advances by one step. After the end of an episode nothing happens until ``reset``."""
        world = self._world
        ((reward, ending),) = world.environment.step([world.action(action)])
        truncated = ending == "steps"
        terminated = ending is not None and not truncated
        return world.observe(0), reward, terminated, truncated, world.info(0, ending)

    def render(self) -> Any:
        """Returns a picture of the surroundings from above, height × width × 3 bytes, straight ahead
        upwards; None without the render mode ``"rgb_array"``."""
        return None if self.render_mode is None else self._world.image(0)

    @property
    def state_hash(self) -> int:
        """A hash of everything that decides the future, as ``World.state_hash`` of a simulator."""
        return self._world.environment.state_hash
