"""Checks of the objects of the town, their tags and layers, textures, and street lights."""

import carla
import numpy as np

from effects_kit import near, of_frame, pixels
from ledger import check, differs, ignored, local, refuses, works

LABELS = carla.CityObjectLabel


@check
def environment_objects(c):
    objects = c.world.get_environment_objects()
    assert len({one.id for one in objects}) == len(objects) > 100
    assert sorted(one.name for one in objects) == sorted(c.world.get_names_of_all_objects())
    for one in objects:
        # Boxes are in the world, at the place of the object.
        assert one.bounding_box.location.distance(one.transform.location) < 1e-3
        assert one.bounding_box.extent.z > 0.0 and one.type != LABELS.Any
    text = str(objects[0])
    assert text.startswith(f"Mesh(id={objects[0].id}, name={objects[0].name}, transform="), text
    works("EnvironmentObject.id EnvironmentObject.name EnvironmentObject.transform "
          "EnvironmentObject.bounding_box EnvironmentObject.type EnvironmentObject.__str__",
          "unique ids, and boxes in the world")
    by_type = {}
    for one in objects:
        by_type.setdefault(one.type, set()).add(one.id)
    tags = tags_in_images(c)
    for name, label in LABELS.names.items():
        found = {one.id for one in c.world.get_environment_objects(label)}
        assert found == (set(by_type.get(label, set())) if label != LABELS.Any else
                         {one.id for one in objects}), name
        seen = [text for text, is_so in (("objects of the town", found),
                                         ("a tag in images", int(label) in tags)) if is_so]
        if seen:
            works(f"CityObjectLabel.{name}", f"{', '.join(seen)}")
        else:
            local(f"CityObjectLabel.{name}", "no object and no tag in the town of this test")
    assert {LABELS.Roads, LABELS.Sidewalks, LABELS.Sky} <= tags and LABELS.Buildings in tags


def tags_in_images(c):
    """Returns the tags in images of vehicles, walkers and the town."""
    car = c.car()
    others = []
    place = car.get_transform()
    ahead, right = place.get_forward_vector(), place.get_right_vector()
    for type_id, ahead_m, right_m in (("vehicle.kawasaki.ninja", 8.0, -3.0),
                                      ("static.prop.barrel", 8.0, 0.0),
                                      ("vehicle.bh.crossbike", 14.0, 0.0),
                                      ("walker.pedestrian.0001", 20.0, 3.0),
                                      ("vehicle.mitsubishi.fusorosa", 26.0, 6.0)):
        at = carla.Transform(place.location, place.rotation)
        at.location += ahead_m * ahead + right_m * right + carla.Location(z=0.5)
        one = c.world.try_spawn_actor(c.library.find(type_id), at)
        others += [one] if one else []
    views = [carla.Transform(carla.Location(z=3.0), carla.Rotation(yaw=90.0 * i)) for i in range(4)]
    views.append(carla.Transform(carla.Location(z=60.0), carla.Rotation(pitch=-90.0)))
    cameras = [c.sensor("sensor.camera.semantic_segmentation", car, view,
                        image_size_x=320, image_size_y=240) for view in views]
    frame = c.ticks(2)
    tags = set()
    for camera, images in cameras:
        tags.update(int(tag) for tag in np.unique(pixels(of_frame(images, frame))[:, :, 2]))
        camera.destroy()
    for one in [car, *others]:
        one.destroy()
    c.ticks(1)
    return tags


def moving(c):
    """Returns the actors that move."""
    return [str(one) for one in c.world.get_actors() if one.get_velocity().length() > 0.01]


@check
def every_layer(c):
    view = carla.Transform(carla.Location(z=150.0), carla.Rotation(pitch=-90.0))
    camera, images = c.sensor("sensor.camera.instance_segmentation", None, view,
                              image_size_x=160, image_size_y=120)

    def seen():
        return pixels(of_frame(images, c.ticks(2))).copy()

    whole = before = seen()
    for name, layer in sorted(carla.MapLayer.names.items(), key=lambda one: int(one[1])):
        if name == "All":
            continue
        c.world.unload_map_layer(layer)
        without = seen()
        if (without != before).any():
            works(f"MapLayer.{name}", "its objects disappeared")
        else:
            assert name in ("NONE", "Decals", "Ground", "Particles"), name
            ignored("accepted; the town has no object in this layer",
                    {f"MapLayer.{name}": lambda: c.world.unload_map_layer(layer)})
        before = without
    c.world.load_map_layer(carla.MapLayer.All)
    changed = (seen() != whole).any(axis=2).sum()
    assert changed == 0, f"{changed} pixels changed; moving: {moving(c)}"
    works("MapLayer.All", "every object reappeared")
    camera.destroy()
    c.ticks(1)


@check
def textures(c):
    for cls, sample in ((carla.TextureColor, carla.Color(1, 2, 3, 4)),
                        (carla.TextureFloatColor, carla.FloatColor(0.5, 0.25, 2.0, 1.0))):
        name, texture = cls.__name__, cls(4, 2)
        assert (texture.width, texture.height) == (4, 2)
        texture.set(3, 1, sample)
        assert texture.get(3, 1) == sample and cls().width == 0
        texture.set_dimensions(8, 6)
        assert (texture.width, texture.height) == (8, 6)
        local(f"{name} {name}.width {name}.height {name}.get {name}.set {name}.set_dimensions",
              "pixels were set and read")
    texture, light = carla.TextureColor(2, 2), carla.TextureFloatColor(2, 2)
    thing = c.world.get_names_of_all_objects()[0]
    for parameter in carla.MaterialParameter.names:
        kind = carla.MaterialParameter.names[parameter]
        refuses("no textures", {
            f"MaterialParameter.{parameter}":
                lambda: c.world.apply_color_texture_to_object(thing, kind, texture)})
    kind = carla.MaterialParameter.Diffuse
    refuses("no textures", {
        "World.apply_color_texture_to_object":
            lambda: c.world.apply_color_texture_to_object(thing, kind, texture),
        "World.apply_float_color_texture_to_object":
            lambda: c.world.apply_float_color_texture_to_object(thing, kind, light),
        "World.apply_textures_to_object":
            lambda: c.world.apply_textures_to_object(thing, texture, light, light, light),
        "World.apply_color_texture_to_objects":
            lambda: c.world.apply_color_texture_to_objects([thing], kind, texture),
        "World.apply_float_color_texture_to_objects":
            lambda: c.world.apply_float_color_texture_to_objects([thing], kind, light),
        "World.apply_textures_to_objects":
            lambda: c.world.apply_textures_to_objects([thing], texture, light, light, light)})


@check
def lists_of_lights(c):
    """Calls that set several lights at once; what lights look like is a check of its own."""
    manager = c.world.get_lightmanager()
    lights = list(manager.get_all_lights())[:2]
    assert len({one.id for one in manager.get_all_lights()}) == len(manager.get_all_lights())
    before = manager.get_light_state(lights)
    manager.set_active(lights, [True, False])
    c.ticks(2)
    assert list(manager.is_active(lights)) == [True, False] == [one.is_on for one in lights]
    manager.set_colors(lights, [carla.Color(1, 2, 3), carla.Color(4, 5, 6)])
    manager.set_intensities(lights, [25.0, 50.0])
    manager.set_light_groups(lights, [carla.LightGroup.Building, carla.LightGroup.Other])
    c.ticks(2)
    assert [(one.r, one.g, one.b) for one in manager.get_color(lights)] == [(1, 2, 3), (4, 5, 6)]
    assert list(manager.get_intensity(lights)) == [25.0, 50.0]
    assert list(manager.get_light_group(lights)) == [carla.LightGroup.Building, carla.LightGroup.Other]
    works("LightManager.set_active LightManager.set_colors LightManager.set_intensities "
          "LightManager.set_light_groups", "each light had its own value")
    for name, group in carla.LightGroup.names.items():
        if name == "NONE":
            continue
        lights[0].set_light_group(group)
        c.ticks(2)
        members = [one.id for one in manager.get_all_lights(group)]
        assert lights[0].id in members and lights[0].light_group == group, name
        assert (name == "Street") == (len(members) > 2), (name, members)
        works(f"LightGroup.{name}", "the light was listed in its group")
    assert len(manager.get_all_lights(carla.LightGroup.NONE)) == len(manager.get_all_lights())
    works("LightGroup.NONE", "the lights of all groups")
    works("Light.id Light.set_light_group", "unique ids; the light was listed in its group")
    lights[0].set_intensity(75.0)
    c.ticks(2)
    assert lights[0].intensity == 75.0
    works("Light.set_intensity", "returned as set")
    lights[0].set_light_state(carla.LightState(
        intensity=90.0, color=carla.Color(7, 8, 9), group=carla.LightGroup.Street, active=True))
    c.ticks(2)
    state = lights[0].light_state
    assert (state.intensity, state.color.r, state.group) == (90.0, 7, carla.LightGroup.Street)
    works("Light.set_light_state Light.light_state", "returned as set")
    manager.set_light_states(lights, before)
    c.ticks(2)
    for one, state in zip(lights, before):
        near(one.intensity, state.intensity, 1e-3)
        assert one.is_on == state.active and one.light_group == state.group
    works("LightManager.set_light_states", "each light had its own state")
    manager.set_day_night_cycle(True)
    c.ticks(1)
