"""The client of 0.8: episodes of one player vehicle."""

import contextlib
import logging
import queue
import time

import carla

from . import measurements
from .autopilot import Autopilot
from .crowd import Crowd
from .listening import Listener, end_all
from .player import Player
from .settings import CarlaSettings
from .tcp import TCPConnectionError, told_as_connection_error, wait_for_server
from .util import make_connection

VehicleControl = measurements.Control

WEATHERS = (
    "Default", "ClearNoon", "CloudyNoon", "WetNoon", "WetCloudyNoon", "MidRainyNoon",
    "HardRainNoon", "SoftRainNoon", "ClearSunset", "CloudySunset", "WetSunset",
    "WetCloudySunset", "MidRainSunset", "HardRainSunset", "SoftRainSunset",
)

# The role of all actors of this module, by which those of a killed client are found.
ROLE = "carla08"

# Seconds of a frame if neither the settings nor the server define a length.
DELTA_SECONDS = 0.05


@contextlib.contextmanager
def make_carla_client(host, world_port=2000, timeout=15):
    """Yields a connected client; raises TCPConnectionError if there is no server."""
    with make_connection(CarlaClient, host, world_port, timeout) as client:
        yield client


class Scene:
    """The map and its start positions."""

    def __init__(self, map_name, player_start_spots, sensors):
        self.map_name = map_name
        self.player_start_spots = player_start_spots
        self.sensors = sensors


class CarlaClient:
    """Call load_settings and start_episode, then read_data and send_control in turns."""

    _manager_port = 8000

    def __init__(self, host, world_port=2000, timeout=15):
        self._host, self._port = host, world_port
        self._timeout = timeout or 15
        self._client = self.world = self.map = None
        self._settings = None
        self._before = None
        self._player = self._crowd = self.autopilot = None
        self._sensors = []
        self._started = 0.0
        self._frame = 0

    @told_as_connection_error
    def connect(self, connection_attempts=10):
        """Connects; retries once a second, up to `connection_attempts` times."""
        for attempt in range(connection_attempts):
            try:
                wait_for_server(self._host, self._port, self._timeout)
                break
            except TCPConnectionError:
                if attempt + 1 == connection_attempts:
                    raise
                time.sleep(1.0)
        self._client = carla.Client(self._host, self._port)
        self._client.set_timeout(float(self._timeout))
        self.world = self._client.get_world()
        self.map = self.world.get_map()

    def disconnect(self):
        """Destroys the actors of this client and restores the settings of the world."""
        if not self.connected():
            return
        try:
            self._end_episode()
            if self._before is not None:
                self.world.apply_settings(self._before)
        except RuntimeError as error:
            logging.debug("while disconnecting: %s", error)
            # The package caches its connection to a traffic manager by port until the process
            # ends. It is closed now; any other port leads to the manager of a new server.
            CarlaClient._manager_port += 1
        self._client = self.world = self.map = None
        self._settings = self._before = None

    def connected(self):
        """Returns whether the client is connected."""
        return self._client is not None

    @told_as_connection_error
    def load_settings(self, carla_settings):
        """Sets up an episode from CarlaSettings or the text of an ini file; returns the scene."""
        self._need_connection()
        if isinstance(carla_settings, CarlaSettings):
            self._settings = carla_settings
        else:
            self._settings = CarlaSettings.parse(str(carla_settings))
        self._end_episode()
        if self._before is None:
            self._before = self.world.get_settings()
            self._remove_left_behind()
        return self._scene()

    @told_as_connection_error
    def start_episode(self, player_start_index):
        """Starts an episode at a start position of the scene; may be called again."""
        self._need_connection()
        if self._settings is None:
            raise TCPConnectionError("call load_settings before start_episode")
        spots = self.map.get_spawn_points()
        if not 0 <= player_start_index < len(spots):
            raise ValueError(f"start position {player_start_index} is not 0 to {len(spots) - 1}")
        settings = self._settings
        self._end_episode()
        self._set_pace(settings)
        # Destroyed actors leave the world with the next frame.
        self._step()
        weather = WEATHERS[settings.WeatherId]
        self.world.set_weather(getattr(carla.WeatherParameters, weather))
        self._player = Player(self.world, self.map, settings.PlayerVehicle,
                              spots[player_start_index])
        self._crowd = Crowd(
            self._client, self.world, self.map, settings, spots, spots[player_start_index],
            self._manager_port)
        self.autopilot = Autopilot(self.map, self._player.actor, settings.SeedVehicles)
        self._sensors = [self._mount(added) for added in settings.sensors]
        self._started = self._step().timestamp.elapsed_seconds
        # The sensors measure from here on; the vehicle has settled on its wheels.
        self._player.forget_collisions()
        self._frame = 0

    @told_as_connection_error
    def read_data(self):
        """Returns the measurements of the next frame, and a dictionary of sensor data."""
        self._need_connection()
        if self._player is None:
            raise TCPConnectionError("call start_episode before read_data")
        snapshot = self._step()
        self._frame += 1
        others = self._crowd.others(snapshot)
        player = self._player.measure(snapshot)
        player.autopilot_control = self.autopilot.control(player, others)
        measured = measurements.Measurements(
            frame_number=self._frame,
            platform_timestamp=int(1000 * time.monotonic()),
            game_timestamp=int(round(
                1000 * (snapshot.timestamp.elapsed_seconds - self._started))),
            player_measurements=player)
        if self._settings.SendNonPlayerAgentsInfo:
            measured.non_player_agents = self._crowd.agents(snapshot, self._player.actor.id)
        return measured, self._sensor_data(snapshot.frame)

    @told_as_connection_error
    def send_control(self, *args, **kwargs):
        """Sends a control, or its fields by name, which holds until the next one."""
        self._need_connection()
        if self._player is None:
            raise TCPConnectionError("call start_episode before send_control")
        control = args[0] if args and not isinstance(args[0], (int, float)) else None
        if control is None:
            names = ("steer", "throttle", "brake", "hand_brake", "reverse")
            control = measurements.Control(**dict(zip(names, args)), **kwargs)
        self._player.actor.apply_control(carla.VehicleControl(
            throttle=min(max(float(control.throttle), 0.0), 1.0),
            steer=min(max(float(control.steer), -1.0), 1.0),
            brake=min(max(float(control.brake), 0.0), 1.0),
            hand_brake=bool(control.hand_brake),
            reverse=bool(control.reverse)))

    def _need_connection(self):
        if not self.connected():
            raise TCPConnectionError("not connected")

    def _scene(self):
        spots = [measurements.transform_of(spot) for spot in self.map.get_spawn_points()]
        name = self.map.name.rsplit("/", 1)[-1]
        return Scene(name, spots, self._settings.sensors)

    def _set_pace(self, settings):
        pace = self.world.get_settings()
        pace.synchronous_mode = bool(settings.SynchronousMode)
        pace.no_rendering_mode = bool(settings.DisableRendering)
        if settings.FixedDeltaSeconds:
            pace.fixed_delta_seconds = float(settings.FixedDeltaSeconds)
        elif settings.SynchronousMode and not (pace.fixed_delta_seconds or 0.0) > 1e-4:
            pace.fixed_delta_seconds = DELTA_SECONDS
        self.world.apply_settings(pace)

    def _step(self):
        """Advances the world by a frame in synchronous mode, otherwise waits for one."""
        if self._settings.SynchronousMode:
            frame = self.world.tick(float(self._timeout))
            snapshot = self.world.get_snapshot()
            while snapshot.frame < frame:
                snapshot = self.world.wait_for_tick(float(self._timeout))
            return snapshot
        return self.world.wait_for_tick(float(self._timeout))

    def _mount(self, added):
        name, attributes = added.blueprint()
        blueprint = self.world.get_blueprint_library().find(name)
        for key, value in attributes.items():
            blueprint.set_attribute(key, str(value))
        if blueprint.has_attribute("role_name"):
            blueprint.set_attribute("role_name", ROLE)
        pose = carla.Transform(
            carla.Location(added.PositionX, added.PositionY, added.PositionZ),
            carla.Rotation(added.RotationPitch, added.RotationYaw, added.RotationRoll))
        actor = self.world.spawn_actor(blueprint, pose, attach_to=self._player.actor)
        measured = queue.Queue()
        return added, Listener(actor, measured.put), measured

    def _sensor_data(self, frame):
        """Returns data of this frame in synchronous mode, otherwise the newest data."""
        found = {}
        for added, _, measured in self._sensors:
            data = None
            try:
                if self._settings.SynchronousMode:
                    while data is None or data.frame < frame:
                        data = measured.get(timeout=self._timeout)
                else:
                    data = measured.get(timeout=self._timeout if self._frame == 1 else 0.001)
                    while True:
                        data = measured.get_nowait()
            except queue.Empty:
                if self._settings.SynchronousMode:
                    raise TCPConnectionError(
                        f"sensor {added.SensorName!r} did not measure frame {frame} within "
                        f"{self._timeout} s") from None
            if data is not None:
                found[added.SensorName] = added.measurement(data, self._frame)
        return found

    def _end_episode(self):
        listeners = [listener for _, listener, _ in self._sensors]
        if self._player is not None:
            listeners.append(self._player.collisions)
        end_all(listeners)
        self._sensors = []
        for part in (self._crowd, self._player):
            if part is not None:
                part.destroy()
        self._crowd = self._player = self.autopilot = None

    def _remove_left_behind(self):
        for actor in self.world.get_actors():
            if actor.attributes.get("role_name") == ROLE:
                actor.destroy()
