"""Reads maps with the official package, as CARLA's route planner does.

Usage: topology.py SOURCE... A source is a file, or the port of a server. Prints one JSON object for each:
its topology's length and the pairs of equal waypoints, or the error of a map that the package cannot
read.
"""

import json
import os
import sys
import tempfile

os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")

import carla


def place(waypoint):
    return [waypoint.road_id, waypoint.section_id, waypoint.lane_id, waypoint.s]


def direction_is_undefined(first, second):
    """Whether `Vector3D.make_unit_vector` refuses the vector between two waypoints."""
    try:
        (second.transform.location - first.transform.location).make_unit_vector()
    except RuntimeError:
        return True
    return False


def read(source):
    if source.isdecimal():
        client = carla.Client("127.0.0.1", int(source))
        client.set_timeout(20.0)
        return client.get_world().get_map()
    with open(source, encoding="utf-8") as file:
        return carla.Map("map", file.read())


def look(source):
    try:
        topology = read(source).get_topology()
    except (RuntimeError, IndexError) as error:
        return {"error": str(error)}
    equal = [[place(a), place(b)] for a, b in topology if direction_is_undefined(a, b)]
    return {"pairs": len(topology), "equal": equal}


if __name__ == "__main__":
    for source in sys.argv[1:]:
        print(json.dumps({"source": source, **look(source)}), flush=True)
    # The package aborts now and then while its threads end.
    os._exit(0)
