"""Checks of the classes that only hold values: their defaults, properties, operators and lists."""

import carla

import members
from ledger import LISTED, check, enter, local

# Another value than the default, for each type of property.
OTHERS = {
    carla.Location: carla.Location(1.0, 2.0, 3.0),
    carla.Vector3D: carla.Vector3D(1.0, 2.0, 3.0),
    carla.Rotation: carla.Rotation(1.0, 2.0, 3.0),
    carla.Transform: carla.Transform(carla.Location(1.0, 2.0, 3.0), carla.Rotation(yaw=4.0)),
    carla.Color: carla.Color(1, 2, 3),
    carla.VehicleControl: carla.VehicleControl(throttle=0.5),
    carla.VehicleAckermannControl: carla.VehicleAckermannControl(speed=0.5),
    carla.WalkerControl: carla.WalkerControl(speed=0.5),
    carla.VehiclePhysicsControl: carla.VehiclePhysicsControl(mass=1234.0),
}
# Lists of values; `torque_curve` and the like are given as plain lists.
LISTS = {
    "VehiclePhysicsControl.torque_curve": [carla.Vector2D(1.0, 2.0)],
    "VehiclePhysicsControl.steering_curve": [carla.Vector2D(1.0, 2.0)],
    "VehiclePhysicsControl.forward_gears": [carla.GearPhysicsControl(ratio=3.0)],
    "VehiclePhysicsControl.wheels": [carla.WheelPhysicsControl(radius=33.0)],
    "VehicleTelemetryData.wheels": [carla.WheelTelemetryData(omega=2.0)],
}
RECORDS = """
    AckermannControllerSettings CAMMessage CustomV2XData GearPhysicsControl LidarDetection
    LightState OpendriveGenerationParameters OpticalFlowPixel Osm2OdrSettings RadarDetection
    SemanticLidarDetection Timestamp VehicleAckermannControl VehicleControl VehiclePhysicsControl
    VehicleTelemetryData WalkerControl WeatherParameters WheelPhysicsControl WheelTelemetryData
    WorldSettings bone_transform bone_transform_out DVSEvent WalkerBoneControlOut
    command.ApplyAngularImpulse command.ApplyForce command.ApplyImpulse
    command.ApplyTargetAngularVelocity command.ApplyTargetVelocity command.ApplyTorque
    command.ApplyTransform command.ApplyVehicleAckermannControl command.ApplyVehicleControl
    command.ApplyVehiclePhysicsControl command.ApplyWalkerControl command.ApplyWalkerState
    command.DestroyActor command.SetAutopilot command.SetEnableGravity command.SetSimulatePhysics
    command.SetVehicleLightState command.ShowDebugTelemetry
""".split()
CONTAINERS = {
    carla.vector_of_bones: carla.bone_transform, carla.vector_of_bones_out: carla.bone_transform_out,
    carla.vector_of_gears: carla.GearPhysicsControl, carla.vector_of_ints: lambda: 0,
    carla.vector_of_transform: carla.Transform, carla.vector_of_vector2D: carla.Vector2D,
    carla.vector_of_wheels: carla.WheelPhysicsControl,
    carla.vector_of_wheels_telemetry: carla.WheelTelemetryData,
}


def other_than(member, value):
    """Returns another value of the type of `value`, exact in single precision."""
    if member in LISTS:
        return LISTS[member]
    if isinstance(value, bool):
        return not value
    if isinstance(value, members.ENUM):
        return next(one for one in type(value).values.values() if one != value)
    if isinstance(value, int):
        return type(value)(1 if value != 1 else 2)
    if isinstance(value, float) or value is None:
        return 0.5 if value != 0.5 else 0.25
    return "other" if isinstance(value, str) else OTHERS[type(value)]


def short(value):
    if isinstance(value, float):
        # The shortest text of a number in single precision.
        return f"{value:.7g}"
    if isinstance(value, list):
        return f"[{', '.join(map(short, value))}]"
    return f'"{value}"' if isinstance(value, str) else str(value)


def same(a, b):
    if isinstance(a, list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))
    return str(a) == str(b)


def properties(name):
    return [one[len(name) + 1:] for one, kind in LISTED.items()
            if one.startswith(f"{name}.") and kind == "property"]


def record(name, cls):
    """Checks constructor, properties and operators of a class of values."""
    untouched, uncompared = cls(), []
    operators = [one for one in ("__eq__", "__ne__", "__str__") if f"{name}.{one}" in LISTED]
    if "__eq__" in operators:
        assert cls() == untouched and not cls() != untouched, name
    for one in properties(name):
        # A property may be a reference into its value, which is therefore made again.
        value, default = cls(), getattr(untouched, one)
        other = other_than(f"{name}.{one}", default)
        setattr(value, one, other)
        read = getattr(value, one)
        assert same(read, other) and not same(read, default), f"{name}.{one}: {short(read)}"
        if "__eq__" in operators:
            assert (value != untouched) != (value == untouched)
            if value == untouched:
                uncompared.append(f"`{one}`")
        local(f"{name}.{one}", f"set and read; {short(default)} by default")
    local(name, "made without arguments")
    if "__eq__" in operators:
        local(f"{name}.__eq__ {name}.__ne__", "values are compared by every property"
              + (f" except {', '.join(uncompared)}" if uncompared else ""))
    if "__str__" in operators:
        text = str(untouched)
        assert text == str(cls()) and not text.startswith("<"), text
        local(f"{name}.__str__", f"`{text}`" if len(text) < 120 else f"`{text[:100]} …`")


@check
def records(c):
    for name, cls in members.classes():
        if name in RECORDS:
            record(name, cls)
    arm = carla.Transform(rotation=carla.Rotation(roll=30.0))
    bones = carla.WalkerBoneControlIn([("crl_arm__L", arm)])
    assert "crl_arm__L" in str(bones), str(bones)
    assert [one.name for one in bones.bone_transforms] == ["crl_arm__L"]
    bones.bone_transforms = [("crl_arm__R", arm), ("crl_arm__L", arm)]
    assert [one.name for one in bones.bone_transforms] == ["crl_arm__R", "crl_arm__L"]
    local("WalkerBoneControlIn.bone_transforms WalkerBoneControlIn.__str__",
          "set as a list of names and transforms, read as objects")


@check
def containers(c):
    for cls, element in CONTAINERS.items():
        name, values = cls.__name__, cls()
        one = element()
        values.append(one)
        values.extend([element(), element()])
        assert len(values) == 3 and len(list(values)) == 3
        values[1] = element()
        assert str(values[1]) == str(one) and one in values
        del values[0]
        assert len(values) == 2 and str(values).startswith("["), str(values)
        local(" ".join(member for member in LISTED if member.split(".")[0] == name),
              "behaves as a list")


@check
def documented_only(c):
    """What CARLA's documentation has and the package lacks."""
    package = dict(members.classes())
    for member, kind in LISTED.items():
        if kind == "documented":
            owner, name = member.rsplit(".", 1)
            absent = owner if owner not in package else member
            assert owner not in package or not hasattr(package[owner], name), member
            enter("absent", member, f"documented; the standard package has no `{absent}`")
