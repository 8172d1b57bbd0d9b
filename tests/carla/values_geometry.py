"""Checks of vectors, transforms, boxes and colours, which the package computes itself."""

import math

import carla

from effects_kit import near
from ledger import check, local, works

VECTORS = {carla.Vector2D: "xy", carla.Vector3D: "xyz", carla.Location: "xyz"}


def close(vector, *numbers):
    for axis, number in zip("xyz", numbers):
        near(getattr(vector, axis), number, 1e-4)


def fails(error, call):
    try:
        call()
    except error:
        return
    raise AssertionError(f"no {error.__name__}")


@check
def vectors(c):
    for cls, axes in VECTORS.items():
        name = cls.__name__
        one, same = cls(*range(1, len(axes) + 1)), cls(*range(1, len(axes) + 1))
        assert all(getattr(cls(), axis) == 0.0 for axis in axes)
        assert one == same and not one != same
        for axis in axes:
            value = cls()
            setattr(value, axis, 0.1)
            # Coordinates have single precision.
            assert getattr(value, axis) != 0.1 and abs(getattr(value, axis) - 0.1) < 1e-8
            assert value != cls()
        assert str(one).startswith(f"{name}(x=1.000000, y=2.000000"), str(one)
        local(" ".join(f"{name}.{axis}" for axis in axes),
              "set and read with single precision; 0 by default")
        local(f"{name} {name}.__eq__ {name}.__ne__ {name}.__str__",
              f"values are compared by their coordinates; printed as `{one}`")
    for cls in (carla.Vector2D, carla.Vector3D):
        name, axes = cls.__name__, VECTORS[cls]
        a, b = cls(3.0, 4.0), cls(1.0, 2.0)
        close(a + b, 4, 6)
        close(a - b, 2, 2)
        close(a * 2.0, 6, 8)
        close(2.0 * a, 6, 8)
        close(a / 2.0, 1.5, 2.0)
        close(a.__rtruediv__(2.0), 1.5, 2.0)
        # A name of Python 2, which no expression of Python 3 calls.
        close(cls(3.0, 4.0).__idiv__(2.0), 1.5, 2.0)
        total = cls(3.0, 4.0)
        kept = total
        total += b
        total -= cls(1.0, 1.0)
        total *= 2.0
        assert total is kept
        close(total, 6, 10)
        assert a.length() == 5.0 and a.squared_length() == 25.0
        close(a.make_unit_vector(), 0.6, 0.8)
        fails(RuntimeError, cls().make_unit_vector)
        local(f"{name}.__add__ {name}.__sub__ {name}.__mul__ {name}.__rmul__ {name}.__truediv__ "
              f"{name}.__rtruediv__ {name}.__idiv__",
              "by coordinate; a number may stand on either side, and `2.0 / v` is `v / 2.0`")
        local(f"{name}.__iadd__ {name}.__isub__ {name}.__imul__", "the vector was changed in place")
        local(f"{name}.length {name}.squared_length {name}.make_unit_vector",
              "(3, 4) has the length 5; a zero vector raises RuntimeError")
    a, b = carla.Vector3D(3.0, 4.0, 12.0), carla.Vector3D(1.0, 2.0, 2.0)
    close(abs(carla.Vector3D(-1.0, 2.0, -3.0)), 1, 2, 3)
    close(abs(carla.Location(-1.0, 2.0, -3.0)), 1, 2, 3)
    close(a.cross(b), -16, 6, 2)
    assert a.dot(b) == 35.0 and a.dot_2d(b) == 11.0
    near(a.distance(b), math.sqrt(4 + 4 + 100), 1e-5)
    near(a.distance_2d(b), math.sqrt(8), 1e-6)
    assert a.distance_squared(b) == 108.0 and a.distance_squared_2d(b) == 8.0
    near(carla.Vector3D(1.0).get_vector_angle(carla.Vector3D(0.0, 2.0)), math.pi / 2, 1e-6)
    local("Vector3D.__abs__ Location.__abs__", "the magnitude of each coordinate")
    local("Vector3D.cross Vector3D.dot Vector3D.dot_2d Vector3D.get_vector_angle",
          "products of two vectors; the angle is in radians")
    local("Vector3D.distance Vector3D.distance_2d Vector3D.distance_squared "
          "Vector3D.distance_squared_2d", "in metres; `2d` leaves out z")
    here, there = c.points[0].location, c.points[1].location
    near(here.distance(there), math.dist((here.x, here.y, here.z), (there.x, there.y, there.z)), 1e-3)
    assert type(here + there) is carla.Vector3D and type(here - there) is carla.Vector3D
    near(here.distance(here + carla.Location(z=2.0)), 2.0, 1e-4)
    works("Location.distance", "metres between two spawn points of the server; accepts a Vector3D")


def matrix(transform):
    """Returns the matrix of a transform, from CARLA's definition of its angles."""
    p, y, r = (math.radians(angle) for angle in
               (transform.rotation.pitch, transform.rotation.yaw, transform.rotation.roll))
    cp, sp, cy, sy, cr, sr = (f(a) for a in (p, y, r) for f in (math.cos, math.sin))
    at = transform.location
    return [[cp * cy, cy * sp * sr - sy * cr, -cy * sp * cr - sy * sr, at.x],
            [cp * sy, sy * sp * sr + cy * cr, -sy * sp * cr + cy * sr, at.y],
            [sp, -cp * sr, cp * cr, at.z],
            [0.0, 0.0, 0.0, 1.0]]


def times(rows, point, w):
    return [sum(a * b for a, b in zip(row, (point.x, point.y, point.z, w))) for row in rows[:3]]


@check
def transforms(c):
    turn = carla.Rotation(pitch=10.0, yaw=20.0, roll=30.0)
    assert carla.Rotation(10.0, 20.0, 30.0) == turn and carla.Rotation() != turn
    turn.pitch, turn.yaw, turn.roll = turn.pitch + 1.0, turn.yaw + 1.0, turn.roll + 1.0
    assert (turn.pitch, turn.yaw, turn.roll) == (11.0, 21.0, 31.0)
    place = carla.Transform(carla.Location(1.0, 2.0, 3.0), turn)
    rows = matrix(place)
    for column, direction in enumerate(("forward", "right", "up")):
        for one in (turn, place):
            close(getattr(one, f"get_{direction}_vector")(), *[row[column] for row in rows])
    assert str(turn) == "Rotation(pitch=11.000000, yaw=21.000000, roll=31.000000)", str(turn)
    for name in ("Rotation", "Transform"):
        local(f"{name}.get_forward_vector {name}.get_right_vector {name}.get_up_vector",
              "the axes x, y and z of CARLA's left-handed space")
    local("Rotation Rotation.pitch Rotation.yaw Rotation.roll Rotation.__eq__ Rotation.__ne__ "
          "Rotation.__str__", f"degrees, in the order pitch, yaw, roll; printed as `{turn}`")
    point = carla.Location(4.0, -5.0, 6.0)
    for transform, w in ((place.transform, 1.0), (place.transform_vector, 0.0)):
        given = carla.Location(4.0, -5.0, 6.0)
        # The package also changes the point that it is given.
        assert transform(given) == given
        close(given, *times(rows, point, w))
    moved = carla.Location(*times(rows, point, 1.0))
    close(place.inverse_transform(moved), 4, -5, 6)
    points = [carla.Location(4.0, -5.0, 6.0)]
    assert place.transform(points) is None
    close(points[0], *times(rows, point, 1.0))
    for computed, expected in zip(place.get_matrix(), rows):
        assert all(abs(a - b) < 1e-5 for a, b in zip(computed, expected)), (computed, expected)
    back = place.get_inverse_matrix()
    close(point, *times(back, carla.Location(*times(rows, point, 1.0)), 1.0))
    local("Transform.transform Transform.transform_vector Transform.inverse_transform",
          "a point with the translation, a vector without it, and back; the argument, a point or "
          "a list of points, is changed too")
    local("Transform.get_matrix Transform.get_inverse_matrix",
          "four rows of four numbers, equal to CARLA's formula within 1e-5")
    other = carla.Transform()
    assert other != place
    other.location, other.rotation = place.location, place.rotation
    assert other == place
    other.location.x = 9.0
    assert other.location.x == 9.0 and place.location.x == 1.0
    assert str(place).startswith("Transform(Location(x=1.000000"), str(place)
    local("Transform Transform.location Transform.rotation Transform.__eq__ Transform.__ne__ "
          "Transform.__str__", "the location is a reference: `t.location.x = 9` changes `t`")


@check
def boxes(c):
    box = carla.BoundingBox(carla.Location(1.0, 0.0, 0.5), carla.Vector3D(2.0, 1.0, 0.5))
    assert box == carla.BoundingBox(box.location, box.extent) and box != carla.BoundingBox()
    box.rotation = carla.Rotation(yaw=90.0)
    assert box.rotation.yaw == 90.0 and str(box).startswith("BoundingBox(Location(x=1.0"), str(box)
    corners = box.get_local_vertices()
    assert len(corners) == 8
    # The box is turned in its own place: 2 m half length along y.
    near(max(corner.y for corner in corners), 2.0, 1e-5)
    near(max(corner.x for corner in corners), 2.0, 1e-5)
    place = carla.Transform(carla.Location(100.0, 0.0, 0.0), carla.Rotation(yaw=90.0))
    there = box.get_world_vertices(place)
    near(max(corner.y for corner in there), 2.0, 1e-4)
    near(max(corner.x for corner in there), 102.0, 1e-4)
    assert box.contains(carla.Location(100.0, 1.0, 0.5), place)
    assert not box.contains(carla.Location(103.0, 1.0, 0.5), place)
    assert box.actor_id == 0
    box.location, box.extent = carla.Location(z=1.0), carla.Vector3D(1.0, 1.0, 1.0)
    assert box.location.z == 1.0 == box.extent.x
    local("BoundingBox BoundingBox.rotation BoundingBox.__eq__ BoundingBox.__ne__ "
          "BoundingBox.__str__ BoundingBox.get_local_vertices BoundingBox.get_world_vertices "
          "BoundingBox.contains BoundingBox.actor_id", "eight corners, in the space of the actor and of the world")
    car = c.car()
    mine = car.bounding_box
    assert 1.8 < mine.extent.x < 3.0 and 0.5 < mine.location.z < 1.2
    near(mine.location.z, mine.extent.z, 0.1)
    works("BoundingBox.location BoundingBox.extent",
          "the vehicle's box stood on the ground; half sizes in metres")
    car.destroy()


@check
def places_and_colours(c):
    place = carla.GeoLocation(latitude=1.0, longitude=2.0, altitude=3.0)
    assert place == carla.GeoLocation(1.0, 2.0, 3.0) and place != carla.GeoLocation()
    place.latitude, place.longitude, place.altitude = 49.0, 8.0, 110.5
    assert (place.latitude, place.longitude, place.altitude) == (49.0, 8.0, 110.5)
    assert str(place) == "GeoLocation(latitude=49.000000, longitude=8.000000, altitude=110.500000)"
    local("GeoLocation GeoLocation.latitude GeoLocation.longitude GeoLocation.altitude "
          "GeoLocation.__eq__ GeoLocation.__ne__ GeoLocation.__str__",
          f"degrees and metres with double precision; printed as `{place}`")
    colour = carla.Color(1, 2, 3)
    assert (colour.r, colour.g, colour.b, colour.a) == (1, 2, 3, 255)
    colour.r, colour.g, colour.b, colour.a = 4, 5, 6, 7
    assert colour == carla.Color(4, 5, 6, 7) and colour != carla.Color()
    assert str(colour) == "Color(4,5,6,7)", str(colour)
    fails(OverflowError, lambda: carla.Color(256, 0, 0))
    local("Color Color.r Color.g Color.b Color.a Color.__eq__ Color.__ne__ Color.__str__",
          "whole numbers from 0 to 255, opaque by default; 256 raises OverflowError")
    light = carla.FloatColor(0.5, 0.25, 0.125)
    assert (light.r, light.g, light.b, light.a) == (0.5, 0.25, 0.125, 1.0)
    light.r, light.g, light.b, light.a = 2.0, 3.0, 4.0, 0.5
    assert light == carla.FloatColor(2.0, 3.0, 4.0, 0.5) and light != carla.FloatColor()
    local("FloatColor FloatColor.r FloatColor.g FloatColor.b FloatColor.a FloatColor.__eq__ "
          "FloatColor.__ne__", "single precision, opaque by default")
