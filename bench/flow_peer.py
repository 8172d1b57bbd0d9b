"""The fundamental diagram of a ring road beside SUMO's, and the distributions behind it.

Vehicles drive on a closed ring: of one lane at 50 km/h with a radius of 200 m, of one and of two lanes
at 110 km/h with one of 700 m. After SETTLE_SECS, flow and density of a lane over MEASURE_SECS. Prints one
line for each density and writes OUT/fundamental-diagram.svg. Needs the packages omnibus (./run wheel), eclipse-sumo, libsumo
and matplotlib.

    python bench/flow_peer.py OUT
"""

import math
import os
import subprocess
import sys
import tempfile

import numpy as np
import sumo

os.environ.setdefault("SUMO_HOME", sumo.SUMO_HOME)
import libsumo  # noqa: E402
import matplotlib  # noqa: E402
import omnibus  # noqa: E402

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

SETTLE_SECS, MEASURE_SECS, DELTA_SECS = 180.0, 120.0, 0.05
LANE_M = 3.5
# Limit in km/h, radius of the left lane in metres, lanes, vehicles per kilometre and lane.
RINGS = [
    (50, 200.0, 1, (5, 10, 15, 20, 30, 40, 50, 60, 80, 100)),
    (110, 700.0, 1, (5, 10, 15, 20, 25, 30, 40, 60)),
    (110, 700.0, 2, (5, 10, 15, 20, 25, 30, 40, 60)),
]
CAR = "vehicle.audi.a2"
#: Length of CAR in metres, and of SUMO's vehicles.
LENGTH_M = 3.7


def ring(radius_m: float, limit_kmh: int, lanes: int) -> str:
    """Returns an OpenDRIVE map of a ring with this radius of its left lane."""
    reference_m = radius_m - LANE_M / 2
    length_m, width = 2.0 * math.pi * reference_m, f'<width sOffset="0" a="{LANE_M}" b="0" c="0" d="0"/>'
    mark = '<roadMark sOffset="0" type="broken" weight="standard" color="standard" width="0.12" laneChange="both"/>'
    right = "".join(
        f'<lane id="{lane}" type="driving" level="false"><link><predecessor id="{lane}"/>'
        f'<successor id="{lane}"/></link>{width}{mark}</lane>'
        for lane in range(-1, -lanes - 1, -1)
    )
    return f"""<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="4" name="ring"/>
<road name="" length="{length_m}" id="1" junction="-1">
<link><predecessor elementType="road" elementId="1" contactPoint="end"/>
<successor elementType="road" elementId="1" contactPoint="start"/></link>
<type s="0" type="motorway"><speed max="{limit_kmh}" unit="km/h"/></type>
<planView><geometry s="0" x="0" y="0" hdg="0" length="{length_m}">
<arc curvature="{1.0 / reference_m}"/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center>
<right>{right}</right></laneSection></lanes></road></OpenDRIVE>"""


def ours(radius_m: float, limit_kmh: int, lanes: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns speeds and positions on the ring, in radians, of all vehicles at all frames."""
    middle_y = radius_m - LANE_M / 2
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "ring.xodr")
        with open(path, "w", encoding="utf-8") as file:
            file.write(ring(radius_m, limit_kmh, lanes))
        with omnibus.launch(path, device="null", options=["--no-rendering"]) as simulator:
            client = simulator.client
            for index in range(count):
                turn = 2.0 * math.pi * index / count
                away_m = radius_m + index % lanes * LANE_M
                place = (away_m * math.sin(turn), middle_y - away_m * math.cos(turn), 0.5)
                half = (0.0, 0.0, math.sin(turn / 2.0), math.cos(turn / 2.0))
                client.spawn(CAR, omnibus.Pose(place, half), autopilot=True)
            for _ in client.ticks(round(SETTLE_SECS / DELTA_SECS)):
                pass
            speeds, turns = [], []
            for frame in client.ticks(round(MEASURE_SECS / DELTA_SECS)):
                speeds.append(np.linalg.norm(frame.world.actors["velocity_mps"], axis=1))
                x, y, _ = frame.world.actors["position_m"].T
                turns.append(np.arctan2(x, middle_y - y))
    return np.array(speeds), np.array(turns)


def peer(radius_m: float, limit_kmh: int, lanes: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The same of SUMO."""
    with tempfile.TemporaryDirectory() as folder:
        nodes, edges, net = (os.path.join(folder, name) for name in ("n.xml", "e.xml", "net.xml"))
        place = lambda turn: (radius_m * math.cos(turn), radius_m * math.sin(turn))
        quarters = [math.pi / 2.0 * quarter for quarter in range(5)]
        with open(nodes, "w", encoding="utf-8") as file:
            file.write("<nodes>")
            for index, turn in enumerate(quarters[:4]):
                x, y = place(turn)
                file.write(f'<node id="{index}" x="{x}" y="{y}" type="priority"/>')
            file.write("</nodes>")
        with open(edges, "w", encoding="utf-8") as file:
            file.write("<edges>")
            for index in range(4):
                turns = np.linspace(quarters[index], quarters[index + 1], 90)
                shape = " ".join("{:.3f},{:.3f}".format(*place(turn)) for turn in turns)
                file.write(
                    f'<edge id="e{index}" from="{index}" to="{(index + 1) % 4}" numLanes="{lanes}" '
                    f'speed="{limit_kmh / 3.6}" shape="{shape}"/>'
                )
            file.write("</edges>")
        convert = [os.path.join(sumo.SUMO_HOME, "bin", "netconvert"), "-n", nodes, "-e", edges]
        options = ["--no-turnarounds", "--no-internal-links", "--offset.disable-normalization"]
        subprocess.run([*convert, *options, "-o", net], check=True, capture_output=True)
        libsumo.start(
            ["sumo", "-n", net, "--step-length", str(DELTA_SECS), "--no-step-log", "--no-warnings"]
            + ["--time-to-teleport", "-1", "--collision.action", "none"]
        )
        libsumo.vehicletype.setLength("DEFAULT_VEHTYPE", LENGTH_M)
        quarter_m = libsumo.lane.getLength("e0_0")
        for index in range(count):
            turn, along = divmod(4.0 * index / count, 1.0)
            loop = [f"e{(int(turn) + step) % 4}" for step in range(400)]
            libsumo.route.add(f"r{index}", loop)
            libsumo.vehicle.add(
                f"v{index}",
                f"r{index}",
                departPos=str(along * quarter_m * 0.999),
                departSpeed="0",
                departLane=str(lanes - 1 - index % lanes),
            )
        for _ in range(round(SETTLE_SECS / DELTA_SECS)):
            libsumo.simulationStep()
        speeds, turns = [], []
        for _ in range(round(MEASURE_SECS / DELTA_SECS)):
            libsumo.simulationStep()
            names = sorted(libsumo.vehicle.getIDList())
            speeds.append([libsumo.vehicle.getSpeed(name) for name in names])
            x, y = np.array([libsumo.vehicle.getPosition(name) for name in names]).T
            turns.append(np.arctan2(y, x))
        libsumo.close()
    assert len(speeds[0]) == count, f"SUMO has {len(speeds[0])} of {count} vehicles"
    return np.array(speeds), np.array(turns)


def time_headways(speeds: np.ndarray, turns: np.ndarray, radius_m: float) -> np.ndarray:
    """Returns the times from front to front on one lane, of vehicles faster than 3 m/s."""
    order = np.argsort(turns, axis=1)
    turns = np.take_along_axis(turns, order, axis=1)
    gaps_m = np.diff(turns, axis=1, append=turns[:, :1] + 2.0 * math.pi) * radius_m
    speeds = np.take_along_axis(speeds, order, axis=1)
    return gaps_m[speeds > 3.0] / speeds[speeds > 3.0]


def main(out: str) -> None:
    os.makedirs(out, exist_ok=True)
    pyplot.rcParams["svg.fonttype"] = "none"
    figure, axes = pyplot.subplots(1, len(RINGS), figsize=(12.0, 3.6), sharey=True)
    for axis, (limit_kmh, radius_m, lanes, densities) in zip(axes, RINGS):
        rows = []
        for per_km in densities:
            lanes_km = lanes * 2.0 * math.pi * radius_m / 1000.0
            count = max(round(per_km * lanes_km), 1)
            density = count / lanes_km
            row = [density]
            for name, measure in (("omnibus", ours), ("SUMO", peer)):
                speeds, turns = measure(radius_m, limit_kmh, lanes, count)
                # Over 1.1 s, as trajectories of videos are smoothed.
                window = round(1.1 / DELTA_SECS)
                accels = (speeds[window:] - speeds[:-window]) / (window * DELTA_SECS)
                flow = density * speeds.mean() * 3.6
                row.append(flow)
                shown = [("acceleration", "m/s2", accels)]
                if lanes == 1:
                    shown.append(("time headway", "s", time_headways(speeds, turns, radius_m)))
                print(
                    f"{lanes} x {limit_kmh} km/h, {density:.1f} vehicles/km, {name}: {flow:.0f} vehicles/h, speed "
                    f"{speeds.mean() * 3.6:.1f} +- {speeds.std() * 3.6:.1f} km/h",
                    flush=True,
                )
                for what, unit, values in shown:
                    parts = " ".join(f"{part:.2f}" for part in np.percentile(values, [5, 15, 50, 85, 95]))
                    print(f"    {what}, {unit}, 5, 15, 50, 85, 95 %: {parts}", flush=True)
            rows.append(row)
        table = np.array(rows)
        axis.plot(table[:, 0], table[:, 1], "o-", label="Omnibus")
        axis.plot(table[:, 0], table[:, 2], "s--", label="SUMO, its defaults")
        axis.axhspan(1800.0, 2400.0, alpha=0.15, color="gray", label="capacity in the field")
        axis.set(title=f"{lanes} x {limit_kmh} km/h", xlabel="vehicles per km and lane")
        axis.set_ylim(0.0, 3000.0)
        axis.legend(loc="lower right")
    axes[0].set_ylabel("vehicles per hour and lane")
    figure.tight_layout()
    figure.savefig(os.path.join(out, "fundamental-diagram.svg"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
