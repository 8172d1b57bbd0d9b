"""Environments for reinforcement learning in this process, without a running simulator.

Importing this module registers ``Omnibus/Drive-v0`` with Gymnasium; ``parallel_env`` makes a
PettingZoo environment of several ego vehicles. It needs ``pip install omnibus-sim[gym]``. The manual
is docs/gym.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

try:
    import gymnasium
except ModuleNotFoundError:
    raise ImportError("omnibus.gym needs Gymnasium: pip install omnibus-sim[gym]")

from .config import (
    Actions,
    BirdsEye,
    Camera,
    Continuous,
    Discrete,
    DriveConfig,
    Lidar,
    Observation,
    Rewards,
    Route,
    State,
    Terminations,
    Waypoint,
)
from .drive import DriveEnv

if TYPE_CHECKING:
    from .parallel import DriveParallelEnv

__all__ = [
    "Actions",
    "BirdsEye",
    "Camera",
    "Continuous",
    "Discrete",
    "DriveConfig",
    "DriveEnv",
    "Lidar",
    "Observation",
    "Rewards",
    "Route",
    "State",
    "Terminations",
    "Waypoint",
    "parallel_env",
]


def parallel_env(
    egos: int = 4, config: DriveConfig | None = None, render_mode: str | None = None
) -> DriveParallelEnv:
    """Returns a PettingZoo ``ParallelEnv`` with ``egos`` ego vehicles, 1 to 64, in one world."""
    try:
        from .parallel import DriveParallelEnv
    except ImportError as error:
        message = "omnibus.gym.parallel_env needs PettingZoo: pip install omnibus-sim[gym]"
        raise ImportError(message) from error
    return DriveParallelEnv(egos, config, render_mode)


gymnasium.register(  # pyright: ignore[reportUnknownMemberType]
    "Omnibus/Drive-v0", entry_point="omnibus.gym:DriveEnv"
)
