"""Checks of traffic lights: states, trigger volumes, stop points and groups."""

import xml.etree.ElementTree as ElementTree

import carla

from ledger import check, differs, works

RED, GREEN = carla.TrafficLightState.Red, carla.TrafficLightState.Green


def lights_of(c):
    return c.world.get_actors().filter("traffic.traffic_light*")


def names(waypoints):
    return {(point.road_id, point.lane_id) for point in waypoints}


def approach(point):
    """Returns the waypoint before the junction on the way to `point`."""
    for _ in range(400):
        if not point.is_junction:
            break
        point = point.previous(0.2)[0]
    return point


def lanes_in_file(text):
    """Returns the lanes that each signal of an OpenDRIVE text applies to, by its id."""
    lanes = {}
    for road in ElementTree.fromstring(text).iter("road"):
        for signal in road.findall("signals/*"):
            for validity in signal.findall("validity"):
                ends = int(validity.get("fromLane")), int(validity.get("toLane"))
                named = {(int(road.get("id")), lane) for lane in range(min(ends), max(ends) + 1)}
                lanes.setdefault(signal.get("id"), set()).update(one for one in named if one[1])
    return lanes


@check
def trigger_volumes(c):
    lanes = lanes_in_file(c.map.to_opendrive())
    lights = lights_of(c)
    assert lights
    for light in lights:
        name = light.get_opendrive_id()
        affected = light.get_affected_lane_waypoints()
        assert names(affected) == lanes[name], (name, names(affected), lanes[name])
        stops = light.get_stop_waypoints()
        assert not any(stop.is_junction for stop in stops), name
        driving = [point for point in affected if point.lane_type == carla.LaneType.Driving]
        expected = names(approach(point) for point in driving)
        assert names(stops) == expected, (name, names(stops), expected)
        width = sum(stop.lane_width for stop in stops)
        extent = light.trigger_volume.extent
        assert width - 0.5 < 2.0 * extent.x < width + 0.5, (name, width, extent)
        assert 0.7 < extent.y < 3.0, (name, extent)
        middle = light.get_transform().transform(light.trigger_volume.location)
        ahead = c.map.get_waypoint(middle).transform.get_forward_vector()
        gap = (light.get_location() - middle).dot(ahead)
        assert 2.9 < gap < 3.1, (name, "the volume is not 3 m before the signal", gap)
        assert not c.map.get_waypoint(middle).is_junction, name
        right = light.get_transform().get_forward_vector()
        along = stops[0].transform.get_right_vector()
        assert right.dot(along) > 0.8, (name, "the x axis does not point to the right")
    works("TrafficLight.get_stop_waypoints TrafficSign.trigger_volume",
          "one waypoint on each approach lane, outside the junction, in the volume 3 m before it; "
          "the light's x axis points across the road")
    works("TrafficLight.get_affected_lane_waypoints TrafficLight.get_opendrive_id",
          "the lanes that the map's file names")


@check
def vehicles_at_lights(c):
    c.world.freeze_all_traffic_lights(True)
    for light in list(lights_of(c))[:6]:
        light.set_state(RED)
        for stop in light.get_stop_waypoints():
            place = stop.transform
            place.location.z += 0.3
            car = c.world.try_spawn_actor(c.library.find("vehicle.tesla.model3"), place)
            if car is None:
                continue
            car.apply_control(carla.VehicleControl(hand_brake=True))
            c.ticks(2)
            assert car.is_at_traffic_light(), light.get_opendrive_id()
            assert car.get_traffic_light().id == light.id
            assert car.get_traffic_light_state() == RED
            light.set_state(GREEN)
            c.ticks(2)
            assert not car.is_at_traffic_light() and car.get_traffic_light() is None
            assert car.get_traffic_light_state() == GREEN
            # Inside the junction and beside the lane no light applies.
            light.set_state(RED)
            place.location -= 15.0 * place.get_forward_vector()
            car.set_transform(place)
            c.ticks(2)
            assert not car.is_at_traffic_light(), "15 m before the volume"
            car.destroy()
            c.ticks(1)
    c.world.freeze_all_traffic_lights(False)
    c.world.tick()
    works("Vehicle.is_at_traffic_light Vehicle.get_traffic_light Vehicle.get_traffic_light_state",
          "set for a vehicle in the trigger volume of a light that is not green, and cleared on "
          "green")


@check
def groups_of_lights(c):
    by_junction = {}
    for light in lights_of(c):
        stop = light.get_stop_waypoints()[0]
        for _ in range(80):
            if stop.is_junction:
                break
            stop = stop.next(0.2)[0]
        by_junction.setdefault(stop.get_junction().id, []).append(light)
    assert max(map(len, by_junction.values())) > 2
    for lights in by_junction.values():
        ids = sorted(light.id for light in lights)
        for light in lights:
            group = sorted(one.id for one in light.get_group_traffic_lights())
            assert group == ids, (light.id, group, ids)
        assert sorted(light.get_pole_index() for light in lights) == list(range(len(lights)))
    works("TrafficLight.get_group_traffic_lights TrafficLight.get_pole_index",
          "the group was all lights of the junction, each with its own pole index")


@check
def frozen_lights(c):
    lights = lights_of(c)
    for state in (RED, GREEN, RED):
        # No tick passes between these calls.
        for light in lights:
            light.set_state(state)
        c.world.freeze_all_traffic_lights(True)
        c.ticks(2)
        shown = [light.get_state() for light in lights]
        assert all(one == state for one in shown), (state, shown)
    c.world.freeze_all_traffic_lights(False)
    c.world.tick()


@check
def traffic_lights(c):
    lights = lights_of(c)
    light = lights[0]
    for state in (GREEN, RED):
        light.set_state(state)
        c.ticks(2)
        assert light.get_state() == light.state == state
    c.world.freeze_all_traffic_lights(True)
    c.world.tick()
    before = [one.get_state() for one in lights]
    assert light.is_frozen()
    c.ticks(400)
    assert [one.get_state() for one in lights] == before
    c.world.freeze_all_traffic_lights(False)
    c.world.tick()
    light.freeze(True)
    c.world.tick()
    # CARLA's client asks for all lights.
    assert all(one.is_frozen() for one in lights)
    light.freeze(False)
    c.world.tick()
    assert not any(one.is_frozen() for one in lights)
    changed = False
    for _ in range(1200):
        c.world.tick()
        changed = changed or [one.get_state() for one in lights] != before
    assert changed
    works("TrafficLight.get_state TrafficLight.set_state TrafficLight.state "
          "World.freeze_all_traffic_lights TrafficLight.freeze TrafficLight.is_frozen",
          "lights changed as set, kept their states while frozen, and continued")
    light.set_green_time(7.0)
    light.set_yellow_time(2.5)
    light.set_red_time(9.0)
    c.world.tick()
    assert light.get_green_time() == 7.0
    assert light.get_yellow_time() == 2.5 and light.get_red_time() == 9.0
    differs("TrafficLight.set_green_time TrafficLight.set_yellow_time TrafficLight.set_red_time "
            "TrafficLight.get_green_time TrafficLight.get_yellow_time TrafficLight.get_red_time",
            "how long a state lasts that a client has set; the signal plan is that of this "
            "simulator's traffic")
    assert light.get_light_boxes() and light.get_elapsed_time() >= 0.0
    light.set_red_time(1000.0)
    light.set_state(RED)
    c.ticks(900)
    assert light.get_state() == RED, "not held for its red time"
    light.reset_group()
    c.world.reset_all_traffic_lights()
    greens = 0
    for _ in range(1200):
        c.world.tick()
        greens += light.get_state() == GREEN
    assert greens > 0, "the light was not green in the signal plan"
    works("TrafficLight.get_light_boxes TrafficLight.get_elapsed_time TrafficLight.reset_group "
          "World.reset_all_traffic_lights",
          "the light had a light box, and returned to the signal plan")
