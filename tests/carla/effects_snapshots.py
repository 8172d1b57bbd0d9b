"""Checks of snapshots, lists of actors, properties of actors, and blueprints."""

import math

import carla

from effects_kit import DELTA, near
from ledger import check, differs, local, refuses, works

DESTROYED = "trying to operate on a destroyed actor"


@check
def snapshots(c):
    car = c.car()
    car.set_target_velocity(5.0 * car.get_transform().get_forward_vector())
    frame = c.ticks(2)
    seen = c.world.get_snapshot()
    assert seen.id == c.world.id and seen.frame == seen.frame_count == frame
    now = seen.timestamp
    assert now.frame == now.frame_count == frame and seen.delta_seconds == now.delta_seconds
    assert seen.elapsed_seconds == now.elapsed_seconds
    near(now.delta_seconds, DELTA, 1e-6)
    c.ticks(1)
    later = c.world.get_snapshot()
    assert later.platform_timestamp > seen.platform_timestamp == now.platform_timestamp > 0.0
    assert later != seen and seen == seen and later.timestamp != now
    assert str(seen) == f"WorldSnapshot(frame={frame})" and f"frame={frame}," in str(now)
    works("WorldSnapshot.id WorldSnapshot.frame WorldSnapshot.timestamp WorldSnapshot.__str__ "
          "WorldSnapshot.__eq__ WorldSnapshot.__ne__ Timestamp.frame Timestamp.__str__ "
          "Timestamp.__ne__", "the episode, and the frame that the tick returned")
    works("WorldSnapshot.frame_count Timestamp.frame_count", "another name of `frame`")
    works("WorldSnapshot.elapsed_seconds WorldSnapshot.delta_seconds",
          "another name of the property of `timestamp`")
    works("WorldSnapshot.platform_timestamp Timestamp.platform_timestamp",
          "seconds of a clock that does not go back")
    assert seen.has_actor(car.id) and not seen.has_actor(999999) and seen.find(999999) is None
    ids = [one.id for one in seen]
    assert len(ids) == len(seen) and sorted(ids) == sorted({a.id for a in c.world.get_actors()})
    works("WorldSnapshot.has_actor WorldSnapshot.find WorldSnapshot.__len__ WorldSnapshot.__iter__ "
          "ActorSnapshot.id", "every actor of the world once; none for an unknown id")
    own = later.find(car.id)
    assert own.get_transform() == car.get_transform()
    for name in ("get_velocity", "get_angular_velocity", "get_acceleration"):
        assert getattr(own, name)() == getattr(car, name)(), name
    assert own.get_velocity().length() > 3.0 and str(own) == f"ActorSnapshot(id={car.id})"
    works("ActorSnapshot.get_transform ActorSnapshot.get_velocity ActorSnapshot.get_acceleration "
          "ActorSnapshot.get_angular_velocity ActorSnapshot.__str__",
          "equal to the actor's own; angular velocity in degrees per second")
    car.destroy()


@check
def actors(c):
    car = c.car(role_name="hero")
    camera, _ = c.sensor("sensor.camera.rgb", car, image_size_x=32, image_size_y=32)
    c.ticks(1)
    listed = c.world.get_actors()
    assert listed.find(car.id).id == car.id and listed.find(999999) is None
    assert len(list(listed)) == len(listed) and listed[0].id in [one.id for one in listed]
    try:
        listed[len(listed)]
        raise AssertionError("an index after the last is accepted")
    except IndexError:
        pass
    assert f"Actor(id={car.id}, type=vehicle.tesla.model3)" in str(listed)
    two = c.world.get_actors([car.id, camera.id, 999999])
    assert sorted(one.id for one in two) == sorted([car.id, camera.id])
    works("ActorList.find ActorList.__getitem__ ActorList.__len__ ActorList.__iter__ "
          "ActorList.__str__", "every actor once; none for an unknown id, IndexError after the last")
    assert camera.parent.id == car.id and car.parent is None
    assert c.world.get_actor(camera.id).parent.id == car.id
    works("Actor.parent", "the vehicle of a camera; none of the vehicle")
    for type_id, tag in (("vehicle.tesla.model3", carla.CityObjectLabel.Car),
                         ("vehicle.carlamotors.firetruck", carla.CityObjectLabel.Truck),
                         ("vehicle.mitsubishi.fusorosa", carla.CityObjectLabel.Bus),
                         ("vehicle.kawasaki.ninja", carla.CityObjectLabel.Motorcycle),
                         ("vehicle.bh.crossbike", carla.CityObjectLabel.Bicycle)):
        one = c.car(type_id)
        assert int(tag) in one.semantic_tags, (type_id, one.semantic_tags)
        one.destroy()
        works(f"CityObjectLabel.{tag}", f"the tag of `{type_id}`")
    works("Actor.semantic_tags", "the tags of CARLA for cars, trucks, buses and two-wheelers")
    assert car.is_active and not car.is_dormant and car.actor_state == carla.ActorState.Active
    works("ActorState.Active", "the state of every actor")
    differs("Actor.actor_state Actor.is_active Actor.is_dormant",
            "always active: this simulator does not load maps in parts")
    local("ActorState.Invalid ActorState.Dormant", "never sent by this simulator")
    assert car.get_world().id == c.world.id and str(car) == f"Actor(id={car.id}, type={car.type_id})"
    spectator = c.world.get_spectator()
    assert carla.Actor.__str__(spectator) == f"Actor(id={spectator.id}, type=spectator)"
    assert str(c.world) == f"World(id={c.world.id})"
    works("Actor.get_world Actor.__str__ World.__str__", f"printed as `{c.world}` and alike")
    assert str(camera).startswith("Actor(id="), str(camera)
    camera.destroy()
    car.destroy()
    c.ticks(1)
    refuses(DESTROYED, {"Actor.destroy:destroyed": car.destroy,
                        "Actor.get_transform:destroyed": car.get_transform,
                        "Vehicle.get_physics_control:destroyed": car.get_physics_control},
            "the package's own error for an actor that does not exist")


@check
def failures(c):
    """A vehicle that lies on its roof."""
    car = c.car()
    place = car.get_transform()
    place.location.z += 1.5
    place.rotation.roll = 180.0
    car.set_transform(place)
    states = carla.VehicleFailureState
    c.ticks(80)
    assert abs(car.get_transform().rotation.roll) > 160.0, car.get_transform()
    assert car.get_failure_state() == states.NONE, "reported before 5 s"
    c.ticks(40)
    assert car.get_failure_state() == states.Rollover
    place.rotation.roll = 0.0
    car.set_transform(place)
    c.ticks(2)
    assert car.get_failure_state() == states.NONE
    works("Vehicle.get_failure_state VehicleFailureState.NONE VehicleFailureState.Rollover",
          "`Rollover` of a vehicle that lay on its roof for 5 s, until it stood again")
    local("VehicleFailureState.Engine VehicleFailureState.TirePuncture",
          "never sent by this simulator")
    car.destroy()


@check
def kinds_of_actors(c):
    """What is printed for each class of actor."""
    light = c.world.get_actors().filter("traffic.traffic_light*")[0]
    sign = c.world.get_actors().filter("traffic.speed_limit.*")[0]
    walker = c.world.spawn_actor(c.library.filter("walker.pedestrian.*")[0], c.points[5])
    brain = c.world.spawn_actor(c.library.find("controller.ai.walker"), carla.Transform(), walker)
    car = c.car()
    lane, _ = c.sensor("sensor.other.lane_invasion", car)
    camera, _ = c.sensor("sensor.camera.rgb", car, image_size_x=32, image_size_y=32)
    classes = {"Vehicle": car, "Walker": walker, "WalkerAIController": brain, "Sensor": camera,
               "TrafficLight": light, "ServerSideSensor": camera, "ClientSideSensor": lane,
               "LaneInvasionSensor": lane}
    for name, actor in classes.items():
        cls = getattr(carla, name)
        assert isinstance(actor, cls), (name, type(actor))
        assert cls.__str__(actor) == f"Actor(id={actor.id}, type={actor.type_id})"
        works(f"{name}.__str__", f"`Actor(id=…, type={actor.type_id})`")
    assert isinstance(sign, carla.TrafficSign) and not isinstance(sign, carla.TrafficLight)
    for one in (lane, camera):
        assert one.is_listening()
        one.stop()
        assert not one.is_listening()
    works("Sensor.is_listening", "true until the sensor was stopped")
    for one in (lane, camera, car, brain, walker):
        one.destroy()
    c.ticks(1)


@check
def blueprint_members(c):
    model = c.library.find("vehicle.tesla.model3")
    assert model.id == "vehicle.tesla.model3" and sorted(model.tags) == ["model3", "tesla", "vehicle"]
    assert model.has_tag("tesla") and not model.has_tag("audi")
    assert model.match_tags("*tesla*") and not model.match_tags("*audi*")
    assert model.has_attribute("color") and not model.has_attribute("colour")
    assert len(list(model)) == len(model) > 5
    assert str(model).startswith("ActorBlueprint(id=vehicle.tesla.model3"), str(model)
    works("ActorBlueprint.id ActorBlueprint.tags ActorBlueprint.has_tag ActorBlueprint.match_tags "
          "ActorBlueprint.has_attribute ActorBlueprint.__len__ ActorBlueprint.__iter__ "
          "ActorBlueprint.__str__", f"`{model}`")
    camera = c.library.find("sensor.camera.rgb")
    kinds = {"image_size_x": "Int", "fov": "Float", "role_name": "String",
             "enable_postprocess_effects": "Bool"}
    for name, kind in kinds.items():
        one = camera.get_attribute(name)
        assert one.id == name and str(one.type) == kind and one.is_modifiable, (name, one.type)
        works(f"ActorAttributeType.{kind}", f"the type of `{name}` of a camera")
    colour = model.get_attribute("color")
    assert str(colour.type) == "RGBColor"
    works("ActorAttributeType.RGBColor", "the type of `color` of a vehicle")
    model.set_attribute("color", "10,20,30")
    assert model.get_attribute("color").as_color() == carla.Color(10, 20, 30)
    assert camera.get_attribute("fov").as_float() == 90.0 == float(camera.get_attribute("fov"))
    assert int(camera.get_attribute("image_size_x")) == 800
    flag = camera.get_attribute("enable_postprocess_effects")
    assert flag.as_bool() is True is bool(flag) and flag.__nonzero__()
    fov = camera.get_attribute("fov")
    assert fov == camera.get_attribute("fov") and fov == 90.0 and fov != 91.0
    assert camera.get_attribute("role_name").as_str() == "front"
    assert "fov" in str(camera.get_attribute("fov")), str(camera.get_attribute("fov"))
    works("ActorAttribute.id ActorAttribute.type ActorAttribute.is_modifiable ActorAttribute.as_bool "
          "ActorAttribute.as_float ActorAttribute.as_str ActorAttribute.as_color "
          "ActorAttribute.__eq__ ActorAttribute.__ne__ ActorAttribute.__bool__ "
          "ActorAttribute.__nonzero__ ActorAttribute.__int__ ActorAttribute.__float__ "
          "ActorAttribute.__str__", f"`{camera.get_attribute('fov')}`")
    wheels = model.get_attribute("number_of_wheels")
    assert not wheels.is_modifiable
    refuses("read-only attribute", {"ActorBlueprint.set_attribute:fixed":
                               lambda: model.set_attribute("number_of_wheels", "3")})
    refuses("not found", {"BlueprintLibrary.find:unknown": lambda: c.library.find("vehicle.none"),
                          "ActorBlueprint.get_attribute:unknown":
                              lambda: model.get_attribute("colour")})
    bikes = c.library.filter_by_attribute("number_of_wheels", "2")
    assert len(bikes) > 2 and all(int(one.get_attribute("number_of_wheels")) == 2 for one in bikes)
    assert len(list(c.library)) == len(c.library) > 100 and "ActorBlueprint(id=" in str(c.library)
    assert c.library[0].id == list(c.library)[0].id
    works("BlueprintLibrary.filter_by_attribute", "every vehicle with two wheels")
    works("BlueprintLibrary.__getitem__ BlueprintLibrary.__len__ BlueprintLibrary.__iter__ "
          "BlueprintLibrary.__str__", "every blueprint once")
