"""Calls the official `carla` package against a running simulator and observes what happens.

Usage: effects.py PORT. Prints one JSON line for each member of the API.
"""

import os
import random
import sys

import effects_kit
import effects_actors
import effects_lights
import effects_recorder
import effects_scenery
import effects_sensors
import effects_traffic
import effects_vehicle
import effects_walkers
import effects_world
import ledger

# In this order: later checks use what earlier ones leave, and each one takes spawn points.
CHECKS = [
    effects_world.versions_and_maps,
    effects_world.asynchronous_and_synchronous_mode,
    effects_world.map_queries,
    effects_world.blueprints,
    effects_actors.spawn_and_destroy,
    effects_actors.vehicle_control,
    effects_actors.teleport_and_velocity,
    effects_actors.simulate_physics,
    effects_traffic.traffic_manager_parameters,
    effects_traffic.traffic_manager_routes,
    effects_traffic.autopilot,
    effects_actors.batches,
    effects_sensors.cameras,
    effects_sensors.lidars_and_radar,
    effects_sensors.physics_sensors,
    effects_sensors.radios,
    effects_sensors.lane_invasion,
    effects_walkers.walker_control_and_bones,
    effects_walkers.walker_poses,
    effects_walkers.hit_walkers,
    effects_walkers.controlled_walkers_die,
    effects_walkers.props_on_the_road,
    effects_lights.trigger_volumes,
    effects_lights.vehicles_at_lights,
    effects_lights.groups_of_lights,
    effects_lights.frozen_lights,
    effects_lights.traffic_lights,
    effects_scenery.weather,
    effects_world.spectator_and_rays,
    effects_scenery.layers_and_objects,
    effects_recorder.recorder,
    effects_sensors.normals_flow_and_events,
    effects_sensors.gbuffer_textures,
    effects_vehicle.physics_control,
    effects_vehicle.ackermann_control,
    effects_vehicle.forces_gravity_and_collisions,
    effects_vehicle.telemetry,
    effects_vehicle.gears_and_yaw,
    effects_vehicle.jump_and_ragdoll,
    effects_actors.unsupported_members,
    effects_scenery.street_lights,
    effects_scenery.debug_drawing,
    effects_world.episodes,
]


def main():
    random.seed(1)
    context = effects_kit.Context(int(sys.argv[1]))
    good = ledger.run(context, CHECKS)
    sys.stdout.flush()
    # The package sometimes aborts while its threads end.
    os._exit(0 if good else 1)


if __name__ == "__main__":
    main()
