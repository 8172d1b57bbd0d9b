"""SUMO beside `cargo run --release -p omnibus-traffic --example planning`.

Prints the microseconds of one vehicle and step of 50 ms, the median of three rounds, for vehicles on
a generated grid of two lanes each way with traffic lights every 100 m. The packages eclipse-sumo and
libsumo are on PyPI.

    python bench/planning_peer.py VEHICLES STREETS FRAMES
"""

import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree

import sumo

os.environ.setdefault("SUMO_HOME", sumo.SUMO_HOME)
import libsumo  # noqa: E402

WARM_UP = 600
ROUTE_EDGES = 60


def main(vehicles: int, streets: int, frames: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        net = os.path.join(folder, "grid.net.xml")
        generator = os.path.join(sumo.SUMO_HOME, "bin", "netgenerate")
        grid = ["--grid", f"--grid.number={streets}", "--grid.length=100", "-L", "2", "--tls.guess"]
        subprocess.run([generator, *grid, "-o", net], check=True, stdout=subprocess.DEVNULL)
        libsumo.start(
            ["sumo", "-n", net, "--step-length", "0.05", "--no-step-log", "--no-warnings"]
            + ["--time-to-teleport", "-1"]
        )
        populate(net, vehicles)
    for _ in range(WARM_UP):
        libsumo.simulationStep()
    rounds = []
    for _ in range(3):
        count, begin = 0, time.perf_counter()
        for _ in range(frames):
            libsumo.simulationStep()
            count += libsumo.vehicle.getIDCount()
        rounds.append((time.perf_counter() - begin) * 1e6 / count)
    print(
        f"{vehicles} vehicles: {statistics.median(rounds):.3f} us per vehicle and step, "
        f"{libsumo.vehicle.getIDCount()} at the end"
    )


def populate(net: str, vehicles: int) -> None:
    """Adds vehicles with random routes, spread over all edges."""
    after: dict[str, set[str]] = {}
    for link in ElementTree.parse(net).getroot().iter("connection"):
        if not link.get("from").startswith(":"):
            after.setdefault(link.get("from"), set()).add(link.get("to"))
    edges = sorted(after)
    draws = random.Random(1)
    for index in range(vehicles):
        route = [edges[index * len(edges) // vehicles]]
        while len(route) < ROUTE_EDGES:
            route.append(draws.choice(sorted(after[route[-1]])))
        libsumo.route.add(f"r{index}", route)
        libsumo.vehicle.add(
            f"v{index}", f"r{index}", departPos="random_free", departLane="random"
        )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:4]))
