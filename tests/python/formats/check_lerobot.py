"""Reads an export as LeRobot's `DatasetReader` and `LeRobotDatasetMetadata` do, with `datasets` and
pandas: <https://github.com/huggingface/lerobot/tree/main/src/lerobot/datasets>.

Arguments: the export, the folder of its scenes.
"""

import json
import pathlib
import sys
import tempfile

import datasets
import numpy as np
import pandas as pd
from plain import scenes

STATS = ("min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99")
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}

root = pathlib.Path(sys.argv[1])
cache = tempfile.TemporaryDirectory()
datasets.disable_progress_bars()


def load(folder: pathlib.Path, features: datasets.Features | None = None) -> datasets.Dataset:
    """Reads the Parquet files in the chunks of a folder."""
    paths = [str(path) for path in sorted(folder.glob("*/*.parquet"))]
    return datasets.Dataset.from_parquet(paths, features=features, cache_dir=cache.name)


def feature(described: dict):
    """Returns the type of a feature, as `get_hf_features_from_features` does."""
    if described["dtype"] == "image":
        return datasets.Image()
    value = datasets.Value(dtype=described["dtype"])
    (length,) = described["shape"]
    return value if length == 1 else datasets.Sequence(length=length, feature=value)


def rotation(xyzw: list[float]) -> np.ndarray:
    """Returns the matrix of a quaternion."""
    x, y, z, w = np.array(xyzw) / np.linalg.norm(xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def check_state(names: list[str], state: list[float], ego: dict) -> None:
    """The numbers of a row are those of the ego, in its own space."""
    found = dict(zip(names, state, strict=True))
    pose = ego["world_from_vehicle"]
    world_from_vehicle = rotation(pose["rotation_xyzw"])
    for name, vector in [("velocity_{}_mps", "velocity_mps"), ("acceleration_{}_mps2", "acceleration_mps2")]:
        in_vehicle = world_from_vehicle.T @ ego[vector]
        close = [found[name.format(axis)] for axis in "xy"]
        assert np.allclose(close, in_vehicle[:2], atol=1e-4), (found, in_vehicle)
    yaw_rate = (world_from_vehicle.T @ ego["angular_velocity_radps"])[2]
    assert np.isclose(found["yaw_rate_radps"], yaw_rate, atol=1e-5)
    assert np.allclose([found[f"position_{axis}_m"] for axis in "xyz"], pose["position_m"])
    angles = [found[f"{name}_rad"] for name in ("yaw", "pitch", "roll")]
    (cz, cy, cx), (sz, sy, sx) = np.cos(angles), np.sin(angles)
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    assert np.allclose(about_z @ about_y @ about_x, world_from_vehicle, atol=1e-5)


def check_statistics(found: dict, values: np.ndarray, name: str) -> None:
    """Statistics are those of numpy over the first axis."""
    for kind in ("min", "max", "mean", "std"):
        number = getattr(values, kind)(axis=0)
        assert np.allclose(np.ravel(found[kind]), number, rtol=1e-4, atol=1e-6), (name, kind)
    for kind in QUANTILES.keys() & found.keys():
        number = np.quantile(values, QUANTILES[kind], axis=0)
        assert np.allclose(np.ravel(found[kind]), number, rtol=1e-4, atol=1e-6), (name, kind)


info = json.loads((root / "meta/info.json").read_text())
assert info["codebase_version"] == "v3.0" and info["video_path"] is None
features = info["features"]
rows = load(root / "data", datasets.Features({name: feature(of) for name, of in features.items()}))
tasks = pd.read_parquet(root / "meta/tasks.parquet")
episodes = load(root / "meta/episodes")
plain = scenes(sys.argv[2])
assert info["total_episodes"] == len(episodes) == len(plain)
assert info["total_frames"] == len(rows) == sum(len(scene.lines) for scene in plain)
assert info["total_tasks"] == len(tasks) == 2 and set(rows.column_names) == set(features)
assert info["splits"] == {"train": f"0:{len(plain)}"}
cameras = [f"observation.images.{name}" for name in plain[0].cameras]
assert cameras == [name for name, of in features.items() if of["dtype"] == "image"]
moved, steered = 0.0, 0.0
pixels_of_all = []
for number, (scene, episode) in enumerate(zip(plain, episodes, strict=True)):
    begin, end = episode["dataset_from_index"], episode["dataset_to_index"]
    assert end - begin == episode["length"] == len(scene.lines)
    assert episode["episode_index"] == number
    path = info["data_path"].format(
        chunk_index=episode["data/chunk_index"], file_index=episode["data/file_index"]
    )
    assert (root / path).is_file(), path
    times = np.array([line["sim_time_nanos"] for line in scene.lines]) / 1e9
    assert np.allclose(np.arange(len(times)) / info["fps"], times - times[0])
    pixels = {name: [] for name in cameras}
    for index, line in enumerate(scene.lines):
        row = rows[begin + index]
        assert (row["episode_index"], row["frame_index"]) == (number, index)
        assert row["index"] == begin + index
        assert abs(row["timestamp"] - index / info["fps"]) < 1e-4
        # As `get_item` looks it up.
        task = tasks.iloc[row["task_index"]].name
        assert task == f"drive through {scene.metadata['settings']['map']}"
        assert episode["tasks"] == [task]
        check_state(features["observation.state"]["names"], row["observation.state"], line["ego"])
        after = scene.lines[min(index + 1, len(scene.lines) - 1)]["ego"]["control"]
        action = dict(zip(features["action"]["names"], row["action"], strict=True))
        assert all(abs(after[name] - value) < 1e-6 for name, value in action.items()), (action, after)
        weather = dict(zip(features["weather"]["names"], row["weather"], strict=True))
        assert weather.keys() == line["weather"].keys()
        assert np.allclose([line["weather"][name] for name in weather], list(weather.values()))
        for name in cameras:
            camera = name.removeprefix("observation.images.")
            shown = np.array(row[name])
            assert list(shown.shape) == features[name]["shape"]
            assert np.array_equal(shown, scene.image(camera, "color", line["frame"]))
            pixels[name].append(shown.reshape(-1, 3) / 255)
        moved += np.linalg.norm(line["ego"]["velocity_mps"])
        steered += abs(action["throttle"]) + abs(action["brake"]) + abs(action["steer"])
    pixels_of_all.append(pixels)
    for name in set(features) - set(cameras):
        values = np.array(rows[begin:end][name], np.float64).reshape(end - begin, -1)
        found = {kind: episode[f"stats/{name}/{kind}"] for kind in STATS}
        check_statistics(found, values, name)
        assert episode[f"stats/{name}/count"] == [end - begin]
    # All images are sampled, because they are few.
    for name in cameras:
        found = {kind: episode[f"stats/{name}/{kind}"] for kind in STATS}
        check_statistics(found, np.concatenate(pixels[name]), name)
assert moved > 1 and steered > 0.1
stats = json.loads((root / "meta/stats.json").read_text())
assert set(stats) == set(features)
for name, found in stats.items():
    if name in cameras:
        values = np.concatenate([np.concatenate(pixels[name]) for pixels in pixels_of_all])
        # `aggregate_stats` demands this shape.
        assert all(np.shape(found[kind]) == (3, 1, 1) for kind in STATS)
    else:
        values = np.array(rows[name], np.float64).reshape(len(rows), -1)
    assert found["count"] == [len(rows)]
    for kind, quantile in QUANTILES.items():
        # As `aggregate_feature_stats` joins those of the episodes.
        joined = (np.min if quantile <= 0.5 else np.max)(
            [np.ravel(episode[f"stats/{name}/{kind}"]) for episode in episodes], axis=0
        )
        assert np.allclose(np.ravel(found.pop(kind)), joined), (name, kind)
    check_statistics(found, values, name)
