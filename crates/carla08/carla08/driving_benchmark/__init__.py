"""The benchmark of the paper "CARLA: An Open Urban Driving Simulator" (CoRL 2017)."""

from .driving_benchmark import DrivingBenchmark, run_driving_benchmark
from .experiment_suites import BasicExperimentSuite, CoRL2017, Experiment, ExperimentSuite

__all__ = ["BasicExperimentSuite", "CoRL2017", "DrivingBenchmark", "Experiment",
           "ExperimentSuite", "run_driving_benchmark"]
