"""A BMW 320i of the CommonRoad multi-body model: the reference for our vehicle model.

    python drive_bmw.py OUT.csv

needs the package commonroad-vehicle-models 3.0.2. Writes one line for each 50 ms of each
manoeuvre: its name, time, front wheel angle, forward speed, yaw rate, slip angle at the centre of
mass, roll, lateral acceleration; in SI and radians, left positive. The steering follows its
target at no more than 0.4 rad/s, the model's own limit.
"""

import csv
import math
import sys

from vehiclemodels.init_mb import init_mb
from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb

STEP_S = 0.0005
OUTPUT_S = 0.05
STEER_RATE = 0.4


def step_steer(kmh, angle):
    """A step of the steering wheel after half a second."""
    return kmh / 3.6, 5.0, lambda t: angle if t >= 0.5 else 0.0, lambda t, v: 0.0


def sine_with_dwell(kmh, angle):
    """A sine of 0.7 Hz with a dwell of half a second at its second peak."""
    def steer(t):
        t -= 0.5
        period = 1.0 / 0.7
        if t < 0.0 or t > period + 0.5:
            return 0.0
        if t > 0.75 * period:
            t = max(0.75 * period, t - 0.5)
        return angle * math.sin(math.tau * t / period)
    return kmh / 3.6, 5.0, steer, lambda t, v: 0.0


def braking():
    """Braking straight ahead, 8 m/s² after half a second: the limit before the rear wheels lock."""
    return 100.0 / 3.6, 3.0, lambda t: 0.0, lambda t, v: -8.0 if t >= 0.5 else 0.0


def accelerating():
    """Full throttle straight ahead after half a second."""
    return 20.0, 6.0, lambda t: 0.0, lambda t, v: 11.5 if t >= 0.5 else 0.0


def skidpad(speed, angle):
    """A circle at constant speed, controlled by the pedal."""
    return speed, 8.0, lambda t: angle if t >= 0.5 else 0.0, lambda t, v: 2.0 * (speed - v)


MANOEUVRES = {
    "step_steer_50": step_steer(50.0, 0.053),
    "step_steer_80": step_steer(80.0, 0.0209),
    "step_steer_110": step_steer(110.0, 0.011),
    "sine_with_dwell_80": sine_with_dwell(80.0, 0.03),
    "full_braking": braking(),
    "full_acceleration": accelerating(),
    "skidpad_8": skidpad(8.0, 0.086),
    "skidpad_11": skidpad(11.0, 0.086),
    "skidpad_13": skidpad(13.0, 0.086),
}


def drive(speed, seconds, steer, push, p):
    state = init_mb([0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0], p)
    rows = []
    steps = round(seconds / STEP_S)
    every = round(OUTPUT_S / STEP_S)
    for step in range(steps + 1):
        t = step * STEP_S
        target = steer(t)
        rate = max(-STEER_RATE, min(STEER_RATE, (target - state[2]) / STEP_S))
        inputs = [rate, push(t, state[3])]
        slope = vehicle_dynamics_mb(state, inputs, p)
        if step % every == 0:
            across = slope[10] + state[5] * state[3]
            slip = math.atan2(state[10], state[3])
            rows.append((t, state[2], state[3], state[5], slip, state[6], across))
        if state[3] < 1.0:
            break
        half = [x + 0.5 * STEP_S * f for x, f in zip(state, slope)]
        middle = vehicle_dynamics_mb(half, inputs, p)
        state = [x + STEP_S * f for x, f in zip(state, middle)]
    return rows


def main():
    p = parameters_vehicle2()
    with open(sys.argv[1], "w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["manoeuvre", "t_s", "steer_rad", "speed_mps", "yaw_radps", "slip_rad",
                      "roll_rad", "across_mps2"])
        for name, (speed, seconds, steer, push) in MANOEUVRES.items():
            for row in drive(speed, seconds, steer, push, p):
                out.writerow([name, f"{row[0]:.2f}"] + [f"{x:.6g}" for x in row[1:]])


if __name__ == "__main__":
    main()
