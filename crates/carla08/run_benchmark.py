#!/usr/bin/env python3
"""Drives the CoRL'17 benchmark with an agent that drives straight ahead, and prints its metrics.

The program of CARLA 0.8, with its flags; summary.csv, measurements.csv and metrics.json are written to
_benchmarks_results/<log>_<suite>_<city>/.
"""

import argparse
import logging

from carla08.agent import AutopilotAgent, ForwardAgent
from carla08.driving_benchmark import BasicExperimentSuite, CoRL2017, run_driving_benchmark


def size(text):
    """Parses WIDTHxHEIGHT."""
    return tuple(int(part) for part in text.split("x"))


def main():
    """Parses the flags and runs the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("-v", "--verbose", action="store_true",
                        help="log each episode")
    parser.add_argument("-db", "--debug", action="store_true", help="print debug information")
    parser.add_argument("--host", metavar="H", default="localhost",
                        help="IP of the host server (default: localhost)")
    parser.add_argument("-p", "--port", metavar="P", default=2000, type=int,
                        help="TCP port to listen to (default: 2000)")
    parser.add_argument("-c", "--city-name", metavar="C", default="Town01",
                        help="the town, for the name of the log and the number of cars "
                        "(default: Town01)")
    parser.add_argument("-n", "--log_name", metavar="T", default="test",
                        help="the name of the log (default: test)")
    parser.add_argument("--corl-2017", action="store_true",
                        help="the whole suite, 600 episodes, instead of one of each task")
    parser.add_argument("--continue-experiment", action="store_true",
                        help="continue the log of that name")
    parser.add_argument("--agent", choices=["forward", "autopilot"], default="forward",
                        help="the agent (default: forward)")
    parser.add_argument("--limit", metavar="N", type=int, default=None,
                        help="most episodes to run now")
    parser.add_argument("--size", metavar="WxH", default=None, type=size,
                        help="size of the camera's image (default: 800x600)")
    args = parser.parse_args()
    level = logging.DEBUG if args.debug else logging.INFO if args.verbose else logging.WARNING
    logging.basicConfig(format="%(levelname)s: %(message)s", level=level)
    suite = CoRL2017 if args.corl_2017 else BasicExperimentSuite
    agent = {"forward": ForwardAgent, "autopilot": AutopilotAgent}[args.agent]()
    run_driving_benchmark(
        agent, suite(args.city_name, args.size), args.city_name, args.log_name,
        args.continue_experiment, args.host, args.port, args.limit)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        print("\nCancelled by user; --continue-experiment goes on.")
    except FileExistsError as error:
        raise SystemExit(str(error)) from None
