"""Checks of the traffic manager."""

import carla

import made_map
from effects_kit import near
from effects_world import update_context
from ledger import check, differs, ignored, works


@check
def traffic_manager_parameters(c):
    """Parameters of one vehicle on a road with two lanes."""
    manager = c.client.get_trafficmanager(8000)
    town = c.world.get_map()
    change = carla.LaneChange
    long = [point for point in town.generate_waypoints(5.0)
            if point.lane_change in (change.Right, change.Both) and not point.is_junction
            and len(point.next_until_lane_end(5.0)) > 12]
    assert long, "no road with a lane to the right"
    start = long[0].transform
    start.location.z += 0.5

    def drive(ticks, set_parameters, start=start):
        """Drives a vehicle with parameters; returns speeds, offsets to the right of the lane's
        centre, and lane ids."""
        car = c.world.spawn_actor(c.library.find("vehicle.tesla.model3"), start)
        c.ticks(10)
        car.set_autopilot(True, manager.get_port())
        set_parameters(car)
        speeds, offsets, lanes = [], [], []
        for _ in range(ticks):
            c.ticks(1)
            place = car.get_location()
            at = town.get_waypoint(place)
            gap = place - at.transform.location
            right = at.transform.get_right_vector()
            speeds.append(car.get_velocity().length())
            offsets.append(gap.x * right.x + gap.y * right.y)
            lanes.append(at.lane_id)
        car.destroy()
        c.ticks(1)
        return speeds, offsets, lanes

    def only(set_parameters):
        """Disables lane changes for other reasons."""
        def both(car):
            manager.auto_lane_change(car, False)
            set_parameters(car)
        return both

    speeds, offsets, lanes = drive(100, only(lambda car: manager.set_desired_speed(car, 14.4)))
    near(speeds[-1], 4.0, 0.4)
    works("TrafficManager.set_desired_speed",
          "the vehicle drove 4 m/s with a desired speed of 14.4 km/h")
    assert len(set(lanes)) == 1, lanes
    near(offsets[-1], 0.0, 0.1)
    slow = lambda car: manager.set_desired_speed(car, 14.4)
    _, offsets, _ = drive(120, only(lambda car: (slow(car), manager.vehicle_lane_offset(car, 0.5))))
    near(offsets[-1], 0.5, 0.1)
    manager.global_lane_offset(-0.4)
    _, offsets, _ = drive(120, only(slow))
    near(offsets[-1], -0.4, 0.1)
    manager.global_lane_offset(0.0)
    works("TrafficManager.vehicle_lane_offset TrafficManager.global_lane_offset",
          "the vehicle drove 0.5 m to the right and 0.4 m to the left of the lane's centre")

    def right_of(lanes):
        """Returns whether the vehicle was in the lane to the right of the first one."""
        return long[0].get_right_lane().lane_id in lanes

    _, _, lanes = drive(160, only(lambda car: manager.force_lane_change(car, True)))
    assert right_of(lanes), lanes
    works("TrafficManager.force_lane_change TrafficManager.auto_lane_change",
          "the vehicle changed to the right lane when forced, and never otherwise without "
          "automatic lane changes")
    for member, set_parameters in {
        "keep_slow_lane_rule_percentage": manager.keep_slow_lane_rule_percentage,
        "random_right_lanechange_percentage": manager.random_right_lanechange_percentage,
    }.items():
        _, _, lanes = drive(160, only(lambda car: set_parameters(car, 100.0)))
        assert right_of(lanes), (member, lanes)
        differs(f"TrafficManager.{member}",
                "at 100 % the vehicle changed to the right where that was safe; the draw is "
                "repeated about every 0.6 s")
    right = long[0].get_right_lane().transform
    right.location.z += 0.5
    left = lambda car: manager.random_left_lanechange_percentage(car, 100.0)
    _, _, lanes = drive(160, only(left), right)
    assert long[0].lane_id in lanes, lanes
    differs("TrafficManager.random_left_lanechange_percentage",
            "at 100 % the vehicle changed to the left where that was safe; the draw is repeated "
            "about every 0.6 s")

    # A vehicle stands in the lane.
    ahead = long[0].next(25.0)[0].transform
    ahead.location.z += 0.5
    wall = c.world.spawn_actor(c.library.find("vehicle.tesla.model3"), ahead)
    wall.apply_control(carla.VehicleControl(hand_brake=True))
    c.ticks(10)

    def hits(set_parameters):
        before = wall.get_location()
        drive(160, only(set_parameters))
        return wall.get_location().distance(before) > 0.05

    assert not hits(lambda car: None)
    assert not hits(lambda car: manager.ignore_walkers_percentage(car, 100.0))
    assert hits(lambda car: manager.collision_detection(car, wall, False))
    works("TrafficManager.collision_detection",
          "the vehicle hit a standing vehicle that it ignored")
    assert hits(lambda car: manager.ignore_vehicles_percentage(car, 100.0))
    differs("TrafficManager.ignore_vehicles_percentage",
            "at 100 % the vehicle hit a standing vehicle; one draw for each pair of vehicles")
    wall.destroy()
    walker = c.world.spawn_actor(c.library.filter("walker.pedestrian.*")[0], ahead)
    c.ticks(10)

    def passes(set_parameters):
        car = c.world.spawn_actor(c.library.find("vehicle.tesla.model3"), start)
        c.ticks(10)
        car.set_autopilot(True, manager.get_port())
        only(set_parameters)(car)
        c.ticks(160)
        gap = car.get_location().distance(walker.get_location())
        moved = walker.get_location().distance(ahead.location)
        car.destroy()
        c.ticks(1)
        # The front of the vehicle is 2.4 m ahead of its centre.
        return gap < 3.2 or moved > 2.0, gap, moved

    keeps = passes(lambda car: None)
    assert not keeps[0], keeps
    drives = passes(lambda car: manager.ignore_walkers_percentage(car, 100.0))
    assert drives[0], (keeps, drives)
    differs("TrafficManager.ignore_walkers_percentage",
            "at 100 % the vehicle hit a standing walker; one draw for each pair of vehicle and "
            "walker")
    walker.destroy()
    manager.ignore_signs_percentage(c.world.get_spectator(), 100.0)
    differs("TrafficManager.ignore_signs_percentage",
            "accepted; the map of this test has no stop or yield signs, so a test of the traffic "
            "crate covers the effect")


def forks(town, points):
    """Yields spawn points before a junction with several routes, and the routes: locations every
    2 m, by CARLA's name of the turn."""
    for point in points:
        here = town.get_waypoint(point.location)
        lane = here.next_until_lane_end(2.0)
        if here.is_junction or len(lane) < 10:
            continue
        ways = {}
        for way in lane[-1].next(3.0):
            way = [way]
            while way[-1].is_junction and len(way) < 40:
                way += way[-1].next(2.0)[:1]
            way += way[-1].next_until_lane_end(2.0)[:10]
            turn = way[-1].transform.rotation.yaw - lane[-1].transform.rotation.yaw
            turn = (turn + 180.0) % 360.0 - 180.0
            if abs(turn) < 20.0 or abs(turn) > 50.0:
                ways["Straight" if abs(turn) < 20.0 else "Left" if turn < 0.0 else "Right"] = way
        if len(ways) > 1:
            yield point, {name: [w.transform.location for w in lane + way]
                          for name, way in ways.items()}


@check
def traffic_manager_routes(c):
    manager = c.client.get_trafficmanager(8000)
    manager.set_synchronous_mode(True)
    town = c.world.get_map()
    found = next(forks(town, c.points), None)
    assert found, "no fork"
    start, ways = found
    start.location.z += 0.3

    def drive(set_route, goal):
        """Drives a vehicle with a route; returns its least distance to the goal."""
        car = c.world.spawn_actor(c.library.find("vehicle.tesla.model3"), start)
        c.ticks(5)
        car.set_autopilot(True, manager.get_port())
        manager.ignore_lights_percentage(car, 100.0)
        set_route(car)
        least = 1e9
        for _ in range(1200):
            c.ticks(1)
            least = min(least, car.get_location().distance(goal))
            if least < 2.0:
                break
        car.destroy()
        c.ticks(1)
        return least

    for name, path in ways.items():
        gap = drive(lambda car: manager.set_route(car, [name]), path[-1])
        assert gap < 5.0, (name, gap)
        gap = drive(lambda car: manager.set_path(car, path), path[-1])
        assert gap < 2.0, (name, gap)
    works("TrafficManager.set_route",
          "the vehicle took every route through a junction as commanded")
    works("TrafficManager.set_path",
          "the vehicle followed the locations on every route through a junction")

    car = c.world.spawn_actor(c.library.find("vehicle.tesla.model3"), start)
    car.set_autopilot(True, manager.get_port())
    before = c.world.get_weather()
    c.world.set_weather(carla.WeatherParameters.ClearNight)
    c.ticks(5)
    none = carla.VehicleLightState.NONE
    assert car.get_light_state() == none, car.get_light_state()
    manager.update_vehicle_lights(car, True)
    c.ticks(5)
    low = carla.VehicleLightState.LowBeam
    assert car.get_light_state() & low == low, car.get_light_state()
    works("TrafficManager.update_vehicle_lights",
          "low beams were on at night; turn signals are on before a turn")
    c.world.set_weather(before)
    car.destroy()
    manager.set_random_device_seed(3)
    c.ticks(2)
    differs("TrafficManager.set_random_device_seed",
            "random decisions are drawn from this seed, the seed of the world and the id of the "
            "vehicle; a test of the traffic crate covers the effect")


@check
def autopilot(c):
    manager = c.client.get_trafficmanager(8000)
    manager.set_synchronous_mode(True)
    manager.global_percentage_speed_difference(10.0)
    manager.set_global_distance_to_leading_vehicle(2.5)
    cars = [c.car() for _ in range(4)]
    for car in cars:
        car.set_autopilot(True, manager.get_port())
        manager.ignore_lights_percentage(car, 100.0)
    starts = [car.get_location() for car in cars]
    c.ticks(120)
    moved = [car.get_location().distance(start) for car, start in zip(cars, starts)]
    assert sum(distance > 5.0 for distance in moved) >= 3, moved
    works("Client.get_trafficmanager TrafficManager.get_port Vehicle.set_autopilot",
          "vehicles were driven by traffic")
    manager.vehicle_percentage_speed_difference(cars[0], 100.0)
    manager.distance_to_leading_vehicle(cars[1], 4.0)
    c.ticks(160)
    speed = cars[0].get_velocity().length()
    assert speed < 0.7, f"at 100 % below the limit the vehicle drives {speed} m/s"
    differs("TrafficManager.global_percentage_speed_difference "
            "TrafficManager.vehicle_percentage_speed_difference "
            "TrafficManager.set_global_distance_to_leading_vehicle "
            "TrafficManager.distance_to_leading_vehicle TrafficManager.ignore_lights_percentage",
            "parameters of this simulator's own traffic; at 100 % below the limit a vehicle "
            "stopped")
    ignored("accepted; traffic plans one step in each frame, also with False", {
        "TrafficManager.set_synchronous_mode": lambda: manager.set_synchronous_mode(True),
    })
    for car in cars:
        car.set_autopilot(False, manager.get_port())
        car.apply_control(carla.VehicleControl(brake=1.0))
    c.ticks(100)
    assert all(car.get_velocity().length() < 0.5 for car in cars)
    for car in cars:
        car.destroy()


@check
def several_managers(c):
    first, second = (c.client.get_trafficmanager(port) for port in (8000, 8010))
    assert (first.get_port(), second.get_port()) == (8000, 8010)
    cars = [c.car() for _ in range(4)]
    second.global_percentage_speed_difference(100.0)
    second.vehicle_percentage_speed_difference(cars[3], 0.0)
    for car, manager in zip(cars, (first, first, second, second)):
        car.set_autopilot(True, manager.get_port())
        manager.ignore_lights_percentage(car, 100.0)
    starts = [car.get_location() for car in cars]
    c.ticks(160)
    moved = [car.get_location().distance(start) for car, start in zip(cars, starts)]
    assert max(moved[:2]) > 5.0 and moved[2] < 1.0 and moved[3] > 5.0, moved
    # The other one does not end what this one has begun.
    cars[3].set_autopilot(False, first.get_port())
    second.global_percentage_speed_difference(0.0)
    c.ticks(100)
    assert cars[2].get_location().distance(starts[2]) > 5.0
    second.shut_down()
    for car in cars:
        car.apply_control(carla.VehicleControl(brake=1.0))
    c.ticks(100)
    speeds = [car.get_velocity().length() for car in cars]
    assert max(speeds[2:]) < 0.2, speeds
    works("TrafficManager.shut_down", "the vehicles of a second manager, on a port of its own, were no "
          "longer driven; what it had set for all of its vehicles held for no others")
    for car in cars:
        car.destroy()


@check
def hybrid_physics(c):
    """A push upwards lifts a vehicle off the ground, and has no effect on one without full physics."""
    manager = c.client.get_trafficmanager(8000)
    hero, car = c.car(role_name="hero"), c.car()
    car.set_autopilot(True, manager.get_port())
    manager.vehicle_percentage_speed_difference(car, 100.0)
    c.ticks(20)

    def rise():
        before = car.get_location().z
        car.add_impulse(carla.Vector3D(0.0, 0.0, 4.0 * car.get_physics_control().mass))
        heights = []
        for _ in range(8):
            c.ticks(1)
            heights.append(car.get_location().z - before)
        c.ticks(30)
        return max(heights)

    assert rise() > 0.3
    manager.set_hybrid_physics_radius(1.0)
    manager.set_hybrid_physics_mode(True)
    c.ticks(3)
    assert rise() < 0.1
    manager.set_hybrid_physics_radius(100000.0)
    c.ticks(3)
    assert rise() > 0.3
    manager.set_hybrid_physics_radius(1.0)
    c.ticks(3)
    manager.set_hybrid_physics_mode(False)
    c.ticks(3)
    assert rise() > 0.3
    differs("TrafficManager.set_hybrid_physics_mode TrafficManager.set_hybrid_physics_radius",
            "beyond the radius of every hero, of every actor with sensors and of every vehicle that a "
            "client drives, a kinematic model with the vehicle's own engine and brakes moved it")
    car.destroy()
    hero.destroy()
    c.ticks(1)


@check
def respawn_of_dormant_vehicles(c):
    manager = c.client.get_trafficmanager(8000)
    hero, car = c.car(role_name="hero"), c.car()
    while car.get_location().distance(hero.get_location()) < 120.0:
        car.destroy()
        car = c.car()
    car.set_autopilot(True, manager.get_port())
    manager.vehicle_percentage_speed_difference(car, 100.0)
    manager.set_boundaries_respawn_dormant_vehicles(25.0, 100.0)
    c.ticks(5)
    away = lambda: car.get_location().distance(hero.get_location())
    assert away() > 100.0, away()
    manager.set_respawn_dormant_vehicles(True)
    c.ticks(5)
    assert 20.0 < away() < 105.0, away()
    manager.set_respawn_dormant_vehicles(False)
    differs("TrafficManager.set_respawn_dormant_vehicles "
            "TrafficManager.set_boundaries_respawn_dormant_vehicles",
            "maps are not loaded in parts: a vehicle of traffic beyond the upper boundary from every "
            "hero continued at a free spawn point within the boundaries")
    car.destroy()
    hero.destroy()
    c.ticks(1)


@check
def osm_mode(c):
    """A road of 420 m whose lanes end without a successor."""
    c.world = c.client.generate_opendrive_world(made_map.text())
    update_context(c)
    manager = c.client.get_trafficmanager(8000)

    def drive():
        """Returns whether a vehicle that drives to the end of the road is there at the end."""
        start = c.map.get_waypoint_xodr(1, -2, made_map.LENGTH_M - 50.0).transform
        start.location.z += 0.5
        car = c.world.spawn_actor(c.library.find("vehicle.tesla.model3"), start)
        car.set_autopilot(True, manager.get_port())
        farthest, is_there = 0.0, True
        for _ in range(400):
            c.ticks(1)
            is_there = c.world.get_snapshot().has_actor(car.id)
            if not is_there:
                break
            farthest = max(farthest, car.get_location().x)
        assert farthest > made_map.LENGTH_M - 16.0, farthest
        if is_there:
            car.destroy()
            c.ticks(1)
        return is_there

    assert drive()
    manager.set_osm_mode(True)
    assert not drive()
    manager.set_osm_mode(False)
    differs("TrafficManager.set_osm_mode", "a vehicle of traffic that stopped where its lane ends "
            "without a successor was removed; without it, it stayed, or turned round where a lane leads "
            "back (CARLA removes it in both modes)")
