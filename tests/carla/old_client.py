"""Runs programs of CARLA 0.8 on the module `carla08`.

Usage: old_client.py PORT FOLDER. The programs write to FOLDER.
"""

import os
import re
import struct
import subprocess
import sys
import tempfile
import zlib

os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")
HERE = os.path.dirname(os.path.abspath(__file__))
OLD = os.path.join(HERE, "..", "..", "crates", "carla08")
sys.path.insert(0, OLD)
sys.dont_write_bytecode = True

# The imports of an agent for CARLA 0.8, with `carla` replaced by `carla08`.
from carla08 import image_converter
from carla08.client import VehicleControl, make_carla_client
from carla08.sensor import Camera, Lidar
from carla08.settings import CarlaSettings
from carla08.tcp import TCPConnectionError
from carla08.transform import Transform

import numpy

SIZE = (64, 48)


def play(folder, program, *args):
    """Runs one of the programs and returns its output."""
    ended = subprocess.run(
        [sys.executable, "-B", os.path.join(OLD, program), *args], cwd=folder,
        capture_output=True, text=True, check=False)
    assert ended.returncode == 0, f"{program}: {ended.stdout}{ended.stderr}"
    return ended.stdout


def png(path):
    """Returns the pixels of a PNG file without filters; checks its checksums."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    at, found = 8, {}
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        (checksum,) = struct.unpack(">I", data[at + 8 + length:at + 12 + length])
        assert zlib.crc32(kind + body) == checksum, f"{path}: wrong checksum of chunk {kind}"
        found[kind] = body
        at += 12 + length
    assert b"IEND" in found, path
    width, height = struct.unpack(">II", found[b"IHDR"][:8])
    rows = numpy.frombuffer(zlib.decompress(found[b"IDAT"]), numpy.uint8)
    return rows.reshape(height, 1 + 3 * width)[:, 1:].reshape(height, width, 3)


def the_example_writes_its_files(port, folder):
    """Two episodes of ten frames, an image of each camera for each."""
    output = play(folder, "client_example.py", "-p", port, "--autopilot", "--images-to-disk",
                  "--lidar", "--episodes", "2", "--frames", "10", "--size", "%dx%d" % SIZE)
    for episode in range(2):
        pictures = []
        for name in ("CameraRGB", "CameraDepth"):
            inside = os.path.join(folder, "_out", f"episode_{episode:04d}", name)
            files = sorted(os.listdir(inside))
            assert files == [f"{i:06d}.png" for i in range(10)], files
            pixels = [png(os.path.join(inside, file)) for file in files]
            assert all(p.shape == (SIZE[1], SIZE[0], 3) for p in pixels)
            assert all(len(numpy.unique(p)) > 8 for p in pixels), f"the images of {name} are uniform"
            pictures.append(pixels)
        assert any((a != b).any() for a, b in zip(pictures[0], pictures[0][1:]))
        inside = os.path.join(folder, "_out", f"episode_{episode:04d}", "Lidar32")
        with open(os.path.join(inside, "000009.ply"), encoding="ascii") as file:
            lines = file.read().splitlines()
        count = int(lines[2].split()[-1])
        assert count > 100 and len(lines) - lines.index("end_header") - 1 == count
    places = [tuple(map(float, found)) for found in
              re.findall(r"Vehicle at \((-?[\d.]+), (-?[\d.]+)\)", output)]
    assert len(places) == 20, output
    agents = [int(n) for n in re.findall(r"\((\d+) non-player agents", output)]
    assert min(agents) > 20, agents


def an_agent_drives(host, port):
    """The control loop of the paper's agents: read, decide, send."""
    with make_carla_client(host, port) as client:
        settings = CarlaSettings()
        settings.set(SynchronousMode=True, SendNonPlayerAgentsInfo=True, NumberOfVehicles=5,
                     NumberOfPedestrians=5, WeatherId=1, SeedVehicles=1, SeedPedestrians=2)
        depth = Camera("CameraDepth", PostProcessing="Depth")
        labels = Camera("CameraSemSeg", PostProcessing="SemanticSegmentation", CameraFOV=90.0)
        for camera in (depth, labels):
            camera.set_image_size(*SIZE)
            camera.set_position(1.8, 0, 1.6)
            settings.add_sensor(camera)
        lidar = Lidar("Lidar32", Channels=16)
        lidar.set_position(0, 0, 2.5)
        settings.add_sensor(lidar)
        # Settings as the text of an ini file.
        scene = client.load_settings(str(settings))
        assert len(scene.player_start_spots) > 10 and len(scene.sensors) == 3
        for start in (3, 8):
            client.start_episode(start)
            began = scene.player_start_spots[start].location
            last, way, fastest = None, 0.0, 0.0
            for frame in range(40):
                measurements, sensor_data = client.read_data()
                player = measurements.player_measurements
                at = player.transform.location
                if frame == 0:
                    assert abs(at.x - began.x) + abs(at.y - began.y) < 1.0
                else:
                    way += ((at.x - last.x) ** 2 + (at.y - last.y) ** 2) ** 0.5
                    assert measurements.game_timestamp > last_time
                last, last_time = at, measurements.game_timestamp
                assert set(sensor_data) == {"CameraDepth", "CameraSemSeg", "Lidar32"}
                assert {s.frame_number for s in sensor_data.values()} == {frame + 1}
                fastest = max(fastest, player.forward_speed)
                client.send_control(VehicleControl(throttle=0.7))
            assert way > 3.0 and fastest > 2.0, (way, fastest)
            check_sensors(sensor_data, depth, player)
            kinds = {agent.WhichOneof("agent") for agent in measurements.non_player_agents}
            assert {"vehicle", "pedestrian"} <= kinds, kinds
            vehicle = next(a for a in measurements.non_player_agents if a.HasField("vehicle"))
            assert vehicle.vehicle.bounding_box.extent.x > 0.5
        control = player.autopilot_control
        assert -1.0 <= control.steer <= 1.0 and 0.0 <= control.throttle <= 1.0


def check_sensors(sensor_data, depth, player):
    """Labels are those of 0.8; depth points, transformed to the world, are on the road."""
    image = sensor_data["CameraSemSeg"]
    found = image_converter.labels_to_array(image)
    assert found.max() <= 12 and (found[-8:] == 7).any(), numpy.unique(found)
    assert image_converter.labels_to_cityscapes_palette(image).shape == (SIZE[1], SIZE[0], 3)
    image = sensor_data["CameraDepth"]
    grey = image_converter.depth_to_logarithmic_grayscale(image)
    assert 0.0 <= grey.min() < grey.max() <= 255.0
    # The road ahead: the middle of the lower rows.
    rows = image_converter.depth_to_array(image)
    cloud = image_converter.depth_to_local_point_cloud(image, max_depth=1.0)
    assert len(cloud) == rows.size
    cloud.apply_transform(Transform(player.transform) * depth.get_unreal_transform())
    ahead = cloud.array.reshape(SIZE[1], SIZE[0], 3)[-2, SIZE[0] // 2]
    at, way = player.transform.location, player.transform.orientation
    along = (ahead[0] - at.x) * way.x + (ahead[1] - at.y) * way.y
    aside = (ahead[0] - at.x) * -way.y + (ahead[1] - at.y) * way.x
    assert 2.0 < along < 6.0 and abs(aside) < 0.3 and abs(ahead[2] - at.z) < 0.6, (
        along, aside, ahead, at)
    points = sensor_data["Lidar32"].data
    low = points[numpy.hypot(points[:, 0], points[:, 1]) < 10.0]
    assert abs(numpy.median(low[:, 2]) + 2.5) < 0.5, "the lidar is not 2.5 m above the road"


def a_missing_server_is_an_error():
    """The connection error is the one after which the programs try again."""
    from carla08.client import CarlaClient

    try:
        CarlaClient("127.0.0.1", 1).connect(connection_attempts=1)
    except TCPConnectionError:
        return
    raise AssertionError("connected without a server")


def a_benchmark_continues(port, folder):
    """Drives one episode, then another one: the log contains both, and the metrics."""
    common = ("-p", port, "--agent", "autopilot", "--size", "16x16", "--limit", "1")
    play(folder, "run_benchmark.py", *common)
    output = play(folder, "run_benchmark.py", *common, "--continue-experiment")
    log = os.path.join(folder, "_benchmarks_results", "test_BasicExperimentSuite_Town01")
    with open(os.path.join(log, "summary.csv"), encoding="utf-8") as file:
        rows = [line.split(",") for line in file.read().splitlines()[1:]]
    assert [row[0] for row in rows] == ["0", "1"], rows
    assert all(row[5] == "1" for row in rows), f"the goal was not reached: {rows}"
    assert "100.0 % completed" in output, output
    assert os.path.exists(os.path.join(log, "metrics.json"))


def start_positions_and_points_are_written(port, folder):
    """A drawing contains the requested positions; points have colors."""
    play(folder, "view_start_positions.py", "-p", port, "-pos", "0,3", "--svg", "spots.svg")
    with open(os.path.join(folder, "spots.svg"), encoding="utf-8") as file:
        assert file.read().count('class="spot"') == 2
    play(folder, "point_cloud_example.py", "-p", port, "--frames", "4", "--every", "2",
         "--size", "%dx%d" % SIZE)
    with open(os.path.join(folder, "_out", "episode_0000", "00003.ply"), encoding="ascii") as file:
        lines = file.read().splitlines()
    assert "property uchar red" in lines and len(lines[-1].split()) == 6


def main():
    port, folder = sys.argv[1], sys.argv[2]
    a_missing_server_is_an_error()
    the_example_writes_its_files(port, folder)
    an_agent_drives("127.0.0.1", int(port))
    start_positions_and_points_are_written(port, folder)
    a_benchmark_continues(port, folder)
    print("all of it")
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    try:
        main()
    except BaseException:
        import traceback

        traceback.print_exc()
        os._exit(1)
