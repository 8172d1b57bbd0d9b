"""Checks of sensors: cameras, lidars, radar, inertial sensors, radios."""

import math
import queue

import carla
import numpy as np

from effects_kit import TIMEOUT, arrived, near, of_frame, pixels
from ledger import check, differs, works


@check
def cameras(c):
    car = c.car()
    size = {"image_size_x": 160, "image_size_y": 120}
    cameras = {kind: c.sensor(f"sensor.camera.{kind}", car, **size) for kind in
               ("rgb", "depth", "semantic_segmentation", "instance_segmentation")}
    for _ in range(5):
        frame = c.world.tick()
        images = {kind: measured.get(timeout=TIMEOUT) for kind, (_, measured) in cameras.items()}
        assert all(image.frame == frame for image in images.values())
    rgb, depth = pixels(images["rgb"]), pixels(images["depth"]).astype(np.float64)
    assert rgb[:, :, :3].std() > 10.0 and (rgb[:, :, 3] == 255).all()
    metres = 1000.0 * (depth[:, :, 2] + 256 * depth[:, :, 1] + 65536 * depth[:, :, 0]) / (2**24 - 1)
    assert 0.5 < metres[110, 80] < 20.0 and metres[:30].max() > 900.0
    tags = pixels(images["semantic_segmentation"])[:, :, 2]
    assert (tags == 1).mean() > 0.05 and (tags == 11).any(), "the road must be below, the sky above"
    assert (pixels(images["instance_segmentation"])[:, :, 2] == tags).mean() > 0.99
    assert images["rgb"].fov == 90.0
    near(images["rgb"].timestamp, c.world.get_snapshot().timestamp.elapsed_seconds, 1e-6)
    placed = images["rgb"].transform.location
    assert placed.distance(car.get_transform().transform(carla.Location(x=1.0, z=2.2))) < 0.1
    works("sensor.camera.rgb sensor.camera.depth sensor.camera.semantic_segmentation "
          "sensor.camera.instance_segmentation Sensor.listen Image.raw_data Image.fov "
          "Image.width Image.height SensorData.frame SensorData.transform SensorData.timestamp",
          "every image had its exact frame; the road was below, the sky above, depth in a "
          "plausible range")
    cameras["rgb"][0].stop()
    c.ticks(3)
    arrived(cameras["rgb"][1])
    frame = c.ticks(3)
    assert cameras["rgb"][1].empty()
    works("Sensor.stop", "no more images arrived")
    for name, (sensor, measured) in cameras.items():
        if name != "rgb":
            of_frame(measured, frame)
        sensor.destroy()
    slow, measured = c.sensor("sensor.camera.rgb", car, sensor_tick=0.2, **size)
    c.ticks(12)
    frames = [image.frame for image in arrived(measured, 2)]
    assert 2 <= len(frames) <= 4 and all(b - a == 4 for a, b in zip(frames, frames[1:])), frames
    works("sensor_tick", "an image arrived every fourth frame")
    slow.destroy()
    car.destroy()


@check
def effects_of_cameras(c):
    size = {"image_size_x": 160, "image_size_y": 120}
    car = c.car()
    cameras = {name: c.sensor("sensor.camera.rgb", car, **size, **attributes) for name, attributes in {
        "plain": {},
        "defaults": {"exposure_mode": "histogram", "bloom_intensity": 0.675, "fstop": 1.4},
        "off": {"enable_postprocess_effects": "False", "temp": 3000, "exposure_compensation": 2},
        "brighter": {"exposure_compensation": 1},
        "manual": {"exposure_mode": "manual", "iso": 100, "shutter_speed": 128, "fstop": 4},
        "darker": {"exposure_mode": "manual", "iso": 50, "shutter_speed": 128, "fstop": 4},
        "automatic": {"exposure_min_bright": 20, "exposure_max_bright": 21},
        "gamma": {"gamma": 3.0},
        "cold": {"temp": 3000},
        "green": {"tint": 0.8},
        "steep": {"slope": 1.6},
        "bloom": {"bloom_intensity": 4},
        "fringe": {"chromatic_aberration_intensity": 4},
        "near": {"focal_distance": 20, "fstop": 1.2},
    }.items()}
    for _ in range(3):
        c.world.tick()
        seen = {name: pixels(measured.get(timeout=TIMEOUT)).astype(np.float64)
                for name, (_, measured) in cameras.items()}
    plain = seen["plain"]
    assert (seen["defaults"] == plain).all() and (seen["off"] == plain).all()
    mean = {name: image[:, :, :3].mean() for name, image in seen.items()}
    assert mean["brighter"] > 1.15 * mean["plain"] and mean["gamma"] > 1.1 * mean["plain"], mean
    near(mean["manual"], mean["plain"], 25.0)
    assert mean["darker"] < 0.85 * mean["manual"] and mean["automatic"] < 0.2 * mean["plain"], mean
    blue, green, red = (seen["cold"][:, :, channel].mean() for channel in range(3))
    assert blue / red > 1.2 * plain[:, :, 0].mean() / plain[:, :, 2].mean()
    green = seen["green"][:, :, 1].mean() / seen["green"][:, :, 2].mean()
    assert green > 1.05 * plain[:, :, 1].mean() / plain[:, :, 2].mean()
    assert seen["steep"][:, :, :3].std() > 1.05 * plain[:, :, :3].std()
    for name in ("bloom", "fringe", "near"):
        assert (abs(seen[name] - plain) > 8).any(axis=2).mean() > 0.01, name
    for sensor, _ in cameras.values():
        sensor.destroy()
    car.destroy()


@check
def lidars_and_radar(c):
    car = c.car()
    lidar = c.sensor("sensor.lidar.ray_cast", car, channels=32, range=50, dropoff_general_rate=0,
                     points_per_second=200000, rotation_frequency=20)
    labelled = c.sensor("sensor.lidar.ray_cast_semantic", car, channels=16, range=50,
                        points_per_second=100000, rotation_frequency=20)
    radar = c.sensor("sensor.other.radar", car, points_per_second=20000, range=80)
    for _ in range(3):
        frame = c.world.tick()
        scan, labels, echoes = [s[1].get(timeout=TIMEOUT) for s in (lidar, labelled, radar)]
        assert scan.frame == labels.frame == echoes.frame == frame
    points = np.frombuffer(scan.raw_data, dtype=np.float32).reshape(-1, 4)
    assert scan.channels == 32 and len(points) > 1000
    assert -math.pi <= scan.horizontal_angle <= math.pi, scan.horizontal_angle
    assert sum(scan.get_point_count(channel) for channel in range(32)) == len(points)
    assert np.linalg.norm(points[:, :3], axis=1).max() <= 50.5
    below = points[:, 2] < -1.5
    assert below.mean() > 0.2, "too few points of the lidar are on the ground"
    works("sensor.lidar.ray_cast LidarMeasurement.raw_data LidarMeasurement.channels "
          "LidarMeasurement.get_point_count LidarMeasurement.horizontal_angle",
          "points were within range, the ground below")
    assert {detection.object_tag for detection in labels} & {1, 2, 10, 24}
    road = [one for one in labels if one.object_tag in (1, 24) and one.point.z < -1.5]
    assert len(road) > 50
    for one in road:
        # On flat ground, the angle of incidence follows from the depression angle of the ray.
        away = math.sqrt(one.point.x ** 2 + one.point.y ** 2 + one.point.z ** 2)
        near(one.cos_inc_angle, -one.point.z / away, 0.12)
    works("sensor.lidar.ray_cast_semantic SemanticLidarDetection.cos_inc_angle",
          "on the road, the value was the sine of the ray's depression angle")
    assert 10 < len(echoes) <= 1000 and all(0.0 < echo.depth <= 80.5 for echo in echoes)
    spread = [math.hypot(math.tan(echo.azimuth), math.tan(echo.altitude)) for echo in echoes]
    assert max(spread) <= math.tan(math.radians(15.0)) + 0.01
    places = {(round(echo.azimuth, 4), round(echo.altitude, 4)) for echo in echoes}
    c.world.tick()
    others = {(round(echo.azimuth, 4), round(echo.altitude, 4))
              for echo in radar[1].get(timeout=TIMEOUT)}
    assert len(places & others) < len(places), "the points are at the same places in the next frame"
    works("sensor.other.radar RadarDetection.depth RadarDetection.azimuth RadarDetection.altitude",
          "points were within the cone, at other places in each frame")
    for sensor, _ in (lidar, labelled, radar):
        sensor.destroy()
    car.destroy()


@check
def physics_sensors(c):
    car = c.car()
    imu = c.sensor("sensor.other.imu", car)
    gnss = c.sensor("sensor.other.gnss", car)
    c.ticks(20)
    frame = c.world.tick()
    while True:
        measured_now = imu[1].get(timeout=TIMEOUT)
        if measured_now.frame == frame:
            break
    near(measured_now.accelerometer.z, 9.81, 0.5)
    assert measured_now.gyroscope.length() < 0.02, measured_now.gyroscope
    heading = math.radians(car.get_transform().rotation.yaw + 90.0) % (2 * math.pi)
    near((measured_now.compass - heading + math.pi) % (2 * math.pi), math.pi, 0.02)
    works("sensor.other.imu IMUMeasurement.accelerometer IMUMeasurement.gyroscope "
          "IMUMeasurement.compass",
          "the accelerometer at rest measured gravity upwards; the compass was the vehicle's "
          "heading")
    c.world.set_imui_sensor_gravity(1.62)
    near(c.world.get_imui_sensor_gravity(), 1.62, 1e-6)
    c.ticks(2)
    frame = c.world.tick()
    measured_now = of_frame(imu[1], frame)
    near(measured_now.accelerometer.z, 1.62, 0.1)
    c.world.set_imui_sensor_gravity(9.81)
    works("World.set_imui_sensor_gravity World.get_imui_sensor_gravity",
          "the accelerometer at rest measured the gravity of the moon")
    away = car.get_transform()
    away.location += 6.0 * away.get_forward_vector()
    car.set_target_velocity(15.0 * away.get_forward_vector())
    c.ticks(3)
    car.set_transform(away)
    for _ in range(3):
        measured_now = of_frame(imu[1], c.world.tick())
        assert abs(measured_now.accelerometer.x) < 20.0, measured_now
    works("sensor.other.imu:teleport", "the IMU measured no acceleration from a teleport")
    frame = c.world.tick()
    while True:
        fix = gnss[1].get(timeout=TIMEOUT)
        if fix.frame == frame:
            break
    there = c.map.transform_to_geolocation(fix.transform.location)
    near(fix.latitude, there.latitude, 1e-8)
    near(fix.longitude, there.longitude, 1e-8)
    works("sensor.other.gnss GnssMeasurement.latitude GnssMeasurement.longitude "
          "Map.transform_to_geolocation", "the position matched the map's geolocation")
    hits = c.sensor("sensor.other.collision", car)
    obstacle = c.sensor("sensor.other.obstacle", car, distance=40)
    ahead = car.get_transform()
    ahead.location += 12.0 * ahead.get_forward_vector() + carla.Location(z=0.2)
    wall = c.world.try_spawn_actor(c.library.find("vehicle.carlamotors.firetruck"), ahead)
    assert wall is not None
    c.ticks(2)
    seen = obstacle[1].get(timeout=TIMEOUT)
    assert seen.other_actor.id == wall.id and 2.0 < seen.distance < 15.0
    mass = car.get_physics_control().mass
    car.set_target_velocity(12.0 * car.get_transform().get_forward_vector())
    c.ticks(30)
    events = arrived(hits[1], 1)
    assert len({event.frame for event in events}) == len(events)
    assert all(e.actor.id == car.id and e.other_actor.id == wall.id for e in events)
    given = sum(event.normal_impulse.x * ahead.get_forward_vector().x
                + event.normal_impulse.y * ahead.get_forward_vector().y for event in events)
    # The vehicle stops or rebounds a little.
    assert -1.6 < given / (12.0 * mass) < -0.6, (given, mass)
    works("sensor.other.collision CollisionEvent.actor CollisionEvent.other_actor "
          "CollisionEvent.normal_impulse",
          "one event for each frame and other actor; the impulses added up to the vehicle's "
          "momentum")
    house = max(c.world.get_environment_objects(carla.CityObjectLabel.Buildings),
                key=lambda house: house.bounding_box.extent.y).bounding_box
    facing = carla.Transform(house.location, house.rotation)
    facing.location -= (house.extent.x + 8.0) * facing.get_forward_vector()
    car.set_simulate_physics(False)
    car.set_transform(facing)
    blind = c.sensor("sensor.other.obstacle", car, distance=40, only_dynamics=True)
    for queue in (obstacle[1], blind[1]):
        arrived(queue)
    frame = c.world.tick()
    seen = of_frame(obstacle[1], frame)
    assert seen.other_actor.id == 0 and seen.other_actor.type_id.startswith("static."), seen
    assert 0.0 <= seen.distance < 9.0, seen
    assert blind[1].empty() or blind[1].get().other_actor.type_id.startswith("vehicle.")
    works("sensor.other.obstacle ObstacleDetectionEvent.other_actor "
          "ObstacleDetectionEvent.distance",
          "the distance that the sensor's sphere travels to a vehicle and to a house; none to the"
          " house with `only_dynamics`")
    blind[0].destroy()
    for sensor, _ in (imu, gnss, hits, obstacle):
        sensor.destroy()
    car.destroy()
    wall.destroy()


@check
def radios(c):
    cars = [c.car(), c.car()]
    quiet = dict(use_etsi_fading=False, scenario="urban", filter_distance=5000,
                 receiver_sensitivity=-200)
    stations = [c.sensor("sensor.other.v2x", car, **quiet) for car in cars]
    chats = [c.sensor("sensor.other.v2x_custom", car, **quiet) for car in cars]
    c.ticks(30)
    events = arrived(stations[0][1], 1)
    assert 1 <= len(events) <= 3 and all(len(event) == 1 for event in events), events
    received = events[-1][0].get()
    message = received["Message"]["Message"]["CAM Parameters"]
    assert received["Message"]["Header"]["Station ID"] == cars[1].id, received
    basic = message["Basic Container"]
    assert basic["Station Type"] == "Passenger Car"
    there = c.map.transform_to_geolocation(cars[1].get_location())
    near(basic["Reference Position"]["Latitude"] * 1e-7, there.latitude, 2e-6)
    near(basic["Reference Position"]["Longitude"] * 1e-7, there.longitude, 2e-6)
    fast = message["High Frequency Container"]["Basic Vehicle Container High Frequency"]
    yaw = cars[1].get_transform().rotation.yaw
    near((fast["Heading"]["Value"] / 10.0 - yaw - 90.0 + 180.0) % 360.0, 180.0, 1.0)
    near(fast["Vehicle Length"]["Value"] / 10.0, 2.0 * cars[1].bounding_box.extent.x, 0.06)
    # A station sends again when its speed has changed by 0.5 m/s or its position by 4 m.
    cars[1].set_target_velocity(8.0 * cars[1].get_transform().get_forward_vector())
    c.ticks(2)
    speed = stations[0][1].get(timeout=TIMEOUT)[0].get()
    speed = speed["Message"]["Message"]["CAM Parameters"]["High Frequency Container"]
    speed = speed["Basic Vehicle Container High Frequency"]["Speed"]["Value"]
    assert 600 <= speed <= 850, speed
    # Not stronger than ETSI's path loss of an urban street in line of sight.
    away = cars[0].get_location().distance(cars[1].get_location())
    clear = 31.5 - (38.77 + 16.7 * math.log10(away) + 18.2 * math.log10(5.9))
    assert events[-1][0].power <= clear + 0.5, (events[-1][0].power, clear)
    works("sensor.other.v2x CAMEvent.__len__ CAMEvent.__getitem__ CAMMessage.get CAMMessage.power",
          "identity, position, heading and speed of the other station; sent when they change; "
          "weaker than in free space")
    chats[1][0].send("turn left")
    c.ticks(2)
    event = chats[0][1].get(timeout=TIMEOUT)
    assert len(event) == 1 and "turn left" in str(event[0].get()), event[0].get()
    assert chats[1][1].empty()
    works("sensor.other.v2x_custom ServerSideSensor.send CustomV2XEvent.__len__ "
          "CustomV2XEvent.__getitem__ CustomV2XData.get",
          "the other station received the text once")
    for sensor, _ in stations + chats:
        sensor.destroy()
    for car in cars:
        car.destroy()


@check
def lane_invasion(c):
    car = c.car()
    crossed = c.sensor("sensor.other.lane_invasion", car)
    c.world.tick()
    side = car.get_transform().get_right_vector()
    for _ in range(20):
        car.set_location(car.get_location() - 0.4 * carla.Location(side.x, side.y, side.z))
        c.world.tick()
    event = crossed[1].get(timeout=TIMEOUT)
    assert event.crossed_lane_markings
    works("sensor.other.lane_invasion LaneInvasionEvent.crossed_lane_markings",
          "the client found the crossed line when the vehicle moved sideways")
    crossed[0].destroy()
    car.destroy()


@check
def normals_flow_and_events(c):
    car = c.car()
    size = {"image_size_x": 160, "image_size_y": 120}
    ahead = carla.Transform(carla.Location(x=3.5, z=2.0))
    normals, lie = c.sensor("sensor.camera.normals", car, ahead, **size)
    flow, move = c.sensor("sensor.camera.optical_flow", car, ahead, **size)
    dvs, change = c.sensor("sensor.camera.dvs", car, ahead, **size)
    still = carla.Transform(car.get_location() + carla.Location(z=500.0), carla.Rotation(pitch=89.0))
    dull, never = c.sensor("sensor.camera.dvs", None, still, **size)
    c.ticks(3)
    car.enable_constant_velocity(carla.Vector3D(x=10.0))
    c.ticks(10)
    frame = c.world.tick()

    image, moved, events = (of_frame(one, frame) for one in (lie, move, change))
    # The road is below the camera: z, which is blue, points up.
    b, g, r = (int(value) for value in pixels(image)[115, 80, :3])
    assert b > 250 and abs(g - 128) < 12 and abs(r - 128) < 12, (r, g, b)
    works("sensor.camera.normals",
          "the normal of the road pointed up; red, green and blue are x, y and z")
    ndc = np.frombuffer(moved.raw_data, dtype=np.float32).reshape(120, 160, 2)
    # The lowest rays, 2 m above the road; 0.5 m of motion between two frames.
    below, depth_m = ndc[119, 80], 2.0 / 59.5 * 80.0
    expected = -59.5 / 60.0 * 0.5 / (depth_m + 0.5)
    assert abs(below[0]) < 0.02 and abs(below[1] - expected) < 0.1 * abs(expected), (below, expected)
    assert len(moved) == 160 * 120 and abs(moved[119 * 160 + 80].y - below[1]) < 1e-6
    coded = moved.get_color_coded_flow()
    assert (coded.width, coded.height) == (160, 120)
    works("sensor.camera.optical_flow OpticalFlowImage.raw_data "
          "OpticalFlowImage.get_color_coded_flow",
          "the road moved down in the image by the distance that the vehicle drove")
    times, signs = events.to_array_t(), set(events.to_array_pol())
    last = round((events.timestamp - 0.05) * 1e9)
    assert len(events) > 50 and signs == {-1, 1}, (len(events), signs)
    assert list(times) == sorted(times) and last <= times[0] and times[-1] <= last + 50_000_001
    assert max(events.to_array_x()) < 160 and max(events.to_array_y()) < 120
    assert np.array(events.to_image()).any()
    assert never.empty(), "a static image must give no events and no call"
    works("sensor.camera.dvs DVSEventArray.to_array_x DVSEventArray.to_array_y "
          "DVSEventArray.to_array_t DVSEventArray.to_array_pol DVSEventArray.to_image",
          "positive and negative events in order of time while the vehicle drove; none from a "
          "static sky")
    for sensor in (normals, flow, dvs, dull):
        sensor.destroy()
    car.destroy()


@check
def gbuffer_textures(c):
    car = c.car()
    size = {"image_size_x": 160, "image_size_y": 120}
    ahead = carla.Transform(carla.Location(x=3.5, z=2.0), carla.Rotation(yaw=30.0))
    names = {"depth": "depth", "tags": "semantic_segmentation", "normals": "normals"}
    others = {name: c.sensor(f"sensor.camera.{kind}", car, ahead, **size)
              for name, kind in names.items()}
    camera, image = c.sensor("sensor.camera.rgb", car, ahead, **size)
    textures = {}
    for texture in carla.GBufferTextureID.names.values():
        textures[str(texture)] = queue.Queue()
        camera.listen_to_gbuffer(texture, textures[str(texture)].put)
        assert camera.is_listening_gbuffer(texture)
    car.enable_constant_velocity(carla.Vector3D(x=10.0))
    c.ticks(10)
    frame = c.world.tick()

    def image_of(measured):
        found = of_frame(measured, frame)
        assert (found.width, found.height, found.fov) == (160, 120, 90.0)
        return pixels(found)[:, :, 2::-1].astype(int)

    depth, tags, normals = (image_of(others[name][1]) for name in ("depth", "tags", "normals"))
    assert (image_of(textures["SceneColor"]) == image_of(image)).all()
    metres = (depth @ [1, 256, 65536]) / 16777215.0 * 1000.0
    share = np.clip(metres / 160.0, 0.0, 1.0)
    grey = np.where(share <= 0.0031308, share * 12.92, 1.055 * share ** (1 / 2.4) - 0.055) * 255.0
    for name in ("SceneDepth", "CustomDepth"):
        seen = image_of(textures[name])
        assert (np.abs(seen - grey[:, :, None]) <= 0.6).all() and len(np.unique(seen)) > 30
    for name in ("SceneStencil", "CustomStencil"):
        assert (image_of(textures[name]) == tags[:, :, :1]).all()
    # The texture is in world axes; rotated into the camera's axes, it equals the normals camera.
    yaw = math.radians(car.get_transform().rotation.yaw + 30.0)
    x, y, z = ((image_of(textures["GBufferA"]) - 127.5) / 127.5).transpose(2, 0, 1)
    turned = np.stack([x * math.cos(yaw) + y * math.sin(yaw), y * math.cos(yaw) - x * math.sin(yaw), z])
    apart = np.abs(turned - (normals - 127.5).transpose(2, 0, 1) / 127.5).max(axis=0)
    assert np.median(apart) < 0.05 and (z > 0.9).sum() > 2000, np.median(apart)
    moving = image_of(textures["Velocity"])
    # The road moves down in the image, which is encoded as less than a half.
    assert (moving[115:, :, 1] < 126).all() and (moving[:, :, 2] == 0).all()
    works("ServerSideSensor.listen_to_gbuffer ServerSideSensor.is_listening_gbuffer "
          "GBufferTextureID.SceneColor GBufferTextureID.SceneDepth GBufferTextureID.GBufferA "
          "GBufferTextureID.CustomDepth GBufferTextureID.CustomStencil GBufferTextureID.Velocity",
          "of the image's own frame: colours, depth up to 160 m as intensity, normals in world "
          "axes, tags, velocities")
    differs("GBufferTextureID.SceneStencil", "the semantic tags")
    for name in ("GBufferB", "GBufferC", "GBufferD", "GBufferE", "GBufferF", "SSAO"):
        assert not image_of(textures[name]).any()
        differs(f"GBufferTextureID.{name}",
                "black, as CARLA sends textures that a scene does not have; this simulator's "
                "shading does not use it")
    camera.stop_gbuffer(carla.GBufferTextureID.Velocity)
    assert not camera.is_listening_gbuffer(carla.GBufferTextureID.Velocity)
    c.ticks(5)
    assert arrived(textures["SSAO"], 1) and textures["Velocity"].empty()
    works("ServerSideSensor.stop_gbuffer", "no more textures arrived")
    camera.enable_gbuffers(True)
    differs("ServerSideSensor.enable_gbuffers",
            "accepted; textures are always measured for their listeners")
    for sensor in (camera, *(sensor for sensor, _ in others.values())):
        sensor.destroy()
    car.destroy()
    c.world.tick()
