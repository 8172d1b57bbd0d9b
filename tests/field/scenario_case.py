"""One scenario of scenario_runner in a process of its own.

scenario_runner expects a person at the keyboard for scenarios that are not routes, and refuses an agent on
its command line; its classes take one all the same, and `ego_agent.py` is it. Usage: scenario_case.py PORT
FOLDER OUT NAME, where NAME is the name of a scenario or the path of an OpenSCENARIO file.
"""

import argparse
import os
import random
import re
import sys

import kit

HERE = os.path.dirname(os.path.abspath(__file__))


def main():
    port, folder, out, name = sys.argv[1:5]
    sys.path[:0] = [folder, HERE]
    os.environ["SCENARIO_RUNNER_ROOT"] = folder
    os.chdir(folder)
    # The file of results of an OpenSCENARIO 2 scenario has the path of the scenario within `out`.
    os.makedirs(os.path.join(out, os.path.dirname(name)), exist_ok=True)
    random.seed(0)
    import scenario_runner as runner
    xosc, osc = name.endswith(".xosc"), name.endswith(".osc")
    # An ego vehicle with a controller of its own needs no agent.
    driven = not osc and (not xosc or "external_control" in open(name, encoding="utf-8").read())
    turn = re.search(r"(?i)turning(left|right)_|(left|right)turn_|(NoSignalJunction|RunningRedLight)", name)
    way = next((part.lower() for part in turn.groups()[:2] if part), "straight") if turn else ""
    options = argparse.Namespace(
        host="127.0.0.1", port=port, timeout="60.0", trafficManagerPort="8000",
        trafficManagerSeed="0", sync=True, list=False, frameRate=20.0,
        scenario=None if xosc or osc else name, openscenario=name if xosc else None,
        openscenarioparams=None, openscenario2=name if osc else None, route=None, route_id="",
        agent=os.path.join(HERE, "ego_agent.py") if driven else None,
        agentConfig=way,
        output=True, file=False, junit=False, json=True, outputDir=out, configFile="",
        additionalScenario="", debug=False, reloadWorld=True, record="", randomize=False,
        repetitions=1, waitForEgo=False)
    scenarios = runner.ScenarioRunner(options)
    ran = scenarios.run()
    sys.stdout.flush()
    # The package sometimes aborts while its threads end.
    os._exit(0 if ran else 1)


main()
