"""The player vehicle and its measurements."""

import logging
import threading

import carla

from . import measurements
from .listening import Listener

# Samples along and across the vehicle's outline, for the fraction off its lane.
ALONG, ACROSS = 7, 5


class Player:
    """A vehicle with a collision sensor."""

    def __init__(self, world, road_map, wanted, spot):
        library = world.get_blueprint_library()
        blueprint = _blueprint(library, wanted)
        blueprint.set_attribute("role_name", "carla08")
        self._map = road_map
        place = carla.Transform(spot.location + carla.Location(z=0.3), spot.rotation)
        self.actor = world.spawn_actor(blueprint, place)
        self._lock = threading.Lock()
        self._collided = {"vehicles": 0.0, "pedestrians": 0.0, "other": 0.0}
        self._box = self.actor.bounding_box
        sensor = world.spawn_actor(
            library.find("sensor.other.collision"), carla.Transform(), attach_to=self.actor)
        self.collisions = Listener(sensor, self._collide)

    def _collide(self, event):
        """Adds an impulse to the sum of its kind of actor."""
        other = event.other_actor.type_id if event.other_actor is not None else ""
        kind = {"vehicle": "vehicles", "walker": "pedestrians"}.get(other.split(".")[0], "other")
        with self._lock:
            self._collided[kind] += event.normal_impulse.length()

    def forget_collisions(self):
        """Resets the sums."""
        with self._lock:
            for kind in self._collided:
                self._collided[kind] = 0.0

    def measure(self, snapshot):
        """Returns the measurements of this frame, without the control of the autopilot."""
        state = snapshot.find(self.actor.id)
        if state is None:
            raise RuntimeError("the player vehicle was destroyed by another client")
        pose, velocity = state.get_transform(), state.get_velocity()
        ahead = pose.get_forward_vector()
        other_lane, off_road = self._strays(pose)
        with self._lock:
            collided = dict(self._collided)
        return measurements.PlayerMeasurements(
            transform=measurements.transform_of(pose),
            bounding_box=measurements.box_of(self._box),
            acceleration=measurements.vector_of(state.get_acceleration()),
            forward_speed=velocity.dot(ahead),
            collision_vehicles=collided["vehicles"],
            collision_pedestrians=collided["pedestrians"],
            collision_other=collided["other"],
            intersection_otherlane=other_lane,
            intersection_offroad=off_road)

    def _strays(self, pose):
        """Returns the fractions of the vehicle's outline in oncoming lanes and off the road."""
        ahead = pose.get_forward_vector()
        other_lane = off_road = 0
        extent = self._box.extent
        drivable = carla.LaneType.Driving | carla.LaneType.Bidirectional | carla.LaneType.Parking
        for i in range(ALONG):
            for j in range(ACROSS):
                point = pose.transform(self._box.location + carla.Location(
                    x=extent.x * (2.0 * i / (ALONG - 1) - 1.0),
                    y=extent.y * (2.0 * j / (ACROSS - 1) - 1.0)))
                lane = self._map.get_waypoint(point, project_to_road=False, lane_type=drivable)
                if lane is None:
                    off_road += 1
                elif not lane.is_junction and lane.lane_type != carla.LaneType.Bidirectional:
                    along = lane.transform.get_forward_vector()
                    other_lane += along.dot(ahead) < -0.2
        return other_lane / (ALONG * ACROSS), off_road / (ALONG * ACROSS)

    def destroy(self):
        """Destroys the vehicle, after its sensors were stopped."""
        self.actor.destroy()


def _blueprint(library, wanted):
    """Returns the blueprint of an asset path of 0.8 or an id; the default is the Mustang."""
    if not wanted:
        return library.find("vehicle.ford.mustang")
    name = str(wanted).rsplit("/", 1)[-1].split(".")[0] if "/" in str(wanted) else str(wanted)
    for blueprint in library.filter("vehicle.*"):
        if blueprint.id == name or name.lower() in blueprint.id.replace("_", "").lower():
            return blueprint
    logging.warning("PlayerVehicle %r is not in the catalogue; using the Mustang", wanted)
    return library.find("vehicle.ford.mustang")
