"""Checks of the map: waypoints, lanes, markings, junctions, signs and road marks."""

import os
import shutil
import tempfile

import carla

import made_map
from effects_kit import near
from effects_world import update_context
from ledger import LISTED, check, works


@check
def waypoints(c):
    start = next(one for one in c.map.generate_waypoints(5.0)
                 if not one.is_junction and len(one.next_until_lane_end(2.0)) > 10
                 and len(one.previous_until_lane_start(2.0)) > 10)
    # The lanes to the right have negative ids, and their s grows along the way.
    sign = -1 if start.lane_id > 0 else 1
    for step, sense in ((start.next, 1), (start.previous, -1)):
        point = step(4.0)[0]
        near(point.transform.location.distance(start.transform.location), 4.0, 0.1)
        near(sense * sign * (point.s - start.s), 4.0, 0.01)
        assert (point.road_id, point.section_id, point.lane_id) == \
            (start.road_id, start.section_id, start.lane_id)
    ahead, behind = start.next_until_lane_end(2.0), start.previous_until_lane_start(2.0)
    for points in (ahead, behind):
        gaps = [a.transform.location.distance(b.transform.location)
                for a, b in zip(points, points[1:-1])]
        assert all(1.7 < gap < 2.3 for gap in gaps), gaps
        assert {point.lane_id for point in points[:-1]} == {start.lane_id}
    same = c.map.get_waypoint_xodr(start.road_id, start.lane_id, start.s)
    assert same.id == start.id and same.transform.location == start.transform.location
    assert c.map.get_waypoint_xodr(9999, 1, 0.0) is None
    for call in (start.next, start.previous):
        try:
            call(0.0)
            raise AssertionError("0 m is accepted")
        except RuntimeError as error:
            assert "distance > 0.0" in str(error), error
    assert start.junction_id == -1 and start.get_junction() is None
    assert 2.5 < start.lane_width < 5.0 and start.is_rht
    assert "Waypoint(" in str(start) and "Map(name=" in str(c.map)
    works("Waypoint.previous Waypoint.next_until_lane_end Waypoint.previous_until_lane_start "
          "Waypoint.s Waypoint.road_id Waypoint.section_id Waypoint.lane_id Waypoint.lane_width "
          "Waypoint.is_rht Waypoint.__str__ Map.__str__ Map.generate_waypoints",
          "equal steps along the lane; a step of 0 m raises RuntimeError")
    works("Map.get_waypoint_xodr Waypoint.id",
          "the same waypoint by road, lane and s; none for an unknown road")
    inside = next(one for one in c.map.generate_waypoints(2.0) if one.is_junction)
    junction = inside.get_junction()
    assert junction.id == inside.junction_id != -1 and inside.is_intersection
    box, place = junction.bounding_box, inside.transform.location
    assert abs(place.x - box.location.x) < box.extent.x + 3.0, (place, box)
    assert abs(place.y - box.location.y) < box.extent.y + 3.0, (place, box)
    pairs = junction.get_waypoints(carla.LaneType.Driving)
    assert len(pairs) > 1 and all(one.is_junction for pair in pairs for one in pair)
    works("Waypoint.is_junction Waypoint.is_intersection Waypoint.junction_id "
          "Waypoint.get_junction Junction.id Junction.bounding_box Junction.get_waypoints",
          "a waypoint inside a junction, in the junction's box; the ends of its lanes")
    corners = c.map.get_crosswalks()
    assert len(corners) % 5 == 0 and corners[0] == corners[4]
    works("Map.get_crosswalks", "closed outlines of five corners")
    place = c.points[0].location
    there = c.map.transform_to_geolocation(place)
    back = c.map.geolocation_to_transform(there)
    near(back.distance(place), 0.0, 0.2)
    works("Map.geolocation_to_transform", "the inverse of `transform_to_geolocation`")
    folder = tempfile.mkdtemp()
    c.map.save_to_disk(os.path.join(folder, "town.xodr"))
    with open(os.path.join(folder, "town.xodr")) as file:
        assert file.read().rstrip() == c.map.to_opendrive().rstrip()
    c.map.cook_in_memory_map(os.path.join(folder, "town.bin"))
    assert os.path.getsize(os.path.join(folder, "town.bin")) > 10000
    shutil.rmtree(folder)
    works("Map.save_to_disk Map.cook_in_memory_map", "the map's text, and the package's cache of it")
    offline = carla.Map("offline", c.map.to_opendrive())
    assert offline.name == "offline" and not offline.get_spawn_points()
    assert len(offline.get_topology()) == len(c.map.get_topology())
    works("Map", "made from a text without a server, and therefore without spawn points")


@check
def lights_and_signs_of_landmarks(c):
    """Actors of landmarks, waypoints and junctions."""
    lights = {one.get_opendrive_id(): one for one in
              c.world.get_actors().filter("traffic.traffic_light*")}
    name, light = next(iter(lights.items()))
    landmark = c.map.get_all_landmarks_from_id(name)[0]
    assert landmark.type == "1000001" and landmark.is_dynamic
    assert c.world.get_traffic_light(landmark).id == light.id
    assert c.world.get_traffic_light_from_opendrive_id(name).id == light.id
    assert c.world.get_traffic_light_from_opendrive_id("none") is None
    works("World.get_traffic_light World.get_traffic_light_from_opendrive_id",
          "the light of the landmark; none for an unknown id")
    speed = next(one for one in c.map.get_all_landmarks() if one.type == "274")
    sign = c.world.get_traffic_sign(speed)
    assert sign.type_id == f"traffic.speed_limit.{speed.value:.0f}", (sign, speed.value)
    assert sign.get_location().distance(speed.transform.location) < 4.0
    works("World.get_traffic_sign", "the speed limit of the landmark, at its place")
    stop = light.get_stop_waypoints()[0]
    before = stop.previous(10.0)[0]
    found = {one.id for one in c.world.get_traffic_lights_from_waypoint(before, 50.0)}
    assert light.id in found, (light.id, found)
    far = {one.id for one in c.world.get_traffic_lights_from_waypoint(before, 1.0)}
    assert light.id not in far, far
    works("World.get_traffic_lights_from_waypoint",
          "the light 10 m ahead within 50 m, not within 1 m")
    inside = stop
    while not inside.is_junction:
        inside = inside.next(1.0)[0]
    group = {one.id for one in c.world.get_traffic_lights_in_junction(inside.junction_id)}
    assert group == {one.id for one in light.get_group_traffic_lights()}, group
    works("World.get_traffic_lights_in_junction", "all lights of the junction")
    seen = before.get_landmarks(60.0)
    assert name in [one.id for one in seen] and all(0.0 <= one.distance <= 60.0 for one in seen)
    assert [one.id for one in before.get_landmarks_of_type(60.0, "1000001")] == \
        [one.id for one in seen if one.type == "1000001"]
    assert not before.get_landmarks_of_type(60.0, "206", True)
    works("Waypoint.get_landmarks Waypoint.get_landmarks_of_type Landmark.distance",
          "the light ahead, and its distance along the way")
    ways = {one.id for one in c.map.get_landmark_group(landmark)}
    assert name in ways, ways
    works("Map.get_landmark_group Map.get_all_landmarks_from_id",
          "the landmarks of the light's controller")


@check
def every_lane_and_sign(c):
    """A map that has every lane type, marking and sign."""
    text = made_map.text()
    c.world = c.client.generate_opendrive_world(text)
    update_context(c)
    assert c.map.to_opendrive() == text
    types, middle = carla.LaneType, made_map.LENGTH_M / 2
    lanes = {-1 - i: kind for i, kind in enumerate(made_map.RIGHT)}
    lanes.update({1 + i: kind for i, kind in enumerate(made_map.LEFT)})
    by_name = {name.lower(): value for name, value in types.names.items()}
    for number, kind in lanes.items():
        place = carla.Location(middle, -made_map.WIDTH_M * (number - (0.5 if number > 0 else -0.5)))
        expected = by_name[kind.lower()]
        point = c.map.get_waypoint(place, True, expected)
        if expected == types.NONE:
            # The package does not look for these lanes.
            assert point is None
            point = c.map.get_waypoint_xodr(1, number, middle)
        assert point.lane_id in (number, -1) if kind == "driving" else point.lane_id == number
        assert point.lane_type == expected and point.lane_width == made_map.WIDTH_M
        works(f"LaneType.{expected}", "the lane of this type was found by road and lane id only"
              if expected == types.NONE else "the lane of this type was found among all others")
        if expected != types.NONE:
            # No lane of the type `NONE` is found by `Any`.
            assert c.map.get_waypoint(place, True, types.Any).lane_id == number
    works("LaneType.Any", "the nearest lane of any type except `NONE`")
    works("Waypoint.lane_type", "as in the map, for each type")
    assert c.map.get_waypoint(carla.Location(middle, 200.0), False) is None
    kinds = {kind: value for kind, value in zip(
        made_map.MARKINGS, "Broken Solid SolidSolid SolidBroken BrokenSolid BrokenBroken BottsDots "
                           "Grass Curb Other NONE".split())}
    names = {"white": "White", "orange": "Other", "standard": "Standard"}
    for i, marking in enumerate(made_map.MARKINGS):
        point = c.map.get_waypoint_xodr(1, -1 - i, middle)
        line = point.right_lane_marking
        colour = names.get(made_map.colour(i), made_map.colour(i).capitalize())
        assert line.type == carla.LaneMarkingType.names[kinds[marking]], (line.type, marking)
        assert line.color == carla.LaneMarkingColor.names[colour], (line.color, colour)
        change = {"both": "Both", "increase": "Right", "decrease": "Left", "none": "NONE"}
        expected = change[made_map.change(i)]
        assert str(line.lane_change) == expected, (i, line.lane_change, expected)
        near(line.width, 0.2, 1e-6)
        works(f"LaneMarkingType.{kinds[marking]}", f"`{marking}` of the map")
        works(f"LaneMarkingColor.{colour}", f"`{made_map.colour(i)}` of the map")
        works(f"LaneChange.{expected}", f"`{made_map.change(i)}` of the map")
        if i:
            left = point.left_lane_marking
            assert left.type == c.map.get_waypoint_xodr(1, -i, middle).right_lane_marking.type
            assert point.get_left_lane().lane_id == -i
    assert c.map.get_waypoint_xodr(1, -1, middle).left_lane_marking.color == \
        carla.LaneMarkingColor.Yellow
    assert c.map.get_waypoint_xodr(1, -1, middle).get_left_lane().lane_id == 1
    assert c.map.get_waypoint_xodr(1, -1, middle).get_right_lane().lane_id == -2
    assert c.map.get_waypoint_xodr(1, -11, middle).get_right_lane() is None
    assert str(c.map.get_waypoint_xodr(1, -2, middle).lane_change) == "Both"
    works("Waypoint.right_lane_marking Waypoint.left_lane_marking LaneMarking.type "
          "LaneMarking.color LaneMarking.lane_change LaneMarking.width", "as in the map")
    works("Waypoint.get_left_lane Waypoint.get_right_lane Waypoint.lane_change",
          "the neighbours, of the other direction too; none beside the last lane")
    signs(c)
    road_marks(c)


def signs(c):
    found = c.map.get_all_landmarks()
    assert len(found) == len(made_map.SIGNS)
    for i, (one, name) in enumerate(zip(sorted(found, key=lambda one: one.s), made_map.SIGNS)):
        at, orientation = made_map.SPACING_M * (i + 1), list(made_map.ORIENTATIONS.values())[i % 3]
        assert (one.id, one.name, one.text) == (f"s{i}", name, name), one
        assert (one.road_id, one.s, one.t, one.z_offset) == (1, at, -4.0, 2.5)
        assert (one.country, one.sub_type, one.unit) == ("OpenDRIVE", "7", "km/h")
        assert (one.value, one.height, one.width) == (30.0 + i, 0.75, 0.5)
        assert (one.h_offset, one.pitch, one.roll) == (0.25, 0.125, 0.0625)
        assert int(one.orientation) == orientation and not one.is_dynamic
        place = one.transform.location
        assert abs(place.x - at) < 1e-3 and abs(place.y - 4.0) < 1e-3 and abs(place.z - 2.5) < 1e-3
        assert one.get_lane_validities() == [(-2, -1)], one.get_lane_validities()
        number = getattr(carla.LandmarkType, name)
        assert one.type == number
        assert [other.id for other in c.map.get_all_landmarks_of_type(number)] == [one.id]
        works(f"LandmarkType.{name}", f"the sign {number} of the map was found by this type")
        works(f"LandmarkOrientation.{carla.LandmarkOrientation.values[orientation]}",
              "as in the map")
    works("Map.get_all_landmarks Map.get_all_landmarks_of_type Landmark.get_lane_validities "
          + " ".join(f"Landmark.{name}" for name in (
              "id name text road_id s t z_offset country type sub_type unit value height width "
              "h_offset pitch roll orientation is_dynamic transform").split()), "as in the map")
    ahead = c.map.get_waypoint_xodr(1, -1, 5.0).get_landmarks(12.0)
    assert [one.id for one in ahead] == ["s0"] and ahead[0].waypoint.road_id == 1
    near(ahead[0].waypoint.s, 10.0, 0.1)
    works("Landmark.waypoint", "the waypoint beside the sign, for signs found from a waypoint")
    for name, type_id in (("StopSign", "traffic.stop"), ("YieldSign", "traffic.yield"),
                          ("MaximumSpeed", "traffic.speed_limit.")):
        sign = c.map.get_all_landmarks_of_type(getattr(carla.LandmarkType, name))[0]
        actor = c.world.get_traffic_sign(sign)
        assert actor is not None and actor.type_id.startswith(type_id), (name, actor)
        assert actor.get_location().distance(sign.transform.location) < 4.0
        works(f"LandmarkType.{name}", f"the sign was found by this type; an actor `{type_id}`")


def road_marks(c):
    found = {one.id: one for one in c.map.get_all_road_marks()}
    assert sorted(found) == ["m1", "m2", "m3"]
    one = found["m1"]
    assert (one.name, one.type, one.road_id) == ("Stencil_ArrowType1", "ArrowType1", 1)
    assert (one.s, one.t, one.z_offset, one.length, one.width) == (50.0, -1.5, 0.5, 2.0, 1.0)
    assert (one.heading, one.pitch, one.roll, one.distance) == (0.25, 0.125, 0.0625, 0.0)
    assert one.transform.location.distance(carla.Location(50.0, 1.5, 0.5)) < 1e-3
    assert one.waypoint is None
    assert [mark.id for mark in c.map.get_road_marks_from_id("m2")] == ["m2"]
    assert [mark.id for mark in c.map.get_all_road_marks_of_type("ArrowType3")] == ["m3"]
    for mark, name in (("m1", "Positive"), ("m2", "Negative"), ("m3", "Both")):
        assert str(found[mark].orientation) == name
        works(f"RoadMarkOrientation.{name}", "as in the map")
    works("Map.get_all_road_marks Map.get_road_marks_from_id Map.get_all_road_marks_of_type "
          + " ".join(one for one in LISTED if one.startswith("RoadMark.")),
          "objects of the map whose names begin with `Stencil_`, as in the map")
