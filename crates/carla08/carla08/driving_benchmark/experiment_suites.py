"""Suites of experiments: tasks, weathers, pairs of start and goal."""

import random

from ..planner import key_of, location
from ..sensor import Camera
from ..settings import CarlaSettings


class Experiment:
    """One task in one weather: pairs of start positions, each driven `Repetitions` times."""

    def __init__(self, **given):
        self.Task, self.TaskName = 0, ""
        self.Conditions = None
        self.Poses = [(1, 1)]
        self.Repetitions = 1
        self.set(**given)

    def set(self, **given):
        """Changes attributes by name; raises ValueError for an unknown name."""
        for name, value in given.items():
            if name not in self.__dict__:
                raise ValueError(f"Experiment: no key named {name!r}")
            setattr(self, name, value)

    task = property(lambda self: self.Task)
    task_name = property(lambda self: self.TaskName)
    conditions = property(lambda self: self.Conditions)
    poses = property(lambda self: self.Poses)
    repetitions = property(lambda self: self.Repetitions)


class ExperimentSuite:
    """Base class of suites; override `build_experiments` and the two lists of weathers."""

    train_weathers = ()
    test_weathers = ()
    collision_as_failure = False

    def __init__(self, city_name):
        self._city_name = city_name
        self._experiments = None

    def get_experiments(self, planner, spots):
        """Returns all experiments; they are built once, since they depend on the map."""
        if self._experiments is None:
            self._experiments = self.build_experiments(planner, spots)
        return self._experiments

    def build_experiments(self, planner, spots):
        """Returns a list of experiments on this map."""
        raise NotImplementedError

    def calculate_time_out(self, path_m):
        """Returns the time limit of a route in seconds: 10 km/h, and ten seconds."""
        return path_m / 1000.0 / 10.0 * 3600.0 + 10.0

    @property
    def metrics_parameters(self):
        """Returns the fraction, or the impulse in kg m/s, that is an infraction, and the number of
        frames after it in which no other one is counted."""
        return {
            "intersection_offroad": {"frames_skip": 10, "frames_recount": 20, "threshold": 0.3},
            "intersection_otherlane": {"frames_skip": 10, "frames_recount": 20, "threshold": 0.4},
            "collision_other": {"frames_skip": 10, "frames_recount": 20, "threshold": 400},
            "collision_vehicles": {"frames_skip": 10, "frames_recount": 30, "threshold": 400},
            "collision_pedestrians": {"frames_skip": 5, "frames_recount": 100, "threshold": 300},
        }


def camera():
    """Returns the camera of the benchmark."""
    mounted = Camera("CameraRGB")
    mounted.set(FOV=100)
    mounted.set_image_size(800, 600)
    mounted.set_position(2.0, 0.0, 1.4)
    mounted.set_rotation(-15.0, 0, 0)
    return mounted


TASKS = ("straight", "one_turn", "navigation", "navigation_dynamic")
PAIRS = 25


class CoRL2017(ExperimentSuite):
    """Four tasks, six weathers, 25 pairs each.

    The pairs of the paper are numbers of start spots in the maps of that time, which no later map
    has. Here they are found on the map that runs, by what the task says: a way without a turn,
    with one, with two or more; always the same for the same map.
    """

    train_weathers = (1, 3, 6, 8)
    test_weathers = (4, 14)

    def __init__(self, city_name, image_size=None):
        super().__init__(city_name)
        self._image_size = image_size

    def build_experiments(self, planner, spots):
        poses = find_poses(planner, spots)
        vehicles = 15 if self._city_name == "Town02" else 20
        experiments = []
        for weather in self.train_weathers + self.test_weathers:
            for task, name in enumerate(TASKS):
                is_dynamic = name == "navigation_dynamic"
                conditions = CarlaSettings()
                conditions.set(
                    SynchronousMode=True,
                    SendNonPlayerAgentsInfo=True,
                    NumberOfVehicles=vehicles if is_dynamic else 0,
                    NumberOfPedestrians=50 if is_dynamic else 0,
                    WeatherId=weather,
                    FixedDeltaSeconds=0.1,
                    SeedVehicles=123456789,
                    SeedPedestrians=123456789)
                mounted = camera()
                if self._image_size is not None:
                    mounted.set_image_size(*self._image_size)
                conditions.add_sensor(mounted)
                experiments.append(Experiment(
                    Conditions=conditions, Poses=poses[min(task, 2)], Task=task, TaskName=name,
                    Repetitions=1))
        return experiments


class BasicExperimentSuite(CoRL2017):
    """One weather, the first pair of each task: a short check."""

    train_weathers = (1,)
    test_weathers = (1,)

    def build_experiments(self, planner, spots):
        found = super().build_experiments(planner, spots)[: len(TASKS)]
        for experiment in found:
            experiment.set(Poses=experiment.poses[:1])
        return found


def find_poses(planner, spots):
    """Returns pairs for no turn, one turn, and two or more turns."""
    chance = random.Random(2017)
    spots = [location(spot) for spot in spots]
    lanes = [key_of(planner.map.get_waypoint(spot)) for spot in spots]
    order = list(range(len(spots)))
    chance.shuffle(order)
    found = ([], [], [])
    for start in order:
        if all(len(pairs) == PAIRS for pairs in found):
            break
        tree = planner.tree(lanes[start])
        goals = list(range(len(spots)))
        chance.shuffle(goals)
        for kind, pairs in enumerate(found):
            shortest = (60.0, 100.0, 200.0)[kind]
            for goal in goals:
                if len(pairs) == PAIRS or lanes[goal] == lanes[start] or lanes[goal] not in tree:
                    continue
                metres, turns, _ = tree[lanes[goal]]
                if min(turns, 2) == kind and shortest < metres < 1500.0 and (
                        spots[goal].distance(spots[start]) > shortest / 2.0):
                    pairs.append((start, goal))
                    break
    return found
