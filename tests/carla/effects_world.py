"""Checks of the connection, time, the map, blueprints and episodes."""

import os
import threading

import carla

from effects_kit import DELTA, TIMEOUT, near
from ledger import check, differs, ignored, works


@check
def versions_and_maps(c):
    assert c.client.get_server_version() == c.client.get_client_version() == "0.9.16"
    works("Client Client.set_timeout Client.get_server_version Client.get_client_version",
          "both versions are 0.9.16")
    assert c.world.id == c.client.get_world().id
    works("Client.get_world World.id", "every client sees the same episode")
    works("Map.name", c.map.name)
    maps = [name.split("/")[-1] for name in c.client.get_available_maps()]
    assert {"Town01", "Town10HD", "Millbrook"} <= set(maps), maps
    works("Client.get_available_maps", "the names that `load_world` accepts")


@check
def asynchronous_and_synchronous_mode(c):
    settings = c.world.get_settings()
    settings.synchronous_mode = False
    settings.fixed_delta_seconds = None
    c.world.apply_settings(settings)
    first = c.world.wait_for_tick()
    second = c.world.wait_for_tick()
    assert second.frame > first.frame
    seen, arrived = [], threading.Event()
    number = c.world.on_tick(lambda snapshot: (seen.append(snapshot.frame), arrived.set()))
    assert arrived.wait(TIMEOUT)
    c.world.remove_on_tick(number)
    works("World.wait_for_tick World.on_tick World.remove_on_tick", "frames arrived without ticks")
    c.synchronise()
    settings = c.world.get_settings()
    assert settings.synchronous_mode and settings.fixed_delta_seconds == DELTA
    before = c.world.get_snapshot()
    frames = [c.world.tick() for _ in range(5)]
    after = c.world.get_snapshot()
    assert frames == list(range(before.frame + 1, before.frame + 6)), frames
    assert after.frame == frames[-1]
    near(after.timestamp.elapsed_seconds - before.timestamp.elapsed_seconds, 5 * DELTA, 1e-6)
    near(after.timestamp.delta_seconds, DELTA, 1e-6)
    works("World.tick World.get_snapshot World.get_settings World.apply_settings "
          "WorldSnapshot.frame WorldSnapshot.timestamp Timestamp.elapsed_seconds "
          "Timestamp.delta_seconds WorldSettings.synchronous_mode "
          "WorldSettings.fixed_delta_seconds",
          "each tick advanced the world by one frame of 0.05 s")
    differs("WorldSettings.fixed_delta_seconds=None",
            "frames are 0.05 s long, at real-time pace in asynchronous mode")


@check
def map_queries(c):
    assert len(c.points) > 10 and len(c.map.get_topology()) > 10
    waypoint = c.map.get_waypoint(c.points[0].location)
    assert waypoint.transform.location.distance(c.points[0].location) < 2.0
    step = waypoint.next(3.0)[0].transform.location.distance(waypoint.transform.location)
    near(step, 3.0, 0.5)
    assert c.map.to_opendrive().lstrip().startswith("<")
    works("World.get_map Map.get_spawn_points Map.get_topology Map.get_waypoint "
          "Map.to_opendrive Waypoint.next Waypoint.transform",
          "a spawn point was on a lane, the next waypoint 3 m ahead")


@check
def blueprints(c):
    cars = c.library.filter("vehicle.*")
    assert len(cars) > 20
    model = c.library.find("vehicle.tesla.model3")
    model.set_attribute("role_name", "hero")
    assert model.get_attribute("role_name").as_str() == "hero"
    assert int(model.get_attribute("number_of_wheels")) == 4
    assert "ego_vehicle" in model.get_attribute("role_name").recommended_values
    assert c.library.find("sensor.camera.rgb").get_attribute("image_size_x").as_int() == 800
    works("World.get_blueprint_library BlueprintLibrary.filter BlueprintLibrary.find "
          "ActorBlueprint.get_attribute ActorBlueprint.set_attribute ActorAttribute.as_int "
          "ActorAttribute.recommended_values", "attributes had defaults and recommended values")


@check
def spectator_and_rays(c):
    spectator = c.world.get_spectator()
    place = carla.Transform(carla.Location(10.0, -20.0, 30.0), carla.Rotation(-40.0, 60.0, 0.0))
    spectator.set_transform(place)
    c.world.tick()
    found = spectator.get_transform()
    assert found.location.distance(place.location) < 1e-3
    near(found.rotation.yaw, 60.0, 1e-2)
    works("World.get_spectator", "the spectator was where it was placed")
    above = c.points[0].location + carla.Location(z=20.0)
    hit = c.world.ground_projection(above, 100.0)
    near(hit.location.z, c.points[0].location.z - 0.5, 0.4)
    assert hit.label in (carla.CityObjectLabel.Roads, carla.CityObjectLabel.RoadLines)
    down = c.world.project_point(above, carla.Vector3D(z=-1.0), 100.0)
    assert down.location.distance(hit.location) < 0.01 and down.label == hit.label
    points = c.world.cast_ray(above, above - carla.Location(z=100.0))
    assert points and abs(points[0].location.z - hit.location.z) < 0.1
    works("World.ground_projection World.project_point World.cast_ray LabelledPoint.label "
          "LabelledPoint.location", "the hit was the road below")
    houses = c.world.get_environment_objects(carla.CityObjectLabel.Buildings)
    assert houses and len(houses) == len(c.world.get_level_bbs(carla.CityObjectLabel.Buildings))
    assert houses[0].bounding_box.extent.z > 1.0
    assert len(c.world.get_names_of_all_objects()) >= len(houses)
    level_boxes_of_actors(c)
    works("World.get_environment_objects World.get_level_bbs World.get_names_of_all_objects",
          "the houses of the town were listed")


def level_boxes_of_actors(c):
    label = carla.CityObjectLabel
    count = len(c.world.get_actors().filter("traffic.traffic_light"))
    assert count and len(c.world.get_level_bbs(label.TrafficLight)) == count
    # Above the town, where no later check finds them.
    place = carla.Transform(c.points[0].location + carla.Location(z=60.0),
                            carla.Rotation(yaw=30.0))
    for type_id, tag in (("vehicle.tesla.model3", label.Car),
                         ("vehicle.carlamotors.carlacola", label.Truck),
                         ("vehicle.mitsubishi.fusorosa", label.Bus),
                         ("vehicle.kawasaki.ninja", label.Motorcycle),
                         ("vehicle.bh.crossbike", label.Bicycle),
                         ("walker.pedestrian.0001", label.Pedestrians)):
        before = len(c.world.get_level_bbs(tag))
        actor = c.world.spawn_actor(c.library.find(type_id), place)
        c.ticks(1)
        assert len(c.world.get_level_bbs(tag)) == before + 1, type_id
        middle = actor.get_transform().transform(actor.bounding_box.location)
        found = [box for box in c.world.get_level_bbs(tag)
                 if box.location.distance(middle) < 0.3]
        assert len(found) == 1, (type_id, [str(box.location) for box in found])
        assert found[0].extent == actor.bounding_box.extent, (type_id, str(found[0].extent))
        near(found[0].rotation.yaw % 360.0, actor.get_transform().rotation.yaw % 360.0, 0.5)
        everything = c.world.get_level_bbs(label.Any)
        assert any(box.location == found[0].location for box in everything), type_id
        actor.destroy()
        c.ticks(1)
        assert len(c.world.get_level_bbs(tag)) == before, type_id


@check
def episodes(c):
    c.car()
    before, frame = c.world.id, c.ticks(1)
    text = c.map.to_opendrive()
    c.world = c.client.reload_world(False)
    assert c.world.id != before
    assert c.world.get_settings().synchronous_mode
    assert c.ticks(2) > frame
    assert not c.world.get_actors().filter("vehicle.*")
    assert c.world.get_snapshot().timestamp.elapsed_seconds < 1.0
    works("Client.reload_world", "the same map without vehicles; frame numbers continued")
    load_another_map(c)
    c.world = c.client.generate_opendrive_world(
        text, carla.OpendriveGenerationParameters(vertex_distance=2.0, wall_height=1.0))
    update_context(c)
    assert c.map.name.endswith("/OpenDriveMap") and c.map.to_opendrive() == text
    differs("Client.generate_opendrive_world",
            "the town includes buildings and vegetation; the parameters of the road mesh are "
            "ignored")
    try:
        c.client.generate_opendrive_world(text[:len(text) // 2])
        raise AssertionError("an incomplete map was loaded")
    except RuntimeError as error:
        assert "OpenDriveMap.xodr: line" in str(error), error
    assert c.client.get_world().id == c.world.id


def load_another_map(c):
    car = c.car()
    image, measured = c.sensor("sensor.camera.rgb", car, image_size_x=64, image_size_y=64)
    c.ticks(2)
    measured.get(timeout=TIMEOUT)
    driver = car.id
    recorded = c.client.start_recorder(f"elsewhere-{os.getpid()}.log")
    c.ticks(10)
    c.client.stop_recorder()
    before, last = c.world.id, c.map.name
    c.world = c.client.load_world("Town02")
    assert c.world.id != before
    assert not c.world.get_settings().synchronous_mode, "settings not reset"
    update_context(c)
    assert c.map.name == "Carla/Maps/Town02" != last
    assert not c.world.get_actors().filter("vehicle.*")
    assert not c.world.get_actors().filter("sensor.*")
    assert c.world.get_actors().filter("traffic.traffic_light")
    car = c.car()
    _, measured = c.sensor("sensor.camera.rgb", car, image_size_x=64, image_size_y=64)
    frame = c.ticks(1)
    while measured.get(timeout=TIMEOUT).frame < frame:
        pass
    car.set_autopilot(True)
    at = car.get_location()
    c.ticks(100)
    assert car.get_location().distance(at) > 5.0, "traffic does not drive in the new world"
    houses = len(c.world.get_environment_objects(carla.CityObjectLabel.Buildings))
    assert houses > 10
    before = c.world.id
    c.world = c.client.load_world("/Game/Carla/Maps/Town02_Opt", False, carla.MapLayer.NONE)
    assert c.world.id != before
    update_context(c)
    assert c.map.name == "Carla/Maps/Town02_Opt"
    works("Client.load_world",
          "another map by each of 0.9.16's spellings, with the requested layers, in a new episode")
    before = c.world.id
    c.client.replay_file(recorded, 0.0, 0.0, 0)
    # The frames inform the package that another client has loaded a world. A client that
    # has another map keeps it; a new client requests the map.
    c.ticks(2)
    assert c.client.get_world().id != before
    fresh = carla.Client("127.0.0.1", c.port)
    fresh.set_timeout(TIMEOUT)
    world = fresh.get_world()
    assert world.get_map().name == last, (world.get_map().name, last)
    assert driver in [one.id for one in world.get_actors().filter("vehicle.*")]
    c.client.stop_replayer(False)
    works("Client.replay_file:another_map", "the map of the recording was loaded first")
    os.remove(recorded)
    c.world = c.client.load_world("Town02_Opt")
    update_context(c)
    before = c.world.id
    c.client.load_world_if_different("Town02_Opt")
    assert c.client.get_world().id == before
    c.client.load_world_if_different("Town01")
    c.world = c.client.get_world()
    assert c.world.id != before
    update_context(c)
    works("Client.load_world_if_different", "only a different map was loaded")


def update_context(c):
    """Updates the context after another world was loaded."""
    c.synchronise()
    c.map = c.world.get_map()
    c.library = c.world.get_blueprint_library()
    c.points = c.map.get_spawn_points()
    c.next_point = 0
    c.ticks(1)
