"""Radars: random directions, and the cells of a receiver, of a car that drives away."""

import math
import pickle

import numpy as np
from kit import launch

import omnibus
from omnibus.sensors import Camera, Radar, RadarReceiver

POINTS = 400
DETECTION = ["velocity_mps", "azimuth_rad", "altitude_rad", "depth_m", "instance", "tag"]
TARGET = [*DETECTION, "power_dbm", "snr_db", "cross_section_dbsm", "is_ghost"]


def behind(pose: omnibus.Pose) -> omnibus.Pose:
    """Returns a pose 20 m behind a car, above the road."""
    x, y, z = pose.position_m
    _, _, turn, real = pose.rotation_xyzw
    ahead = (1 - 2 * turn * turn, 2 * real * turn)
    place = (x - 20 * ahead[0], y - 20 * ahead[1], z + 0.3)
    return omnibus.Pose(place, pose.rotation_xyzw)


def a_car_that_drives_away_is_detected() -> None:
    with launch() as simulator:
        client = simulator.client
        place = client.map.spawn_points[0]
        car = client.spawn("vehicle.tesla.model3", place)
        field = {"horizontal_fov_rad": 0.5, "vertical_fov_rad": 0.2, "points": POINTS, "seed": 3}
        pose = behind(place)
        sensors = [
            Radar("plain", pose=pose, **field),
            Radar("cells", pose=pose, receiver=RadarReceiver(), **field),
            Radar("deaf", pose=pose, receiver=RadarReceiver(snr_min_db=60.0), **field),
            Camera("eye", 32, 24),
        ]
        client.create_bundle("ears", sensors)
        client.tick()
        client.control(car, throttle=1.0)
        for frame in client.ticks(40):
            pass
        actor = frame.world.actor(car)
        _, _, turn, real = place.rotation_xyzw
        ahead = np.array([1 - 2 * turn * turn, 2 * real * turn, 0.0])
        speed = float(actor["velocity_mps"] @ ahead)
        assert speed > 2.0, speed

        found = frame["plain"].detections(frame.world)
        assert list(found.dtype.names or ()) == DETECTION
        assert 50 < len(found) <= POINTS and not found.flags.writeable
        along = np.cos(found["azimuth_rad"]) * np.cos(found["altitude_rad"])
        on_car = found["instance"] == car
        assert on_car.any() and not on_car.all()
        assert np.abs(found["velocity_mps"] - speed * along)[on_car].max() < 0.1 * speed
        assert not found["velocity_mps"][~on_car].any(), "what rests"
        assert (np.abs(found["azimuth_rad"]) < 0.26).all()
        # The same seed has the same directions, whatever the receiver.
        assert (frame["cells"].detections(frame.world) == found).all()

        cells = frame["cells"].targets(frame.world)
        assert list(cells.dtype.names or ()) == TARGET
        wave_db = 20 * math.log10(299_792_458 / 77e9)
        due = 62 + wave_db + cells["cross_section_dbsm"] - 30 * math.log10(4 * math.pi)
        due -= 40 * np.log10(cells["depth_m"])
        assert np.abs(cells["power_dbm"] - due).max() < 0.02, "the radar equation"
        assert np.abs(cells["snr_db"] - cells["power_dbm"] - 120).max() < 1e-3
        assert cells["snr_db"].min() >= 13 and not cells["is_ghost"].any()
        mine = cells[cells["instance"] == car]
        assert len(mine) and np.abs(mine["velocity_mps"] - speed).max() < 0.1 * speed
        assert mine["snr_db"].max() > 30, mine
        deaf = frame["deaf"].targets(frame.world)
        assert len(deaf) < len(cells) and (deaf["snr_db"] >= 60).all()
        assert frame["cells"].points.shape == (114, 45, 4)

        # A pickled frame detects the same.
        again = pickle.loads(pickle.dumps(frame))
        assert (again["cells"].targets(again.world) == cells).all()
        assert (frame.measurements["ears"].copy()["cells"].targets(frame.world) == cells).all()

        def fails(kind: type[Exception], said: str, work: object) -> None:
            try:
                work()
            except kind as error:
                assert said in str(error), error
            else:
                raise AssertionError(said)

        world = client.tick().world
        fails(ValueError, "use both of one tick", lambda: frame["plain"].detections(world))
        fails(AttributeError, "has no receiver", lambda: frame["plain"].targets(frame.world))
        fails(AttributeError, "is no radar", lambda: frame["eye"].detections(frame.world))
        for wrong, said in (
            (Radar("x", horizontal_fov_rad=4.0), "field of view is 4"),
            (Radar("x", receiver=RadarReceiver(cell=(0.0, 1.0, 1.0))), "distance of a cell is 0"),
            (Radar("x", receiver=7), "is no receiver"),
        ):
            fails(ValueError, said, lambda wrong=wrong: client.create_bundle("x", [wrong]))


a_car_that_drives_away_is_detected()
