"""What the drivers of `./run field` share: one JSON line per case, the synchronous world, the traffic."""

import json
import os
import sys
import tempfile

# The package caches map files without limit; a run must not use those of another simulator.
os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("MPLBACKEND", "Agg")

import carla

DELTA = 0.05


def report(case, ok, observed):
    """Prints the result of one case."""
    print(json.dumps({"case": case, "ok": None if ok is None else bool(ok), "observed": observed}), flush=True)


def arguments():
    """Port of the simulator, folder of the program, folder for output, and whether to be brief."""
    port, folder, out, quick = sys.argv[1:5]
    return int(port), folder, out, quick == "quick"


def towns():
    """The towns of CARLA whose own maps are there; generated towns have their names, but other roads."""
    return os.environ.get("FIELD_TOWNS", "").split()


def load(client, town):
    """Loads a town in synchronous mode, without rendering."""
    world = client.load_world(town)
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = DELTA
    world.apply_settings(settings)
    world.tick()
    return world


def spawn_traffic(client, world, count, random, port=8000):
    """Spawns `count` vehicles on autopilot; returns them."""
    manager = client.get_trafficmanager(port)
    manager.set_synchronous_mode(True)
    manager.set_random_device_seed(1)
    cars = [b for b in world.get_blueprint_library().filter("vehicle.*")
            if b.has_attribute("base_type") and b.get_attribute("base_type") == "car"]
    points = list(world.get_map().get_spawn_points())
    random.shuffle(points)
    vehicles = []
    for point in points:
        if len(vehicles) == count:
            break
        blueprint = random.choice(cars)
        blueprint.set_attribute("role_name", "autopilot")
        vehicle = world.try_spawn_actor(blueprint, point)
        if vehicle is not None:
            vehicle.set_autopilot(True, port)
            vehicles.append(vehicle)
    return vehicles


def destroy(client, actors):
    client.apply_batch_sync([carla.command.DestroyActor(a.id) for a in actors], True)


def end():
    """Ends the process; the package sometimes aborts while its threads end."""
    sys.stdout.flush()
    os._exit(0)
