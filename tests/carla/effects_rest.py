"""Checks of what remains: files of maps, wheels, signal states, walkers that walk by themselves."""

import os
import shutil
import tempfile

import carla

from effects_kit import near
from ledger import check, differs, ignored, local, refuses, works

OSM = """<osm version="0.6">
<node id="1" lat="49.0" lon="8.0"/><node id="2" lat="49.001" lon="8.0"/>
<node id="3" lat="49.001" lon="8.002"/>
<way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/>
<tag k="highway" v="residential"/></way></osm>"""


@check
def files_of_maps(c):
    folder = tempfile.mkdtemp()
    assert c.client.set_files_base_folder(folder)
    files = list(c.client.get_required_files("", False))
    assert [name.split("/")[2] for name in files] == ["OpenDrive", "Nav"], files
    assert list(c.client.get_required_files("Nav", False)) == files[1:]
    assert list(c.client.get_required_files("TM", False)) == []
    c.client.request_file(files[0])
    stored = {os.path.join(at, name): name for at, _, names in os.walk(folder) for name in names}
    assert [f"Carla/Maps/OpenDrive/{name}" for name in stored.values()] == files[:1], stored
    with open(next(iter(stored)), encoding="utf-8") as text:
        assert text.read() == c.map.to_opendrive()
    works("Client.set_files_base_folder Client.request_file",
          "the map's text was stored below the given folder")
    differs("Client.get_required_files", "the map's text and its navigation mesh; CARLA's third "
            "file is a cache of its own traffic manager")
    refuses("unknown file",
            {"Client.request_file:unknown": lambda: c.client.request_file("Town01.bin")})
    # The package has no call that returns to its own folder; nothing is read from this one.
    c.client.set_files_base_folder(os.environ["CARLA_CACHE_DIR"])
    shutil.rmtree(folder)


@check
def open_street_map(c):
    settings = carla.Osm2OdrSettings()
    settings.set_osm_way_types(["residential"])
    settings.set_traffic_light_excluded_way_types(["motorway_link"])
    settings.center_map = True
    text = carla.Osm2Odr.convert(OSM, settings)
    assert text.lstrip().startswith("<?xml") and "<road " in text, text[:300]
    roads = carla.Map("converted", text)
    assert len(roads.get_topology()) > 0
    local("Osm2Odr.convert Osm2OdrSettings.set_osm_way_types "
          "Osm2OdrSettings.set_traffic_light_excluded_way_types",
          "an OpenDRIVE map of the streets of a small text")
    settings.set_osm_way_types(["motorway"])
    try:
        carla.Osm2Odr.convert(OSM, settings)
        raise AssertionError("a street of another kind was converted")
    except RuntimeError as error:
        assert "No edges" in str(error), error


@check
def wheels(c):
    car = c.car()
    where = carla.VehicleWheelLocation
    car.apply_control(carla.VehicleControl(steer=0.8))
    c.ticks(20)
    angles = {name: car.get_wheel_steer_angle(place) for name, place in where.names.items()}
    assert angles["FL_Wheel"] == angles["Front_Wheel"] > 5.0
    assert angles["BL_Wheel"] == angles["BR_Wheel"] == 0.0, angles
    # The inner wheel turns more.
    assert angles["FR_Wheel"] > angles["FL_Wheel"], angles
    for name in where.names:
        works(f"VehicleWheelLocation.{name}",
              f"{'turned' if angles[name] else 'straight'} while the vehicle steered")
    ignored("no effect: wheels have no angle of their own; logged", {
        "Vehicle.set_wheel_steer_direction":
            lambda: car.set_wheel_steer_direction(where.FL_Wheel, 10.0),
        "Vehicle.set_wheel_pitch_angle": lambda: car.set_wheel_pitch_angle(where.FL_Wheel, 10.0)})
    refuses("no wheels that pitch", {
        "Vehicle.get_wheel_pitch_angle": lambda: car.get_wheel_pitch_angle(where.FL_Wheel)})
    ignored("accepted; there is no server window",
            {"Vehicle.show_debug_telemetry": lambda: car.show_debug_telemetry(True)})
    bones, names = car.get_vehicle_bone_world_transforms(), car.get_bone_names()
    assert len(bones) == len(names) >= 5
    for name, bone in zip(names, bones):
        assert bone.location.distance(car.get_location()) < 4.0, name
    differs("Vehicle.get_vehicle_bone_world_transforms", "the bones of a vehicle are its parts")
    car.destroy()


@check
def states_of_lights(c):
    light = c.world.get_actors().filter("traffic.traffic_light*")[0]
    states = carla.TrafficLightState
    for state in (states.Yellow, states.Off, states.Unknown, states.Red, states.Green):
        light.set_state(state)
        c.ticks(2)
        assert light.get_state() == state, state
        works(f"TrafficLightState.{state}", "returned as set")
    light.reset_group()
    c.world.reset_all_traffic_lights()
    c.ticks(1)


@check
def walkers_by_themselves(c):
    c.world.set_pedestrians_seed(7)
    c.world.set_pedestrians_cross_factor(0.25)
    places = [c.world.get_random_location_from_navigation() for _ in range(4)]
    assert all(places) and len({(one.x, one.y) for one in places}) > 1
    sides = [c.map.get_waypoint(one, True, carla.LaneType.Sidewalk) for one in places]
    assert all(side.transform.location.distance(one) < 5.0 for side, one in zip(sides, places))
    works("World.get_random_location_from_navigation", "places on sidewalks")
    differs("World.set_pedestrians_seed", "accepted; the package draws from it")
    differs("World.set_pedestrians_cross_factor",
            "at 1, walkers crossed quiet streets away from crosswalks, at strips without parked cars; "
            "in CARLA anywhere")
    walker = brain = None
    for place in places:
        walker = c.world.try_spawn_actor(c.library.filter("walker.pedestrian.*")[0],
                                         carla.Transform(place + carla.Location(z=1.0)))
        if walker:
            break
    c.ticks(2)
    brain = c.world.spawn_actor(c.library.find("controller.ai.walker"), carla.Transform(), walker)
    c.ticks(2)
    brain.start()
    goal = next(one for one in places if one.distance(walker.get_location()) > 15.0)
    brain.go_to_location(goal)
    brain.set_max_speed(1.5)
    c.ticks(40)
    start = walker.get_location()
    c.ticks(100)
    moved = walker.get_location().distance(start)
    assert 4.0 < moved < 8.5, moved
    works("WalkerAIController.start WalkerAIController.go_to_location "
          "WalkerAIController.set_max_speed", "the walker walked at 1.5 m/s on the sidewalk")
    brain.stop()
    c.ticks(5)
    way, start = walker.get_transform().get_forward_vector(), walker.get_location()
    c.ticks(20)
    moved = walker.get_location() - start
    near(moved.x * way.x + moved.y * way.y, 1.5, 0.3)
    works("WalkerAIController.stop", "no longer steered, the walker walked on straight, as in CARLA")
    bones = walker.get_bones()
    assert len(bones.bone_transforms) == 66
    one = bones.bone_transforms[0]
    assert isinstance(one, carla.bone_transform_out) and one.name
    place = walker.get_transform()
    for bone in bones.bone_transforms:
        there = place.transform(bone.component.location)
        assert bone.world.location.distance(there) < 0.05, (bone.name, bone.world, there)
        assert bone.relative.location.length() < 1.5
    differs("WalkerBoneControlOut.bone_transforms bone_transform_out.name bone_transform_out.world "
            "bone_transform_out.component bone_transform_out.relative", "66 bones by name")
    brain.destroy()
    walker.destroy()
    c.ticks(1)


@check
def traffic_actions(c):
    manager = c.client.get_trafficmanager(8000)
    car = c.car()
    car.set_autopilot(True, manager.get_port())
    c.ticks(5)
    assert manager.get_next_action(car) == ["Void", None] and manager.get_all_actions(car) == []
    differs("TrafficManager.get_next_action TrafficManager.get_all_actions",
            "`Void` and nothing: the package does not read the answer of a traffic manager that "
            "runs in another process, here always that of the simulator")
    start = car.get_location()
    c.ticks(80)
    assert car.get_location().distance(start) > 2.0
    car.destroy()
    assert isinstance(c.world.debug, carla.DebugHelper)
    works("World.debug", "the drawing calls")
    ignored("accepted; annotations see through glass as images do",
            {"World.set_annotations_traverse_translucency":
                lambda: c.world.set_annotations_traverse_translucency(True)})
    c.ticks(1)
