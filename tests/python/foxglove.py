"""A client of the Foxglove WebSocket protocol, which decodes messages with Foxglove's own schemas.

Usage: foxglove.py URL SUBPROTOCOL MESSAGES

It subscribes to everything, and prints a line of JSON for each message when it has that many of each
topic (the map comes once). The protocol is that of
https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md.
"""

import base64
import collections
import importlib
import io
import json
import pathlib
import signal
import struct
import sys

from PIL import Image, ImageStat
from websockets.sync.client import connect

sys.path.insert(0, str(pathlib.Path(__file__).parent / "formats"))
from check_schema import check_schema  # noqa: E402

# Ends a test that hangs.
signal.alarm(200)


def nanos(time) -> int:
    return time.seconds * 10**9 + time.nanos


def vector(of) -> list[float]:
    return [of.x, of.y, of.z]


def facts(topic: str, message) -> dict:
    """Returns what the test compares with the simulator."""
    match topic:
        case "/tf":
            assert len({nanos(edge.timestamp) for edge in message.transforms}) <= 1
            edges = {
                edge.child_frame_id: [edge.parent_frame_id, vector(edge.translation)]
                for edge in message.transforms
            }
            return {"edges": edges}
        case "/actors" | "/map":
            (deletion,) = message.deletions
            assert deletion.type == deletion.ALL
            boxes = {
                entity.id: [vector(entity.cubes[0].pose.position), vector(entity.cubes[0].size)]
                for entity in message.entities
                if entity.cubes
            }
            lines = sum(len(entity.lines) for entity in message.entities)
            return {"boxes": boxes, "lines": lines, "entities": len(message.entities)}
        case "/ego/pose":
            return {"stamp": nanos(message.timestamp), "position": vector(message.pose.position)}
        case "/front/image":
            image = Image.open(io.BytesIO(message.data))
            assert message.format == "jpeg" and image.format == "JPEG", message.format
            mean = ImageStat.Stat(image.convert("RGB")).mean
            return {
                "stamp": nanos(message.timestamp), "space": message.frame_id, "size": image.size,
                "mean": mean,
            }  # fmt: skip
        case "/front/calibration":
            return {
                "stamp": nanos(message.timestamp), "space": message.frame_id,
                "size": [message.width, message.height], "k": list(message.K),
            }  # fmt: skip
        case "/lidar/points":
            fields = {field.name: field.offset for field in message.fields}
            assert message.point_stride == 24 and fields["z"] == 8, fields
            count = len(message.data) // 24
            assert count * 24 == len(message.data)
            points = [struct.unpack_from("<4f2I", message.data, 24 * at) for at in range(count)]
            return {
                "stamp": nanos(message.timestamp), "space": message.frame_id, "points": count,
                "first": points[0], "last": points[-1],
            }  # fmt: skip
        case "/stages":
            return message
    raise AssertionError(topic)


def main(url: str, subprotocol: str, count: int) -> None:
    with connect(url, subprotocols=[subprotocol], max_size=None) as socket:
        assert socket.subprotocol == subprotocol, socket.subprotocol
        info = json.loads(socket.recv())
        assert info["op"] == "serverInfo" and info["capabilities"] == ["time"], info
        advertised = json.loads(socket.recv())
        assert advertised["op"] == "advertise", advertised
        channels = {channel["id"]: channel for channel in advertised["channels"]}
        types = {}
        for channel in channels.values():
            if channel["encoding"] == "protobuf":
                check_schema(base64.b64decode(channel["schema"]))
                name = channel["schemaName"].removeprefix("foxglove.")
                module = importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2")
                types[channel["id"]] = getattr(module, name).FromString
            else:
                types[channel["id"]] = json.loads
        # Any numbers that are not those of the channels.
        subscriptions = {100 + channel: channel for channel in channels}
        requests = [{"id": id, "channelId": channel} for id, channel in subscriptions.items()]
        socket.send(json.dumps({"op": "subscribe", "subscriptions": requests}))
        seen: collections.Counter = collections.Counter()
        topics = {channel["topic"] for channel in channels.values()}
        clock = -1
        while any(seen[topic] < (1 if topic == "/map" else count) for topic in topics):
            data = socket.recv()
            if isinstance(data, str):
                print(json.dumps({"topic": "status", "facts": json.loads(data)}))
            elif data[0] == 2:
                (time,) = struct.unpack("<Q", data[1:])
                assert time > clock, (time, clock)
                clock = time
                seen["time"] += 1
            else:
                opcode, id, time = struct.unpack("<BIQ", data[:13])
                channel = channels[subscriptions[id]]
                seen[channel["topic"]] += 1
                said = facts(channel["topic"], types[channel["id"]](data[13:]))
                assert opcode == 1 and said.get("stamp", time) == time, (time, said)
                print(json.dumps({"topic": channel["topic"], "time": time, "facts": said}))
        assert seen["time"] > 0 and clock > 0
        socket.send(json.dumps({"op": "unsubscribe", "subscriptionIds": list(subscriptions)}))


main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
