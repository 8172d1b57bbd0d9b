"""Checks of what sensors send: every property of every kind of measurement."""

import os
import shutil
import struct
import tempfile

import carla
import numpy as np

from effects_kit import TIMEOUT, near, of_frame, pixels
from effects_snapshots import DESTROYED
from ledger import LISTED, check, differs, ignored, refuses, works

SIZE = {"image_size_x": 32, "image_size_y": 24, "fov": 80}


def in_order(name, values):
    """Enters the operators of a sequence of values."""
    works(" ".join(f"{name}.{one}" for one in ("__len__", "__iter__", "__getitem__", "__setitem__")
                   if f"{name}.{one}" in LISTED), f"a sequence of {values}")


@check
def images(c):
    car = c.car()
    camera, measured = c.sensor("sensor.camera.rgb", car, **SIZE)
    deep, depths = c.sensor("sensor.camera.depth", car, **SIZE)
    tags, labels = c.sensor("sensor.camera.semantic_segmentation", car, **SIZE)
    frame = c.ticks(2)
    image, depth, label = (of_frame(one, frame) for one in (measured, depths, labels))
    assert image.frame == image.frame_number == frame
    works("SensorData.frame_number", "another name of `frame`")
    assert (image.width, image.height, image.fov) == (32, 24, 80.0)
    assert len(image) == 32 * 24 == len(list(image)) and len(image.raw_data) == 4 * len(image)
    first, seen = image[0], pixels(image)[0, 0]
    assert (first.b, first.g, first.r, first.a) == tuple(int(part) for part in seen)
    image[0] = carla.Color(1, 2, 3, 4)
    assert tuple(pixels(image)[0, 0]) == (3, 2, 1, 4)
    in_order("Image", "colours from the upper left corner, in the order blue, green, red, alpha")
    assert str(image) == f"Image(frame={frame}, timestamp={image.timestamp:.6f}, size=32x24)", image
    works("Image.__str__", f"`{image}`".replace(str(frame), "…").replace(
        f"{image.timestamp:.6f}", "…"))
    folder = tempfile.mkdtemp()
    for converter, kept in ((carla.ColorConverter.Raw, image), (carla.ColorConverter.Depth, depth),
                            (carla.ColorConverter.LogarithmicDepth, depth),
                            (carla.ColorConverter.CityScapesPalette, label)):
        path = os.path.join(folder, f"{converter}.png")
        assert kept.save_to_disk(path, converter) == path
        with open(path, "rb") as file:
            header = file.read(24)
        assert header[1:4] == b"PNG" and struct.unpack(">II", header[16:]) == (32, 24)
    shutil.rmtree(folder)
    works("Image.save_to_disk", "a file in the PNG format")
    raw = pixels(depth).astype(np.float64)[..., :3] @ [65536, 256, 1] / (2 ** 24 - 1)
    depth.convert(carla.ColorConverter.Depth)
    grey = pixels(depth)[..., 0]
    assert (pixels(depth)[..., :3] == grey[..., None]).all()
    assert np.abs(grey - raw * 255.0).max() < 1.5
    works("ColorConverter.Depth", "grey in proportion to the depth, white at 1 km")
    again = of_frame(depths, c.ticks(1))
    again.convert(carla.ColorConverter.LogarithmicDepth)
    assert pixels(again)[..., 0].mean() > grey.mean() + 20.0
    works("ColorConverter.LogarithmicDepth", "grey by the logarithm of the depth")
    numbers = pixels(label)[..., 2].copy()
    label.convert(carla.ColorConverter.CityScapesPalette)
    road = pixels(label)[numbers == 1]
    assert len(road) and (road[:, 2::-1] == (128, 64, 128)).all(), road[:1]
    works("ColorConverter.CityScapesPalette Image.convert", "the road was (128, 64, 128)")
    before = image.raw_data.tobytes()
    image.convert(carla.ColorConverter.Raw)
    assert image.raw_data.tobytes() == before
    works("ColorConverter.Raw", "nothing was changed")
    for sensor in (camera, deep, tags):
        sensor.destroy()
    car.destroy()


@check
def flow_and_events(c):
    car = c.car()
    flow, moves = c.sensor("sensor.camera.optical_flow", car, **SIZE)
    dvs, changes = c.sensor("sensor.camera.dvs", car, **SIZE)
    car.enable_constant_velocity(carla.Vector3D(x=8.0))
    frame = c.ticks(8)
    moved = of_frame(moves, frame)
    assert (moved.width, moved.height, moved.fov) == (32, 24, 80.0)
    assert len(moved) == len(list(moved)) == 32 * 24 and "size=32x24" in str(moved)
    moved[5] = carla.OpticalFlowPixel(0.5, 0.25)
    assert (moved[5].x, moved[5].y) == (0.5, 0.25)
    assert np.frombuffer(moved.raw_data, dtype=np.float32)[10] == 0.5
    in_order("OpticalFlowImage", "pixels with two numbers")
    works("OpticalFlowImage.width OpticalFlowImage.height OpticalFlowImage.fov "
          "OpticalFlowImage.__str__ OpticalFlowPixel.x OpticalFlowPixel.y", "as of the blueprint")
    coded = moved.get_color_coded_flow()
    assert (coded.width, coded.height, coded.fov) == (32, 24, 80.0), coded.fov
    assert len(coded.raw_data) == 4 * 32 * 24
    works("FakeImage.width FakeImage.height FakeImage.fov FakeImage.raw_data",
          "four bytes for each pixel: the direction of the motion as hue")
    refuses("did not match C++ signature", {
        "FakeImage.__len__": lambda: len(coded), "FakeImage.__getitem__": lambda: coded[0],
        "FakeImage.__setitem__": lambda: coded.__setitem__(0, 1),
        "FakeImage.__delitem__": lambda: coded.__delitem__(0),
        "FakeImage.__contains__": lambda: 1 in coded, "FakeImage.__iter__": lambda: list(coded),
        "FakeImage.append": lambda: coded.append(1), "FakeImage.extend": lambda: coded.extend([1])},
        "a defect of the package: its methods do not accept its own class")
    happened = of_frame(changes, frame)
    assert (happened.width, happened.height, happened.fov) == (32, 24, 80.0)
    assert len(happened) == len(list(happened)) > 0
    assert f"frame={frame}, " in str(happened), str(happened)
    event = happened[0]
    rows = zip(happened.to_array_x(), happened.to_array_y(), happened.to_array_t())
    assert (event.x, event.y, event.t) == next(rows)
    assert 0 <= event.x < 32 and 0 <= event.y < 24 and event.t > 0 and event.pol in (True, False)
    assert len(happened.raw_data) == 13 * len(happened), len(happened.raw_data)
    happened[0] = carla.DVSEvent()
    assert happened[0].t == 0
    in_order("DVSEventArray", "events in order of time")
    works("DVSEventArray.width DVSEventArray.height DVSEventArray.fov DVSEventArray.raw_data "
          "DVSEventArray.__str__ DVSEvent.x DVSEvent.y DVSEvent.t DVSEvent.pol",
          "pixel, nanoseconds and polarity of each event")
    refuses("No to_python", {"DVSEventArray.to_array": happened.to_array},
            "a defect of the package: it cannot return its table; the columns can be read")
    flow.destroy()
    dvs.destroy()
    car.destroy()


@check
def points(c):
    car = c.car()
    size = dict(channels=16, range=40, points_per_second=20000, rotation_frequency=20)
    lidar, scans = c.sensor("sensor.lidar.ray_cast", car, dropoff_general_rate=0, **size)
    labelled, labels = c.sensor("sensor.lidar.ray_cast_semantic", car, **size)
    radar, echoes = c.sensor("sensor.other.radar", car, points_per_second=5000, range=80)
    wall = car.get_transform()
    wall.location += 15.0 * wall.get_forward_vector() + carla.Location(z=0.3)
    truck = c.world.spawn_actor(c.library.find("vehicle.carlamotors.firetruck"), wall)
    c.ticks(3)
    car.set_target_velocity(5.0 * car.get_transform().get_forward_vector())
    frame = c.ticks(1)
    scan, label, echo = (of_frame(one, frame) for one in (scans, labels, echoes))
    numbers = np.frombuffer(scan.raw_data, dtype=np.float32).reshape(-1, 4)
    assert len(scan) == len(list(scan)) == len(numbers) > 100
    one = scan[7]
    assert np.allclose([one.point.x, one.point.y, one.point.z, one.intensity], numbers[7])
    assert all(0.0 < hit.intensity <= 1.0 for hit in scan)
    assert f"number_of_points={len(scan)}" in str(scan), str(scan)
    folder = tempfile.mkdtemp()
    for name, points in (("LidarMeasurement", scan), ("SemanticLidarMeasurement", label)):
        path = points.save_to_disk(os.path.join(folder, f"{name}.ply"))
        with open(path) as file:
            text = file.read()
        assert f"element vertex {len(points)}" in text, text[:200]
        works(f"{name}.save_to_disk", "a file in the PLY format with every point")
    shutil.rmtree(folder)
    scan[7] = carla.LidarDetection()
    assert scan[7].intensity == 0.0
    in_order("LidarMeasurement", "points with an intensity")
    works("LidarMeasurement.__str__ LidarDetection.point LidarDetection.intensity",
          "metres in the sensor's axes; an intensity from 0 to 1")
    assert label.channels == 16 and abs(label.horizontal_angle) <= 7.0
    assert sum(label.get_point_count(channel) for channel in range(16)) == len(label)
    assert len(label.raw_data) == 24 * len(label) and "number_of_points=" in str(label)
    trucks = [hit for hit in label if hit.object_idx == truck.id]
    assert len(trucks) > 5 and {hit.object_tag for hit in trucks} == {carla.CityObjectLabel.Truck}
    assert all(9.0 < hit.point.x < 16.0 for hit in trucks)
    label[0] = carla.SemanticLidarDetection()
    assert label[0].object_idx == 0
    in_order("SemanticLidarMeasurement", "points with an actor and a tag")
    works("SemanticLidarMeasurement.channels SemanticLidarMeasurement.horizontal_angle "
          "SemanticLidarMeasurement.get_point_count SemanticLidarMeasurement.raw_data "
          "SemanticLidarMeasurement.__str__ SemanticLidarDetection.point "
          "SemanticLidarDetection.object_idx SemanticLidarDetection.object_tag",
          "points on a truck ahead had its id and its tag")
    assert echo.get_detection_count() == len(echo) == len(list(echo)) > 10
    assert len(echo.raw_data) == 16 * len(echo) and "point_count=" in str(echo), str(echo)
    ahead = [hit for hit in echo if abs(hit.azimuth) < 0.03 and abs(hit.altitude) < 0.03]
    # The distance becomes less by 5 m/s.
    assert ahead and all(-5.5 < hit.velocity < -4.0 for hit in ahead), [h.velocity for h in ahead]
    echo[0] = carla.RadarDetection()
    assert echo[0].depth == 0.0
    in_order("RadarMeasurement", "detections")
    works("RadarMeasurement.raw_data RadarMeasurement.get_detection_count RadarMeasurement.__str__ "
          "RadarDetection.velocity", "negative towards a truck that the vehicle approached")
    for sensor in (lidar, labelled, radar):
        sensor.destroy()
    car.destroy()
    truck.destroy()
    c.ticks(1)


@check
def events(c):
    car = c.car()
    imu, turns = c.sensor("sensor.other.imu", car)
    gnss, fixes = c.sensor("sensor.other.gnss", car)
    frame = c.ticks(2)
    turn, fix = of_frame(turns, frame), of_frame(fixes, frame)
    height = c.map.transform_to_geolocation(fix.transform.location).altitude
    near(fix.altitude, height, 0.01)
    works("GnssMeasurement.altitude", "the height above the origin of the map, in metres")
    assert f"frame={frame}" in str(fix) and f"frame={frame}" in str(turn)
    works("GnssMeasurement.__str__ IMUMeasurement.__str__", "with the frame and the values")
    near(fix.timestamp, turn.timestamp, 1e-9)
    hits, bumps = c.sensor("sensor.other.collision", car)
    lane, crossings = c.sensor("sensor.other.lane_invasion", car)
    wall = car.get_transform()
    wall.location += 9.0 * wall.get_forward_vector() + carla.Location(z=0.3)
    obstacle, things = c.sensor("sensor.other.obstacle", car, distance=20)
    other = c.world.spawn_actor(c.library.find("vehicle.carlamotors.firetruck"), wall)
    c.ticks(1)
    thing = things.get(timeout=TIMEOUT)
    assert thing.actor.id == car.id and thing.other_actor.id == other.id
    assert f"frame={thing.frame}, " in str(thing), str(thing)
    works("ObstacleDetectionEvent.actor ObstacleDetectionEvent.__str__", "the sensor's carrier")
    car.set_target_velocity(9.0 * car.get_transform().get_forward_vector())
    c.ticks(30)
    bump = bumps.get(timeout=TIMEOUT)
    assert f"frame={bump.frame}, " in str(bump), str(bump)
    works("CollisionEvent.__str__", "with the frame; the other actor is an address")
    other.destroy()
    side = car.get_transform().get_right_vector()
    for _ in range(20):
        car.set_location(car.get_location() - 0.4 * carla.Location(side.x, side.y, side.z))
        c.world.tick()
    crossing = crossings.get(timeout=TIMEOUT)
    assert "LaneInvasionEvent(" in str(crossing), str(crossing)
    assert isinstance(crossing.crossed_lane_markings[0], carla.LaneMarking)
    works("LaneInvasionEvent.__str__ LaneInvasionEvent.crossed_lane_markings",
          "the markings between two lanes")
    refuses(DESTROYED, {"LaneInvasionEvent.actor": lambda: crossing.actor},
            "a defect of the package: its own events belong to no episode")
    for sensor in (imu, gnss, hits, lane, obstacle):
        sensor.destroy()
    car.destroy()
    c.ticks(1)


@check
def radio_messages(c):
    cars = [c.car(), c.car()]
    quiet = dict(use_etsi_fading=False, scenario="urban", filter_distance=5000,
                 receiver_sensitivity=-200)
    stations = [c.sensor("sensor.other.v2x", car, **quiet) for car in cars]
    chats = [c.sensor("sensor.other.v2x_custom", car, **quiet) for car in cars]
    c.ticks(3)
    event = stations[0][1].get(timeout=TIMEOUT)
    assert event.get_message_count() == len(event) == len(list(event)) == 1
    message = event[0]
    assert -200.0 < message.power < 0.0 and f"stationId={cars[1].id}" in str(message), str(message)
    works("CAMEvent.get_message_count CAMEvent.__iter__ CAMMessage.__str__",
          "one message of the other station")
    chats[1][0].send("hello")
    c.ticks(2)
    event = chats[0][1].get(timeout=TIMEOUT)
    assert event.get_message_count() == len(event) == len(list(event)) == 1
    text = event[0]
    assert -200.0 < text.power < 0.0 and "CustomV2XData(power=" in str(text), str(text)
    works("CustomV2XEvent.get_message_count CustomV2XEvent.__iter__ CustomV2XData.power "
          "CustomV2XData.__str__", "one message of the other station, and its power in dBm")
    for sensor, _ in stations + chats:
        sensor.destroy()
    for car in cars:
        car.destroy()
    c.ticks(1)


@check
def options_of_sensors(c):
    car = c.car()
    camera, _ = c.sensor("sensor.camera.rgb", car, **SIZE)
    lidar, _ = c.sensor("sensor.lidar.ray_cast", car)
    assert not camera.is_enabled_for_ros()
    ignored("accepted; this simulator has no ROS of its own", {
        "ServerSideSensor.enable_for_ros": camera.enable_for_ros,
        "ServerSideSensor.disable_for_ros": camera.disable_for_ros})
    assert not camera.is_enabled_for_ros()
    differs("ServerSideSensor.is_enabled_for_ros", "always false")
    refuses("No to_python", {"ServerSideSensor.get_ignored_vehicles": lidar.get_ignored_vehicles},
            "a defect of the package: it cannot return its list")
    refuses("no sensors that overlook vehicles", {
        "ServerSideSensor.set_ignored_vehicles": lambda: lidar.set_ignored_vehicles([car.id])})
    camera.destroy()
    lidar.destroy()
    car.destroy()
    c.ticks(1)
