"""Reads an exported recording with mcap and compares it with what `omnibus inspect` prints of the
recording, in CARLA's units and left-handed axes.

Arguments: the exported file, the text of `omnibus inspect --info --all`, that of
`--collisions a,a --json`.
"""

import json
import math
import pathlib
import re
import sys
from collections import Counter

import numpy as np
from check_schema import check_schema
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

NUMBER = r"(-?[0-9.e+-]+)"
PLACE = re.compile(
    rf"  Id: (\d+) Location: \({NUMBER}, {NUMBER}, {NUMBER}\) "
    rf"Rotation: \({NUMBER}, {NUMBER}, {NUMBER}\)"
)
CREATED = re.compile(r" Create (\d+): (\S+) \((\d)\) at")


def printed(text: str) -> list[dict]:
    """Returns the frames of the text: the places by id, the actors that came and went."""
    frames: list[dict] = []
    for line in text.splitlines():
        if line.startswith("Frame "):
            seconds = float(line.split(" at ")[1].split()[0])
            frames.append({"seconds": seconds, "places": {}, "created": {}, "gone": 0})
        elif match := PLACE.match(line):
            frames[-1]["places"][int(match[1])] = [float(number) for number in match.groups()[1:]]
        elif match := CREATED.match(line):
            frames[-1]["created"][int(match[1])] = (match[2], int(match[3]))
        elif line.startswith(" Destroy "):
            frames[-1]["gone"] += 1
    return frames


def axes(rotation) -> np.ndarray:
    """Returns the matrix of a quaternion; its columns are the axes of the box."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def of_carla(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Returns right-handed axes of CARLA's degrees: yaw to the right, pitch up, roll to the right."""
    yaw, pitch, roll = (math.radians(angle) for angle in (-yaw, -pitch, roll))
    (cz, sz), (cy, sy), (cx, sx) = ((math.cos(a), math.sin(a)) for a in (yaw, pitch, roll))
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    return about_z @ about_y @ about_x


def vector(message) -> np.ndarray:
    return np.array([message.x, message.y, message.z])


frames = printed(pathlib.Path(sys.argv[2]).read_text())
collisions = json.loads(pathlib.Path(sys.argv[3]).read_text())["collisions"]
by_time: dict[int, dict] = {}
events, maps = [], []
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    assert {a.name for a in reader.iter_attachments()} == {"recording.json", "map.xodr"}
    for schema in reader.get_summary().schemas.values():
        check_schema(schema.data)
    for _, channel, message, decoded in reader.iter_decoded_messages():
        if channel.topic == "/events":
            events.append((message.log_time, decoded))
        elif channel.topic == "/map":
            maps.append(decoded)
        else:
            by_time.setdefault(message.log_time, {})[channel.topic] = decoded
times = sorted(by_time)
assert len(times) == len(frames) > 10
kinds: dict[int, int] = {}
blueprints: dict[int, str] = {}
moved, compared = 0, 0
before: dict[int, list[float]] = {}
for time, frame in zip(times, frames, strict=True):
    assert abs((time - times[0]) / 1e9 - frame["seconds"]) < 1e-3
    for key, (blueprint, kind) in frame["created"].items():
        kinds[key], blueprints[key] = kind, blueprint
    tf = {t.child_frame_id: t for t in by_time[time]["/tf"].transforms}
    update = by_time[time]["/actors"]
    entities = {int(entity.id): entity for entity in update.entities}
    assert len(update.deletions) == 1 and len(entities) == len(tf)
    assert set(frame["places"]) <= set(entities)
    # The text lists lights apart.
    assert all(kinds[key] == 3 for key in set(entities) - set(frame["places"]))
    for key, place in frame["places"].items():
        transform, entity = tf[f"actor/{key}"], entities[key]
        assert transform.parent_frame_id == entity.frame_id == "world"
        expected = np.array([place[0], -place[1], place[2]]) / 100
        world_from_actor = axes(transform.rotation)
        # Six digits are printed.
        assert np.allclose(vector(transform.translation), expected, atol=0.02), (key, transform)
        assert np.allclose(world_from_actor, of_carla(*place[3:]), atol=1e-3), (key, place)
        (cube,) = entity.cubes
        assert np.allclose(axes(cube.pose.orientation), world_from_actor, atol=1e-6)
        # The box stands on the ground that the actor stands on, and has its middle above it.
        size = vector(cube.size)
        offset = world_from_actor.T @ (vector(cube.pose.position) - vector(transform.translation))
        if kinds[key] == 1:
            assert size[0] > size[1] and abs(offset[1]) < 0.1 and abs(offset[0]) < 0.3 * size[0]
            assert abs(offset[2] - size[2] / 2) < 0.35, (entity, offset)
        has_arrow = len(entity.arrows) == 1
        assert has_arrow == (kinds[key] in (1, 2)), entity
        if has_arrow:
            assert entity.arrows[0].pose == cube.pose
        metadata = {pair.key: pair.value for pair in entity.metadata}
        assert metadata["blueprint"] == blueprints[key]
        assert blueprints[key] in entity.texts[0].text
        moved += key in before and before[key] != place
        compared += 1
    before = frame["places"]
assert moved > 20 and compared > 100, (moved, compared)

# Every actor that comes or goes is an event, and every collision that begins.
texts = [event.message for _, event in events]
appeared = sum(len(frame["created"]) for frame in frames)
assert sum(text.endswith(" appears") for text in texts) == appeared
assert sum(text.endswith(" disappears") for text in texts) == sum(f["gone"] for f in frames)
hits = [event for _, event in events if "collides with" in event.message]
assert all(event.level == event.WARNING for event in hits)
ends = re.compile(r" (\d+) collides with (?:\S+ (\d+)|something static):")
pairs = [tuple(int(id) for id in ends.search(event.message).groups() if id) for event in hits]
expected = [tuple(id for id in row["actor_ids"] if id) for row in collisions]
# What touches, parts and touches again between two frames begins twice; in the table it goes on.
assert not Counter(expected) - Counter(pairs), (pairs, expected)
assert 0 < len(pairs) < 1.5 * len(expected), (pairs, expected)

# The map is there once, and the first actors are on it.
(drawn,) = maps
lines = [
    np.array([vector(point)[:2] for point in line.points])
    for entity in drawn.entities
    for line in entity.lines
]
begins, ends = (np.concatenate([line[part] for line in lines]) for part in (slice(-1), slice(1, None)))
assert len(begins) > 100 and {"edge"} < {entity.id for entity in drawn.entities}
along = ends - begins
for key, place in frames[0]["places"].items():
    if kinds[key] == 1:
        at = np.array([place[0], -place[1]]) / 100
        part = ((at - begins) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-9)
        nearest = begins + along * np.clip(part, 0, 1)[:, None]
        assert np.linalg.norm(nearest - at, axis=1).min() < 6, (key, at)
