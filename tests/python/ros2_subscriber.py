"""Subscribes to a node of `omnibus ros2` with Eclipse Cyclone DDS, an implementation that is not ours.

ros2_subscriber.py DOMAIN ROLE FOLDER

Receives until one instant is complete on every topic, and writes the message of each topic into
FOLDER: the data as `<name>.bin` and the rest as `received.json`. Then it drives the vehicle by
vehicle_control_cmd until the odometry shows 2 m/s, and prints "driven".
"""

import json
import pathlib
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int8, int32, sequence, uint8, uint16, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


def message(name):
    package, kind = name.split("/")
    return {"typename": f"{package}.msg.dds_.{kind}_"}


@dataclass
class Time(IdlStruct, **message("builtin_interfaces/Time")):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, **message("std_msgs/Header")):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, **message("geometry_msgs/Vector3")):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, **message("geometry_msgs/Quaternion")):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, **message("geometry_msgs/Pose")):
    position: Vector3
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, **message("geometry_msgs/PoseWithCovariance")):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class Twist(IdlStruct, **message("geometry_msgs/Twist")):
    linear: Vector3
    angular: Vector3


@dataclass
class TwistWithCovariance(IdlStruct, **message("geometry_msgs/TwistWithCovariance")):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Clock(IdlStruct, **message("rosgraph_msgs/Clock")):
    clock: Time


@dataclass
class Float32(IdlStruct, **message("std_msgs/Float32")):
    data: float32


@dataclass
class Bool(IdlStruct, **message("std_msgs/Bool")):
    data: bool


@dataclass
class Odometry(IdlStruct, **message("nav_msgs/Odometry")):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class Transform(IdlStruct, **message("geometry_msgs/Transform")):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, **message("geometry_msgs/TransformStamped")):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, **message("tf2_msgs/TFMessage")):
    transforms: sequence[TransformStamped]


@dataclass
class Image(IdlStruct, **message("sensor_msgs/Image")):
    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class RegionOfInterest(IdlStruct, **message("sensor_msgs/RegionOfInterest")):
    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, **message("sensor_msgs/CameraInfo")):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest


@dataclass
class PointField(IdlStruct, **message("sensor_msgs/PointField")):
    name: str
    offset: uint32
    datatype: uint8
    count: uint32


@dataclass
class PointCloud2(IdlStruct, **message("sensor_msgs/PointCloud2")):
    header: Header
    height: uint32
    width: uint32
    fields: sequence[PointField]
    is_bigendian: bool
    point_step: uint32
    row_step: uint32
    data: sequence[uint8]
    is_dense: bool


@dataclass
class Imu(IdlStruct, **message("sensor_msgs/Imu")):
    header: Header
    orientation: Quaternion
    orientation_covariance: array[float64, 9]
    angular_velocity: Vector3
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Vector3
    linear_acceleration_covariance: array[float64, 9]


@dataclass
class NavSatStatus(IdlStruct, **message("sensor_msgs/NavSatStatus")):
    status: int8
    service: uint16


@dataclass
class NavSatFix(IdlStruct, **message("sensor_msgs/NavSatFix")):
    header: Header
    status: NavSatStatus
    latitude: float64
    longitude: float64
    altitude: float64
    position_covariance: array[float64, 9]
    position_covariance_type: uint8


@dataclass
class CarlaStatus(IdlStruct, **message("carla_msgs/CarlaStatus")):
    frame: uint64
    fixed_delta_seconds: float32
    synchronous_mode: bool
    synchronous_mode_running: bool


@dataclass
class CarlaEgoVehicleControl(IdlStruct, **message("carla_msgs/CarlaEgoVehicleControl")):
    header: Header
    throttle: float32
    steer: float32
    brake: float32
    hand_brake: bool
    reverse: bool
    gear: int32
    manual_gear_shift: bool


@dataclass
class CarlaEgoVehicleStatus(IdlStruct, **message("carla_msgs/CarlaEgoVehicleStatus")):
    header: Header
    velocity: float32
    acceleration: Twist  # geometry_msgs/Accel has the same layout.
    orientation: Quaternion
    control: CarlaEgoVehicleControl


# As rclcpp asks for the data of sensors; the images are asked for as by default, reliably.
BEST_EFFORT = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5))
RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))


def nanos(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def main(domain, role, folder):
    folder = pathlib.Path(folder)
    participant = DomainParticipant(int(domain))
    prefix = f"/carla/{role}/"

    def reader(name, kind, qos):
        return DataReader(participant, Topic(participant, f"rt{name}", kind), qos=qos)

    # Those with a header, by their names.
    readers = {
        "odometry": reader(prefix + "odometry", Odometry, RELIABLE),
        "image": reader(prefix + "front/image", Image, RELIABLE),
        "depth": reader(prefix + "front_depth/image", Image, BEST_EFFORT),
        "camera_info": reader(prefix + "front/camera_info", CameraInfo, RELIABLE),
        "lidar": reader(prefix + "lidar", PointCloud2, RELIABLE),
        "imu": reader(prefix + "imu", Imu, BEST_EFFORT),
        "gnss": reader(prefix + "gnss", NavSatFix, RELIABLE),
        "vehicle_status": reader(prefix + "vehicle_status", CarlaEgoVehicleStatus, RELIABLE),
    }
    clock = reader("/clock", Clock, BEST_EFFORT)
    tf = reader("/tf", TFMessage, RELIABLE)
    status = reader("/carla/status", CarlaStatus, RELIABLE)
    speedometer = reader(prefix + "speedometer", Float32, RELIABLE)
    control_topic = Topic(participant, f"rt{prefix}vehicle_control_cmd", CarlaEgoVehicleControl)
    control = DataWriter(participant, control_topic, qos=RELIABLE)

    at = {}
    others = {}
    while True:
        for name, source in readers.items():
            for sample in source.take(N=20):
                at.setdefault(nanos(sample.header.stamp), {})[name] = sample
        for sample in tf.take(N=20):
            stamps = {nanos(transform.header.stamp) for transform in sample.transforms}
            assert len(stamps) == 1, stamps
            at.setdefault(stamps.pop(), {})["tf"] = sample
        for sample in clock.take(N=20):
            at.setdefault(nanos(sample.clock), {})["clock"] = sample
        for name, source in {"status": status, "speedometer": speedometer}.items():
            for sample in source.take(N=20):
                others[name] = sample
        complete = [stamp for stamp, found in at.items() if len(found) == len(readers) + 2]
        if complete and len(others) == 2:
            break
        # What is older will not be complete.
        for stamp in sorted(at)[:-20]:
            del at[stamp]
        time.sleep(0.002)

    found = at[complete[-1]]
    for name in ["image", "depth", "lidar"]:
        (folder / f"{name}.bin").write_bytes(bytes(found[name].data))
        found[name].data = len(found[name].data)
    found["clock_nanos"] = nanos(found.pop("clock").clock)
    plain = lambda value: value.__dict__ if hasattr(value, "__dict__") else list(value)
    text = json.dumps({"at": complete[-1], **found, **others}, default=plain)
    (folder / "received.json").write_text(text)
    print("received", flush=True)

    header = Header(Time(0, 0), "map")
    speed_mps = 0.0
    while speed_mps < 2.0:
        control.write(CarlaEgoVehicleControl(header, 0.7, 0.0, 0.0, False, False, 0, False))
        for sample in readers["odometry"].take(N=20):
            speed_mps = sample.twist.twist.linear.x
        time.sleep(0.01)
    print("driven", flush=True)


main(*sys.argv[1:])
