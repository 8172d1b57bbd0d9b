"""Reads an export with mcap and Foxglove's published schemas.

Arguments: the export, the folder of its scenes.
"""

import io
import json
import pathlib
import sys

import numpy as np
from check_schema import check_schema
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image
from plain import Scene, scenes, slack_px
from pyquaternion import Quaternion


def matrix(translation, rotation) -> np.ndarray:
    """Returns the 4 x 4 matrix of a rigid transform."""
    made = Quaternion(rotation.w, rotation.x, rotation.y, rotation.z).transformation_matrix
    made[:3, 3] = [translation.x, translation.y, translation.z]
    return made


def nanos(time) -> int:
    return time.seconds * 10**9 + time.nanos


def check_map(scene: Scene, update) -> None:
    """The map has the lines of `lanes.json`."""
    lanes = json.loads((scene.folder / "lanes.json").read_text())
    expected: dict[str, list] = {}
    for boundary in lanes["boundaries"]:
        name = "edge" if boundary["type"] == "none" else f"{boundary['type']} {boundary['color']}"
        expected.setdefault(name, []).append(boundary["points_m"])
    expected["crosswalk"] = [walk["corners_m"] for walk in lanes["crosswalks"]]
    expected["stop line"] = [line["points_m"] for line in lanes["stop_lines"]]
    found = {
        entity.id: [[[p.x, p.y, p.z] for p in line.points] for line in entity.lines]
        for entity in update.entities
    }
    assert found == {name: lines for name, lines in expected.items() if lines}, found.keys()
    assert len(found["edge"]) > 5 and any(name.startswith("solid") for name in found)
    for entity in update.entities:
        is_loop = entity.id == "crosswalk"
        assert all(line.type == (line.LINE_LOOP if is_loop else line.LINE_STRIP) for line in entity.lines)


def check_frame(scene: Scene, line: dict, got: dict) -> int:
    """Checks the messages of one frame; returns how many boxes were compared with pixels."""
    frame, boxes = line["frame"], 0
    tf = {t.child_frame_id: t for t in got["/tf"].transforms}
    world_from_ego = matrix(tf["ego"].translation, tf["ego"].rotation)
    assert tf["ego"].parent_frame_id == "world"
    assert np.allclose(world_from_ego[:3, 3], line["ego"]["world_from_vehicle"]["position_m"])
    entities = {int(e.id): e for e in got["/boxes"].entities}
    actors = {actor["actor_id"]: actor for actor in scene.boxes(frame)}
    assert set(entities) == set(actors) and len(got["/boxes"].deletions) == 1
    for name, sensor in scene.cameras.items():
        image, calibration = got[f"/{name}/image"], got[f"/{name}/calibration"]
        shown = np.array(Image.open(io.BytesIO(image.data)))
        assert image.format == "png" and np.array_equal(shown, scene.image(name, "color", frame))
        assert image.frame_id == calibration.frame_id and nanos(image.timestamp) == line["sim_time_nanos"]
        assert (calibration.height, calibration.width) == shown.shape[:2]
        mount = tf[image.frame_id]
        world_from_optical = world_from_ego @ matrix(mount.translation, mount.rotation)
        projection = np.array(calibration.P).reshape(3, 4) @ np.linalg.inv(world_from_optical)
        ids = scene.ids(name, frame)
        for key, actor in actors.items():
            (cube,) = entities[key].cubes
            size = np.array([cube.size.x, cube.size.y, cube.size.z])
            assert np.allclose(size, actor["size_m"])
            signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, 8)
            corners = np.vstack([signs * size[:, None], np.ones(8)])
            seen = projection @ matrix(cube.pose.position, cube.pose.orientation) @ corners
            if name not in actor["cameras"] or seen[2].min() < 0.1:
                continue
            rows, columns = np.nonzero(ids == key)
            for axis, pixels in enumerate((columns, rows)):
                low, high = (seen[axis] / seen[2]).min(), (seen[axis] / seen[2]).max()
                slack = slack_px(actor, np.ptp(seen[1] / seen[2]))
                assert low - slack <= pixels.min() and pixels.max() <= high + slack, actor
            boxes += 1
    for name in scene.lidars:
        cloud = got[f"/{name}/points"]
        kinds = {7: "<f4", 5: "<u4"}
        layout = np.dtype(
            {
                "names": [f.name for f in cloud.fields],
                "formats": [kinds[f.type] for f in cloud.fields],
                "offsets": [f.offset for f in cloud.fields],
                "itemsize": cloud.point_stride,
            }
        )
        points = np.frombuffer(cloud.data, layout)
        plain, labels = scene.points(name, frame), scene.labels(name, frame)
        found = np.stack([points[f] for f in ("x", "y", "z", "intensity")], axis=1)
        assert len(plain) > 0 and np.array_equal(found, plain)
        assert np.array_equal(np.stack([points["id"], points["tag"]], axis=1), labels)
        mount = tf[cloud.frame_id]
        (pose,) = (s["world_from_sensor"] for s in line["sensors"] if s["name"] == name)
        place = (world_from_ego @ matrix(mount.translation, mount.rotation))[:3, 3]
        assert np.allclose(place, pose["position_m"], atol=1e-3)
    return boxes


for scene in scenes(sys.argv[2]):
    with (pathlib.Path(sys.argv[1]) / f"{scene.name}.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        names = {attachment.name for attachment in reader.iter_attachments()}
        assert names == {"metadata.json", "map.xodr"}
        for schema in reader.get_summary().schemas.values():
            if schema.encoding == "protobuf":
                assert schema.name.startswith("foxglove.")
                check_schema(schema.data)
        by_time, in_json = {}, {"/ego/sensors": [], "/weather": []}
        for schema, channel, message in reader.iter_messages(list(in_json)):
            in_json[channel.topic].append((message.log_time, json.loads(message.data)))
        topics = {c.topic for c in reader.get_summary().channels.values()} - set(in_json)
        for _, channel, message, decoded in reader.iter_decoded_messages(topics):
            by_time.setdefault(message.log_time, {})[channel.topic] = decoded
    check_map(scene, by_time[scene.lines[0]["sim_time_nanos"]]["/map"])
    assert sum("/map" in messages for messages in by_time.values()) == 1
    weather = [(line["sim_time_nanos"], line["weather"]) for line in scene.lines]
    assert in_json["/weather"] == weather
    readings = in_json["/ego/sensors"]
    wanted = [reading for line in scene.lines for reading in line["ego_sensors"]]
    assert [time for time, _ in readings] == [reading["sim_time_nanos"] for reading in wanted]
    for (_, found), reading in zip(readings, wanted, strict=True):
        assert found["imu"] == reading["imu"] and set(found) == set(reading)
    for reading in wanted:
        fix = by_time[reading["sim_time_nanos"]]["/gnss"]
        assert abs(fix.latitude - reading["gnss"]["latitude_deg"]) < 1e-12
    boxes = sum(check_frame(scene, line, by_time[line["sim_time_nanos"]]) for line in scene.lines)
    assert boxes > 5, boxes
