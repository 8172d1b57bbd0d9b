"""CARLA 0.8's Python classes on today's `carla` package.

Code of that time runs after `from carla.client import ...` has become
`from carla08.client import ...`; the names are also here, without their modules.
Locations are metres, angles degrees, in CARLA's left-handed space.
"""

from . import image_converter
from .client import CarlaClient, VehicleControl, make_carla_client
from .measurements import Control
from .sensor import Camera, Lidar
from .settings import CarlaSettings
from .tcp import TCPConnectionError
from .transform import Transform

__all__ = [
    "Camera",
    "CarlaClient",
    "CarlaSettings",
    "Control",
    "Lidar",
    "TCPConnectionError",
    "Transform",
    "VehicleControl",
    "image_converter",
    "make_carla_client",
]
