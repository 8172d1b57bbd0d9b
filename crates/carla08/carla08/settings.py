"""The settings of an episode."""

import configparser
import io
import random

from . import sensor

MAX_NUMBER_OF_WEATHER_IDS = 14


class CarlaSettings:
    """Names and defaults as in `CarlaSettings.ini`.

    `FixedDeltaSeconds` is ours: the length of a frame in synchronous mode, where 0.8 had
    `-benchmark -fps=N` on the server's command line. None keeps what the server has.
    """

    def __init__(self, **given):
        self.SynchronousMode = True
        self.SendNonPlayerAgentsInfo = False
        self.DisableRendering = False
        self.QualityLevel = "Epic"
        self.PlayerVehicle = None
        self.NumberOfVehicles = 20
        self.NumberOfPedestrians = 30
        self.WeatherId = 1
        self.SeedVehicles = None
        self.SeedPedestrians = None
        self.DisableTwoWheeledVehicles = False
        self.FixedDeltaSeconds = None
        self.set(**given)
        self._sensors = []

    def set(self, **given):
        """Changes attributes by name; raises ValueError for an unknown name."""
        for name, value in given.items():
            if name.startswith("_") or name not in self.__dict__:
                raise ValueError(f"CarlaSettings: no key named {name!r}")
            if name == "QualityLevel" and value not in ("Low", "Epic"):
                raise ValueError(f"QualityLevel is {value!r}, not 'Low' or 'Epic'")
            setattr(self, name, value)

    def randomize_seeds(self):
        """Randomizes the seeds of vehicles and pedestrians."""
        self.SeedVehicles = random.getrandbits(16)
        self.SeedPedestrians = random.getrandbits(16)

    def randomize_weather(self):
        """Selects a random one of the fifteen weathers."""
        self.WeatherId = random.randint(0, MAX_NUMBER_OF_WEATHER_IDS)

    def add_sensor(self, added):
        """Adds a camera or a lidar to the player vehicle."""
        if not isinstance(added, (sensor.Camera, sensor.Lidar)):
            raise ValueError(f"{added!r} is not a Camera or Lidar")
        if any(added.SensorName == known.SensorName for known in self._sensors):
            raise ValueError(f"there are two sensors named {added.SensorName!r}; rename one")
        self._sensors.append(added)

    @property
    def sensors(self):
        """Returns the sensors in the order in which they were added."""
        return list(self._sensors)

    SECTIONS = {
        "CARLA/Server": ("SynchronousMode", "SendNonPlayerAgentsInfo", "DisableRendering"),
        "CARLA/QualitySettings": ("QualityLevel",),
        "CARLA/LevelSettings": (
            "PlayerVehicle", "NumberOfVehicles", "NumberOfPedestrians", "WeatherId",
            "SeedVehicles", "SeedPedestrians", "DisableTwoWheeledVehicles"),
    }

    def __str__(self):
        """Returns the text of a `CarlaSettings.ini`."""
        ini = _parser()
        for section, names in self.SECTIONS.items():
            ini.add_section(section)
            for name in names:
                value = getattr(self, name)
                if value is not None:
                    text = str(value).lower() if isinstance(value, bool) else str(value)
                    ini.set(section, name, text)
        ini.add_section("CARLA/Sensor")
        ini.set("CARLA/Sensor", "Sensors", ",".join(s.SensorName for s in self._sensors))
        for added in self._sensors:
            section = f"CARLA/Sensor/{added.SensorName}"
            ini.add_section(section)
            for name, value in added.fields().items():
                ini.set(section, name, str(value))
        text = io.StringIO()
        ini.write(text)
        return text.getvalue()

    @classmethod
    def parse(cls, text):
        """Returns settings from the text of an ini file; unknown keys are ignored."""
        ini = _parser()
        try:
            ini.read_string(text)
        except configparser.Error as error:
            raise ValueError(f"settings: {error}") from error
        settings = cls()
        for section, names in cls.SECTIONS.items():
            for name in names:
                if ini.has_option(section, name):
                    settings.set(**{name: _value(ini.get(section, name))})
        listed = ini.get("CARLA/Sensor", "Sensors", fallback="")
        for name in filter(None, (part.strip() for part in listed.split(","))):
            section = f"CARLA/Sensor/{name}"
            if not ini.has_section(section):
                raise ValueError(f"settings: sensor {name!r} is listed, but [{section}] is missing")
            fields = {key: _value(text) for key, text in ini.items(section)}
            kind = fields.pop("SensorType", "CAMERA").upper()
            made = {"CAMERA": sensor.Camera, "LIDAR_RAY_CAST": sensor.Lidar}.get(kind)
            if made is None:
                raise ValueError(f"settings: SensorType of {name!r} is {kind!r}, not CAMERA or "
                                 "LIDAR_RAY_CAST")
            settings.add_sensor(made(name, **fields))
        return settings


def _parser():
    ini = configparser.ConfigParser(interpolation=None, inline_comment_prefixes=(";",))
    ini.optionxform = str
    return ini


def _value(text):
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            pass
    return text or None
