"""The metrics of the paper, computed from the two tables."""

import collections

COUNTED = ("intersection_offroad", "intersection_otherlane", "collision_other",
           "collision_vehicles", "collision_pedestrians")


def compute(parameters, experiments, summary, measurements):
    """Returns metrics by weather and task."""
    names = {i: e.task_name for i, e in enumerate(experiments)}
    frames = collections.defaultdict(list)
    for row in measurements:
        frames[_episode(row)].append(row)
    episodes = collections.defaultdict(list)
    for row in summary:
        episodes[(row["weather"], names[int(row["exp_id"])])].append(row)
    result = collections.defaultdict(dict)
    for (weather, task), rows in episodes.items():
        result[weather][task] = _figures(parameters, rows, frames)
    return dict(result)


def _figures(parameters, rows, frames):
    seconds, metres = 0.0, 0.0
    counts = dict.fromkeys(COUNTED, 0)
    completion = 0.0
    for row in rows:
        driven = frames[_episode(row)]
        seconds += float(row["final_time"])
        metres += _metres(driven)
        far = float(row["initial_distance"])
        completion += 1.0 - float(row["final_distance"]) / far if far > 0.0 else 1.0
        for name in COUNTED:
            values = [float(frame[name]) for frame in driven]
            count = _onsets if name.startswith("intersection") else _jumps
            counts[name] += count(values, **parameters[name])
    km = metres / 1000.0
    figures = {
        "episodes": len(rows),
        "episodes_fully_completed": sum(int(row["result"]) for row in rows) / len(rows),
        "episodes_completion": completion / len(rows),
        "driven_kilometers": km,
        "average_speed": km / (seconds / 3600.0) if seconds > 0.0 else 0.0,
    }
    for name in COUNTED:
        figures[name] = counts[name]
        # Kilometres between two infractions; without any, at least the driven distance.
        figures[f"km_between_{name}"] = km / max(counts[name], 1)
    return figures


def _onsets(values, threshold, frames_skip, frames_recount):
    """Counts how often a fraction exceeds the threshold, again after each interval in which it
    stays above."""
    count, quiet_until, since = 0, 0, None
    for i, value in enumerate(values):
        if value <= threshold:
            since = None
            continue
        is_new = since is None and i >= quiet_until
        is_again = since is not None and i - since >= frames_recount
        if is_new or is_again:
            count += 1
            quiet_until = i + frames_skip
        if since is None or is_again:
            since = i
    return count


def _jumps(values, threshold, frames_skip, frames_recount):
    """Counts how often a sum of impulses grows by more than the threshold within a few frames."""
    count, quiet_until = 0, 0
    for i in range(1, len(values)):
        if i >= quiet_until and values[i] - values[max(i - frames_skip, 0)] > threshold:
            count += 1
            quiet_until = i + frames_recount
    return count


def _metres(driven):
    points = [(float(row["pos_x"]), float(row["pos_y"])) for row in driven]
    return sum(((x - a) ** 2 + (y - b) ** 2) ** 0.5
               for (a, b), (x, y) in zip(points, points[1:]))


def _episode(row):
    return tuple(row[n] for n in ("exp_id", "rep", "weather", "start_point", "end_point"))


def summary_text(result):
    """Returns the metrics as text."""
    lines = []
    for weather in sorted(result, key=int):
        lines.append(f"Weather {weather}")
        for task, figures in result[weather].items():
            lines.append(
                f"  {task:<20} {figures['episodes']:>3} episodes, "
                f"{100 * figures['episodes_fully_completed']:5.1f} % completed, "
                f"{100 * figures['episodes_completion']:6.1f} % of the way, "
                f"{figures['driven_kilometers']:.2f} km at {figures['average_speed']:.1f} km/h")
            lines.append("    infractions: " + ", ".join(
                f"{name.split('_', 1)[1] if name.startswith('inter') else name} {figures[name]}"
                for name in COUNTED))
    return "\n".join(lines)
