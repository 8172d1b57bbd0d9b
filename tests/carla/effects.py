"""Calls the official `carla` package against a running simulator and observes what happens.

Usage: effects.py PORT [CHECK…]. Prints one JSON line for each member of the API.
"""

import os
import random
import sys

import effects_kit
import effects_actors
import effects_commands
import effects_cosmos
import effects_events
import effects_lights
import effects_map
import effects_recorder
import effects_scenery
import effects_sensors
import effects_snapshots
import effects_town
import effects_rest
import effects_traffic
import effects_vehicle
import effects_walkers
import effects_world
import ledger
import values_geometry
import values_records
import values_returned

# In this order: later checks use what earlier ones leave, and each one takes spawn points.
CHECKS = [
    effects_world.versions_and_maps,
    effects_world.asynchronous_and_synchronous_mode,
    effects_world.map_queries,
    effects_map.waypoints,
    effects_map.lights_and_signs_of_landmarks,
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
    effects_walkers.friction_triggers,
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
    effects_vehicle.jump_and_ragdoll,
    effects_vehicle.gears_and_yaw,
    effects_actors.unsupported_members,
    effects_scenery.street_lights,
    effects_scenery.debug_drawing,
    values_records.records,
    values_records.containers,
    values_records.documented_only,
    values_geometry.vectors,
    values_geometry.transforms,
    values_geometry.boxes,
    values_geometry.places_and_colours,
    values_returned.settings_are_returned,
    values_returned.weather_is_returned,
    values_returned.controls_are_returned,
    values_returned.physics_is_returned,
    values_returned.ackermann_is_returned,
    values_returned.vehicle_lights_are_returned,
    values_returned.doors,
    effects_snapshots.snapshots,
    effects_snapshots.actors,
    effects_snapshots.failures,
    effects_snapshots.kinds_of_actors,
    effects_snapshots.blueprint_members,
    effects_commands.commands_of_vehicles,
    effects_commands.commands_of_walkers,
    effects_commands.batches_of_commands,
    effects_commands.attachments,
    effects_events.images,
    effects_events.flow_and_events,
    effects_events.points,
    effects_events.events,
    effects_events.radio_messages,
    effects_events.options_of_sensors,
    effects_town.environment_objects,
    effects_town.every_layer,
    effects_town.textures,
    effects_town.lists_of_lights,
    effects_rest.files_of_maps,
    effects_rest.open_street_map,
    effects_rest.wheels,
    effects_rest.states_of_lights,
    effects_rest.walkers_by_themselves,
    effects_rest.traffic_actions,
    effects_traffic.several_managers,
    effects_traffic.hybrid_physics,
    effects_traffic.respawn_of_dormant_vehicles,
    effects_cosmos.cosmos_visualization,
    effects_cosmos.empty_actors,
    effects_world.episodes,
    effects_map.every_lane_and_sign,
    effects_sensors.effects_of_cameras,
    effects_traffic.osm_mode,
]


def main():
    random.seed(1)
    context = effects_kit.Context(int(sys.argv[1]))
    chosen = [one for one in CHECKS if not sys.argv[2:] or one.__name__ in sys.argv[2:]]
    if chosen != CHECKS:
        context.synchronise()
    good = ledger.run(context, chosen)
    sys.stdout.flush()
    # The package sometimes aborts while its threads end.
    os._exit(0 if good else 1)


if __name__ == "__main__":
    main()
