"""Checks of walkers: control, bones, poses, and collisions with vehicles."""

import carla

from effects_kit import near
from ledger import check, differs, works


@check
def walker_control_and_bones(c):
    blueprint = c.library.filter("walker.pedestrian.*")[0]
    walker = c.world.spawn_actor(blueprint, c.points[5])
    c.ticks(10)
    start = walker.get_location()
    walker.apply_control(carla.WalkerControl(carla.Vector3D(x=0.0, y=1.0), 1.5))
    c.ticks(20)
    moved = walker.get_location() - start
    near(moved.y, 1.5, 0.3)
    near(walker.get_control().speed, 1.5, 1e-6)
    works("Walker.apply_control Walker.get_control",
          "the walker moved 1.5 m to the right in one second")
    bones = {bone.name: bone for bone in walker.get_bones().bone_transforms}
    assert len(bones) == 66, len(bones)
    head, foot = bones["crl_Head__C"].world.location, bones["crl_foot__L"].world.location
    assert 1.0 < head.z - foot.z < 2.0, (head, foot)
    assert head.distance(walker.get_location()) < 2.5
    assert "crl_thigh__R" in walker.get_bone_names()
    assert len(walker.get_bone_world_transforms()) == 66
    assert len(walker.get_bone_relative_transforms()) == 66
    differs("Walker.get_bones Actor.get_bone_names Actor.get_bone_world_transforms "
            "Actor.get_bone_relative_transforms",
            "66 bones with CARLA's names, the head above the feet; in the rest pose, a bone's "
            "axes are the actor's, and the bones of a vehicle are its parts")
    walker.destroy()


@check
def walker_poses(c):
    blueprint = c.library.filter("walker.pedestrian.*")[0]
    walker = c.world.spawn_actor(blueprint, c.points[5])
    c.ticks(2)

    def bones():
        c.ticks(2)
        return {bone.name: bone for bone in walker.get_bones().bone_transforms}

    def lift():
        now = bones()
        hand, arm = now["crl_hand__L"].component.location, now["crl_arm__L"].component.location
        return hand.z - arm.z, hand.y - arm.y

    rest = bones()
    hangs, _ = lift()
    assert hangs < -0.4, hangs
    up = rest["crl_arm__L"].relative
    up.rotation.roll += 170.0
    walker.set_bones(carla.WalkerBoneControlIn([("crl_arm__L", up)]))
    near(lift()[0], hangs, 1e-4)
    walker.blend_pose(1.0)
    near(lift()[0], -hangs, 0.05)
    near(bones()["crl_arm__L"].relative.location.distance(up.location), 0.0, 1e-3)
    differs("Walker.set_bones WalkerBoneControlIn",
            "an arm was raised relative to its shoulder; in the rest pose, a bone's axes are the "
            "actor's")
    walker.blend_pose(0.5)
    half, aside = lift()
    assert abs(half) < 0.15 and aside < -0.3, (half, aside)
    walker.hide_pose()
    near(lift()[0], hangs, 1e-4)
    walker.show_pose()
    near(lift()[0], -hangs, 0.05)
    works("Walker.blend_pose Walker.show_pose Walker.hide_pose",
          "the arm hung at 0, pointed sideways at 0.5 and upwards at 1")
    walker.hide_pose()
    walker.apply_control(carla.WalkerControl(carla.Vector3D(x=1.0), 1.5))
    for _ in range(40):
        thigh = bones()["crl_thigh__L"].relative.rotation.pitch
        if abs(thigh) > 10.0:
            break
    assert abs(thigh) > 10.0, thigh
    walker.get_pose_from_animation()
    walker.show_pose()
    c.ticks(2)
    held = [bones()["crl_thigh__L"].relative.rotation.pitch for _ in range(10)]
    assert max(held) - min(held) < 0.1 and abs(held[0]) > 5.0, (thigh, held)
    works("Walker.get_pose_from_animation",
          "the pose of the step was held while the walker moved on")
    walker.destroy()


def straight(c, length):
    """Returns a spawn point before a straight road of this length, in metres."""
    for point in c.points:
        here = c.map.get_waypoint(point.location)
        way = [here] + here.next_until_lane_end(2.0)
        if here.is_junction or len(way) * 2.0 < length:
            continue
        turns = [abs((w.transform.rotation.yaw - here.transform.rotation.yaw + 180.0) % 360.0
                     - 180.0) for w in way[:int(length / 2.0)]]
        if max(turns) < 2.0:
            return here.transform
    raise AssertionError(f"no straight road of {length} m")


def drive_into(c, car, speed, ticks, brake_after=None):
    """Drives a vehicle straight ahead without pedals; returns its speeds."""
    ahead = car.get_transform().get_forward_vector()
    car.set_target_velocity(speed * ahead)
    speeds = []
    for tick in range(ticks):
        if brake_after is not None and tick == brake_after:
            car.apply_control(carla.VehicleControl(brake=1.0))
        c.world.tick()
        speeds.append(car.get_velocity().length())
    return speeds


def place_car(c, at):
    at = carla.Transform(at.location + carla.Location(z=0.4), at.rotation)
    car = c.world.spawn_actor(c.library.find("vehicle.tesla.model3"), at)
    c.ticks(20)
    return car


@check
def hit_walkers(c):
    road = straight(c, 50.0)
    ahead = road.get_forward_vector()
    for invincible in ("true", "false"):
        car = place_car(c, road)
        blueprint = c.library.filter("walker.pedestrian.*")[0]
        if invincible == "false":
            blueprint.set_attribute("is_invincible", "false")
        assert blueprint.get_attribute("is_invincible").as_bool() == (invincible == "true")
        place = carla.Transform(road.location + 12.0 * ahead + carla.Location(z=0.5))
        walker = c.world.spawn_actor(blueprint, place)
        c.ticks(2)
        stood = walker.get_location()
        speeds = drive_into(c, car, 10.4, 40, brake_after=30)
        # 75 kg against 1.8 t: the vehicle keeps most of its speed.
        assert speeds[24] > 8.0, speeds
        assert walker.get_location().distance(stood) > 3.0
        car.destroy()
        head = lambda: {bone.name: bone for bone in walker.get_bones().bone_transforms}[
            "crl_Head__C"].world.location.z - stood.z
        c.ticks(40)
        assert head() < 0.7, head()
        if invincible == "true":
            c.ticks(60)
            assert head() > 1.0, head()
            lay = walker.get_location()
            walker.apply_control(carla.WalkerControl(carla.Vector3D(y=1.0), 1.5))
            c.ticks(20)
            near(walker.get_location().distance(lay), 1.5, 0.3)
            walker.destroy()
        else:
            c.ticks(120)
            assert walker.id in {actor.id for actor in c.world.get_actors()}
            c.ticks(20)
            assert walker.id not in {actor.id for actor in c.world.get_actors()}
    differs("walker.is_invincible",
            "a walker hit by a vehicle fell as a ragdoll, and the vehicle drove on; with `true` "
            "the walker stood up 5 s later and walked on, in CARLA it is pushed and does not "
            "fall; with `false` its body was removed after 10 s, as in CARLA")


@check
def controlled_walkers_die(c):
    """The package sets a walker of an AI controller dead that a vehicle touches."""
    controller_blueprint = c.library.find("controller.ai.walker")
    walker = None
    while walker is None:
        place = c.world.get_random_location_from_navigation()
        walker = c.world.try_spawn_actor(c.library.filter("walker.pedestrian.*")[3],
                                         carla.Transform(place))
    c.ticks(1)
    controller = c.world.spawn_actor(controller_blueprint, carla.Transform(), attach_to=walker)
    c.ticks(1)
    controller.start()
    controller.go_to_location(c.world.get_random_location_from_navigation())
    controller.set_max_speed(1.4)
    c.ticks(20)
    car = place_car(c, straight(c, 50.0))
    at = walker.get_transform()
    behind = at.location - 9.0 * at.get_forward_vector() + carla.Location(z=0.1)
    car.set_transform(carla.Transform(behind, at.rotation))
    # It passes through the furniture of the sidewalk, in a straight line.
    car.set_simulate_physics(False)
    c.ticks(1)
    car.set_target_velocity(8.0 * at.get_forward_vector())
    fell = None
    for tick in range(60):
        c.world.tick()
        bones = {bone.name: bone for bone in walker.get_bones().bone_transforms}
        if bones["crl_Head__C"].world.location.z - at.location.z < 0.9:
            fell = tick
            break
    assert fell is not None, "the walker stands"
    car.destroy()
    c.ticks(170)
    assert walker.id in {actor.id for actor in c.world.get_actors()}
    c.ticks(35)
    actors = {actor.id for actor in c.world.get_actors()}
    assert walker.id not in actors and controller.id not in actors
    works("WalkerAIController.start",
          "a walker with a controller that a vehicle touched fell, since the package set it dead; "
          "body and controller were removed, the body after 10 s")


@check
def props_on_the_road(c):
    road = straight(c, 50.0)
    ahead = road.get_forward_vector()

    def hit(name, set_physics=None):
        """Returns the speed of a vehicle after it met a prop, and how far the prop moved."""
        car = place_car(c, road)
        place = carla.Transform(road.location + 12.0 * ahead, road.rotation)
        prop = c.world.spawn_actor(c.library.find(name), place)
        if set_physics is not None:
            prop.set_simulate_physics(set_physics)
        c.ticks(2)
        stood = prop.get_location()
        assert stood.distance(place.location) < 0.1, (name, stood)
        speed = drive_into(c, car, 8.0, 40)[-1]
        moved = prop.get_location().distance(stood)
        car.destroy()
        prop.destroy()
        c.ticks(1)
        return speed, moved

    for name in ("static.prop.dirtdebris01", "static.prop.dirtdebris02", "static.prop.dirtdebris03",
                 "static.prop.plasticbag", "static.prop.trashbag"):
        for set_physics in (None, False):
            speed, _ = hit(name, set_physics)
            assert speed > 7.0, (name, set_physics, speed)
    for name in ("static.prop.trafficcone01", "static.prop.constructioncone", "static.prop.box01",
                 "static.prop.streetbarrier", "static.prop.barrel"):
        for set_physics in (None, False, True):
            speed, moved = hit(name, set_physics)
            assert speed > 6.0 and moved > 2.0, (name, set_physics, speed, moved)
    speed, moved = hit("static.prop.vendingmachine")
    assert speed < 4.0 and moved < 0.01, (speed, moved)
    differs("static.prop.*",
            "dirt debris and bags did not slow a vehicle; it pushed cones, boxes, barriers and a "
            "barrel aside, which stay where they are spawned until then; props above 50 kg stop it "
            "unless physics is simulated")


@check
def friction_triggers(c):
    road = straight(c, 50.0)

    def braking(attributes):
        """Returns the distance of a full stop from 8 m/s in a trigger, and the friction of the tyres."""
        car = place_car(c, road)
        trigger = None
        if attributes:
            blueprint = c.library.find("static.trigger.friction")
            for name, value in attributes.items():
                blueprint.set_attribute(name, value)
            trigger = c.world.spawn_actor(blueprint, road)
            c.ticks(2)
        inside = [wheel.tire_friction for wheel in car.get_physics_control().wheels]
        car.set_target_velocity(8.0 * road.get_forward_vector())
        c.world.tick()
        start = car.get_location()
        car.apply_control(carla.VehicleControl(brake=1.0))
        c.ticks(150)
        way = car.get_location().distance(start)
        if trigger is not None:
            trigger.destroy()
            c.ticks(2)
        after = [wheel.tire_friction for wheel in car.get_physics_control().wheels]
        car.destroy()
        c.ticks(1)
        return way, inside, after

    dry, own, _ = braking({})
    wide = {"extent_x": "10000.0", "extent_y": "10000.0", "extent_z": "1000.0"}
    icy, inside, after = braking({"friction": "0.7", **wide})
    assert all(abs(friction - 0.7) < 1e-4 for friction in inside) and after == own, (inside, after)
    assert icy > 3.0 * dry, (icy, dry)
    small = {"extent_x": "10.0", "extent_y": "10.0", "extent_z": "10.0"}
    _, inside, after = braking({"friction": "0.7", **small})
    assert after == own, after
    works("static.trigger.friction",
          f"a vehicle stopped from 8 m/s within {dry:.0f} m, and with friction 0.7 within {icy:.0f} m; "
          "it has its own friction again outside of the trigger and after its end")
