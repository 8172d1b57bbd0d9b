"""Checks of walkers: control, bones and poses."""

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
    near(walker.get_control().speed, 1.5, 0.2)
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
