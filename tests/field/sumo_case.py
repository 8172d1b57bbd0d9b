"""CARLA's co-simulation with SUMO, unmodified: SUMO's vehicles appear and move, CARLA's appear in SUMO.

SUMO comes from the package `eclipse-sumo`. The script runs at the pace of the clock until it is interrupted.
"""

import glob
import os
import signal
import subprocess
import sys
import time

import kit
from kit import carla

HERE = os.path.dirname(os.path.abspath(__file__))


def observe(client, seconds):
    """What a second client sees while the script runs."""
    first, way, most, states, lamps = {}, 0.0, 0, set(), set()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        world = client.get_world()
        actors = world.get_actors()
        vehicles = [a for a in actors if a.type_id.startswith("vehicle.")]
        most = max(most, len(vehicles))
        for vehicle in vehicles:
            at = vehicle.get_location()
            if at.x or at.y:
                way = max(way, at.distance(first.setdefault(vehicle.id, at)))
                lamps.add(int(vehicle.get_light_state()))
        for light in actors.filter("traffic.traffic_light"):
            states.add((light.id, str(light.state)))
        time.sleep(0.2)
    lights = {light for light, _ in states}
    changed = sum(len([s for s in states if s[0] == light]) > 1 for light in lights)
    return most, way, changed, len(lights), len(lamps)


def main():
    port, folder, out, quick = kit.arguments()
    import sumo
    environment = dict(os.environ, SUMO_HOME=sumo.SUMO_HOME)
    environment["PATH"] = os.path.join(sumo.SUMO_HOME, "bin") + os.pathsep + environment["PATH"]
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    there = kit.towns()
    for config in sorted(glob.glob(f"{folder}/examples/*.sumocfg")):
        town = os.path.basename(config).removesuffix(".sumocfg")
        if town not in there:
            kit.report(f"not run, because {town} is not there", None, os.path.basename(config))
            continue
        for manager in ("none", "sumo", "carla"):
            if quick and manager == "sumo":
                continue
            world = client.load_world(town)
            log = open(os.path.join(out, f"sumo-{town}-{manager}.log"), "w", encoding="utf-8")
            script = subprocess.Popen(
                [sys.executable, os.path.join(HERE, "sumo_script.py"), "run_synchronization.py", config, "--carla-port", str(port),
                 "--tls-manager", manager, "--sync-vehicle-all"],
                cwd=folder, env=environment, stdout=log, stderr=subprocess.STDOUT)
            time.sleep(5.0)
            point = world.get_map().get_spawn_points()[0]
            own = world.try_spawn_actor(world.get_blueprint_library().find("vehicle.audi.tt"), point)
            seen = observe(client, 20.0 if quick else 60.0)
            running = script.poll() is None
            script.send_signal(signal.SIGINT)
            try:
                code = script.wait(30.0)
            except subprocess.TimeoutExpired:
                script.kill()
                code = "none: it did not end"
            text = open(log.name, encoding="utf-8").read()
            errors = [line for line in text.splitlines() if "Error" in line or "error" in line]
            if own is not None and own.is_alive:
                own.destroy()
            most, way, changed, lights, lamps = seen
            good = running and most > 3 and way > 30.0 and lamps > 1 and not errors
            if manager == "sumo":
                good = good and changed > 0
            kit.report(f"{town}, lights: {manager}", good,
                       f"{most} vehicles, one moved {way:.0f} m, {changed} of {lights} lights changed, "
                       f"{lamps} lamp states, {'ran until interrupted' if running else f'ended early, exit {code}'}"
                       + (f"; {errors[-1][:160]}" if errors else ""))


main()
kit.end()
