"""carla-birdeye-view: its nine masks around a vehicle in traffic, and the picture."""

import os
import random
import sys

import kit
from kit import carla

import cv2

# The program was written for OpenCV 4.2, in which the module contained itself.
sys.modules["cv2.cv2"] = cv2
cv2.cv2 = cv2


def main():
    port, folder, out, quick = kit.arguments()
    sys.path.insert(0, folder)
    os.chdir(out)
    from carla_birdeye_view import BirdViewMasks, BirdViewProducer
    from carla_birdeye_view.mask import PixelDimensions
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    there = kit.towns()
    for town in [t for t in ("Town01", "Town10HD") if t in there][:1 if quick else 2]:
        world = kit.load(client, town)
        vehicles = kit.spawn_traffic(client, world, 40, random.Random(1))
        library = world.get_blueprint_library()
        for _ in range(20):
            at = world.get_random_location_from_navigation()
            walker = world.try_spawn_actor(library.find("walker.pedestrian.0001"), carla.Transform(at))
            vehicles += [walker] if walker is not None else []
        world.tick()
        producer = BirdViewProducer(client, PixelDimensions(width=300, height=300), pixels_per_meter=4,
                                    render_lanes_on_junctions=False)
        pixels = {mask: 0 for mask in BirdViewMasks}
        for step in range(60):
            for _ in range(20):
                world.tick()
            view = producer.produce(agent_vehicle=vehicles[step % 10])
            for mask in BirdViewMasks:
                pixels[mask] += int((view[:, :, mask] > 0).sum())
        picture = os.path.join(out, f"birdeye-{town}.png")
        cv2.imwrite(picture, BirdViewProducer.as_rgb(view)[:, :, ::-1])
        empty = [mask.name for mask, count in pixels.items() if count == 0]
        kit.report(town, not empty, ", ".join(f"{m.name.lower()} {n / 60:.0f}" for m, n in pixels.items())
                   + " pixels per view" + (f"; empty: {', '.join(empty)}" if empty else ""))
        kit.destroy(client, vehicles)


main()
kit.end()
