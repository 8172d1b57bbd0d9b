"""Reads an export with nuscenes-devkit, and holds its geometry against pixels and points.

Arguments: the export, the folder of its scenes.
"""

import sys
import types

# The devkit imports scikit-learn for its statistics of lidar segmentation, which are not used here.
for name in ("sklearn", "sklearn.metrics"):
    sys.modules[name] = types.ModuleType(name)
sys.modules["sklearn.metrics"].confusion_matrix = None

import numpy as np
from nuscenes.nuscenes import NuScenes
from nuscenes.utils.data_classes import Box, LidarPointCloud, RadarPointCloud
from nuscenes.utils.geometry_utils import points_in_box, view_points
from PIL import Image
from plain import Scene, scenes, slack_px
from pyquaternion import Quaternion

data = NuScenes("v1.0-trainval", sys.argv[1], verbose=False)
by_name = {scene.name: scene for scene in scenes(sys.argv[2])}
PREFIXES = {
    "Car": "vehicle.",
    "Truck": "vehicle.",
    "Bus": "vehicle.bus",
    "Motorcycle": "vehicle.motorcycle",
    "Bicycle": "vehicle.bicycle",
    "Pedestrian": "human.pedestrian",
}


def annotated(scene: Scene, frame: int) -> list[dict]:
    """Returns the actors of a frame that nuScenes has a category for."""
    return [actor for actor in scene.boxes(frame) if actor["tag_name"] in PREFIXES]


def actor_of(row: dict, actors: list[dict], origin: np.ndarray) -> dict:
    """Returns the actor of an annotation: the one at its place."""
    places = np.array([actor["world_from_box"]["position_m"] for actor in actors]) - origin
    away = np.linalg.norm(places - row["translation"], axis=1)
    assert away.min() < 1e-3, away.min()
    return actors[int(away.argmin())]


def check_camera(scene: Scene, frame: int, token: str, actors: dict[str, dict]) -> int:
    """Every box encloses the pixels of its actor; returns the number of boxes."""
    path, boxes, intrinsics = data.get_sample_data(token, box_vis_level=0)
    with Image.open(path) as image:
        assert image.size == tuple(data.get("sample_data", token)[k] for k in ("width", "height"))
    ids = scene.ids("front", frame)
    count = 0
    for box in boxes:
        actor = actors[box.token]
        view = actor["cameras"].get("front")
        if view is None or box.corners()[2].min() < 0.1:
            continue
        assert np.allclose(box.center, view["optical_from_box"]["position_m"], atol=5e-3)
        corners = view_points(box.corners(), intrinsics, normalize=True)[:2]
        rows, columns = np.nonzero(ids == actor["actor_id"])
        # Whole coordinates are the centres of pixels.
        slack = slack_px(actor, np.ptp(corners[1]))
        for axis, pixels in enumerate((columns, rows)):
            low, high = corners[axis].min(), corners[axis].max()
            assert low - slack <= pixels.min() and pixels.max() <= high + slack, (actor, low, high)
        # The other way round, on what is seen as a whole: the box is no larger than needed. Legs far away are
        # thinner than a pixel, and no pixel may show them.
        is_whole = view["occluded_fraction"] < 0.02 and view["truncated_fraction"] == 0
        if is_whole and np.ptp(corners[1]) > 12:
            slack = 2.5 + 0.2 * np.ptp(corners[1])
            assert abs(rows.min() - corners[1].min()) < slack, actor
            assert abs(rows.max() - corners[1].max()) < slack, actor
        count += 1
    return count


def check_lidar(scene: Scene, frame: int, token: str, actors: dict[str, dict]) -> int:
    """Every box holds the points of its actor; returns their number."""
    path, boxes, _ = data.get_sample_data(token, box_vis_level=0)
    cloud = LidarPointCloud.from_file(path)
    plain, labels = scene.points("lidar", frame), scene.labels("lidar", frame)
    assert cloud.points.shape == (4, len(plain)) and len(plain) > 0
    assert 0 <= cloud.points[3].min() and cloud.points[3].max() <= 255
    assert np.allclose(cloud.points[:3].T @ [[0, -1, 0], [1, 0, 0], [0, 0, 1]], plain[:, :3])
    ring = np.fromfile(path, "<f4").reshape(-1, 5)[:, 4]
    elevation = np.arctan2(plain[:, 2], np.hypot(plain[:, 0], plain[:, 1]))
    channels = scene.lidars["lidar"]["lidar"]["channels"]
    means = [elevation[ring == number].mean() for number in np.unique(ring)]
    assert ring.max() < channels and np.all(np.diff(means) > 0)
    count = 0
    for box in boxes:
        row = data.get("sample_annotation", box.token)
        is_actor = labels[:, 0] == actors[box.token]["actor_id"]
        # Wheels and mirrors leave the box by centimetres; the rear foot of a walker is up to 0.57 m behind its middle.
        out_m = 0.9 if actors[box.token]["tag_name"] == "Pedestrian" else 0.1
        slack = Box(box.center, box.wlh + out_m, box.orientation)
        is_inside = points_in_box(slack, cloud.points[:3])
        assert row["num_lidar_pts"] == is_actor.sum(), (row, is_actor.sum())
        assert np.sum(is_actor & is_inside) >= 0.95 * is_actor.sum(), (row, is_actor.sum())
        # The interior of a vehicle holds points of its own only; walkers pass through each other.
        if row["category_name"].startswith("vehicle."):
            interior = Box(box.center, box.wlh * 0.8, box.orientation)
            inside = points_in_box(interior, cloud.points[:3])
            assert np.sum(inside & ~is_actor) <= 0.05 * inside.sum() + 1, row
        count += is_actor.sum()
    return count


def check_radar(scene: Scene, frame: int, token: str) -> None:
    """Every detection has its place and its velocity along the ray; things at rest have none."""
    cloud = RadarPointCloud.from_file(data.get_sample_data_path(token)).points
    path = scene.folder / f"RADAR_FRONT/detections/{frame:06}.bin"
    rate, azimuth, altitude, distance = np.fromfile(path, "<f4").reshape(-1, 4).T
    level = np.cos(altitude)
    to = np.array([np.cos(azimuth) * level, np.sin(azimuth) * level, np.sin(altitude)])
    assert cloud.shape == (18, len(rate)) and len(rate) > 0
    assert np.allclose(cloud[:3], to * distance, atol=1e-3)
    assert np.allclose(cloud[6:8], to[:2] * rate, atol=1e-4)
    is_static = scene.labels("RADAR_FRONT", frame)[:, 0] >= 1 << 23
    assert is_static.any() and np.abs(cloud[8:10, is_static]).max() < 1e-3
    assert (cloud[3, is_static] == 1).all()


def check_scene(record: dict) -> np.ndarray:
    """Checks the samples of a scene in their order; returns how many boxes and points it compared."""
    scene = by_name.pop(record["name"])
    log = data.get("log", record["log_token"])
    assert log["location"] == scene.metadata["settings"]["map"]
    token, boxes, points = record["first_sample_token"], 0, 0
    origins, speeds = [], []
    for line in scene.lines:
        sample = data.get("sample", token)
        assert sample["timestamp"] == line["sim_time_nanos"] // 1000
        assert set(sample["data"]) == {"CAM_FRONT", "LIDAR_TOP", "RADAR_FRONT"}, sample["data"]
        lidar = data.get("sample_data", sample["data"]["LIDAR_TOP"])
        ego = data.get("ego_pose", lidar["ego_pose_token"])
        mount = data.get("calibrated_sensor", lidar["calibrated_sensor_token"])
        place = Quaternion(ego["rotation"]).rotate(np.array(mount["translation"]))
        (pose,) = (s["world_from_sensor"] for s in line["sensors"] if s["name"] == "lidar")
        # The origin is on the rear axle: half a wheelbase behind that of the plain data set.
        vehicle_from_lidar = np.array(scene.lidars["lidar"]["vehicle_from_sensor"])
        x, y, z = np.array(mount["translation"]) - vehicle_from_lidar[:3, 3]
        assert 1.2 < x < 1.7 and abs(y) < 1e-6 and abs(z) < 1e-6, mount
        # The same world, moved by the corner of the map.
        origins.append(np.array(pose["position_m"]) - place - ego["translation"])
        mask = data.get("map", log["map_token"])["mask"]
        assert mask.is_on_mask(*ego["translation"][:2]), "the ego drives beside the road"
        plain = annotated(scene, line["frame"])
        rows = [data.get("sample_annotation", row) for row in sample["anns"]]
        actors = {row["token"]: actor_of(row, plain, origins[0]) for row in rows}
        assert len(rows) == len(plain) == len({a["actor_id"] for a in actors.values()})
        for row in rows:
            actor = actors[row["token"]]
            assert row["category_name"].startswith(PREFIXES[actor["tag_name"]]), row
            length, width, height = actor["size_m"]
            assert np.allclose(row["size"], [width, length, height])
            assert row["visibility_token"] in "1234" and len(row["attribute_tokens"]) == 1
            velocity = data.box_velocity(row["token"])
            if row["prev"] and row["next"]:
                speeds.append(np.linalg.norm(velocity - actor["velocity_mps"]))
        boxes += check_camera(scene, line["frame"], sample["data"]["CAM_FRONT"], actors)
        points += check_lidar(scene, line["frame"], sample["data"]["LIDAR_TOP"], actors)
        check_radar(scene, line["frame"], sample["data"]["RADAR_FRONT"])
        token = sample["next"]
    assert token == "", "samples beyond the last frame"
    assert np.ptp(origins, axis=0).max() < 1e-2, origins
    assert np.median(speeds) < 0.3, sorted(speeds)
    return np.array([boxes, points])


boxes, points = sum(check_scene(record) for record in data.scene)
assert boxes > 10 and points > 100, (boxes, points)
assert not by_name, by_name
for instance in data.instance:
    token, count, last = instance["first_annotation_token"], 0, ""
    while token:
        row = data.get("sample_annotation", token)
        assert row["instance_token"] == instance["token"] and row["prev"] == last
        token, last, count = row["next"], token, count + 1
    assert (count, last) == (instance["nbr_annotations"], instance["last_annotation_token"])
for row in data.map:
    share = row["mask"].mask().astype(bool).mean()
    assert 0.02 < share < 0.6, f"roads cover {share}"
