"""Checks of vehicle physics, forces and telemetry, and of walkers that jump and fall."""

import math

import carla

from effects_kit import DELTA, near
from ledger import check, differs, works


def speed(car):
    velocity = car.get_velocity()
    return math.hypot(velocity.x, velocity.y)


def distance_in(c, car, seconds):
    start = car.get_location()
    c.ticks(int(seconds / DELTA))
    return start.distance(car.get_location())


def numbers(physics):
    """Returns all numbers of a VehiclePhysicsControl except the positions of its wheels."""
    wheels = [
        [w.tire_friction, w.damping_rate, w.max_steer_angle, w.radius, w.max_brake_torque,
         w.max_handbrake_torque, w.lat_stiff_max_load, w.lat_stiff_value, w.long_stiff_value]
        for w in physics.wheels]
    gears = [[g.ratio, g.down_ratio, g.up_ratio] for g in physics.forward_gears]
    com = physics.center_of_mass
    return [
        [[p.x, p.y] for p in physics.torque_curve], physics.max_rpm, physics.moi,
        physics.damping_rate_full_throttle, physics.damping_rate_zero_throttle_clutch_engaged,
        physics.damping_rate_zero_throttle_clutch_disengaged, physics.use_gear_autobox,
        physics.gear_switch_time, physics.clutch_strength, physics.final_ratio, gears,
        physics.mass, physics.drag_coefficient, [com.x, com.y, com.z],
        [[p.x, p.y] for p in physics.steering_curve], wheels, physics.use_sweep_wheel_collision]


def same(a, b, path=""):
    """Asserts that two lists of numbers are equal, to the last bit."""
    if isinstance(a, list):
        assert len(a) == len(b), path
        for index, (x, y) in enumerate(zip(a, b)):
            same(x, y, f"{path}[{index}]")
    else:
        assert a == b, f"{path}: {a} differs from {b}"


def launch(c, change):
    """Changes the physics of a vehicle; returns how many metres it drives in three seconds of full
    throttle, and the physics that were set and read."""
    car = c.car()
    physics = car.get_physics_control()
    change(physics)
    car.apply_physics_control(physics)
    c.ticks(2)
    car.apply_control(carla.VehicleControl(throttle=1.0))
    meters = distance_in(c, car, 3.0)
    read = car.get_physics_control()
    car.destroy()
    return meters, physics, read


@check
def physics_control(c):
    plain, _, before = launch(c, lambda physics: None)

    def every_number(p):
        p.torque_curve = [carla.Vector2D(0.0, 200.0), carla.Vector2D(4000.0, 180.0),
                          carla.Vector2D(7000.0, 90.0)]
        p.max_rpm, p.moi = 7100.0, 0.9
        p.damping_rate_full_throttle = 0.1
        p.damping_rate_zero_throttle_clutch_engaged = 1.5
        p.damping_rate_zero_throttle_clutch_disengaged = 0.25
        p.gear_switch_time, p.clutch_strength, p.final_ratio = 0.7, 7.3, 3.1
        p.forward_gears = [carla.GearPhysicsControl(3.0, 0.4, 0.7),
                           carla.GearPhysicsControl(1.5, 0.45, 0.75)]
        p.mass, p.drag_coefficient = p.mass * 1.5, 0.5
        p.center_of_mass = carla.Vector3D(0.1, 0.05, -0.02)
        p.steering_curve = [carla.Vector2D(0.0, 1.0), carla.Vector2D(20.16, 0.9),
                            carla.Vector2D(60.1, 0.6)]
        wheels = p.wheels
        for index, wheel in enumerate(wheels):
            wheel.tire_friction, wheel.damping_rate = 3.01 + 0.1 * index, 0.5
            wheel.radius, wheel.max_brake_torque = wheel.radius + 1.3, 1234.5
            wheel.lat_stiff_max_load, wheel.lat_stiff_value = 3.0, 15.0
            wheel.long_stiff_value = 5001.3
            if wheel.max_steer_angle > 0.0:
                wheel.max_steer_angle = 44.3
            else:
                wheel.max_handbrake_torque = 2345.0
        p.wheels = wheels
        p.use_sweep_wheel_collision = True

    slow, written, read = launch(c, every_number)
    same(numbers(written), numbers(read))
    assert slow < 0.8 * plain, f"{slow} m instead of {plain} m"
    assert before.wheels[0].max_steer_angle > before.wheels[2].max_steer_angle == 0.0
    bicycle = c.car("vehicle.bh.crossbike")
    physics = bicycle.get_physics_control()
    assert len(physics.wheels) == len(bicycle.get_telemetry_data().wheels) == 4
    left, right, rear, _ = physics.wheels
    assert left.max_steer_angle == right.max_steer_angle > rear.max_steer_angle == 0.0
    bicycle.apply_physics_control(physics)
    c.ticks(1)
    same(numbers(physics), numbers(bicycle.get_physics_control()))
    wheels = physics.wheels
    for index, wheel in enumerate(wheels):
        wheel.tire_friction, wheel.max_brake_torque = 2.1 + 0.1 * index, 40.1 + index
    physics.wheels = wheels
    bicycle.apply_physics_control(physics)
    c.ticks(1)
    same(numbers(physics), numbers(bicycle.get_physics_control()))
    load = sum(w.tire_load for w in bicycle.get_telemetry_data().wheels)
    near(load / (physics.mass * 9.81), 1.0, 0.05)
    bicycle.destroy()

    car = c.car()
    good = numbers(car.get_physics_control())

    def refused(change):
        bad = car.get_physics_control()
        change(bad)
        answer = c.client.apply_batch_sync(
            [carla.command.ApplyVehiclePhysicsControl(car.id, bad)])[0]
        assert answer.has_error(), numbers(bad)
        c.ticks(1)
        same(good, numbers(car.get_physics_control()))
        return answer.error

    for number in (float("nan"), float("inf"), -100.0, 1e30):
        error = refused(lambda p: setattr(p, "mass", number))
        assert "mass" in error, error
    assert "torque curve" in refused(lambda p: setattr(p, "torque_curve", []))
    assert "wheels" in refused(lambda p: setattr(p, "wheels", p.wheels[:3]))
    differs("Vehicle.get_physics_control Vehicle.apply_physics_control "
            "command.ApplyVehiclePhysicsControl",
            "every number was read as it was set, and a heavy vehicle with a weak engine "
            "accelerated less; a friction of 3.5 is the blueprint's own tyre, gears shift at "
            "their ratios at half throttle, wheel positions are fixed, "
            "`use_sweep_wheel_collision` has no effect; two-wheelers have four wheels, as in CARLA: "
            "each of theirs is a left and a right one")
    car.destroy()


@check
def ackermann_control(c):
    car = c.car()
    assert car.get_ackermann_controller_settings().speed_kp > 0.1
    settings = carla.AckermannControllerSettings(
        speed_kp=0.2, speed_ki=0.0, speed_kd=0.25, accel_kp=0.01, accel_ki=0.0, accel_kd=0.01)
    car.apply_ackermann_controller_settings(settings)
    c.ticks(1)
    near(car.get_ackermann_controller_settings().speed_kp, 0.2, 1e-6)
    works("Vehicle.get_ackermann_controller_settings Vehicle.apply_ackermann_controller_settings",
          "the settings were read as they were set")
    car.apply_ackermann_control(carla.VehicleAckermannControl(speed=3.0))
    c.ticks(160)
    near(speed(car), 3.0, 0.7)
    car.apply_ackermann_control(carla.VehicleAckermannControl(speed=3.0, steer=0.2))
    c.ticks(10)
    angle = car.get_wheel_steer_angle(carla.VehicleWheelLocation.FL_Wheel)
    near(math.radians(angle), 0.2, 0.03)
    car.apply_ackermann_control(carla.VehicleAckermannControl())
    c.ticks(120)
    assert speed(car) < 0.05, speed(car)
    c.client.apply_batch_sync([carla.command.ApplyVehicleAckermannControl(
        car, carla.VehicleAckermannControl(speed=2.0))])
    c.ticks(120)
    near(speed(car), 2.0, 0.5)
    works("Vehicle.apply_ackermann_control command.ApplyVehicleAckermannControl "
          "VehicleAckermannControl.steer VehicleAckermannControl.speed",
          "the vehicle drove 3 m/s, turned its wheels 0.2 rad to the right, and stopped")
    car.destroy()


@check
def forces_gravity_and_collisions(c):
    car = c.car()
    physics = car.get_physics_control()
    ahead = car.get_transform().get_forward_vector()
    c.ticks(20)
    car.add_impulse(physics.mass * 5.0 * ahead)
    c.world.tick()
    near(speed(car), 5.0, 0.5)
    car.apply_control(carla.VehicleControl(brake=1.0))
    c.ticks(60)
    car.apply_control(carla.VehicleControl())
    car.add_force(physics.mass * 5.0 / DELTA * ahead)
    c.world.tick()
    near(speed(car), 5.0, 0.5)
    works("Actor.add_impulse Actor.add_force",
          "an impulse of five times the mass, or an equal force over one tick, changed the speed "
          "by 5 m/s")
    car.apply_control(carla.VehicleControl(brake=1.0))
    c.ticks(60)
    car.set_enable_gravity(False)
    car.set_location(car.get_location() + carla.Location(z=4.0))
    c.ticks(1)
    high = car.get_location().z
    c.ticks(30)
    near(car.get_location().z, high, 0.02)
    car.add_angular_impulse(carla.Vector3D(z=2000.0))
    c.ticks(2)
    spun = math.radians(car.get_angular_velocity().z)
    # About 3000 kg m² about the vertical axis.
    assert 0.3 < spun < 1.5, spun
    car.add_torque(carla.Vector3D(z=2000.0))
    c.ticks(2)
    near(math.radians(car.get_angular_velocity().z), 2.0 * spun, 0.2 * spun)
    differs("Actor.add_angular_impulse Actor.add_torque",
            "newton metre seconds about the body's own inertia; the official client sends both as"
            " an impulse")
    c.client.apply_batch_sync([carla.command.SetEnableGravity(car, True)])
    c.ticks(40)
    assert car.get_location().z < high - 3.0
    works("Actor.set_enable_gravity command.SetEnableGravity",
          "the actor stayed in the air without gravity and fell with it")
    car.destroy()
    c.ticks(1)

    one, other = c.car(), c.car()
    c.ticks(10)
    one.set_collisions(False)
    stood = other.get_location()
    one.set_transform(other.get_transform())
    c.ticks(20)
    near(stood.distance(other.get_location()), 0.0, 0.05)
    near(one.get_location().distance(other.get_location()), 0.0, 0.5)
    works("Actor.set_collisions", "two vehicles stood at one place on the ground")
    one.destroy()
    other.destroy()


@check
def telemetry(c):
    car = c.car()
    c.ticks(40)
    weight = car.get_physics_control().mass * 9.81
    data = car.get_telemetry_data()
    near(sum(w.tire_load for w in data.wheels) / weight, 1.0, 0.03)
    car.apply_control(carla.VehicleControl(throttle=1.0))
    c.ticks(20)
    data = car.get_telemetry_data()
    assert data.engine_rpm > 500.0 and data.throttle == 1.0 and data.gear >= 1
    near(data.speed, speed(car), 0.3)
    along = sum(w.long_force for w in data.wheels)
    assert along > 0.1 * weight, along
    assert any(w.long_slip > 0.0 and w.torque > 50.0 and w.omega > 5.0 for w in data.wheels)
    car.apply_control(carla.VehicleControl(throttle=0.3, steer=0.5))
    c.ticks(15)
    data = car.get_telemetry_data()
    # At a kerb, one wheel may be pushed the other way.
    across = [w.lat_force for w in data.wheels]
    assert sum(across) > 0.1 * weight, across
    differs("Vehicle.get_telemetry_data",
            "tyre loads added up to the weight, forces accelerated and turned the vehicle; "
            "normalised forces are fractions of the load")
    car.destroy()


@check
def gears_and_yaw(c):
    car = c.car("vehicle.audi.tt")
    car.apply_control(carla.VehicleControl(throttle=0.2, manual_gear_shift=True, gear=2))
    c.ticks(2)
    control = car.get_control()
    assert control.manual_gear_shift and control.gear == 2, control
    car.apply_control(carla.VehicleControl(brake=1.0))
    c.ticks(40)
    assert not car.get_control().manual_gear_shift
    works("VehicleControl.manual_gear_shift VehicleControl.gear",
          "the second gear was engaged and read while it was selected")
    place = car.get_transform()
    car.set_simulate_physics(False)
    for yaw in (180.0, 90.0, -90.0, 0.0):
        place.rotation = carla.Rotation(yaw=yaw)
        car.set_transform(place)
        c.ticks(1)
        assert car.get_transform().rotation.yaw == yaw, (car.get_transform(), yaw)
    car.destroy()
    c.ticks(1)
    place.rotation.yaw = 180.0
    # Above whatever is beside the lane.
    place.location.z += 30.0
    car = c.world.spawn_actor(c.library.find("vehicle.tesla.model3"), place)
    car.set_simulate_physics(False)
    spectator = c.world.get_spectator()
    spectator.set_transform(place)
    c.ticks(2)
    near(abs(car.get_transform().rotation.yaw), 180.0, 0.1)
    assert spectator.get_transform().rotation.yaw == 180.0, spectator.get_transform()
    car.destroy()
    works("Rotation.yaw", "180 and other right angles were read as they were set")


@check
def jump_and_ragdoll(c):
    car = c.car()
    c.ticks(20)
    ahead = car.get_transform().get_forward_vector()
    blueprint = c.library.filter("walker.pedestrian.*")[0]
    blueprint.set_attribute("is_invincible", "false")
    place = car.get_transform()
    place.location += 12.0 * ahead + carla.Location(z=0.5)
    walker = c.world.spawn_actor(blueprint, place)
    c.ticks(5)
    ground = walker.get_location().z
    walker.apply_control(carla.WalkerControl(jump=True))
    highest = 0.0
    for _ in range(25):
        c.world.tick()
        highest = max(highest, walker.get_location().z - ground)
    assert 0.5 < highest < 1.3, highest
    near(walker.get_location().z, ground, 0.1)
    works("WalkerControl.jump", "the walker jumped 0.9 m high and landed")
    car.set_target_velocity(11.0 * ahead)
    car.apply_control(carla.VehicleControl(brake=0.4))
    c.ticks(80)
    bones = {bone.name: bone for bone in walker.get_bones().bone_transforms}
    for name in ("crl_Head__C", "crl_spine01__C", "crl_foot__L", "crl_hand__R"):
        assert abs(bones[name].world.location.z - ground) < 0.7, (name, bones[name].world)
    turned = [bone.relative.rotation for bone in bones.values()]
    bent = [turn for turn in turned if max(map(abs, (turn.pitch, turn.yaw, turn.roll))) > 8.0]
    assert len(bent) >= 4, bent
    c.ticks(40)
    rests = walker.get_transform()
    c.ticks(20)
    near(walker.get_location().distance(rests.location), 0.0, 0.01)
    walker.destroy()
    car.destroy()
