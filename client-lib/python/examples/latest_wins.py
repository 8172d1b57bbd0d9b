"""An agent that is slower than the world: it takes only the newest image, and counts what it missed.

    python client-lib/python/examples/latest_wins.py
"""

import math
import sys
import time

import omnibus
from omnibus.sensors import Camera

#: How long the agent works on one image: three to four frames of 50 ms pass.
WORK_SECS = 0.17

EYE = Camera(
    "eye", 320, 240, math.radians(86), omnibus.Pose((1.5, 0.0, 2.0)), outputs=("depth",)
)


def main(map: str | None = None) -> None:
    with omnibus.launch(map, sensors=[EYE]) as simulator:
        client, (bundle,) = simulator.client, simulator.bundles
        # The world runs on its own clock and does not wait for clients.
        client.apply_settings(omnibus.Settings(synchronous=False, real_time_factor=1.0))
        last = 0
        for _ in range(10):
            newest = bundle.wait(timeout_secs=30)
            newest = bundle.latest() or newest
            nearest_m = newest["eye"].depth.min()
            passed = newest.frame - last - 1 if last else 0
            last = newest.frame
            print(f"frame {last}: nearest {nearest_m:.2f} m; {passed} frames passed unseen")
            time.sleep(WORK_SECS)


if __name__ == "__main__":
    main(*sys.argv[1:])
