"""The agents of the examples' folder, which is given: they keep their lane and their gap."""

import pathlib
import runpy
import sys

FOLDER = pathlib.Path(sys.argv[1])
#: A car of 1.85 m is in its lane of 3.5 m while its middle is nearer to the lane's centre than this.
IN_LANE_M = 0.8


def run(name):
    sys.argv = [name]
    samples = runpy.run_path(str(FOLDER / name))["main"]()
    assert len(samples) == 800
    assert not any(sample.collides for sample in samples), "it touched something"
    deviation_m = max(abs(sample.deviation_m) for sample in samples)
    driven_m = sum(sample.speed_mps * 0.05 for sample in samples)
    print(f"{name}: drove {driven_m:.0f} m, at most {deviation_m:.2f} m beside the lane's centre")
    assert deviation_m < IN_LANE_M, deviation_m
    assert driven_m > 200.0, driven_m
    return samples


run("camera_follower.py")
for sample in run("lidar_follower.py"):
    assert 3.0 < sample.gap_m < 20.0, sample
    # When both have started, the gap is the wanted one, and the agent measures it.
    if sample.time_secs > 16.0:
        assert abs(sample.gap_m - 4.0 - 0.8 * sample.speed_mps) < 2.5, sample
        assert abs(sample.gap_m - sample.measured_m) < 0.7, sample
