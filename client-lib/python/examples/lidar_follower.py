"""A lidar-based agent: follows the vehicle ahead, at a distance, from point clouds alone.

    python client-lib/python/examples/lidar_follower.py

Of each cloud the agent keeps the points above the road that are near to where it saw the vehicle
last; the nearest of them are the vehicle's rear. It steers to their middle (pure pursuit: R. C.
Coulter, CMU-RI-TR-92-01, 1992) and holds a gap that grows with its own speed. Map and poses are read
for the report only.
"""

import math
import pathlib
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import omnibus
from omnibus.sensors import Lidar

#: A closed road with a lane in each direction, beside the examples in Rust.
OVAL = pathlib.Path(__file__).parents[2] / "examples" / "oval.xodr"
TICKS = 800
DELTA_SECS = 0.05
#: Axle to axle, of the car below.
WHEELBASE_M = 2.875
#: From the middle of the wheelbase to the front bumper.
BUMPER_M = 2.4
#: How far ``steer`` 1 turns the front wheels.
STEER_MAX_RAD = 0.61
#: The gap at rest, and what is added for each metre per second.
GAP_M, GAP_SECS = 4.0, 0.8
#: Height above the road of the points that count.
LOW_M, HIGH_M = 0.4, 1.8
#: The vehicle moves less than this between two clouds.
NEAR_M = 1.6
#: Height of the lidar above the road.
ROOF_M = 1.9
#: The bit of an actor's flags that says that it touches something.
COLLIDING = 4


@dataclass
class Sample:
    """What the agent did at one frame, by the simulator's own account."""

    time_secs: float
    #: How far the car is to the left of the lane's centre.
    deviation_m: float
    #: From bumper to bumper.
    gap_m: float
    #: The same as the agent measured it.
    measured_m: float
    speed_mps: float
    collides: bool


class View:
    """What the agent believes of the vehicle ahead, in vehicle space."""

    def __init__(self) -> None:
        #: The middle of its rear.
        self.rear = np.array([12.0, 0.0])
        #: How fast the gap shrinks.
        self.closing_mps = 0.0

    @property
    def gap_m(self) -> float:
        return float(np.hypot(*self.rear)) - BUMPER_M

    def look(self, points: NDArray[np.float32]) -> None:
        """Finds the vehicle where it was seen last. If nothing is there, the last belief holds."""
        flat = points.reshape(-1, 4)
        height_m = flat[:, 2] + ROOF_M
        # A ray that hit nothing is all zeros, at the lidar itself: above what counts.
        near = flat[(height_m >= LOW_M) & (height_m < HIGH_M), :2]
        near = near[np.hypot(*(near - self.rear).T) < NEAR_M]
        if len(near) == 0:
            return
        range_m = np.hypot(*near.T)
        found = near[range_m < range_m.min() + 0.4]
        if len(found) < 3:
            return
        rear = found.mean(axis=0, dtype=np.float64)
        closing_mps = float(np.hypot(*self.rear) - np.hypot(*rear)) / DELTA_SECS
        # Single clouds resolve a few centimetres, so that their difference is smoothed.
        self.closing_mps += 0.2 * (closing_mps - self.closing_mps)
        self.rear = rear

    def steer(self) -> float:
        # Seen from the rear axle: the circle through both has this curvature.
        x_m, y_m = float(self.rear[0]) + WHEELBASE_M / 2.0, float(self.rear[1])
        curvature_per_m = 2.0 * y_m / (x_m * x_m + y_m * y_m)
        return min(max(math.atan(WHEELBASE_M * curvature_per_m) / STEER_MAX_RAD, -1.0), 1.0)

    def wanted_mps2(self, speed_mps: float) -> float:
        missing_m = self.gap_m - GAP_M - GAP_SECS * speed_mps
        return 0.35 * missing_m - 0.9 * self.closing_mps


def main(map: str = str(OVAL)) -> list[Sample]:
    roof = Lidar(
        "roof",
        channels=24,
        columns=240,
        lower_rad=-0.25,
        upper_rad=0.02,
        range_m=60.0,
        pose=omnibus.Pose((0.0, 0.0, ROOF_M)),
        fov_rad=2.4,
        outputs=("points",),
    )
    view = View()
    samples: list[Sample] = []
    with omnibus.launch(
        map, ego="vehicle.tesla.model3", autopilot=False, sensors=[roof], delta_secs=DELTA_SECS
    ) as simulator:
        client, ego = simulator.client, simulator.ego
        assert ego is not None
        place = client.tick().world.actor(ego)
        at, heading_rad = place["position_m"], yaw(place["rotation_xyzw"])
        x_m = float(at[0]) + 14.0 * math.cos(heading_rad)
        y_m = float(at[1]) + 14.0 * math.sin(heading_rad)
        x, y, z, w = (float(value) for value in place["rotation_xyzw"])
        ahead = omnibus.Pose((x_m, y_m, float(at[2]) + 0.5), (x, y, z, w))
        # The vehicle ahead drives at the limit and not faster.
        client.traffic.set(driver_spread=0.0)
        leader = client.spawn("vehicle.audi.a2", ahead, autopilot=True)
        blueprint = next(b for b in client.blueprints if b.id == "vehicle.audi.a2")
        for frame in client.ticks(TICKS):
            car, other = frame.world.actor(ego), frame.world.actor(leader)
            speed_mps = math.hypot(*car["velocity_mps"])
            view.look(frame["roof"].points)
            wanted_mps2 = view.wanted_mps2(speed_mps)
            client.control(
                ego,
                throttle=min(max(0.1 + 0.2 * wanted_mps2, 0.0), 0.8),
                brake=min(max(-0.15 * wanted_mps2 - 0.05, 0.0), 1.0),
                steer=view.steer(),
            )
            between_m = math.dist(car["position_m"], other["position_m"])
            samples.append(
                Sample(
                    time_secs=frame.world.sim_time_secs,
                    deviation_m=deviation(client, car["position_m"]),
                    gap_m=between_m - BUMPER_M - blueprint.half_extents_m[0],
                    measured_m=view.gap_m,
                    speed_mps=speed_mps,
                    collides=bool(car["flags"] & COLLIDING),
                )
            )
    return samples


def yaw(rotation_xyzw: NDArray[np.float32]) -> float:
    x, y, z, w = (float(value) for value in rotation_xyzw)
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def deviation(client: omnibus.Client, position_m: NDArray[np.float32]) -> float:
    """Returns how far a position is to the left of the nearest lane's centre."""
    x_m, y_m, z_m = (float(value) for value in position_m)
    lane = client.map.nearest((x_m, y_m, z_m))
    if lane is None:
        return math.inf
    from_x_m, from_y_m = x_m - lane.position_m[0], y_m - lane.position_m[1]
    return from_y_m * math.cos(lane.heading_rad) - from_x_m * math.sin(lane.heading_rad)


if __name__ == "__main__":
    print("time_secs,deviation_m,gap_m,measured_m,speed_mps")
    for sample in main(*sys.argv[1:]):
        print(
            f"{sample.time_secs:.2f},{sample.deviation_m:.3f},{sample.gap_m:.2f},"
            f"{sample.measured_m:.2f},{sample.speed_mps:.2f}"
        )
