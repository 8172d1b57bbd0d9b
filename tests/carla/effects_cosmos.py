"""Checks of the Cosmos visualization, and of actors without a body."""

import carla
import numpy as np

from effects_kit import TIMEOUT, of_frame, pixels
from ledger import check, differs, works


def shown_at(image, location):
    """Returns where an image with a field of view of 90 degrees shows a place: column and row."""
    x, y, z, _ = np.dot(image.transform.get_inverse_matrix(),
                        [location.x, location.y, location.z, 1.0])
    focal = image.width / 2
    return focal + focal * y / x, image.height / 2 - focal * z / x


@check
def cosmos_visualization(c):
    lane, vehicle = (71, 134, 183), (255, 0, 0)
    palette = {(0, 0, 0), (0, 255, 0), (202, 132, 58), (58, 4, 124), (109, 144, 136),
               (214, 144, 137), lane, vehicle}
    car = c.car()
    behind = carla.Transform(carla.Location(x=-9.0, z=4.0), carla.Rotation(pitch=-12.0))
    camera, measured = c.sensor("sensor.camera.cosmos_visualization", car, behind,
                                image_size_x=640, image_size_y=480)
    for _ in range(3):
        frame = c.world.tick()
        image = measured.get(timeout=TIMEOUT)
        assert image.frame == frame and image.fov == 90.0
    colours = pixels(image)[:, :, 2::-1]
    assert {tuple(one) for one in colours.reshape(-1, 3).tolist()} <= palette
    assert (colours == 0).all(axis=2).mean() > 0.5 and (pixels(image)[:, :, 3] == 255).all()

    def is_shown(location, colour):
        u, v = shown_at(image, location)
        near_by = colours[max(int(v) - 1, 0):int(v) + 2, max(int(u) - 1, 0):int(u) + 2]
        return (near_by == colour).all(axis=2).any()

    corners = car.bounding_box.get_world_vertices(car.get_transform())
    assert all(is_shown(corner, vehicle) for corner in corners)
    ahead = [c.map.get_waypoint(car.get_location()).next(float(metres)) for metres in range(6, 30, 2)]
    ahead = [one[0].transform.location for one in ahead if one and not one[0].is_junction]
    assert sum(is_shown(one, lane) for one in ahead) > len(ahead) / 2 > 0
    differs("sensor.camera.cosmos_visualization",
            "boxes of vehicles, walkers, traffic lights and signs, poles, lanes, stop lines and "
            "crosswalks in CARLA's colours on black; lanes are the middles of driving lanes outside "
            "of junctions, and trucks are red, which have no colour of their own in CARLA")
    camera.destroy()
    car.destroy()


@check
def empty_actors(c):
    place = carla.Transform(carla.Location(x=3.0, y=4.0, z=20.0))
    empty = c.world.spawn_actor(c.library.find("util.actor.empty"), place)
    camera = c.sensor("sensor.camera.depth", empty, carla.Transform(),
                      image_size_x=32, image_size_y=32)
    for _ in range(2):
        frame = c.ticks(3)
        assert of_frame(camera[1], frame).transform.location.distance(place.location) < 0.01
        place.location.x += 5.0
        empty.set_transform(place)
    works("util.actor.empty", "a camera on it was where it was, and moved with it")
    camera[0].destroy()
    empty.destroy()
    c.ticks(1)
