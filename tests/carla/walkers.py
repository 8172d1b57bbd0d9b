"""Twenty walkers of the official package walk on the map's navigation mesh.

Usage: walkers.py PORT SECONDS [FACTOR]. Prints how far they walked and on which surfaces. FACTOR is the
share of walkers that cross quiet streets away from crosswalks; with it, each walks to and fro between the
two sides of a street.
"""

import os
import sys
import tempfile

# The package caches navigation meshes without limit; a test must not use those of another run.
os.environ["CARLA_CACHE_DIR"] = tempfile.mkdtemp(prefix="carla-cache-")

import carla

DELTA = 0.05
COUNT = 20
# The surfaces on which walkers are expected.
FINE = {carla.CityObjectLabel.Sidewalks}
LABELS = carla.CityObjectLabel
GROUND = {LABELS.Sidewalks, LABELS.Roads, LABELS.RoadLines, LABELS.Terrain, LABELS.Ground,
          LABELS.Other, LABELS.Static}


def main(port, seconds, factor=0.0):
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = DELTA
    world.apply_settings(settings)
    world.set_pedestrians_seed(3)
    world.set_pedestrians_cross_factor(factor)
    world.tick()
    crosswalks = outlines(world.get_map().get_crosswalks())
    library = world.get_blueprint_library()
    blueprints = library.filter("walker.pedestrian.*")
    walkers, controllers = [], []
    sides = across(world, crosswalks) if factor else []
    # The place from which a walker comes, and its goal.
    ends = []
    while len(walkers) < COUNT:
        place, goal = sides.pop() if factor else (world.get_random_location_from_navigation(),) * 2
        assert place is not None, "the map has no navigation mesh"
        walker = world.try_spawn_actor(blueprints[len(walkers)], carla.Transform(place))
        if walker is not None:
            walkers.append(walker)
            ends.append([place, goal])
    world.tick()
    for walker in walkers:
        controller = library.find("controller.ai.walker")
        controllers.append(world.spawn_actor(controller, carla.Transform(), attach_to=walker))
    world.tick()

    def next_goal(index):
        if factor:
            ends[index].reverse()
            return ends[index][0]
        return world.get_random_location_from_navigation()

    goals = []
    for index, controller in enumerate(controllers):
        controller.start()
        goals.append(next_goal(index))
        controller.go_to_location(goals[-1])
        controller.set_max_speed(1.0 + 0.05 * index)
    way = [0.0] * COUNT
    on_road, crossing, looked = [], 0, 0
    last = [walker.get_location() for walker in walkers]
    for frame in range(round(seconds / DELTA)):
        world.tick()
        for index, walker in enumerate(walkers):
            at = walker.get_location()
            step = at.distance(last[index])
            way[index] += step
            last[index] = at
            if at.distance(goals[index]) < 2.0:
                goals[index] = next_goal(index)
                controllers[index].go_to_location(goals[index])
            if frame % 10:
                continue
            looked += 1
            down = world.cast_ray(at + carla.Location(z=1.0), at - carla.Location(z=3.0))
            solid = [hit for hit in down if hit.label in GROUND]
            assert solid, f"no ground below {at}"
            # Litter counts as what it lies on.
            below = next((hit for hit in solid if hit.label != LABELS.Static), solid[0])
            assert abs(below.location.z - at.z) < 0.4, f"{at} is not on {below.location}"
            if below.label in FINE:
                continue
            if any(within(at, outline) for outline in crosswalks):
                crossing += 1
            else:
                on_road.append((walker.id, at.x, at.y, str(below.label)))
    moving = sum(one > 5.0 for one in way)
    assert moving >= COUNT * 0.9, f"only {moving} of {COUNT} walkers moved: {way}"
    for index, distance in enumerate(way):
        # A walker may be pushed aside by another one, so the limit has a margin.
        speed, wanted = distance / seconds, 1.0 + 0.05 * index
        assert speed < 1.15 * wanted, f"walker {index} walks at {speed} m/s, set to {wanted} m/s"
    assert factor or not on_road, f"on a road in {len(on_road)} of {looked} samples: {on_road[:5]}"
    assert factor or crossing > 0 or seconds < 30, "no walker used a crosswalk"
    speeds = [walker.get_velocity().length() for walker in walkers]
    assert sum(speed > 0.3 for speed in speeds) > COUNT / 2, speeds
    for controller in controllers:
        controller.stop()
    print(f"{moving} of {COUNT} walked {sum(way):.0f} m in total, {crossing} of {looked} samples on "
          f"crosswalks, {len(on_road) or 'none'} on a road")


def across(world, crosswalks):
    """Returns pairs of places on the two sides of a street, away from crosswalks."""
    cells, pairs = {}, []
    for _ in range(4000):
        place = world.get_random_location_from_navigation()
        assert place is not None, "the map has no navigation mesh"
        cells.setdefault((int(place.x // 16), int(place.y // 16)), []).append(place)
    for places in cells.values():
        for number, first in enumerate(places):
            for second in places[:number]:
                middle = (first + second) / 2.0
                near = any(min(middle.distance(corner) for corner in outline) < 15.0 for outline in crosswalks)
                if near or not 8.0 < first.distance(second) < 14.0:
                    continue
                down = world.cast_ray(middle + carla.Location(z=1.0), middle - carla.Location(z=3.0))
                if any(hit.label in (LABELS.Roads, LABELS.RoadLines) for hit in down):
                    pairs.append((first, second))
                    break
    assert len(pairs) >= COUNT, f"only {len(pairs)} pairs of places across a street"
    # Far apart, as the cells come in the order of random places.
    return pairs


def outlines(points):
    """Splits CARLA's list of points into polygons; each one ends at its first point."""
    polygons, line = [], []
    for point in points:
        if line and point.distance(line[0]) < 1e-3:
            polygons.append(line)
            line = []
        else:
            line.append(point)
    return polygons


def within(at, outline):
    """Returns whether a point is in a polygon or within half a metre of it."""
    inside = False
    for a, b in zip(outline, outline[1:] + outline[:1]):
        if (a.y > at.y) != (b.y > at.y) and at.x < a.x + (at.y - a.y) * (b.x - a.x) / (b.y - a.y):
            inside = not inside
        length = max((b.x - a.x) ** 2 + (b.y - a.y) ** 2, 1e-6)
        share = ((at.x - a.x) * (b.x - a.x) + (at.y - a.y) * (b.y - a.y)) / length
        share = min(1.0, max(0.0, share))
        off = ((a.x + share * (b.x - a.x) - at.x) ** 2 + (a.y + share * (b.y - a.y) - at.y) ** 2)
        if off < 0.5 ** 2:
            return True
    return inside


if __name__ == "__main__":
    main(int(sys.argv[1]), *map(float, sys.argv[2:]))
    sys.stdout.flush()
    # The package sometimes aborts while its threads end.
    os._exit(0)
