"""Runs the episodes of a suite with an agent, and records them."""

import logging

from ..client import make_carla_client
from ..planner import Planner, length_m, location
from ..settings import CarlaSettings
from ..util import retry_until_served
from . import metrics
from .recording import Recording

# Metres from the goal at which an episode is a success.
SUCCESS_M = 2.0


class DrivingBenchmark:
    """One run; `continue_experiment` continues an earlier one."""

    def __init__(self, city_name="Town01", name_to_save="Test", continue_experiment=False,
                 limit=None, distance_for_success=SUCCESS_M):
        self._city_name, self._name = city_name, name_to_save
        self._limit, self._success_m = limit, distance_for_success
        self._continue = continue_experiment

    def benchmark_agent(self, suite, agent, client):
        """Runs the remaining episodes; returns the metrics."""
        name = f"{self._name}_{type(suite).__name__}_{self._city_name}"
        recording = Recording(name, self._continue)
        # The run continues after the server was restarted.
        self._continue = True
        planner = Planner(client.map)
        scene = client.load_settings(CarlaSettings())
        if scene.map_name != self._city_name:
            logging.warning("the map is %s, the log is named after %s",
                            scene.map_name, self._city_name)
        spots = scene.player_start_spots
        experiments = suite.get_experiments(planner, spots)
        done, driven = recording.done(), 0
        for ident, experiment, pair, rep in _episodes(experiments):
            key = (ident, rep, experiment.conditions.WeatherId, *pair)
            if key in done:
                continue
            if self._limit is not None and driven >= self._limit:
                break
            client.load_settings(experiment.conditions)
            summary, frames = self._drive(
                suite, agent, client, planner, spots, experiment, pair)
            named = dict(zip(("exp_id", "rep", "weather", "start_point", "end_point"), key))
            recording.write({**named, **summary}, [{**named, **frame} for frame in frames])
            driven += 1
            logging.info("%s, weather %d, %d to %d: %s after %.1f of %.1f s, %.1f of %.1f m left",
                         experiment.task_name, key[2], *pair,
                         "success" if summary["result"] else "failure", summary["final_time"],
                         summary["time_out"], summary["final_distance"],
                         summary["initial_distance"])
        result = metrics.compute(suite.metrics_parameters, experiments,
                                 recording.summary(), recording.measurements())
        recording.write_metrics(result)
        return result, recording.folder

    def _drive(self, suite, agent, client, planner, spots, experiment, pair):
        start, goal = spots[pair[0]], spots[pair[1]]
        route = planner.route(location(start), location(goal))
        time_out = suite.calculate_time_out(length_m(route))
        client.start_episode(pair[0])
        client.autopilot.follow(route)
        agent.reset()
        target = location(goal)
        frames, initial, success = [], location(start).distance(target), False
        while True:
            measurements, sensor_data = client.read_data()
            player = measurements.player_measurements
            at = location(player.transform)
            # In the plane: a start position is above the road.
            at.z = target.z
            distance = at.distance(target)
            seconds = measurements.game_timestamp / 1000.0
            directions = planner.command(route, at)
            control = agent.run_step(measurements, sensor_data, directions, goal)
            client.send_control(control)
            frames.append(_frame(measurements, control))
            success = distance < self._success_m
            crashed = suite.collision_as_failure and frames[-1]["collision_vehicles"] > 0
            if success or crashed or seconds > time_out:
                break
        return {
            "result": int(success), "initial_distance": initial, "final_distance": distance,
            "final_time": min(seconds, time_out), "time_out": time_out}, frames


def _episodes(experiments):
    for ident, experiment in enumerate(experiments):
        for pair in experiment.poses:
            for rep in range(experiment.repetitions):
                yield ident, experiment, pair, rep


def _frame(measurements, control):
    player = measurements.player_measurements
    return {
        "collision_other": player.collision_other,
        "collision_pedestrians": player.collision_pedestrians,
        "collision_vehicles": player.collision_vehicles,
        "intersection_otherlane": player.intersection_otherlane,
        "intersection_offroad": player.intersection_offroad,
        "pos_x": player.transform.location.x, "pos_y": player.transform.location.y,
        "steer": control.steer, "throttle": control.throttle, "brake": control.brake,
        "forward_speed": player.forward_speed, "game_timestamp": measurements.game_timestamp}


def run_driving_benchmark(agent, experiment_suite, city_name="Town01", log_name="Test",
                          continue_experiment=False, host="127.0.0.1", port=2000, limit=None):
    """Runs a benchmark, and continues it after the server was restarted; prints and returns the
    metrics."""
    benchmark = DrivingBenchmark(city_name, log_name, continue_experiment, limit)

    def work():
        with make_carla_client(host, port) as client:
            return benchmark.benchmark_agent(experiment_suite, agent, client)

    result, folder = retry_until_served(work, logging)
    print(metrics.summary_text(result))
    print(f"written to {folder}")
    return result
