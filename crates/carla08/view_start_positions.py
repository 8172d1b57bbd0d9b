#!/usr/bin/env python3
"""Draws the map and its start positions, numbered.

The program of CARLA 0.8, with its flags; draws with matplotlib if that is installed, otherwise
writes _out/start_positions.svg.
"""

import argparse
import logging
import os

from carla08.client import make_carla_client
from carla08.settings import CarlaSettings
from carla08.util import retry_until_served


def wanted(text, count):
    """Parses "all", "5" or "1,2,30" into indices."""
    if text == "all":
        return list(range(count))
    found = [int(part) for part in text.split(",")]
    for index in found:
        if not 0 <= index < count:
            raise SystemExit(f"start position {index} is not 0 to {count - 1}")
    return found


def lines_of(road_map):
    """Returns the centre lines of all lanes as lists of (x, y)."""
    lines = []
    for before, _ in road_map.get_topology():
        points = [before, *before.next_until_lane_end(4.0)]
        lines.append([(p.transform.location.x, p.transform.location.y) for p in points])
    return lines


def write_svg(path, lines, spots, chosen, labels):
    """Writes an SVG drawing; x to the right, y down, as on the map."""
    xs = [x for line in lines for x, _ in line]
    ys = [y for line in lines for _, y in line]
    left, top = min(xs) - 20, min(ys) - 20
    width, height = max(xs) - left + 20, max(ys) - top + 20
    text = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{2 * width:.0f}" '
            f'height="{2 * height:.0f}" viewBox="{left:.1f} {top:.1f} {width:.1f} {height:.1f}">',
            '<rect x="-99999" y="-99999" width="199999" height="199999" fill="#fff"/>']
    for line in lines:
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in line)
        text.append(f'<polyline points="{points}" fill="none" stroke="#bbb" stroke-width="3"/>')
    for index in chosen:
        at, ahead = spots[index].location, spots[index].orientation
        text.append(f'<circle class="spot" cx="{at.x:.1f}" cy="{at.y:.1f}" r="2" fill="#d22"/>'
                    f'<line x1="{at.x:.1f}" y1="{at.y:.1f}" x2="{at.x + 6 * ahead.x:.1f}" '
                    f'y2="{at.y + 6 * ahead.y:.1f}" stroke="#d22"/>')
        if labels:
            text.append(f'<text x="{at.x + 2:.1f}" y="{at.y - 2:.1f}" font-size="6">'
                        f'{index}</text>')
    text.append("</svg>")
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(text))
    print(f"written to {path}")


def show(lines, spots, chosen, labels):
    """Shows a window and writes a PDF file."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(12, 12))
    for line in lines:
        axes.plot(*zip(*line), color="0.7", linewidth=2)
    for index in chosen:
        at, ahead = spots[index].location, spots[index].orientation
        axes.arrow(at.x, at.y, 6 * ahead.x, 6 * ahead.y, color="r", head_width=2)
        if labels:
            axes.text(at.x, at.y, str(index), size="x-small")
    axes.set_aspect("equal")
    axes.invert_yaxis()
    os.makedirs("_out", exist_ok=True)
    figure.savefig("_out/start_positions.pdf")
    print("written to _out/start_positions.pdf")
    pyplot.show()


def view_start_positions(args):
    """Requests the scene and draws it."""
    with make_carla_client(args.host, args.port) as client:
        scene = client.load_settings(
            CarlaSettings(NumberOfVehicles=0, NumberOfPedestrians=0))
        spots, lines = scene.player_start_spots, lines_of(client.map)
    print(f"{scene.map_name}: {len(spots)} start positions")
    chosen = wanted(args.positions, len(spots))
    if not args.svg:
        try:
            show(lines, spots, chosen, not args.no_labels)
            return
        except ImportError:
            logging.warning("matplotlib is not installed; writing an SVG file")
    write_svg(args.svg or "_out/start_positions.svg", lines, spots, chosen, not args.no_labels)


def main():
    """Parses the flags, and retries until the server is up."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("-v", "--verbose", action="store_true", dest="debug",
                        help="print debug information")
    parser.add_argument("--host", metavar="H", default="localhost",
                        help="IP of the host server (default: localhost)")
    parser.add_argument("-p", "--port", metavar="P", default=2000, type=int,
                        help="TCP port to listen to (default: 2000)")
    parser.add_argument("-pos", "--positions", metavar="P", default="all",
                        help="positions to draw: 5 or 1,2,30 (default: all)")
    parser.add_argument("--no-labels", action="store_true", help="draw no numbers")
    parser.add_argument("--svg", metavar="PATH", default=None,
                        help="write an SVG file even if matplotlib is installed")
    args = parser.parse_args()
    logging.basicConfig(format="%(levelname)s: %(message)s",
                        level=logging.DEBUG if args.debug else logging.INFO)
    retry_until_served(lambda: view_start_positions(args), logging)
    print("Done.")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("\nCancelled by user. Bye!")
