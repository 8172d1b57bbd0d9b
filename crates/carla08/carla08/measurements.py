"""The result of `CarlaClient.read_data`: plain classes with the fields of 0.8's messages."""


class Record:
    """Fields with defaults; prints like a message."""

    FIELDS = {}

    def __init__(self, **given):
        for name, make in self.FIELDS.items():
            setattr(self, name, given.pop(name) if name in given else make())
        if given:
            raise ValueError(f"{type(self).__name__} has no field {sorted(given)[0]!r}")

    def __str__(self):
        lines = []
        for name in self.FIELDS:
            value = getattr(self, name)
            if isinstance(value, Record):
                inner = str(value).replace("\n", "\n  ")
                lines.append(f"{name} {{\n  {inner}\n}}")
            else:
                lines.append(f"{name}: {value}")
        return "\n".join(lines)

    __repr__ = __str__


class Vector3D(Record):
    """A vector, in metres unless the field defines another unit."""

    FIELDS = {"x": float, "y": float, "z": float}


class Rotation3D(Record):
    """Degrees."""

    FIELDS = {"pitch": float, "yaw": float, "roll": float}


class Transform(Record):
    """A pose; `orientation` is the forward unit vector."""

    FIELDS = {"location": Vector3D, "orientation": Vector3D, "rotation": Rotation3D}


class BoundingBox(Record):
    """Half extents in metres, around a centre in the space of the actor."""

    FIELDS = {"transform": Transform, "extent": Vector3D}


class Control(Record):
    """A control; steering is positive to the right."""

    FIELDS = {"steer": float, "throttle": float, "brake": float, "hand_brake": bool,
              "reverse": bool}


class PlayerMeasurements(Record):
    """The player vehicle: m/s, m/s^2, collisions in kg m/s since the episode began."""

    FIELDS = {
        "transform": Transform,
        "bounding_box": BoundingBox,
        "acceleration": Vector3D,
        "forward_speed": float,
        "collision_vehicles": float,
        "collision_pedestrians": float,
        "collision_other": float,
        "intersection_otherlane": float,
        "intersection_offroad": float,
        "autopilot_control": Control,
    }


class Vehicle(Record):
    """A vehicle; forward speed in m/s."""

    FIELDS = {"transform": Transform, "bounding_box": BoundingBox, "forward_speed": float}


class Pedestrian(Vehicle):
    """A pedestrian; forward speed in m/s."""


class TrafficLight(Record):
    """A traffic light and its state."""

    GREEN, YELLOW, RED = 0, 1, 2
    FIELDS = {"transform": Transform, "bounding_box": BoundingBox, "state": int}


class SpeedLimitSign(Record):
    """A speed limit sign; the limit in m/s."""

    FIELDS = {"transform": Transform, "speed_limit": float}


class Agent:
    """A non-player agent, which has exactly one of four kinds."""

    KINDS = ("vehicle", "pedestrian", "traffic_light", "speed_limit_sign")

    def __init__(self, ident, kind, what):
        self.id = ident
        self._kind = kind
        setattr(self, kind, what)

    def HasField(self, kind):  # pylint: disable=invalid-name
        """Returns whether the agent is of this kind."""
        return kind == self._kind

    def WhichOneof(self, _group="agent"):  # pylint: disable=invalid-name
        """Returns the kind of the agent."""
        return self._kind


class Measurements(Record):
    """One frame; time stamps in milliseconds."""

    FIELDS = {
        "frame_number": int,
        "platform_timestamp": int,
        "game_timestamp": int,
        "player_measurements": PlayerMeasurements,
        "non_player_agents": list,
    }


def transform_of(pose):
    """Converts a `carla.Transform`."""
    ahead = pose.get_forward_vector()
    turn = pose.rotation
    return Transform(
        location=vector_of(pose.location),
        orientation=vector_of(ahead),
        rotation=Rotation3D(pitch=turn.pitch, yaw=turn.yaw, roll=turn.roll))


def vector_of(vector):
    """Converts a `carla.Vector3D`."""
    return Vector3D(x=vector.x, y=vector.y, z=vector.z)


def box_of(box):
    """Converts a `carla.BoundingBox`."""
    return BoundingBox(
        transform=Transform(location=vector_of(box.location)), extent=vector_of(box.extent))
