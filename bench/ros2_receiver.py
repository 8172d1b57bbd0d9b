"""The subscriber of `bench ros2`: Eclipse Cyclone DDS.

Usage: ros2_receiver.py DOMAIN TOPIC. Prints "matched" when it has found the publisher. When standard
input ends, it prints one JSON list: for each image its stamp and the instant at which DDS held all of
it, in nanoseconds of simulated time and of the monotonic clock. Decoding comes after that instant.
"""

import json
import select
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int32, sequence, uint8, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Image(IdlStruct, typename="sensor_msgs.msg.dds_.Image_"):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


class Clock(Listener):
    def __init__(self):
        super().__init__()
        self.nanos = []

    def on_data_available(self, reader):
        self.nanos.append(time.monotonic_ns())


def main(domain, topic):
    participant = DomainParticipant(int(domain))
    reliable = Policy.Reliability.Reliable(duration(seconds=1))
    clock = Clock()
    reader = DataReader(
        participant,
        Topic(participant, f"rt{topic}", Image),
        qos=Qos(reliable, Policy.History.KeepAll),
        listener=clock,
    )
    while not reader.get_matched_publications():
        time.sleep(0.01)
    print("matched", flush=True)
    stamps = []
    while not select.select([sys.stdin], [], [], 0.005)[0]:
        for image in reader.take(N=10):
            stamps.append(image.header.stamp.sec * 1_000_000_000 + image.header.stamp.nanosec)
    assert len(stamps) == len(clock.nanos), f"{len(stamps)} images, {len(clock.nanos)} instants"
    print(json.dumps(list(zip(stamps, clock.nanos))))


main(*sys.argv[1:])
