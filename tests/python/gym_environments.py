"""omnibus.gym: the official checkers, seeds, processes, errors, and the quick example of docs/gym.md.

The arguments are the page, the state hash of Rust's run, and the folder of the examples.
"""

import copy
import dataclasses
import os
import pathlib
import pickle
import re
import runpy
import sys
import warnings
from typing import Any

import gymnasium
import numpy as np
import pettingzoo.test
from gymnasium.utils.env_checker import check_env

import omnibus
import omnibus.gym
from omnibus import _omnibus
from omnibus.gym import (
    BirdsEye,
    Camera,
    Continuous,
    Discrete,
    DriveConfig,
    DriveEnv,
    Lidar,
    Rewards,
    Route,
    State,
    Terminations,
    Waypoint,
    parallel_env,
)

MANUAL, RUST_HASH = pathlib.Path(sys.argv[1]), int(sys.argv[2])
EXAMPLES = pathlib.Path(sys.argv[3])
SMALL = Route(map=os.environ["OMNIBUS_TEST_MAP"], length_m=80.0)
CONFIG = DriveConfig(route=SMALL, vehicles=4, terminations=Terminations(steps_max=150))


def expect(error: type[Exception], text: str, call: Any) -> None:
    """Expects that a call raises an error whose message has a text."""
    try:
        call()
    except error as raised:
        assert text in str(raised), raised
    else:
        raise AssertionError(f"no error: {text}")


def drive(env: gymnasium.Env[Any, Any], seed: int, steps: int = 60) -> list[Any]:
    """Returns everything that an environment gives in some steps after a reset with a seed."""
    said: list[Any] = [env.reset(seed=seed)]
    env.action_space.seed(seed)
    for _ in range(steps):
        said.append(env.step(env.action_space.sample()))
        if said[-1][2] or said[-1][3]:
            said.append(env.reset())
    return said


def same(a: Any, b: Any) -> bool:
    """Returns whether two results are the same to the bit."""
    return pickle.dumps(a) == pickle.dumps(b)


def checkers() -> None:
    """The official checkers, for every kind of observation and action."""
    for observations in (
        State(),
        Lidar(rays=32),
        BirdsEye(size_px=32),
        Camera(width_px=32, height_px=24),
        Camera(output="depth"),
        (State(), Lidar(), BirdsEye(), Camera(output="tags")),
    ):
        for actions in (Continuous(), Discrete(), Waypoint()):
            config = dataclasses.replace(CONFIG, observations=observations, actions=actions)
            with warnings.catch_warnings():
                # The checker wishes a reward for each of its own steps.
                warnings.simplefilter("error")
                env = gymnasium.make("Omnibus/Drive-v0", config=config)
                check_env(env.unwrapped)
                env.close()
    for actions in (Continuous(), Discrete(), Waypoint()):
        seen = Camera(width_px=16, height_px=16) if actions == Discrete() else CONFIG.observations
        config = dataclasses.replace(CONFIG, actions=actions, observations=seen)
        pettingzoo.test.parallel_api_test(parallel_env(3, config), num_cycles=200)
        pettingzoo.test.parallel_seed_test(lambda config=config: parallel_env(3, config), 100)


def rust_run() -> None:
    """The run of Rust's crate, step by step: the same state hash."""
    twin = _omnibus.Environment(
        _omnibus.EnvironmentMap(SMALL.map, seed=3), seed=7, vehicles=4, route_m=80.0
    )
    for step in range(40):
        twin.step([(0.05 if step % 20 < 10 else -0.05, 0.3)])
    assert twin.state_hash == RUST_HASH, (twin.state_hash, RUST_HASH)


def seeds() -> None:
    """Seeds."""
    one, two = DriveEnv(CONFIG), DriveEnv(CONFIG)
    first = drive(one, 5)
    assert same(drive(two, 5), first) and one.state_hash == two.state_hash
    assert same(drive(one, 5), first)
    assert not same(drive(two, 6), first)
    again = first[0][1]["episode_seed"]
    assert same(one.reset(options={"episode_seed": again})[0], first[0][0])
    seeds = DriveConfig(route=dataclasses.replace(SMALL, map_seeds=(1, 2)))
    several = DriveEnv(seeds)
    assert {several.reset(seed=seed)[1]["map_seed"] for seed in range(8)} == {1, 2}


def observations() -> None:
    """Observations and infos; what was returned is not written again."""
    one = DriveEnv(CONFIG)
    observation, info = one.reset(seed=1)
    assert set(observation) == {"state", "lidar"} and observation["lidar"].shape == (240,)
    kept = copy.deepcopy(observation)
    later, _, _, _, info = one.step(np.array([0.1, 1.0], np.float32))
    assert same(observation, kept) and not np.array_equal(later["state"], kept["state"])
    assert info["ending"] is None and 0 < info["progress_m"] < info["route_m"], info
    later["state"][:] = 7.0
    assert one.reset(options={"route_m": 50.0, "vehicles": 0})[1]["route_m"] < 60
    assert one.reset()[1]["route_m"] > 70


def pictures() -> None:
    """The raster, and pictures that are drawn from it."""
    config = dataclasses.replace(CONFIG, observations=BirdsEye(size_px=64, pixel_m=0.5))
    env = DriveEnv(config, "rgb_array")
    raster, _ = env.reset(seed=1)
    assert raster.shape == (6, 64, 64) and raster.dtype == np.uint8
    # The ego vehicle: 4.7 m × 1.9 m of half metres, in the middle of its route, on the road.
    ego = raster[5] > 0
    assert ego[32, 32] and 20 < ego.sum() < 60, ego.sum()
    assert (raster[2] > 0)[20:30, 32].all() and (raster[0] > 0)[ego].all()
    image = env.render()
    assert image.shape == (256, 256, 3) and image.dtype == np.uint8
    assert tuple(image[128, 128]) == (30, 140, 70)
    assert DriveEnv(CONFIG).render() is None
    world = parallel_env(2, CONFIG, "rgb_array")
    world.reset(seed=1)
    assert world.render().shape == (256, 256, 3)


def cameras() -> None:
    """Cameras: what they show, and that each agent has its own."""
    def image(camera: Camera) -> Any:
        env = DriveEnv(dataclasses.replace(CONFIG, observations=camera))
        first, _ = env.reset(seed=1)
        kept = first.copy()
        for _ in range(12):
            later = env.step((0.0, 1.0))[0]
        assert later.shape == first.shape and not np.array_equal(later, kept)
        assert np.array_equal(first, kept)
        assert same(env.reset(seed=1)[0], kept)
        return first

    color = image(Camera())
    assert color.shape == (84, 84, 3) and color.dtype == np.uint8 and color.std() > 20
    # The sky above, bluer than the road below.
    assert color[5, :, 2].mean() > 1.2 * color[70, :, 2].mean(), (color[5].mean(0), color[70].mean(0))
    tags = image(Camera(width_px=90, height_px=60, output="tags"))
    assert tags.shape == (60, 90, 1) and tags.dtype == np.uint8
    assert (tags[45:, 30:60] == 1).mean() > 0.5 and {1, 11, 24} <= set(np.unique(tags)), np.unique(tags)
    behind = Camera(pose=omnibus.Pose((-8.0, 0.0, 3.0)), output="tags")
    # The vehicle itself, 8 m ahead and some 2 m below the camera.
    assert (image(behind)[50:56, 40:45] == 14).all()
    depth = image(Camera(width_px=90, height_px=60, output="depth"))
    assert depth.shape == (60, 90, 1) and depth.dtype == np.float32
    assert (depth[tags == 11] == 1000).all() and 1 < depth[59, 45, 0] < 5, depth[59, 45]
    world = parallel_env(2, dataclasses.replace(CONFIG, observations=Camera()))
    observed, _ = world.reset(seed=1)
    assert not np.array_equal(observed["ego_0"], observed["ego_1"])
    assert np.array_equal(observed["ego_0"], world._world.environment.camera(0))


def endings() -> None:
    """Endings: terminated or truncated, never both; a controller of waypoints arrives."""
    waypoints = DriveEnv(dataclasses.replace(CONFIG, vehicles=0, actions=Waypoint()))
    waypoints.reset(seed=3)
    ends = False
    while not ends:
        _, reward, terminated, truncated, info = waypoints.step((0.0, 0.0))
        ends = terminated or truncated
    assert (terminated, truncated, info["ending"]) == (True, False, "arrival"), info
    assert reward > 5.0
    assert waypoints.step((0.0, 0.0))[1:3] == (0.0, True)
    one = DriveEnv(CONFIG)
    one.reset(seed=1)
    for _ in range(150):
        _, _, terminated, truncated, info = one.step((0.0, -1.0))
        if terminated or truncated:
            break
    assert (terminated, truncated, info["ending"]) == (False, True, "steps"), info


def agents() -> None:
    """Several agents: those that have ended leave, the others go on."""
    world = parallel_env(3, dataclasses.replace(CONFIG, vehicles=0))
    world.reset(seed=2)
    assert world.agents == ["ego_0", "ego_1", "ego_2"]
    counts = []
    # Some more than the most steps of an episode.
    for _ in range(200):
        if not world.agents:
            break
        wheel = {"ego_0": (1.0, 1.0), "ego_1": (0.0, -1.0), "ego_2": (0.0, -1.0)}
        given = {agent: wheel[agent] for agent in world.agents}
        observed, rewards, ended, cut, infos = world.step(given)
        assert set(observed) == set(rewards) == set(ended) == set(cut) == set(infos) == set(given)
        assert not any(ended[agent] and cut[agent] for agent in given)
        counts.append(len(world.agents))
    assert counts[-2:] == [2, 0] and counts[0] == 3, counts
    expect(ValueError, "actions lacks ['ego_0'", lambda: (world.reset(), world.step({})))


def processes() -> None:
    """Processes: forked and spawned ones; several environments share one map."""
    seen = dataclasses.replace(CONFIG, observations=(State(), Camera(width_px=16, height_px=16)))
    one, two = DriveEnv(seen), DriveEnv(CONFIG)
    assert one._world._map is two._world._map
    first, _ = one.reset(seed=3)
    with warnings.catch_warnings():
        # Newer Pythons warn of every fork beside threads, such as those of NumPy.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        # A camera that has rendered works in a forked process.
        os._exit(0 if same(one.reset(seed=3)[0], first) else 1)
    assert os.waitpid(child, 0)[1] == 0
    make = [lambda: gymnasium.make("omnibus.gym:Omnibus/Drive-v0", config=CONFIG)] * 2
    for context in ("fork", "spawn"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            vector = gymnasium.vector.AsyncVectorEnv(make, context=context)
        vector.reset(seed=3)
        batch, rewards, *_ = vector.step(np.zeros((2, 2), np.float32))
        assert batch["state"].shape == (2, 24) and rewards.shape == (2,)
        vector.close()
    assert pickle.loads(pickle.dumps(CONFIG)) == CONFIG == copy.deepcopy(CONFIG)


def errors() -> None:
    """Errors name what is wrong."""
    expect(ValueError, "Lidar.rays is 0, must be 1 to 4096", lambda: Lidar(rays=0))
    expect(ValueError, "Camera.fov_rad is 3.5, must be 0.1 to 3", lambda: Camera(fov_rad=3.5))
    expect(ValueError, "Camera.output is 'flow'", lambda: Camera(output="flow"))  # type: ignore[arg-type]
    bent = Camera(pose=omnibus.Pose(rotation_xyzw=(0.0, 0.0, 0.0, 2.0)))
    expect(
        ValueError,
        "camera.mount has position",
        lambda: DriveEnv(dataclasses.replace(CONFIG, observations=bent)),
    )
    expect(ValueError, "a value of Discrete.steer is 2", lambda: Discrete(steer=(2.0,)))
    expect(ValueError, "must be different ones", lambda: DriveConfig(observations=(State(), State())))
    expect(ValueError, "vehicles is 2000", lambda: DriveConfig(vehicles=2000))
    expect(
        ValueError,
        "frame_s is 1, must be 0.005 to 0.1",
        lambda: DriveEnv(dataclasses.replace(CONFIG, frame_s=1.0)),
    )
    expect(
        ValueError,
        "reward.speed is NaN",
        lambda: DriveEnv(dataclasses.replace(CONFIG, rewards=Rewards(speed=float("nan")))),
    )
    expect(omnibus.OmnibusError, 'no map is named "Nowhere"', lambda: DriveEnv(DriveConfig(route=Route("Nowhere"))))
    expect(ValueError, "render_mode is 'ansi'", lambda: DriveEnv(CONFIG, "ansi"))
    expect(ValueError, "egos is 65, must be 1 to 64", lambda: parallel_env(65, CONFIG))
    one = DriveEnv(CONFIG)
    expect(ValueError, "steer in the action of ego vehicle 0 is 3", lambda: one.reset() and one.step((3.0, 0.0)))
    expect(ValueError, "must be two numbers", lambda: one.step(0))
    expect(ValueError, "ego is 5, and there are 1", lambda: one._world.environment.state(5))


def page() -> None:
    """The examples of the page."""
    blocks = re.findall(r"^```python\n(.*?)^```", MANUAL.read_text(), re.MULTILINE | re.DOTALL)
    assert len(blocks) > 2
    for block in blocks:
        exec(compile(block, str(MANUAL), "exec"), {"__name__": "page"})


def learning() -> None:
    """The example of PPO, for one update."""
    sys.argv = ["ppo_lane_keeping.py", "--steps", "1", "--episodes", "1", "--picture", "curve.svg"]
    runpy.run_path(str(EXAMPLES / "ppo_lane_keeping.py"))["main"]()
    assert pathlib.Path("curve.svg").read_text().startswith("<svg")


# A spawned process imports this file.
if __name__ == "__main__":
    for test in (
        rust_run,
        checkers,
        seeds,
        observations,
        pictures,
        cameras,
        endings,
        agents,
        processes,
        errors,
        page,
        learning,
    ):
        print(test.__name__, flush=True)
        test()
