"""Checks of the recorder and the replayer."""

import os
import shutil

import carla

from effects_kit import near
from ledger import check, differs, works


@check
def recorder(c):
    name = f"effects-{os.getpid()}/run.log"
    assert "not found" in c.client.show_recorder_file_info(name, False)
    car = c.car(role_name="hero")
    plain, name = name, c.client.start_recorder(name, True)
    assert os.path.isabs(name) and name.endswith(plain), name
    folder = os.path.dirname(name)
    car.set_autopilot(True)
    way = []
    for _ in range(60):
        c.world.tick()
        way.append(car.get_location())
    c.client.stop_recorder()
    c.world.tick()
    works("Client.start_recorder Client.stop_recorder",
          "the file was written at the path that the call returned")
    data = c.client.show_recorder_file_info(name, True)
    assert f"Create {car.id}: vehicle.tesla.model3 (1) at (" in data, data[:400]
    assert "role_name = hero" in data and "Frames: 61" in data or "Frames: 60" in data, data[-200:]
    assert data.count(" Positions: ") in (60, 61)
    works("Client.show_recorder_file_info",
          "the vehicle, its role and every frame were listed in CARLA's format")
    assert "Actor 1" in c.client.show_recorder_collisions(name, "h", "a")
    works("Client.show_recorder_collisions", "the table had CARLA's format")
    assert "Duration" in c.client.show_recorder_actors_blocked(name, 0.05, 10000.0)
    works("Client.show_recorder_actors_blocked", "the table had CARLA's format")
    gone = car.id
    car.destroy()
    c.world.tick()

    before = {one.id for one in c.world.get_actors().filter("vehicle.*")}
    c.client.set_replayer_time_factor(2.0)
    text = c.client.replay_file(name, 0.0, 0.0, gone)
    assert "Total time recorded" in text, text
    c.ticks(2)
    came = {one.id for one in c.world.get_actors().filter("vehicle.*")} - before
    assert came == {gone}, (came, gone)
    again = c.world.get_actor(gone)
    c.ticks(18)
    where = again.get_location()
    nearest = min(range(60), key=lambda i: way[i].distance(where))
    assert way[nearest].distance(where) < 0.05 and 35 <= nearest <= 42, nearest
    spectator = c.world.get_spectator().get_transform()
    near(spectator.location.distance(where), (10.0 ** 2 + 5.0 ** 2) ** 0.5, 0.5)
    near(spectator.rotation.pitch, again.get_transform().rotation.pitch - 25.0, 1.0)
    works("Client.replay_file", "the vehicle followed its recorded path, the spectator behind it")
    differs("Client.set_replayer_time_factor", "the factor applies from the next replay on")
    c.client.stop_replayer(False)
    c.ticks(2)
    assert gone not in [one.id for one in c.world.get_actors()]
    works("Client.stop_replayer", "the replayed vehicle was destroyed")
    c.client.set_replayer_time_factor(1.0)
    c.client.set_replayer_ignore_hero(True)
    c.client.replay_file(name, 0.0, 0.0, 0)
    c.ticks(3)
    assert {one.id for one in c.world.get_actors().filter("vehicle.*")} == before
    works("Client.set_replayer_ignore_hero", "the hero was not replayed")
    c.client.stop_replayer(False)
    c.client.set_replayer_ignore_hero(False)
    c.client.set_replayer_ignore_spectator(True)
    differs("Client.set_replayer_ignore_spectator", "accepted; the spectator is never recorded")
    shutil.rmtree(folder)
