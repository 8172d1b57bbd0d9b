"""Checks that the server returns each property as it was set."""

import carla

from effects_kit import DELTA, TIMEOUT, arrived, near
from ledger import LISTED, check, differs, ignored, works
from values_records import short

GEARS = [carla.GearPhysicsControl(3.5, 0.4, 0.7), carla.GearPhysicsControl(1.5, 0.45, 0.75)]
PHYSICS = {
    "max_rpm": 7100.0, "moi": 0.9, "damping_rate_full_throttle": 0.1,
    "damping_rate_zero_throttle_clutch_engaged": 1.5,
    "damping_rate_zero_throttle_clutch_disengaged": 0.25, "use_gear_autobox": True,
    "gear_switch_time": 0.7, "clutch_strength": 7.0, "final_ratio": 3.1, "mass": 2100.0,
    "drag_coefficient": 0.5, "use_sweep_wheel_collision": True}
WHEEL = {
    "tire_friction": 3.0, "damping_rate": 0.5, "max_steer_angle": 45.0, "radius": 36.0,
    "max_brake_torque": 1234.0, "lat_stiff_max_load": 3.0, "lat_stiff_value": 15.0,
    "long_stiff_value": 5000.0}
SETTINGS = {
    "substepping": False, "max_substep_delta_time": 0.02, "max_substeps": 4,
    "max_culling_distance": 100.0, "deterministic_ragdolls": False,
    "tile_stream_distance": 1000.0, "actor_active_distance": 500.0, "spectator_as_ego": False}
WEATHER = {
    "cloudiness": 31.0, "precipitation": 32.0, "precipitation_deposits": 33.0,
    "wind_intensity": 34.0, "sun_azimuth_angle": 35.0, "sun_altitude_angle": 36.0,
    "fog_density": 37.0, "fog_distance": 38.0, "fog_falloff": 0.5, "wetness": 39.0,
    "scattering_intensity": 1.5, "mie_scattering_scale": 0.25, "rayleigh_scattering_scale": 0.125,
    "dust_storm": 40.0}
SEEN = "cloudiness precipitation precipitation_deposits wind_intensity sun_azimuth_angle " \
       "sun_altitude_angle fog_density fog_distance wetness".split()


def equal(got, expected, what):
    """Numbers pass the wire in single precision."""
    assert abs(got - expected) <= 1e-4 * max(1.0, abs(expected)), f"{what}: {got}, not {expected}"


@check
def settings_are_returned(c):
    before = c.world.get_settings()
    for name, value in SETTINGS.items():
        settings = c.world.get_settings()
        assert short(getattr(settings, name)) != short(value), name
        setattr(settings, name, value)
        c.world.apply_settings(settings)
        equal(getattr(c.world.get_settings(), name), value, name)
        differs(f"WorldSettings.{name}",
                "returned as set; physics has a fixed step of its own, and everything is loaded")
    c.world.apply_settings(before)
    assert c.world.get_settings() == before
    car = c.car()
    camera, images = c.sensor("sensor.camera.rgb", car, image_size_x=64, image_size_y=48)
    settings = c.world.get_settings()
    settings.no_rendering_mode = True
    c.world.apply_settings(settings)
    arrived(images)
    c.ticks(4)
    assert c.world.get_settings().no_rendering_mode
    blind = images.qsize()
    settings.no_rendering_mode = False
    c.world.apply_settings(settings)
    last = c.ticks(2)
    while images.get(timeout=TIMEOUT).frame < last:
        pass
    assert blind == 0, f"{blind} images without rendering"
    works("WorldSettings.no_rendering_mode", "cameras sent no images until it was off again")
    camera.destroy()
    car.destroy()


@check
def weather_is_returned(c):
    before = c.world.get_weather()
    for name, value in WEATHER.items():
        weather = c.world.get_weather()
        setattr(weather, name, value)
        c.world.set_weather(weather)
        c.world.tick()
        equal(getattr(c.world.get_weather(), name), value, name)
        if name in SEEN:
            works(f"WeatherParameters.{name}", "returned as set, and visible to cameras")
        else:
            differs(f"WeatherParameters.{name}", "returned as set, and stored only")
    presets = [name.split(".")[1] for name, kind in LISTED.items()
               if name.startswith("WeatherParameters.") and kind == "constant"]
    for preset in presets:
        given = getattr(carla.WeatherParameters, preset)
        c.world.set_weather(given)
        c.world.tick()
        read = c.world.get_weather()
        for name in WEATHER:
            # A negative value keeps the map's own.
            if getattr(given, name) >= 0.0:
                equal(getattr(read, name), getattr(given, name), f"{preset}.{name}")
        works(f"WeatherParameters.{preset}",
              f"returned as set: clouds {given.cloudiness:g}, rain {given.precipitation:g}, "
              f"sun at {given.sun_altitude_angle:g}°, fog {given.fog_density:g}")
    c.world.set_weather(before)
    c.world.tick()


@check
def controls_are_returned(c):
    # A vehicle with several gears.
    car = c.car("vehicle.audi.tt")
    for name, value in {"throttle": 0.25, "steer": -0.5, "brake": 0.75, "hand_brake": True,
                        "reverse": True, "manual_gear_shift": True, "gear": 2}.items():
        control = carla.VehicleControl(manual_gear_shift=name == "gear")
        setattr(control, name, value)
        car.apply_control(control)
        c.ticks(2)
        equal(getattr(car.get_control(), name), value, name)
    car.apply_control(carla.VehicleControl(throttle=0.6, hand_brake=True))
    start = car.get_location()
    c.ticks(20)
    assert car.get_location().distance(start) < 0.3
    works("VehicleControl.hand_brake", "returned as set; the vehicle was held against the throttle")
    car.apply_control(carla.VehicleControl(throttle=0.6, manual_gear_shift=True, gear=-1))
    c.ticks(30)
    back = car.get_location() - start
    ahead = car.get_transform().get_forward_vector()
    assert back.x * ahead.x + back.y * ahead.y < -0.3, back
    works("VehicleControl.manual_gear_shift VehicleControl.gear",
          "returned as set; the vehicle drove backwards in gear -1")
    car.destroy()
    walker = c.world.spawn_actor(c.library.filter("walker.pedestrian.*")[0], c.points[5])
    c.ticks(5)
    given = carla.WalkerControl(carla.Vector3D(y=2.0), 1.25, True)
    walker.apply_control(given)
    c.ticks(2)
    control = walker.get_control()
    assert control == given and control.direction.y == 2.0 and control.jump, control
    works("WalkerControl WalkerControl.direction WalkerControl.speed",
          "returned as set, also in the air")
    walker.destroy()
    c.ticks(1)


@check
def physics_is_returned(c):
    car = c.car()
    physics = car.get_physics_control()
    for name, value in PHYSICS.items():
        setattr(physics, name, value)
    physics.torque_curve = [carla.Vector2D(0.0, 200.0), carla.Vector2D(7000.0, 90.0)]
    physics.steering_curve = [carla.Vector2D(0.0, 1.0), carla.Vector2D(60.0, 0.5)]
    physics.forward_gears, physics.center_of_mass = GEARS, carla.Vector3D(0.1, 0.05, -0.02)
    wheels = physics.wheels
    for name, value in WHEEL.items():
        setattr(wheels[0], name, value)
    wheels[2].max_handbrake_torque = 2345.0
    physics.wheels = wheels
    car.apply_physics_control(physics)
    c.ticks(2)
    read = car.get_physics_control()
    plain = "returned as set"
    for name, value in PHYSICS.items():
        equal(getattr(read, name), value, name)
    works(" ".join(f"VehiclePhysicsControl.{name}" for name in PHYSICS
                   if name != "use_sweep_wheel_collision"), plain)
    differs("VehiclePhysicsControl.use_sweep_wheel_collision",
            "returned as set; wheels are always swept")
    for curve in ("torque_curve", "steering_curve"):
        for one, other in zip(getattr(physics, curve), getattr(read, curve), strict=True):
            equal(other.x, one.x, curve)
            equal(other.y, one.y, curve)
    assert read.center_of_mass.distance(physics.center_of_mass) < 1e-4
    for one, other in zip(GEARS, read.forward_gears, strict=True):
        for name in ("ratio", "down_ratio", "up_ratio"):
            equal(getattr(other, name), getattr(one, name), name)
    works("VehiclePhysicsControl.torque_curve VehiclePhysicsControl.steering_curve "
          "VehiclePhysicsControl.center_of_mass VehiclePhysicsControl.forward_gears "
          "GearPhysicsControl.ratio GearPhysicsControl.down_ratio GearPhysicsControl.up_ratio", plain)
    assert len(read.wheels) == 4
    for name, value in WHEEL.items():
        equal(getattr(read.wheels[0], name), value, name)
    equal(read.wheels[2].max_handbrake_torque, 2345.0, "max_handbrake_torque")
    works("VehiclePhysicsControl.wheels WheelPhysicsControl.max_handbrake_torque "
          + " ".join(f"WheelPhysicsControl.{name}" for name in WHEEL), plain)
    place, front = car.get_transform(), read.wheels[0].position
    # CARLA gives the centre of the wheel in the world, in centimetres.
    at = place.inverse_transform(carla.Location(front.x / 100, front.y / 100, front.z / 100))
    assert 1.0 < at.x < 2.0 and -1.0 < at.y < -0.5 and 0.1 < at.z < 0.6, at
    works("WheelPhysicsControl.position", "the centre of the front left wheel, in the world, in "
          "centimetres")
    car.destroy()
    c.ticks(1)


@check
def ackermann_is_returned(c):
    car = c.car()
    given = {"speed_kp": 0.2, "speed_ki": 0.1, "speed_kd": 0.25, "accel_kp": 0.01,
             "accel_ki": 0.02, "accel_kd": 0.03}
    car.apply_ackermann_controller_settings(carla.AckermannControllerSettings(**given))
    c.ticks(2)
    read = car.get_ackermann_controller_settings()
    for name, value in given.items():
        equal(getattr(read, name), value, name)
        works(f"AckermannControllerSettings.{name}", "returned as set")
    car.destroy()
    car = c.car()
    # The wheel turns at the rate that is given, and the vehicle accelerates no faster than given.
    car.apply_ackermann_control(carla.VehicleAckermannControl(steer=0.4, steer_speed=0.2))
    c.ticks(int(1.0 / DELTA))
    half = car.get_wheel_steer_angle(carla.VehicleWheelLocation.FL_Wheel)
    c.ticks(int(2.0 / DELTA))
    whole = car.get_wheel_steer_angle(carla.VehicleWheelLocation.FL_Wheel)
    assert 0.35 < half / whole < 0.65, (half, whole)
    works("VehicleAckermannControl.steer_speed", "the wheels turned at this rate, in rad/s")

    def speed_after(seconds, **control):
        car = c.car()
        car.apply_ackermann_control(carla.VehicleAckermannControl(speed=10.0, **control))
        c.ticks(int(seconds / DELTA))
        speed = car.get_velocity().length()
        car.destroy()
        return speed

    free, slow = speed_after(3.0), speed_after(3.0, acceleration=0.5)
    assert 0.5 < slow < 1.6 < free, (slow, free)
    works("VehicleAckermannControl.acceleration", "the vehicle accelerated no faster, in m/s²")
    smooth = speed_after(3.0, acceleration=3.0, jerk=0.1)
    assert 0.0 < smooth < 0.5 * 0.1 * 3.0 ** 2 + 0.1, smooth
    works("VehicleAckermannControl.jerk", "the acceleration changed no faster, in m/s³")
    car.destroy()
    c.ticks(1)


@check
def vehicle_lights_are_returned(c):
    car = c.car()
    for name, state in carla.VehicleLightState.names.items():
        car.set_light_state(state)
        c.ticks(2)
        # All: CARLA's server has eleven lights.
        shown = int(state) & 0x7FF
        assert int(car.get_light_state()) == shown, (name, car.get_light_state())
        works(f"VehicleLightState.{name}", f"returned as {shown}")
    car.destroy()


@check
def doors(c):
    car = c.car()
    for name, door in carla.VehicleDoor.names.items():
        car.open_door(door)
        c.ticks(2)
        bones = zip(car.get_bone_names(), car.get_bone_relative_transforms(), strict=True)
        # The hinge of an open door is turned.
        opened = [bone for bone, pose in bones
                  if bone.startswith("door") and abs(pose.rotation.yaw) > 20.0]
        car.close_door(door)
        c.ticks(2)
        assert len(opened) == (4 if name == "All" else 1), (name, opened)
        works(f"VehicleDoor.{name}", f"opened {', '.join(f'`{one}`' for one in opened)}")
    car.destroy()
