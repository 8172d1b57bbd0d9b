"""Checks of spawning, controlling, moving and batches, and of what this simulator does not have."""

import carla

from effects_kit import near
from ledger import check, differs, ignored, refuses, works

command = carla.command


@check
def spawn_and_destroy(c):
    car = c.car(role_name="hero", color="10,20,30")
    assert car.attributes["role_name"] == "hero" and car.type_id == "vehicle.tesla.model3"
    assert car.id in [actor.id for actor in c.world.get_actors().filter("vehicle.*")]
    assert c.world.get_actor(car.id).id == car.id
    assert 1.8 < car.bounding_box.extent.x < 3.0
    assert c.world.try_spawn_actor(c.library.find("vehicle.audi.tt"), car.get_transform()) is None
    refuses("Spawn failed because of collision at spawn position", {
        "World.spawn_actor:occupied":
            lambda: c.world.spawn_actor(c.library.find("vehicle.audi.tt"), car.get_transform())})
    works("World.spawn_actor World.try_spawn_actor World.get_actors World.get_actor Actor.id "
          "Actor.type_id Actor.attributes Actor.bounding_box ActorList.filter",
          "the actor was listed with its attributes; a second one at the same place was refused")
    assert car.is_alive and car.destroy()
    c.world.tick()
    assert not car.is_alive
    assert car.id not in [actor.id for actor in c.world.get_actors()]
    works("Actor.destroy Actor.is_alive", "the actor was no longer listed")


@check
def vehicle_control(c):
    # The vehicle leaves the road and must not hit parked vehicles.
    c.world.unload_map_layer(carla.MapLayer.ParkedVehicles)
    car = c.car()
    start = car.get_transform()
    ahead = start.get_forward_vector()
    car.apply_control(carla.VehicleControl(throttle=0.6))
    c.ticks(40)
    moved = car.get_location() - start.location
    forward = moved.x * ahead.x + moved.y * ahead.y
    assert forward > 2.0, forward
    speed = car.get_velocity().length()
    assert speed > 1.0
    near(car.get_control().throttle, 0.6, 1e-6)
    yaw = car.get_transform().rotation.yaw
    car.apply_control(carla.VehicleControl(throttle=0.3, steer=0.5))
    c.ticks(20)
    turned = (car.get_transform().rotation.yaw - yaw + 180.0) % 360.0 - 180.0
    assert turned > 3.0, f"steered to the right, the vehicle turned by {turned} degrees"
    assert car.get_angular_velocity().z > 0.0
    car.apply_control(carla.VehicleControl(brake=1.0))
    c.ticks(60)
    assert car.get_velocity().length() < 0.5
    works("Vehicle.apply_control Vehicle.get_control Actor.get_transform Actor.get_location "
          "Actor.get_velocity Actor.get_angular_velocity VehicleControl.throttle "
          "VehicleControl.steer VehicleControl.brake",
          "throttle moved the vehicle forwards, steering turned it right, braking stopped it")
    start = car.get_location()
    car.apply_control(carla.VehicleControl(throttle=0.5, reverse=True))
    c.ticks(40)
    back = car.get_location() - start
    ahead = car.get_transform().get_forward_vector()
    assert back.x * ahead.x + back.y * ahead.y < -0.5
    works("VehicleControl.reverse", "the vehicle moved backwards")
    assert 10.0 <= car.get_speed_limit() <= 130.0
    works("Vehicle.get_speed_limit", "30 km/h until the vehicle passes a speed sign, then that of the sign")
    car.apply_control(carla.VehicleControl(brake=1.0))
    c.ticks(40)
    car.apply_control(carla.VehicleControl(throttle=1.0))
    c.ticks(10)
    measured_now = car.get_acceleration()
    ahead = car.get_transform().get_forward_vector()
    assert measured_now.x * ahead.x + measured_now.y * ahead.y > 0.5
    works("Actor.get_acceleration", "the acceleration was forwards while the throttle was open")
    car.apply_control(carla.VehicleControl(steer=1.0))
    c.ticks(10)
    place = carla.VehicleWheelLocation
    left, right, rear = map(car.get_wheel_steer_angle,
                            (place.FL_Wheel, place.FR_Wheel, place.BL_Wheel))
    assert right > left + 0.5 and left > 5.0 and rear == 0.0, (left, right, rear)
    works("Vehicle.get_wheel_steer_angle",
          "in degrees, positive to the right; the inner wheel turned further than the outer one")
    car.destroy()
    c.world.load_map_layer(carla.MapLayer.ParkedVehicles)


@check
def teleport_and_velocity(c):
    car = c.car()
    target = c.points[(c.next_point + 3) % len(c.points)]
    car.set_transform(target)
    c.world.tick()
    assert car.get_location().distance(target.location) < 1.5
    works("Actor.set_transform", "the actor was at the new pose in the next frame")
    lifted = car.get_location() + carla.Location(z=3.0)
    car.set_location(lifted)
    c.world.tick()
    near(car.get_location().z, lifted.z, 0.3)
    c.ticks(40)
    works("Actor.set_location", "the actor was lifted and fell")
    ahead = car.get_transform().get_forward_vector()
    car.set_target_velocity(8.0 * ahead)
    c.world.tick()
    near(car.get_velocity().length(), 8.0, 1.0)
    works("Actor.set_target_velocity", "the actor moved at 8 m/s in the next frame")
    car.set_target_velocity(carla.Vector3D())
    car.apply_control(carla.VehicleControl(brake=1.0, hand_brake=True))
    c.ticks(20)
    car.set_target_angular_velocity(carla.Vector3D(z=40.0))
    c.world.tick()
    assert car.get_angular_velocity().z > 5.0
    works("Actor.set_target_angular_velocity", "the actor turned clockwise")
    c.ticks(20)
    assert 800.0 < car.get_physics_control().mass < 3000.0
    car.apply_control(carla.VehicleControl())
    car.enable_constant_velocity(carla.Vector3D(x=6.0))
    c.ticks(20)
    near(car.get_velocity().length(), 6.0, 1.0)
    car.disable_constant_velocity()
    car.apply_control(carla.VehicleControl(brake=1.0))
    c.ticks(40)
    assert car.get_velocity().length() < 1.0
    works("Actor.enable_constant_velocity Actor.disable_constant_velocity",
          "the actor moved at 6 m/s until it was released")
    car.destroy()


@check
def simulate_physics(c):
    car = c.car()
    car.set_simulate_physics(False)
    high = car.get_location() + carla.Location(z=5.0)
    car.set_location(high)
    c.ticks(20)
    assert car.get_location().distance(high) < 1e-3
    car.set_simulate_physics(True)
    c.ticks(60)
    near(high.z - car.get_location().z, 5.0, 0.5)
    works("Actor.set_simulate_physics",
          "the actor stayed in the air without physics and fell with it")
    car.destroy()
    car = c.car(sticky_control="false")
    car.apply_control(carla.VehicleControl(throttle=1.0))
    c.ticks(4)
    assert car.get_control().throttle == 0.0
    works("sticky_control", "with `false`, pedals returned to 0 unless the control was repeated")
    car.destroy()


@check
def batches(c):
    blueprint = c.library.find("vehicle.audi.tt")
    places = c.points[1::11][:10]
    spawned = c.client.apply_batch_sync(
        [command.SpawnActor(blueprint, place) for place in places], True)
    ids = [answer.actor_id for answer in spawned if not answer.error]
    assert len(ids) >= 5
    cars = c.world.get_actors(ids)
    controls = [command.ApplyVehicleControl(car, carla.VehicleControl(throttle=0.6))
                for car in cars]
    assert not any(answer.error for answer in c.client.apply_batch_sync(controls, True))
    starts = [car.get_location() for car in cars]
    c.ticks(30)
    moved = [car.get_location().distance(start) for car, start in zip(cars, starts)]
    assert sum(distance > 0.5 for distance in moved) >= len(ids) - 2, moved
    again = c.client.apply_batch_sync([command.SpawnActor(blueprint, cars[0].get_transform())])
    assert "collision" in again[0].error, again[0].error
    c.client.apply_batch_sync([
        command.ApplyTransform(cars[0].id, c.points[-1]),
        command.ApplyTargetVelocity(cars[1].id, carla.Vector3D(z=4.0)),
        command.SetVehicleLightState(cars[2].id, carla.VehicleLightState.HighBeam),
    ], True)
    assert cars[0].get_location().distance(c.points[-1].location) < 1.5
    assert cars[1].get_velocity().z > 2.0
    assert cars[2].get_light_state() == carla.VehicleLightState.HighBeam
    lamps = c.world.get_vehicles_light_states()
    assert lamps[cars[2].id] == carla.VehicleLightState.HighBeam
    cars[2].set_light_state(carla.VehicleLightState.Fog)
    c.ticks(1)
    assert cars[2].get_light_state() == carla.VehicleLightState.Fog
    c.client.apply_batch([command.DestroyActor(id) for id in ids])
    c.ticks(2)
    assert not c.world.get_actors().filter("vehicle.audi.tt")
    works("Client.apply_batch Client.apply_batch_sync command.SpawnActor command.DestroyActor "
          "command.ApplyVehicleControl command.ApplyTransform command.ApplyTargetVelocity",
          "each command took effect; errors were returned one by one")
    differs("Vehicle.set_light_state Vehicle.get_light_state World.get_vehicles_light_states "
            "command.SetVehicleLightState",
            "the state was returned and lights were visible; they do not illuminate their "
            "surroundings")


@check
def unsupported_members(c):
    car = c.car()
    before = c.world.id
    refuses("no map is named",
            {"Client.load_world:unknown": lambda: c.client.load_world("Atlantis")},
            "an error that lists the known maps")
    assert c.client.get_world().id == before and car.is_alive
    refuses("no components", {
        "Actor.get_component_names": car.get_component_names,
        "Actor.get_component_world_transform": lambda: car.get_component_world_transform("a"),
        "Actor.get_component_relative_transform":
            lambda: car.get_component_relative_transform("a")})
    assert "wheel_fl" in car.get_bone_names(), car.get_bone_names()
    refuses("no sockets", {
        "Actor.get_socket_names": car.get_socket_names,
        "Actor.get_socket_world_transforms": car.get_socket_world_transforms,
        "Actor.get_socket_relative_transforms": car.get_socket_relative_transforms})
    car.open_door(carla.VehicleDoor.FL)
    c.ticks(2)
    assert "door_fl" in car.get_bone_names(), car.get_bone_names()
    car.close_door(carla.VehicleDoor.All)
    c.ticks(2)
    assert "door_fl" not in car.get_bone_names(), car.get_bone_names()
    differs("Vehicle.open_door Vehicle.close_door",
            "doors were visible in images at once; physics ignores doors, and their bones are "
            "listed only while one is open")
    ignored("no effect: there is no other physics engine", {
        "Vehicle.enable_carsim": lambda: car.enable_carsim("a"),
        "Vehicle.use_carsim_road": lambda: car.use_carsim_road(True),
        "Vehicle.enable_chrono_physics":
            lambda: car.enable_chrono_physics(1, 0.01, "a", "b", "c", "d"),
        "Vehicle.restore_physx_physics": car.restore_physx_physics})
    car.destroy()
