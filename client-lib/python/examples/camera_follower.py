"""A camera-based agent: keeps its lane from images of semantic tags alone.

    python client-lib/python/examples/camera_follower.py

The agent sees which pixels are road markings (a camera's tag output, which a real car gets from a
trained network) and its own speed. Each marking is projected onto a flat road; between the nearest
ones to the left and right lies the lane. It steers to the lane's centre some metres ahead (pure
pursuit: R. C. Coulter, CMU-RI-TR-92-01, 1992). Map and poses are read for the report only.
"""

import math
import pathlib
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import omnibus
from omnibus.sensors import Camera

#: A closed road with a lane in each direction, beside the examples in Rust.
OVAL = pathlib.Path(__file__).parents[2] / "examples" / "oval.xodr"
TICKS = 800
CRUISE_MPS = 8.0
#: Axle to axle, of the car below.
WHEELBASE_M = 2.875
#: How far ``steer`` 1 turns the front wheels.
STEER_MAX_RAD = 0.61
#: Where markings are looked for, ahead of the middle of the wheelbase.
NEAR_M, FAR_M = 5.0, 11.0
#: The bit of an actor's flags that says that it touches something.
COLLIDING = 4
#: The semantic tag of road markings.
ROAD_LINE = 24
WIDTH, HEIGHT, FOV_RAD = 320, 160, math.pi / 2
#: Of the camera in the vehicle: position, and pitch downwards.
EYE_M = (0.6, 0.0, 1.6)
PITCH_RAD = 0.2


@dataclass
class Sample:
    """What the agent did at one frame, by the simulator's own account."""

    time_secs: float
    #: How far the car is to the left of the lane's centre.
    deviation_m: float
    speed_mps: float
    collides: bool


class Lane:
    """What the agent believes of its lane, in vehicle space."""

    def __init__(self) -> None:
        self.width_m = 3.5
        #: A point of the centre ahead.
        self.goal = (FAR_M, 0.0)
        columns, rows = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
        focal = WIDTH / (2.0 * math.tan(FOV_RAD / 2.0))
        left, up = (WIDTH / 2.0 - columns) / focal, (HEIGHT / 2.0 - rows) / focal
        # The direction of each pixel's ray in vehicle space, turned down by the pitch.
        forward = math.cos(PITCH_RAD) + up * math.sin(PITCH_RAD)
        up = up * math.cos(PITCH_RAD) - math.sin(PITCH_RAD)
        reach = np.where(up < 0.0, EYE_M[2] / -np.minimum(up, -1e-6), np.inf)
        #: Where each pixel meets a flat road: all pixels of a row at the same x.
        self.x_m = EYE_M[0] + (reach * forward)[:, 0]
        self.y_m = reach * left
        self.rows = [row for row in range(HEIGHT - 1, -1, -1) if NEAR_M <= self.x_m[row] <= FAR_M]

    def look(self, tags: NDArray[np.uint8]) -> None:
        """Follows the lane from the near rows of the image to the far ones. Where no marking is
        seen, the last belief holds."""
        centre_m = 0.0
        for row in self.rows:
            from_centre = self.y_m[row][tags[row] == ROAD_LINE] - centre_m
            lefts = from_centre[(from_centre >= 0.5) & (from_centre < self.width_m)]
            rights = from_centre[(from_centre <= -0.5) & (from_centre > -self.width_m)]
            if lefts.size and rights.size:
                left, right = float(lefts.min()), float(rights.max())
                self.width_m += 0.02 * (min(max(left - right, 2.5), 4.5) - self.width_m)
                centre_m += (left + right) / 2.0
            elif lefts.size:
                centre_m += float(lefts.min()) - self.width_m / 2.0
            elif rights.size:
                centre_m += float(rights.max()) + self.width_m / 2.0
            else:
                continue
            self.goal = (float(self.x_m[row]), centre_m)

    def steer(self) -> float:
        # Seen from the rear axle: the circle through both has this curvature.
        x_m, y_m = self.goal[0] + WHEELBASE_M / 2.0, self.goal[1]
        curvature_per_m = 2.0 * y_m / (x_m * x_m + y_m * y_m)
        return min(max(math.atan(WHEELBASE_M * curvature_per_m) / STEER_MAX_RAD, -1.0), 1.0)


def main(map: str = str(OVAL)) -> list[Sample]:
    pitch = (0.0, math.sin(PITCH_RAD / 2.0), 0.0, math.cos(PITCH_RAD / 2.0))
    eye = Camera("eye", WIDTH, HEIGHT, FOV_RAD, omnibus.Pose(EYE_M, pitch), outputs=("tags",))
    lane = Lane()
    samples: list[Sample] = []
    with omnibus.launch(
        map, ego="vehicle.tesla.model3", autopilot=False, sensors=[eye]
    ) as simulator:
        client, ego = simulator.client, simulator.ego
        assert ego is not None
        for frame in client.ticks(TICKS):
            car = frame.world.actor(ego)
            speed_mps = math.hypot(*car["velocity_mps"])
            lane.look(frame["eye"].tags)
            missing_mps = CRUISE_MPS - speed_mps
            client.control(
                ego,
                throttle=min(max(0.15 + 0.2 * missing_mps, 0.0), 0.8),
                brake=min(max(-0.2 * missing_mps - 0.1, 0.0), 1.0),
                steer=lane.steer(),
            )
            deviation_m = deviation(client, car["position_m"])
            collides = bool(car["flags"] & COLLIDING)
            samples.append(Sample(frame.world.sim_time_secs, deviation_m, speed_mps, collides))
    return samples


def deviation(client: omnibus.Client, position_m: NDArray[np.float32]) -> float:
    """Returns how far a position is to the left of the nearest lane's centre."""
    x_m, y_m, z_m = (float(value) for value in position_m)
    lane = client.map.nearest((x_m, y_m, z_m))
    if lane is None:
        return math.inf
    from_x_m, from_y_m = x_m - lane.position_m[0], y_m - lane.position_m[1]
    return from_y_m * math.cos(lane.heading_rad) - from_x_m * math.sin(lane.heading_rad)


if __name__ == "__main__":
    print("time_secs,deviation_m,speed_mps")
    for sample in main(*sys.argv[1:]):
        print(f"{sample.time_secs:.2f},{sample.deviation_m:.3f},{sample.speed_mps:.2f}")
