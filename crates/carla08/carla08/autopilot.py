"""The autopilot's control, which the server of 0.8 sent with every frame.

It follows its lane (or a route that it is given), keeps the limit, slows in bends, stops for
actors in its way and for red lights. It does not drive the vehicle: the client sends the control.
"""

import math
import random

import carla

from .measurements import Control

STEP_M = 2.0
AHEAD_M = 60.0
# The largest speed of 0.8's autopilot, whatever the road allows.
CRUISE_MPS = 30.0 / 3.6
# Comfortable lateral and longitudinal accelerations.
LATERAL_MPS2, BRAKING_MPS2 = 2.0, 3.0
# The largest wheel angle before it has been estimated.
STEER_MAX_RAD = math.radians(35.0)


class Autopilot:
    """Computes a control from the states of the player vehicle and other actors."""

    def __init__(self, road_map, actor, seed):
        self._map, self._actor = road_map, actor
        self._chance = random.Random(seed)
        self._path = []
        self._route = None
        extent = actor.bounding_box.extent
        self._half_length, self._half_width = extent.x, extent.y
        self._steer_max = STEER_MAX_RAD

    def follow(self, route):
        """Sets a route of waypoints 2 m apart; the vehicle stops at the last one."""
        self._route = list(route)
        self._path = []

    def control(self, player, others):
        """Returns the control of this frame."""
        at = carla.Location(player.transform.location.x, player.transform.location.y,
                            player.transform.location.z)
        self._look_ahead(at)
        if len(self._path) < 2:
            return Control(brake=1.0)
        speed = player.forward_speed
        target = self._speed(player, others)
        steer = self._steer(player, at, speed)
        change = target - speed
        throttle = min(max(0.35 * change + 0.05 * target, 0.0), 0.75)
        brake = min(max(-0.35 * change, 0.0), 1.0) if change < -0.3 else 0.0
        if target < 0.1:
            throttle, brake = 0.0, max(brake, 0.5)
        return Control(steer=steer, throttle=0.0 if brake else throttle, brake=brake)

    def _look_ahead(self, at):
        """Updates the path of points from the vehicle to some distance ahead."""
        while len(self._path) > 1 and (
                self._path[1].transform.location.distance(at)
                <= self._path[0].transform.location.distance(at)):
            self._path.pop(0)
        if self._path and self._path[0].transform.location.distance(at) > 6.0:
            self._path = []
        if self._route is not None:
            if not self._path:
                near = min(range(len(self._route)), default=0,
                           key=lambda i: self._route[i].transform.location.distance(at))
                self._route = self._route[near:]
            while self._route and len(self._path) * STEP_M < AHEAD_M:
                self._path.append(self._route.pop(0))
            return
        if not self._path:
            self._path = [self._map.get_waypoint(at)]
        while len(self._path) * STEP_M < AHEAD_M:
            ways = self._path[-1].next(STEP_M)
            if not ways:
                break
            self._path.append(ways[0] if len(ways) == 1 else self._chance.choice(ways))

    def _steer(self, player, at, speed):
        """Returns the steering of pure pursuit from the rear axle."""
        reach = min(max(4.0, 0.7 * speed + 2.0), 14.0)
        goal = self._path[-1].transform.location
        for point in self._path:
            if point.transform.location.distance(at) >= reach:
                goal = point.transform.location
                break
        yaw = math.radians(player.transform.rotation.yaw)
        dx, dy = goal.x - at.x, goal.y - at.y
        x = dx * math.cos(yaw) + dy * math.sin(yaw) + 0.6 * self._half_length
        y = -dx * math.sin(yaw) + dy * math.cos(yaw)
        square = max(x * x + y * y, 1.0)
        bend = 2.0 * y / square
        angle = math.atan(bend * 1.25 * self._half_length)
        self._learn_steering()
        return min(max(angle / self._steer_max, -1.0), 1.0)

    def _learn_steering(self):
        """Estimates the largest wheel angle from the sent and the measured steering."""
        sent = self._actor.get_control().steer
        if abs(sent) > 0.1:
            turned = math.radians(
                self._actor.get_wheel_steer_angle(carla.VehicleWheelLocation.FL_Wheel))
            shown = min(max(turned / sent, math.radians(20.0)), math.radians(80.0))
            self._steer_max += 0.05 * (shown - self._steer_max)

    def _speed(self, player, others):
        """Returns the target speed: cruising, in bends, behind actors, before traffic lights."""
        limit = self._actor.get_speed_limit() / 3.6
        target = min(CRUISE_MPS, limit if limit > 1.0 else CRUISE_MPS)
        points = [point.transform for point in self._path]
        for i in range(len(points) - 2):
            turn = math.radians(points[i + 2].rotation.yaw - points[i].rotation.yaw)
            bend = abs(math.atan2(math.sin(turn), math.cos(turn))) / (2.0 * STEP_M)
            if bend > 0.01:
                within = math.sqrt(LATERAL_MPS2 / bend)
                target = min(target, math.sqrt(within**2 + 2.0 * BRAKING_MPS2 * STEP_M * i))
        room = self._room(player, points, others)
        if self._route is not None and not self._route:
            room = min(room, (len(points) - 1) * STEP_M)
        if self._actor.is_at_traffic_light():
            state = self._actor.get_traffic_light_state()
            if state in (carla.TrafficLightState.Red, carla.TrafficLightState.Yellow):
                room = 0.0
        return min(target, math.sqrt(2.0 * BRAKING_MPS2 * max(room, 0.0)))

    def _room(self, player, points, others):
        """Returns the length of free path ahead of the bumper in metres."""
        at = player.transform.location
        room = AHEAD_M
        for other in others:
            pose = other.get_transform()
            if abs(pose.location.x - at.x) + abs(pose.location.y - at.y) > 1.5 * AHEAD_M:
                continue
            for i, point in enumerate(points):
                offset = pose.location - point.location
                if abs(offset.z) < 3.0 and math.hypot(offset.x, offset.y) < self._half_width + 1.3:
                    if i * STEP_M > self._half_length:
                        room = min(room, i * STEP_M - 2.0 * self._half_length - 3.0)
                    break
        return room
