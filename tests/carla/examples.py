"""CARLA's own example scripts, unmodified, against a running simulator.

Usage: examples.py PORT PYTHONAPI OUT [NAME...]. PYTHONAPI is that folder of CARLA's repository;
scripts run in OUT, where what they write stays. Prints one JSON line for each: what was observed,
or why it failed.
"""

import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")

import carla


class Observer:
    """What was observed of the world while a script ran."""

    def __init__(self, port):
        self.port = port
        self.kinds, self.most, self.moved, self.weathers = set(), {}, 0.0, set()
        self.walked, self.spectators, self.lights, self.frames = 0.0, set(), set(), set()
        self.settings = []
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.watch, daemon=True)
        self.thread.start()

    def watch(self):
        client = carla.Client("127.0.0.1", self.port)
        client.set_timeout(30.0)
        first = {}
        while not self.stop.wait(0.1):
            try:
                world = client.get_world()
                self.frames.add(world.get_snapshot().frame)
                actors = list(world.get_actors())
                settings = world.get_settings()
                self.settings.append((settings.synchronous_mode, settings.fixed_delta_seconds,
                                      settings.no_rendering_mode))
                counts = {}
                for actor in actors:
                    kind = actor.type_id
                    self.kinds.add(kind)
                    group = kind.split(".")[0]
                    counts[group] = counts.get(group, 0) + 1
                    if group in ("vehicle", "walker"):
                        at = actor.get_location()
                        if at.x or at.y:
                            way = at.distance(first.setdefault(actor.id, at))
                            if group == "vehicle":
                                self.moved = max(self.moved, way)
                            else:
                                self.walked = max(self.walked, way)
                    if group == "vehicle":
                        self.lights.add(int(actor.get_light_state()))
                for group, count in counts.items():
                    self.most[group] = max(self.most.get(group, 0), count)
                weather = world.get_weather()
                self.weathers.add((round(weather.sun_altitude_angle), round(weather.cloudiness)))
                at = world.get_spectator().get_location()
                self.spectators.add((round(at.x), round(at.y)))
            except RuntimeError:
                # Another world was loaded.
                pass

    def end(self):
        self.stop.set()
        self.thread.join(40.0)


class Result:
    """The result of a script."""

    def __init__(self, code, output, observer, out):
        self.code, self.output, self.observer, self.out = code, output, observer, out

    def files(self, pattern, least=1, bytes_least=1000):
        found = [f for f in glob.glob(os.path.join(self.out, pattern))
                 if os.path.getsize(f) >= bytes_least]
        assert len(found) >= least, f"{len(found)} files {pattern}, expected {least}"
        return f"{len(found)} files {pattern}"

    def prints(self, pattern, least=1):
        found = re.findall(pattern, self.output, re.M)
        assert len(found) >= least, f"{len(found)} times {pattern!r}, expected {least}"
        return f"{len(found)} times {pattern!r}" if least > 1 else f"prints {str(found[0])!r}"

    def drove(self, least_m):
        assert self.observer.moved >= least_m, f"vehicles moved {self.observer.moved:.1f} m"
        return f"a vehicle moved {self.observer.moved:.0f} m"

    def had(self, **least):
        for group, count in least.items():
            most = self.observer.most.get(group, 0)
            assert most >= count, f"at most {most} {group}s, expected {count}: {self.observer.most}"
        return ", ".join(f"{self.observer.most[group]} {group}s" for group in least)

    def kinds(self, *wanted):
        missing = [one for one in wanted if one not in self.observer.kinds]
        assert not missing, f"not observed: {missing}"
        return f"{len(wanted)} kinds of sensors"


def clean(ran):
    """Asserts that the script ended without an error, by itself or by the script runner."""
    assert ran.code == 0, f"exit {ran.code}: {tail(ran.output)}"
    assert "Traceback" not in ran.output, tail(ran.output)


def tail(text):
    lines = [line for line in text.strip().splitlines() if line.strip()]
    return " | ".join(lines[-4:])[-600:]


EXAMPLES = []


def example(path, arguments="", seconds=10.0, keys="-", world="Town03", limit=120.0):
    def enter(function):
        EXAMPLES.append((function.__name__, path, arguments.split(), seconds, keys, world, limit,
                         function))
        return function
    return enter


@example("util/test_connection.py", world=None)
def test_connection(ran):
    return ran.prints("CARLA [0-9.]+ connected at")


@example("examples/tutorial.py")
def tutorial(ran):
    return ran.files("_out/*.png", 3) + ", " + ran.had(vehicle=2)


@example("examples/synchronous_mode.py", seconds=15.0)
def synchronous_mode(ran):
    return ran.drove(10.0)


@example("examples/sensor_synchronization.py", seconds=15.0)
def sensor_synchronization(ran):
    return ran.prints(r"Frame: \d+   Sensor:", 50)


@example("examples/generate_traffic.py", "-n 25 -w 15", seconds=30.0)
def generate_traffic(ran):
    ran.prints("spawned")
    assert ran.observer.walked > 3.0, f"walkers walked {ran.observer.walked:.1f} m"
    walked = f"a walker {ran.observer.walked:.0f} m"
    return ran.drove(20.0) + f", {ran.had(vehicle=20, walker=12)}, {walked}"


@example("examples/generate_traffic.py", "-n 10 -w 5 --asynch --safe", seconds=15.0)
def generate_traffic_asynch(ran):
    return ran.drove(5.0) + ", " + ran.had(vehicle=8)


@example("examples/lidar_to_camera.py", "-f 40", seconds=90.0)
def lidar_to_camera(ran):
    return ran.files("_out/*.png", 30)


@example("examples/client_bounding_boxes.py", seconds=15.0, keys="w*60")
def client_bounding_boxes(ran):
    return ran.drove(3.0)


@example("examples/vehicle_physics.py", seconds=60.0)
def vehicle_physics(ran):
    return ran.prints(r"[Vv]elocity", 2) if "elocity" in ran.output else ran.prints(r"\S.*")


@example("examples/dynamic_weather.py", "-s 20", seconds=12.0)
def dynamic_weather(ran):
    assert len(ran.observer.weathers) > 5, ran.observer.weathers
    return f"{len(ran.observer.weathers)} weather states"


@example("examples/vehicle_gallery.py", seconds=25.0)
def vehicle_gallery(ran):
    assert len(ran.observer.spectators) > 5, ran.observer.spectators
    return ran.prints(r"vehicle\.\S+") + ", the spectator moves around it"


@example("examples/start_recording.py", "-n 10 -t 8 -f {out}/drive.log", seconds=40.0)
def start_recording(ran):
    return ran.files("drive.log") + ", " + ran.had(vehicle=8)


@example("examples/show_recorder_file_info.py", "-f {out}/drive.log -a")
def show_recorder_file_info(ran):
    return ran.prints(r"Duration: [0-9.]+ seconds")


@example("examples/show_recorder_collisions.py", "-f {out}/drive.log -t aa")
def show_recorder_collisions(ran):
    return ran.prints(r"Frames: \d+")


@example("examples/show_recorder_actors_blocked.py", "-f {out}/drive.log -t 2 -d 10")
def show_recorder_actors_blocked(ran):
    return ran.prints(r"Frames: \d+")


@example("examples/start_replaying.py", "-f {out}/drive.log -s 0 -d 6", seconds=20.0)
def start_replaying(ran):
    return ran.prints(r"Replaying from [0-9.]+ s")


@example("examples/manual_control.py", "--sync --res 320x240 --filter vehicle.tesla.model3 "
         "--generation 2", seconds=45.0,
         keys="f1,w*80,c,tab,l,o,o,g,n,n,n,n,n,n,n,n,n,n,n,n,n,n,p,v", limit=150.0)
def manual_control(ran):
    assert len(ran.observer.lights) > 1, "vehicle lights were not switched"
    # `n` goes through all fourteen cameras and lidars; normals are the last.
    return ran.drove(3.0) + ", " + ran.kinds(
        "sensor.camera.rgb", "sensor.other.gnss", "sensor.other.imu", "sensor.other.collision",
        "sensor.other.lane_invasion", "sensor.camera.normals")


@example("examples/automatic_control.py", "--sync --res 320x240 --seed 7", seconds=40.0,
         limit=150.0)
def automatic_control(ran):
    return ran.drove(15.0)


@example("examples/automatic_control.py", "--sync --res 320x240 --agent Basic --seed 3",
         seconds=30.0, limit=150.0)
def automatic_control_basic(ran):
    return ran.drove(10.0)


@example("examples/no_rendering_mode.py", "--res 640x480 --no-rendering --map Town02",
         seconds=15.0, keys="h,i,tab")
def no_rendering_mode(ran):
    assert any(no_rendering for _, _, no_rendering in ran.observer.settings)
    return "rendering is switched off, the map is drawn"


@example("examples/visualize_multiple_sensors.py", "--sync --res 640x360", seconds=30.0)
def visualize_multiple_sensors(ran):
    return ran.drove(1.0) + ", " + ran.kinds(
        "sensor.camera.rgb", "sensor.lidar.ray_cast", "sensor.lidar.ray_cast_semantic")


@example("examples/open3d_lidar.py", seconds=20.0)
def open3d_lidar(ran):
    return ran.drove(3.0) + ", " + ran.kinds("sensor.lidar.ray_cast")


@example("examples/draw_skeleton.py", "--res 320x240", seconds=20.0)
def draw_skeleton(ran):
    return ran.had(walker=1)


@example("examples/V2XDemo.py", "--sync --res 320x240", seconds=25.0, keys="w*60")
def V2XDemo(ran):
    return ran.kinds("sensor.other.v2x")


@example("examples/tutorial_gbuffer.py", seconds=30.0)
def tutorial_gbuffer(ran):
    return ", ".join(ran.files(f"_out/{name}*.png") for name in
                     ("FinalColor", "GBuffer-SceneColor", "GBuffer-SceneDepth",
                      "GBuffer-SceneStencil"))


@example("util/config.py", "--inspect")
def config_inspect(ran):
    return ran.prints(r"(?i)map:.*Town03")


@example("util/config.py", "--list")
def config_list(ran):
    return ran.prints(r"Town\d+", 8)


@example("util/config.py", "--list-blueprints vehicle.*")
def config_list_blueprints(ran):
    return ran.prints(r"vehicle\.", 30)


@example("util/config.py", "--map Town02 --delta-seconds 0.04 --weather HardRainNoon")
def config_map(ran):
    assert any(delta is not None and abs(delta - 0.04) < 1e-6
               for _, delta, _ in now(ran)), "the delta was not set"
    return "the map is loaded, the delta and rain are set"


@example("util/config.py", "--reload-map --fps 25")
def config_reload(ran):
    assert any(delta is not None and abs(delta - 0.04) < 1e-6 for _, delta, _ in now(ran))
    return "the map is reloaded, 25 frames per second"


@example("util/config.py", "--no-rendering --no-sync")
def config_no_rendering(ran):
    assert any(no_rendering for _, _, no_rendering in now(ran))
    return "rendering is switched off"


@example("util/config.py", "--default")
def config_default(ran):
    assert not any(synchronous for synchronous, _, _ in now(ran))
    return "the settings are the defaults"


@example("util/config.py", "--xodr-path {out}/own.xodr")
def config_xodr(ran):
    assert client_of(ran).get_world().get_map().name.endswith("OpenDriveMap")
    return "the map of the file is loaded"


@example("util/environment.py", "--sun night --weather rain --cars Position --lights on",
         seconds=15.0)
def environment(ran):
    assert len(ran.observer.weathers | {sky(ran)}) > 1, ran.observer.weathers
    return "sun and rain are set"


@example("util/performance_benchmark.py", "--sync --ticks 20 --maps Town03 --sensors 0 "
         "--weather 0", seconds=90.0, limit=150.0)
def performance_benchmark(ran):
    return ran.prints(r"(?i)fps|tick|Town03")


@example("util/lane_explorer.py", "-t 0.1", seconds=10.0)
def lane_explorer(ran):
    return ran.prints(r"(?i)Initial location|roadId|laneId|->|Location|Exit") if ran.output.strip() \
        else "explores until it is stopped"


@example("util/raycast_sensor_testing.py", "--sync -ln 1 -lp 50000 -rn 1 -sln 1 --profiling "
         "--no-render-window", seconds=60.0, limit=150.0)
def raycast_sensor_testing(ran):
    return ran.prints(r"(?i)lidar|semantic")


@example("util/extract_spawn_points.py", "-o {out}")
def extract_spawn_points(ran):
    return ran.files("*.csv")


def client_of(ran):
    client = carla.Client("127.0.0.1", ran.observer.port)
    client.set_timeout(30.0)
    return client


def now(ran):
    settings = client_of(ran).get_world().get_settings()
    return [(settings.synchronous_mode, settings.fixed_delta_seconds, settings.no_rendering_mode)]


def sky(ran):
    weather = client_of(ran).get_world().get_weather()
    return (round(weather.sun_altitude_angle), round(weather.cloudiness))


def play(port, api, out, entry):
    name, path, arguments, seconds, keys, world, limit, judge = entry
    script = os.path.join(api, path)
    if not os.path.exists(script):
        return {"example": name, "script": path, "missing": "no such script"}
    if world is not None:
        # Actors of the previous script are gone.
        client = carla.Client("127.0.0.1", port)
        client.set_timeout(60.0)
        text = client.load_world(world).get_map().to_opendrive()
        with open(os.path.join(out, "own.xodr"), "w", encoding="utf-8") as own:
            own.write(text)
    shutil.rmtree(os.path.join(out, "_out"), ignore_errors=True)
    observer = Observer(port)
    filled = [word.replace("{out}", out).replace("{api}", api) for word in arguments]
    command = [sys.executable, "-u", os.path.join(HERE, "script_runner.py"), str(port), str(seconds),
               keys, script] + filled
    environment = dict(os.environ)
    environment["PYTHONPATH"] = os.path.join(api, "carla")
    begun = time.monotonic()
    try:
        run = subprocess.run(command, cwd=out, env=environment, stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, timeout=limit, check=False)
        code, output = run.returncode, run.stdout.decode(errors="replace")
    except subprocess.TimeoutExpired as late:
        code, output = -1, (late.stdout or b"").decode(errors="replace")
        output += f"\nnot over after {limit} s"
    observer.end()
    ran = Result(code, output, observer, out)
    with open(os.path.join(out, f"{name}.txt"), "w", encoding="utf-8") as kept:
        kept.write(output)
    result = {"example": name, "script": path, "arguments": " ".join(arguments),
              "seconds": round(time.monotonic() - begun, 1)}
    try:
        clean(ran)
        result["observed"] = judge(ran)
    except Exception as error:  # Whatever it is, it is this example's failure.
        result["failure"] = f"{error}"
    return result


def main():
    port, api, out = int(sys.argv[1]), os.path.abspath(sys.argv[2]), os.path.abspath(sys.argv[3])
    names = sys.argv[4:]
    os.makedirs(out, exist_ok=True)
    for entry in EXAMPLES:
        if not names or entry[0] in names:
            print(json.dumps(play(port, api, out, entry)), flush=True)


if __name__ == "__main__":
    main()
    # The package sometimes aborts while its threads end.
    os._exit(0)
