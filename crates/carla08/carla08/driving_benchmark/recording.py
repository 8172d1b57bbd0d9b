"""The tables of a run, and the episode at which to continue it."""

import csv
import json
import os

SUMMARY = ("exp_id", "rep", "weather", "start_point", "end_point", "result", "initial_distance",
           "final_distance", "final_time", "time_out")
MEASUREMENTS = ("exp_id", "rep", "weather", "start_point", "end_point", "collision_other",
                "collision_pedestrians", "collision_vehicles", "intersection_otherlane",
                "intersection_offroad", "pos_x", "pos_y", "steer", "throttle", "brake",
                "forward_speed", "game_timestamp")


class Recording:
    """The folder of one run: summary.csv, measurements.csv, metrics.json."""

    def __init__(self, name, continue_experiment, root="_benchmarks_results"):
        self.folder = os.path.join(root, name)
        self._summary = os.path.join(self.folder, "summary.csv")
        self._measurements = os.path.join(self.folder, "measurements.csv")
        if os.path.exists(self._summary) and not continue_experiment:
            raise FileExistsError(
                f"{self.folder} holds an earlier run; --continue-experiment goes on with it, "
                "another --log_name begins a new one")
        os.makedirs(self.folder, exist_ok=True)
        for path, names in ((self._summary, SUMMARY), (self._measurements, MEASUREMENTS)):
            if not os.path.exists(path):
                with open(path, "w", newline="", encoding="utf-8") as file:
                    csv.writer(file).writerow(names)
        self._drop_unfinished()

    def summary(self):
        """One row for each episode."""
        return _rows(self._summary)

    def measurements(self):
        """One row for each frame."""
        return _rows(self._measurements)

    def done(self):
        """Returns the episodes that are complete."""
        return {_episode(row) for row in self.summary()}

    def write(self, summary, frames):
        """Writes an episode, its frames first: a row of the summary means that it is complete."""
        _append(self._measurements, MEASUREMENTS, frames)
        _append(self._summary, SUMMARY, [summary])

    def write_metrics(self, metrics):
        """Writes the metrics."""
        with open(os.path.join(self.folder, "metrics.json"), "w", encoding="utf-8") as file:
            json.dump(metrics, file, indent=2, sort_keys=True)

    def _drop_unfinished(self):
        """Removes the frames of an incomplete episode."""
        done, rows = self.done(), self.measurements()
        kept = [row for row in rows if _episode(row) in done]
        if len(kept) < len(rows):
            with open(self._measurements, "w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerow(MEASUREMENTS)
            _append(self._measurements, MEASUREMENTS, kept)


def _episode(row):
    return tuple(int(row[n]) for n in ("exp_id", "rep", "weather", "start_point", "end_point"))


def _rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if None not in row.values()]


def _append(path, names, rows):
    with open(path, "a", newline="", encoding="utf-8") as file:
        csv.DictWriter(file, names).writerows(rows)
