"""Forks, threads, callbacks, asyncio, and ends of every kind: no hang, no crash, no leak."""

import asyncio
import gc
import math
import os
import pathlib
import signal
import stat
import subprocess
import sys
import threading
import time

from kit import launch, nothing_is_left, run_python

import omnibus
from omnibus.sensors import BrownConrady, Camera, CameraEffects, Fisheye, Imu

FRONT = Camera("front", 64, 48, math.radians(90), omnibus.Pose((1.5, 0.0, 1.5)))


def eventually(what: str, is_so) -> None:
    for _ in range(6000):
        if is_so():
            return
        time.sleep(0.01)
    raise AssertionError(f"{what} did not come about within a minute")


def raises(kind: type[BaseException], words: list[str], call) -> None:
    try:
        call()
    except kind as error:
        print(f"{kind.__name__}: {error}")
        for word in words:
            assert word in str(error), (word, str(error))
    else:
        raise AssertionError(f"{kind} was not raised")


def a_forked_child_leaves_its_parent_s_connection_alone() -> None:
    with launch(sensors=[FRONT]) as simulator:
        frame = simulator.client.tick()
        image = frame["front"].color
        total = int(image.sum())
        child = os.fork()
        if child == 0:
            # Any failure is an exit code; the objects are dropped, and the interpreter ends.
            assert int(image.sum()) == total
            raises(omnibus.NotAllowedError, ["fork", "connect a Client"], simulator.client.tick)
            raises(omnibus.NotAllowedError, ["fork"], simulator.client.close)
            raises(omnibus.NotAllowedError, ["fork"], simulator.bundles[0].receive)
            with omnibus.Client("child", simulator.name) as own:
                assert own.snapshot().frame == frame.number
            simulator.close()
            del frame, image
            gc.collect()
            sys.exit(0)
        _, status = os.waitpid(child, 0)
        assert status == 0, status
        # Nothing of the parent was given back.
        assert simulator.is_running
        for _ in range(20):
            simulator.client.tick()
        assert int(image.sum()) == total and simulator.bundles[0].views_held == 1


def threads_share_a_client() -> None:
    with launch(sensors=[FRONT, Imu("imu")]) as simulator:
        client, ego = simulator.client, simulator.ego
        stop, errors, turns = threading.Event(), [], [0] * 4

        def work(index: int) -> None:
            try:
                while not stop.is_set():
                    client.control(ego, throttle=0.3)
                    assert len(client.snapshot()) > 0
                    assert client.map.nearest((0.0, 0.0, 0.0)) is not None
                    turns[index] += 1
            except BaseException as error:
                errors.append(error)

        workers = [threading.Thread(target=work, args=(index,)) for index in range(4)]
        for worker in workers:
            worker.start()
        numbers = [frame.number for frame in client.ticks(200)]
        stop.set()
        for worker in workers:
            worker.join()
        assert not errors, errors
        assert numbers == list(range(numbers[0], numbers[0] + 200))
        assert all(turns), turns


def a_wait_lets_other_threads_run() -> None:
    with launch() as simulator:
        agent = omnibus.Client("agent", simulator.name)
        agent.join_barrier()
        ticked = threading.Thread(target=simulator.client.tick)
        ticked.start()
        # The tick waits for the agent; this thread runs, and uses the same client.
        agent.await_frame()
        for _ in range(1000):
            assert simulator.client.is_open and ticked.is_alive()
        simulator.client.snapshot()
        agent.arrive()
        ticked.join()
        agent.leave_barrier()
        raises(omnibus.SimulatorTimeoutError, ["0.2 s"], lambda: agent.await_frame(0.2))
        raises(TimeoutError, ["0.1 s"], lambda: agent.await_frame(0.1))


def ctrl_c_ends_a_wait() -> None:
    with launch() as simulator:
        agent = omnibus.Client("agent", simulator.name)
        threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        raises(KeyboardInterrupt, [], agent.await_frame)
        agent.join_barrier()
        threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        raises(KeyboardInterrupt, [], simulator.client.tick)
        # The frame was requested; it completes, and the next tick goes on.
        agent.snapshot()
        agent.arrive()
        agent.leave_barrier()
        before = simulator.client.snapshot().frame
        assert simulator.client.tick().number == before + 1


def an_exception_of_a_callback_is_reported_once_and_ends_its_listener() -> None:
    with launch() as simulator:
        observer = omnibus.Client("observer", simulator.name)
        bundle = observer.create_bundle("eye", [FRONT])
        seen, worlds, printed = [], [], []
        threading.excepthook = lambda args: printed.append(args.exc_value)

        def fail(measurement: omnibus.Measurement) -> None:
            seen.append(measurement.frame)
            if len(seen) == 3:
                raise RuntimeError("the third one")

        listener = omnibus.listen(bundle, fail)
        with omnibus.listen(observer, lambda world: worlds.append(world.frame)):
            while listener.is_running:
                simulator.client.tick()
            eventually("a world is seen", lambda: worlds)
        raises(RuntimeError, ["the third one"], listener.close)
        listener.close()
        assert len(seen) == 3 and seen == sorted(set(seen)), seen
        assert worlds == sorted(set(worlds)), worlds
        assert [str(error) for error in printed] == ["the third one"], printed
        threading.excepthook = threading.__excepthook__


def asyncio_waits_beside_other_tasks() -> None:
    async def main(simulator: omnibus.Simulator) -> None:
        observer = omnibus.Client("observer", simulator.name)
        bundle = observer.create_bundle("eye", [FRONT])
        worlds, measured = [], []

        async def watch() -> None:
            async for world in omnibus.aio.frames(observer):
                worlds.append(world.frame)

        async def measure() -> None:
            async for measurement in omnibus.aio.measurements(bundle):
                measured.append(measurement.frame)

        tasks = [asyncio.create_task(watch()), asyncio.create_task(measure())]
        while len(measured) < 5 or len(worlds) < 2:
            await omnibus.aio.tick(simulator.client)
        for task in tasks:
            task.cancel()
        results = await asyncio.gather(*tasks, return_exceptions=True)
        assert all(isinstance(result, asyncio.CancelledError) for result in results), results
        assert measured == sorted(measured) and worlds == sorted(worlds)

    with launch() as simulator:
        asyncio.run(main(simulator))


def a_killed_simulator_is_an_error_and_nothing_hangs() -> None:
    for during_a_tick in (False, True):
        with launch(sensors=[FRONT]) as simulator:
            client, ego = simulator.client, simulator.ego
            frame = client.tick()
            image = frame["front"].color
            total = int(image.sum())
            if during_a_tick:
                agent = omnibus.Client("agent", simulator.name)
                agent.join_barrier()
                threading.Timer(0.3, lambda: os.kill(simulator.pid, signal.SIGKILL)).start()
            else:
                os.kill(simulator.pid, signal.SIGKILL)
            raises(omnibus.SimulatorEndedError, ["omnibus.launch()"], client.tick)
            raises(omnibus.SimulatorEndedError, ["has ended"], client.await_frame)
            raises(omnibus.OmnibusError, [], lambda: client.spawn("vehicle.audi.a2", omnibus.Pose()))
            raises(omnibus.OmnibusError, ["no simulator named"], lambda: omnibus.Client("x", simulator.name))
            # What is held stays readable.
            assert int(image.sum()) == total and ego in frame.world
            assert not simulator.is_running
    raises(omnibus.NotAllowedError, ["closed"], client.tick)


EXITS = {
    "at the end of the program": "",
    "while a thread ticks": """
threading.Thread(target=lambda: [client.tick() for _ in iter(int, 1)], daemon=True).start()
time.sleep(0.3)
""",
    "while a thread waits for a tick that does not end": """
agent = omnibus.Client("agent", simulator.name)
agent.join_barrier()
threading.Thread(target=client.tick, daemon=True).start()
time.sleep(0.3)
""",
    "while listeners wait": """
other = omnibus.Client("other", simulator.name)
listening = omnibus.listen(other, print), omnibus.listen(simulator.bundles[0], print)
time.sleep(0.3)
""",
    "with an exception": "1 / 0",
    "by SIGKILL": "os.kill(os.getpid(), 9)",
    "by SIGKILL, with a forked child that lives on": """
if os.fork() == 0:
    os.close(1); os.close(2); time.sleep(2); os._exit(0)
os.kill(os.getpid(), 9)
""",
    "by SIGKILL, launched by a thread that has ended": """
started = []
thread = threading.Thread(target=lambda: started.append(launch()))
thread.start(); thread.join(); time.sleep(0.3)
assert started[0].client.tick().number > 0
print(started[0].name, flush=True)
os.kill(os.getpid(), 9)
""",
    "by os._exit": "os._exit(3)",
    "after a block that raises": """
client.close()
with launch(sensors=[FRONT]) as second:
    print(second.name, flush=True)
    second.client.tick()
    raise SystemExit(4)
""",
}
CODES = {"with an exception": 1, "by os._exit": 3, "after a block that raises": 4}
PRELUDE = """
import math, os, sys, threading, time
from kit import launch
import omnibus
from omnibus.sensors import Camera
FRONT = Camera("front", 64, 48, math.radians(90), omnibus.Pose((1.5, 0.0, 1.5)))
simulator = launch(sensors=[FRONT])
client, frame = simulator.client, simulator.client.tick()
print(simulator.name, flush=True)
"""


def a_simulator_ends_however_python_ends() -> None:
    for how, program in EXITS.items():
        ended = run_python(PRELUDE + program)
        code = -signal.SIGKILL if "SIGKILL" in how else CODES.get(how, 0)
        assert ended.returncode == code, (how, ended)
        names = ended.stdout.split()
        assert names, (how, ended)
        for name in names:
            if name.startswith("py"):
                eventually(f"{how}: the end of {name}", lambda: nothing_is_left(name))
        for word in ("Fatal", "panicked", "Segmentation"):
            assert word not in ended.stderr, (how, ended.stderr)
        print("ended", how)


def the_first_tick_of_a_launched_world_has_all_its_road_users() -> None:
    def first() -> bytes:
        with launch(options=["--vehicles", "30", "--walkers", "20"]) as simulator:
            simulator.client.tick()
            actors = simulator.client.world.actors
            counts = [int((actors["kind"] == kind).sum()) for kind in (1, 2)]
            assert counts == [30, 20], counts
            simulator.client.tick()
            return simulator.client.world.actors.tobytes()

    assert first() == first()


def a_program_of_another_build_is_refused_by_name() -> None:
    folder = pathlib.Path.cwd()
    other = folder / "omnibus"
    other.write_text("#!/bin/sh\necho 'omnibus 0.0.9 (build 0123456789abcdef)'\n")
    other.chmod(other.stat().st_mode | stat.S_IXUSR)
    words = [omnibus.__build__, "0.0.9 (build 0123456789abcdef)", str(other)]
    raises(omnibus.BuildError, words, lambda: launch(program=other))
    raises(omnibus.OmnibusError, ["/no/such"], lambda: launch(program="/no/such"))
    raises(omnibus.OmnibusError, ["did not start", "NoSuchTown"], lambda: omnibus.launch("NoSuchTown"))
    raises(ValueError, ["wait_strategy", "latency"], lambda: omnibus.Client(wait_strategy="quick"))
    with launch() as simulator:
        # The running host claims to be of another build.
        page = pathlib.Path(f"/dev/shm/omnibus-{simulator.name}/control")
        with page.open("r+b") as control:
            build = int(omnibus.__build__.split("build ")[1].rstrip(")"), 16).to_bytes(8, "little")
            offset = control.read().index(build)
            control.seek(offset)
            control.write(bytes(8))
            control.flush()
            words = [omnibus.__build__, "0000000000000000", "omnibus.launch()"]
            raises(omnibus.BuildError, words, lambda: omnibus.Client("late", simulator.name))
            control.seek(offset)
            control.write(build)


def a_projection_follows_the_lens() -> None:
    lens = BrownConrady(-0.2, 0.05, 0.001, -0.002, 0.01)
    camera = Camera("c", 640, 480, lens=lens, intrinsics_px=(500.0, 510.0, 322.5, 239.0))
    forward, left, up = 4.0, 1.0, -0.5
    x, y = -left / forward, -up / forward
    square = x * x + y * y
    radial = 1 + lens.k1 * square + lens.k2 * square**2 + lens.k3 * square**3
    bent_x = x * radial + 2 * lens.p1 * x * y + lens.p2 * (square + 2 * x * x)
    bent_y = y * radial + lens.p1 * (square + 2 * y * y) + 2 * lens.p2 * x * y
    u, v = camera.projection.project((forward, left, up))
    assert math.hypot(u - (322.5 + 500.0 * bent_x), v - (239.0 + 510.0 * bent_y)) < 1e-3, (u, v)
    back = camera.projection.unproject((u, v), forward)
    assert math.dist(back, (forward, left, up)) < 1e-4, back
    assert camera.projection.focal_px == (500.0, 510.0) and camera.focal_px == 500.0
    roof = omnibus.Pose((0.0, 0.0, 2.0))
    around = Camera("a", 256, 256, 3.4, roof, lens=Fisheye(max_angle_rad=1.7), outputs=("depth", "color"))
    assert around.projection.project((-0.1, 1.0, 0.0)) is not None, "behind, but less than 97.4°"
    assert around.projection.project((-0.2, 1.0, 0.0)) is None
    with launch(sensors=[around]) as simulator:
        seen = simulator.client.tick()["a"]
        assert seen.depth[0, 0] == 1000.0 and not seen.color[0, 0, :3].any(), "outside of the circle"
        assert seen.depth[200, 128] < 1000.0 and seen.color[200, 128, :3].any()
    raises(ValueError, ['camera "c"', "k1 is"], lambda: Camera("c", 8, 8, lens=BrownConrady(1e9)).projection)
    raises(ValueError, ["is no lens"], lambda: Camera("c", 8, 8, lens=3).projection)


def effects_change_the_color_image() -> None:
    bright = CameraEffects(compensation_ev=1.5, vignette=0.5, white_electrons=5000.0)
    pose = omnibus.Pose((1.5, 0.0, 1.5))
    plain = Camera("plain", 64, 48, pose=pose, quality="low")
    shown = Camera("shown", 64, 48, pose=pose, quality="low", effects=bright)
    with launch(sensors=[plain, shown]) as simulator:
        seen = simulator.client.tick()
        assert seen["shown"].color[..., :3].mean() > 1.1 * seen["plain"].color[..., :3].mean()
        wrong = Camera("c", 8, 8, effects=CameraEffects(bloom=2.0))
        raises(omnibus.RefusedError, ["bloom is 2, not 0 to 1"], lambda: simulator.client.create_bundle("b", [wrong]))
        wrong = Camera("c", 8, 8, effects=CameraEffects(exposure="bright"))
        raises(ValueError, ["unknown exposure"], lambda: simulator.client.create_bundle("b", [wrong]))
        wrong = Camera("c", 8, 8, effects=3)
        raises(ValueError, ["is no effects"], lambda: simulator.client.create_bundle("b", [wrong]))


def refusals_have_codes_and_advice() -> None:
    with launch(sensors=[FRONT]) as simulator:
        client, ego = simulator.client, simulator.ego
        place = client.map.spawn_points[0]
        for code, call in (
            ("UnknownBlueprint", lambda: client.spawn("vehicle.no.such", place)),
            ("UnknownActor", lambda: client.destroy(9999)),
            ("Map", lambda: client.load_map("NoSuchTown")),
        ):
            try:
                call()
            except omnibus.RefusedError as error:
                assert error.code == code, error.code
            else:
                raise AssertionError(code)
        late = omnibus.Client("late", simulator.name)
        raises(omnibus.NotAllowedError, ["'launch'".replace("'", '"'), "await_frame"], late.tick)
        raises(KeyError, ["actor 9999", "does not exist"], lambda: client.world.actor(9999))
        raises(KeyError, ["front"], lambda: client.tick()["rear"])
        raises(AttributeError, ["depth", "outputs"], lambda: client.tick()["front"].depth)
        raises(ValueError, ["no sensor"], lambda: client.create_bundle("b", ["eye"]))
        raises(ValueError, ["delta_secs"], lambda: client.synchronise(-1.0))
        raises(omnibus.RefusedError, ["fov_rad"], lambda: client.create_bundle("b", [Camera("c", 8, 8, 9.0)]))
        bent = Camera("c", 8, 8, lens=BrownConrady(-9.0))
        raises(omnibus.RefusedError, ["polynomial falls"], lambda: client.create_bundle("b", [bent]))
        client.load_map()
        raises(omnibus.WorldGoneError, ["create the bundle again"], client.tick)
        assert client.tick().measurements == {} and ego not in client.world


if __name__ == "__main__":
    # A shell starts background jobs with SIGINT ignored, and Python leaves it so.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for test in (
        a_forked_child_leaves_its_parent_s_connection_alone,
        threads_share_a_client,
        a_wait_lets_other_threads_run,
        ctrl_c_ends_a_wait,
        an_exception_of_a_callback_is_reported_once_and_ends_its_listener,
        asyncio_waits_beside_other_tasks,
        a_killed_simulator_is_an_error_and_nothing_hangs,
        a_simulator_ends_however_python_ends,
        the_first_tick_of_a_launched_world_has_all_its_road_users,
        a_program_of_another_build_is_refused_by_name,
        a_projection_follows_the_lens,
        effects_change_the_color_image,
        refusals_have_codes_and_advice,
    ):
        begun = time.monotonic()
        test()
        print(f"{test.__name__}: {time.monotonic() - begun:.1f} s", flush=True)
