"""Checks of the commands of a batch, each with its effect and with an unknown actor."""

import carla

from effects_kit import near
from ledger import check, differs, refuses, works

command = carla.command
UNKNOWN = 999999


@check
def commands_of_vehicles(c):
    car = c.car()

    def run(*commands):
        answers = c.client.apply_batch_sync(list(commands), True)
        assert all(answer.error == "" and not answer.has_error() for answer in answers), \
            [answer.error for answer in answers]
        assert all(answer.actor_id == car.id for answer in answers)

    run(command.ApplyVehicleControl(car, carla.VehicleControl(throttle=0.75)))
    near(car.get_control().throttle, 0.75, 1e-6)
    moved = car.get_transform()
    moved.location += 6.0 * moved.get_forward_vector() + carla.Location(z=0.5)
    run(command.ApplyTransform(car, moved))
    assert car.get_location().distance(moved.location) < 1.0
    run(command.ApplyVehicleControl(car, carla.VehicleControl(brake=1.0)))
    c.ticks(40)
    mass, ahead = car.get_physics_control().mass, car.get_transform().get_forward_vector()
    run(command.ApplyVehicleControl(car, carla.VehicleControl()))
    run(command.ApplyImpulse(car, 3.0 * mass * ahead))
    near(car.get_velocity().length(), 3.0, 0.4)
    run(command.ApplyForce(car, 3.0 * mass / 0.05 * ahead))
    near(car.get_velocity().length(), 6.0, 0.7)
    works("command.ApplyImpulse command.ApplyForce",
          "three times the mass, or an equal force over one tick, changed the speed by 3 m/s")
    run(command.ApplyTargetVelocity(car, 4.0 * ahead))
    near(car.get_velocity().length(), 4.0, 0.4)
    run(command.SetEnableGravity(car, False),
        command.ApplyTransform(car, carla.Transform(
            car.get_location() + carla.Location(z=5.0), car.get_transform().rotation)),
        command.ApplyTargetVelocity(car, carla.Vector3D()))
    high = car.get_location().z
    c.ticks(10)
    near(car.get_location().z, high, 0.05)
    run(command.ApplyTargetAngularVelocity(car, carla.Vector3D(z=40.0)))
    near(car.get_angular_velocity().z, 40.0, 4.0)
    works("command.ApplyTargetAngularVelocity", "the vehicle turned at 40 degrees per second")
    run(command.ApplyTargetAngularVelocity(car, carla.Vector3D()))
    turns = []
    for kind, size in ((command.ApplyAngularImpulse, 2000.0), (command.ApplyTorque, 40000.0)):
        before = car.get_angular_velocity().z
        run(kind(car, carla.Vector3D(z=size)))
        turns.append(car.get_angular_velocity().z - before)
    assert 10.0 < turns[0] < 90.0, turns
    near(turns[1], turns[0], 0.1 * turns[0])
    differs("command.ApplyAngularImpulse command.ApplyTorque",
            "newton metre seconds about the body's own inertia, and newton metres over one tick")
    run(command.SetSimulatePhysics(car, False))
    place = car.get_transform()
    c.ticks(5)
    assert car.get_location().distance(place.location) < 1e-3
    run(command.SetSimulatePhysics(car, True), command.SetEnableGravity(car, True))
    c.ticks(60)
    assert car.get_location().z < high - 4.0
    works("command.SetSimulatePhysics command.SetEnableGravity",
          "the vehicle stayed in the air without physics or gravity, and fell with both")
    run(command.SetVehicleLightState(car.id, carla.VehicleLightState.Fog))
    assert car.get_light_state() == carla.VehicleLightState.Fog
    run(command.SetAutopilot(car, True, 8000))
    start = car.get_location()
    c.ticks(80)
    assert car.get_location().distance(start) > 2.0
    run(command.SetAutopilot(car.id, False))
    works("command.SetAutopilot", "the vehicle was driven by traffic")
    refuses("No registered converter", {
        "command.ShowDebugTelemetry": lambda: run(command.ShowDebugTelemetry(car.id, True))},
        "a defect of the package: it cannot send this command")
    run(command.DestroyActor(car))
    c.ticks(1)
    assert not c.world.get_snapshot().has_actor(car.id)


@check
def commands_of_walkers(c):
    walker = c.world.spawn_actor(c.library.filter("walker.pedestrian.*")[0], c.points[5])
    c.ticks(10)
    start = walker.get_location()
    c.client.apply_batch_sync([command.ApplyWalkerControl(
        walker, carla.WalkerControl(carla.Vector3D(y=1.0), 1.5))], True)
    c.ticks(19)
    near(walker.get_location().y - start.y, 1.5, 0.3)
    works("command.ApplyWalkerControl", "the walker moved 1.5 m to the right in one second")
    place = walker.get_transform()
    place.location.x += 3.0
    answer = c.client.apply_batch_sync([command.ApplyWalkerState(walker, place, 1.25)], True)[0]
    assert not answer.has_error(), answer.error
    c.ticks(1)
    near(walker.get_location().distance(place.location), 0.0, 0.3)
    near(walker.get_control().speed, 1.25, 0.05)
    works("command.ApplyWalkerState",
          "the walker was at the given place in the next frame, and walked on at 1.25 m/s")
    walker.destroy()
    c.ticks(1)


@check
def batches_of_commands(c):
    blueprint = c.library.find("vehicle.tesla.model3")
    camera = c.library.find("sensor.camera.rgb")
    place = next(point for point in c.points
                 if all(point.location.distance(one.get_location()) > 15.0
                        for one in c.world.get_actors().filter("vehicle.*")))
    spawn = command.SpawnActor(blueprint, place).then(
        command.SetAutopilot(command.FutureActor, True))
    assert command.FutureActor == 0 and spawn.transform == place
    answer = c.client.apply_batch_sync([spawn], True)[0]
    assert not answer.has_error(), answer.error
    car = c.world.get_actor(answer.actor_id)
    c.ticks(80)
    assert car.get_location().distance(place.location) > 2.0
    works("command.SpawnActor.then command.FutureActor",
          "the vehicle was spawned and driven by traffic")
    works("command.SpawnActor.transform", "where the vehicle was spawned")
    car.set_autopilot(False)
    above = carla.Transform(carla.Location(z=2.0))
    by_actor = command.SpawnActor(camera, above, car)
    by_id = command.SpawnActor(camera, above, car.id)
    behind = command.SpawnActor(camera, carla.Transform(carla.Location(x=-6.0, z=3.0)), car,
                                carla.AttachmentType.SpringArm, "")
    assert by_actor.socket_name == "" and behind.socket_name == ""
    assert behind.attachment_type == carla.AttachmentType.SpringArm
    answers = c.client.apply_batch_sync([by_actor, by_id, behind], True)
    sensors = [c.world.get_actor(one.actor_id) for one in answers]
    assert all(one.parent.id == car.id for one in sensors), [one.error for one in answers]
    near(sensors[0].get_location().distance(car.get_location()), 2.0, 0.5)
    works("command.SpawnActor.attachment_type command.SpawnActor.socket_name command.SpawnActor",
          "cameras were attached by actor, by id, and by a spring arm")
    refuses("No Python class registered for C++ class", {
        "command.SpawnActor.parent_id": lambda: by_id.parent_id},
        "a defect of the package: its property cannot be read; it works as an argument")
    for sensor in sensors:
        sensor.destroy()
    zero, control = carla.Vector3D(), carla.WalkerControl()
    for function, made in (
            ("apply_control_to_vehicle",
             command.ApplyVehicleControl(UNKNOWN, carla.VehicleControl())),
            ("apply_ackermann_control_to_vehicle",
             command.ApplyVehicleAckermannControl(UNKNOWN, carla.VehicleAckermannControl())),
            ("apply_control_to_walker", command.ApplyWalkerControl(UNKNOWN, control)),
            ("apply_physics_control", command.ApplyVehiclePhysicsControl(
                UNKNOWN, carla.VehiclePhysicsControl())),
            ("set_actor_transform", command.ApplyTransform(UNKNOWN, place)),
            ("set_walker_state", command.ApplyWalkerState(UNKNOWN, place, 1.0)),
            ("set_actor_target_velocity", command.ApplyTargetVelocity(UNKNOWN, zero)),
            ("set_actor_target_angular_velocity",
             command.ApplyTargetAngularVelocity(UNKNOWN, zero)),
            ("add_actor_impulse", command.ApplyImpulse(UNKNOWN, zero)),
            ("add_actor_force", command.ApplyForce(UNKNOWN, zero)),
            ("add_actor_angular_impulse", command.ApplyAngularImpulse(UNKNOWN, zero)),
            ("add_actor_torque", command.ApplyTorque(UNKNOWN, zero)),
            ("set_actor_simulate_physics", command.SetSimulatePhysics(UNKNOWN, True)),
            ("set_actor_enable_gravity", command.SetEnableGravity(UNKNOWN, True)),
            ("set_actor_autopilot", command.SetAutopilot(UNKNOWN, True)),
            ("set_vehicle_light_state", command.SetVehicleLightState(UNKNOWN, 1)),
            ("spawn_actor_with_parent", command.SpawnActor(camera, above, UNKNOWN))):
        answer = c.client.apply_batch_sync([made], True)[0]
        assert answer.has_error() and answer.error == (
            f"Responding error from function {function}: Actor could not be found in the "
            f"registry.  Actor Id: {UNKNOWN}"), answer.error
    answer = c.client.apply_batch_sync([command.DestroyActor(UNKNOWN)], True)[0]
    assert answer.error == "unable to destroy actor: not found", answer.error
    works("command.Response.actor_id command.Response.error command.Response.has_error",
          "the actor of the command, or the reason why it failed")
    car.destroy()
    c.ticks(1)


@check
def attachments(c):
    car = c.car()
    for name, kind in carla.AttachmentType.names.items():
        found = c.library.find("sensor.camera.rgb")
        place = carla.Transform(carla.Location(x=-6.0, z=3.0))
        sensor = c.world.spawn_actor(found, place, attach_to=car, attachment_type=kind)
        c.ticks(30)
        gap = sensor.get_transform().location.distance(car.get_transform().transform(
            carla.Location(x=-6.0, z=3.0)))
        assert gap < 1.0, (name, gap)
        sensor.destroy()
        works(f"AttachmentType.{name}", "the camera stayed behind the standing vehicle")
    car.destroy()
    c.ticks(1)
