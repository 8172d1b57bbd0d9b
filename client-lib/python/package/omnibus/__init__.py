"""Omnibus, a driving simulator whose parts share memory.

SI units and radians; right-handed axes, x forward, y left, z up. CARLA's axes and degrees are in
``omnibus.carla_axes`` only. The manual is docs/python.md.
"""

from typing import TYPE_CHECKING

from . import carla_axes, errors, sensors
from ._omnibus import (
    BUILD,
    KEYPOINT_LINKS,
    KEYPOINTS,
    VERSION,
    Bundle,
    Cancel,
    Keypoints,
    LanePoint,
    Map,
    Measurement,
    Projection,
    Reading,
    Recorder,
    Traffic,
    World,
)
from .client import Blueprint, Client, Frame, Settings, Weather
from .errors import (
    BuildError,
    CancelledError,
    FrameIncompleteError,
    NotAllowedError,
    OmnibusError,
    RefusedError,
    SimulatorEndedError,
    SimulatorTimeoutError,
    ViewLimitError,
    WorldGoneError,
)
from .listener import Listener, listen
from .pose import Pose
from .simulator import Simulator, launch

if TYPE_CHECKING:
    from types import ModuleType

    from . import aio

__version__ = VERSION
#: Version and build, as ``omnibus --version`` prints them. A simulator of another build is refused.
__build__ = BUILD

__all__ = [
    "KEYPOINTS",
    "KEYPOINT_LINKS",
    "Blueprint",
    "BuildError",
    "Bundle",
    "Cancel",
    "CancelledError",
    "Client",
    "Frame",
    "FrameIncompleteError",
    "Keypoints",
    "LanePoint",
    "Listener",
    "Map",
    "Measurement",
    "NotAllowedError",
    "OmnibusError",
    "Pose",
    "Projection",
    "Reading",
    "Recorder",
    "RefusedError",
    "Settings",
    "Simulator",
    "SimulatorEndedError",
    "SimulatorTimeoutError",
    "Traffic",
    "ViewLimitError",
    "Weather",
    "World",
    "WorldGoneError",
    "__build__",
    "__version__",
    "aio",
    "carla_axes",
    "errors",
    "launch",
    "listen",
    "sensors",
]


def __getattr__(name: str) -> "ModuleType":
    """Imports ``omnibus.aio`` when it is first used: asyncio takes as long to import as NumPy."""
    if name == "aio":
        from importlib import import_module

        return import_module(".aio", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
