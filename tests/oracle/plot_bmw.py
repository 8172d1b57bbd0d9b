"""Draws docs/vehicle-model/: our BMW 320i and CommonRoad's, and the table of differences.

    OMNIBUS_BMW=ours.csv cargo test --release -p sim-host commonroad
    python plot_bmw.py ../../sim-host/src/physics/tests/bmw.csv ours.csv ../../docs/vehicle-model

needs matplotlib. Prints the table as Markdown.
"""

import csv
import math
import pathlib
import sys

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

TITLES = {
    "step_steer_50": "Step steer at 50 km/h",
    "step_steer_80": "Step steer at 80 km/h",
    "step_steer_110": "Step steer at 110 km/h",
    "sine_with_dwell_80": "Sine with dwell at 80 km/h",
    "full_braking": "Full braking from 100 km/h",
    "full_acceleration": "Full acceleration from 20 m/s",
    "skidpad_8": "Circle at 8 m/s",
    "skidpad_11": "Circle at 11 m/s",
    "skidpad_13": "Circle at 13 m/s",
}
ROWS = 20


def read(path):
    runs = {}
    with open(path, encoding="utf-8") as file:
        for row in csv.DictReader(file):
            name = row.pop("manoeuvre")
            runs.setdefault(name, []).append({k: float(v) for k, v in row.items()})
    return runs


def difference(ours, theirs, what):
    """Returns differences in percent: of the mean of the last second, and the largest one."""
    most = max(abs(row[what]) for row in theirs)
    end = [sum(row[what] for row in run[-ROWS:]) / ROWS for run in (ours, theirs)]
    worst = max(abs(a[what] - b[what]) for a, b in zip(ours, theirs))
    steady = (end[0] - end[1]) / abs(end[1]) if abs(end[1]) > 0.05 * most else None
    return steady, worst / most


def draw(name, ours, theirs, folder):
    is_straight = name.startswith("full")
    panels = [("speed_mps", "speed, m/s")] if is_straight else [
        ("yaw_radps", "yaw rate, rad/s"), ("slip_rad", "slip angle, rad"),
        ("roll_rad", "roll, rad")]
    figure, axes = plt.subplots(1, len(panels), figsize=(3.6 * len(panels), 2.6), squeeze=False)
    for axis, (what, label) in zip(axes[0], panels):
        for run, style, label in ((theirs, "k--", "multi-body"), (ours, "C0-", "ours")):
            axis.plot([r["t_s"] for r in run], [r[what] for r in run], style, lw=1.2, label=label)
        axis.set_xlabel("s")
        axis.set_title(label, fontsize=9)
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=8)
    axes[0][0].legend(fontsize=8)
    figure.suptitle(TITLES[name], fontsize=10)
    figure.tight_layout()
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
    plt.close(figure)


def percent(value):
    return "–" if value is None else f"{100.0 * value:+.1f} %"


def main():
    theirs, ours = read(sys.argv[1]), read(sys.argv[2])
    folder = pathlib.Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    # Fixed names, so that a file changes only when a curve does.
    plt.rcParams["svg.hashsalt"] = "omnibus"
    print("| manoeuvre | yaw rate at the end | at worst | slip at the end | at worst "
          "| speed at worst |")
    print("|---|---|---|---|---|---|")
    for name, title in TITLES.items():
        draw(name, ours[name], theirs[name], folder)
        cells = []
        for what in ("yaw_radps", "slip_rad"):
            steady, worst = difference(ours[name], theirs[name], what)
            if name.startswith("full"):
                cells += ["–", "–"]
            elif what == "slip_rad":
                most = max(abs(row[what]) for row in theirs[name])
                cells += [percent(steady), f"{math.degrees(worst * most):.2f}°"]
            else:
                cells += [percent(steady), f"{100.0 * worst:.1f} %"]
        _, speed = difference(ours[name], theirs[name], "speed_mps")
        print(f"| {title} | {' | '.join(cells)} | {100.0 * speed:.1f} % |")


if __name__ == "__main__":
    main()
