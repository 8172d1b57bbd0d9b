//! Labels against what the CPU tracer shows of the same actors.

use bytemuck::Zeroable;
use client_lib::KEYPOINTS;
use glam::Quat;
use protocol::{
    Block, Frame, LensSpec, STRIDE, SensorSpec, Stamp, Weather, layout, lens_model, output, sensor,
};
use sensor_render::{BundleJob, CpuTracer, Scene, World, pose_planes};
use town::Town;

use super::*;

const SIZE: [u32; 2] = [400, 300];

/// A camera at the origin of the world, 1.2 m above the ground, that looks along x.
fn camera(lens: LensSpec) -> SensorSpec {
    SensorSpec {
        name: protocol::Name::new("front"),
        kind: sensor::CAMERA,
        outputs: output::DEPTH | output::INSTANCE,
        parent_from_sensor: Pose::new(Vec3::Z * 1.2, Quat::IDENTITY),
        width: SIZE[0],
        height: SIZE[1],
        fov_rad: 1.2,
        lens,
        ..SensorSpec::default()
    }
}

fn fisheye() -> LensSpec {
    LensSpec {
        model: lens_model::FISHEYE,
        focal_px: [150.0; 2],
        center_px: [200.0, 150.0],
        max_angle_rad: 1.6,
        ..LensSpec::default()
    }
}

fn actor(id: u32, blueprint: &str, pose: Pose) -> ActorState {
    let (index, made) = town::blueprint(blueprint).unwrap();
    let kind = if made.skeleton().is_some() { kind::WALKER } else { kind::VEHICLE };
    ActorState { actor_id: ActorId(id), blueprint: index, kind, pose, ..ActorState::default() }
}

/// The instance and depth images of a camera, and the boxes of all actors.
struct Looked {
    ids: Vec<u32>,
    boxes: Vec<ActorBox>,
}

impl Looked {
    fn at(actors: &[ActorState], lens: LensSpec) -> Looked {
        static SCENE: std::sync::OnceLock<Scene> = std::sync::OnceLock::new();
        let scene = SCENE.get_or_init(|| Scene::of_town(&Town::default()).unwrap());
        let mut world = World::new();
        let stamp = Stamp { frame: Frame(1), episode: 1, ..Stamp::zeroed() };
        world.place(scene, stamp, 50_000_000, &Weather::default(), actors, |_| [128; 3]);
        let spec = camera(lens);
        let (mut planes, bytes) = layout(&[spec]);
        pose_planes(&mut planes, &[spec], &Pose::IDENTITY);
        let mut payload = vec![Block::zeroed(); (bytes as usize).div_ceil(size_of::<Block>())];
        let out: &mut [u8] = bytemuck::cast_slice_mut(&mut payload);
        let job = BundleJob { parent: ActorId::NONE, sensors: &[spec], planes: &planes, out };
        CpuTracer::in_calling_thread().measure(scene, &world, &mut [job]).unwrap();
        let payload: &[u8] = bytemuck::cast_slice(&payload);
        let plane = |output: u32| {
            let plane = planes.iter().find(|plane| plane.output == output).unwrap();
            &payload[plane.offset as usize..][..plane.byte_len as usize]
        };
        let ids: &[u32] = bytemuck::cast_slice(plane(output::INSTANCE));
        let objects = StaticObjects::new(Town::default());
        let boxed = Boxed { actors, limbs: &[], objects: &objects };
        let front = CameraView {
            name: "front",
            camera: CameraModel::of(&spec),
            world_from_sensor: planes[0].world_from_sensor,
            seen: seen(ids, SIZE[0] as usize, boxed),
            ids,
            depth: Some(bytemuck::cast_slice(plane(output::DEPTH))),
        };
        let views = Views {
            cameras: vec![front],
            lidars: Vec::new(),
            radars: Vec::new(),
            labels: LabelSettings { keypoints: true, amodal_masks: true },
        };
        let blueprints: Vec<_> = town::catalogue()
            .iter()
            .map(|b| BlueprintInfo {
                id: b.id.to_owned(),
                tag: b.tag as u8,
                half_extents_m: b.half_extents_m.to_array(),
                center_m: b.center_m.to_array(),
            })
            .collect();
        let raster = &mut Silhouette::default();
        let boxes = actor_boxes(boxed, ActorId(1000), &blueprints, &views, raster);
        Looked { ids: ids.to_vec(), boxes }
    }

    fn view(&self, id: u32) -> &View {
        &self.boxes.iter().find(|one| one.actor_id == id).unwrap().cameras["front"]
    }

    /// Returns whether each pixel of the image shows an actor, down the columns.
    fn visible(&self, id: u32) -> Vec<bool> {
        let [width, height] = SIZE.map(|size| size as usize);
        let pixel = |at: usize| self.ids[at % height * width + at / height] == id;
        (0..width * height).map(pixel).collect()
    }

    /// Returns the same of the amodal mask.
    fn amodal(&self, id: u32) -> Vec<bool> {
        let runs = self.view(id).amodal_mask.as_ref().unwrap().runs().unwrap();
        let run = |(index, run): (usize, &u32)| vec![index % 2 == 1; *run as usize];
        runs.iter().enumerate().flat_map(run).collect()
    }

    fn keypoint(&self, id: u32, name: &str) -> u8 {
        let index = KEYPOINTS.iter().position(|one| *one == name).unwrap();
        self.view(id).keypoints.as_ref().unwrap().visibility[index]
    }
}

/// Returns the number of pixels of each of two masks that the other lacks.
fn differences(a: &[bool], b: &[bool]) -> [usize; 2] {
    let only = |a: &[bool], b: &[bool]| a.iter().zip(b).filter(|(a, b)| **a && !**b).count();
    [only(a, b), only(b, a)]
}

fn count(mask: &[bool]) -> usize {
    mask.iter().filter(|is_in| **is_in).count()
}

fn at(x: f32, y: f32, heading_rad: f32) -> Pose {
    Pose::level(Vec3::new(x, y, 0.0), heading_rad)
}

/// Cars with turned wheels, walkers in the middle of a step, a cyclist.
fn moving(pose: Pose, id: u32, blueprint: &str) -> ActorState {
    let walks = blueprint.starts_with("walker");
    ActorState {
        velocity_mps: (pose.rotation() * Vec3::X * if walks { 1.8 } else { 8.0 }).to_array(),
        phase: if walks { STRIDE / 4 } else { 0 },
        wheel_steer_rad: 0.4,
        wheel_spin_rad: 1.0,
        ..actor(id, blueprint, pose)
    }
}

#[test]
fn the_mask_of_what_nothing_occludes_is_what_the_image_shows() {
    for lens in [LensSpec::default(), fisheye()] {
        for blueprint in ["vehicle.tesla.model3", "walker.pedestrian.0003", "vehicle.bh.crossbike"]
        {
            let one = moving(at(6.0, 0.4, 0.9), 7, blueprint);
            let looked = Looked::at(&[one], lens);
            let (visible, amodal) = (looked.visible(7), looked.amodal(7));
            let [missing, added] = differences(&visible, &amodal);
            let all = count(&visible);
            assert!(all > 200, "{blueprint}: {all}");
            assert_eq!(missing, 0, "{blueprint}: the mask holds every visible pixel");
            assert!(added <= all / 100, "{blueprint}: {added} of {all} pixels more");
            let view = looked.view(7);
            assert_eq!(view.unoccluded_px as usize, count(&amodal));
            assert_eq!(view.visible_px as usize, all);
        }
    }
}

#[test]
fn the_mask_of_a_half_hidden_car_is_what_shows_without_the_occluder() {
    for lens in [LensSpec::default(), fisheye()] {
        let hidden = moving(at(14.0, 0.0, 1.2), 7, "vehicle.tesla.model3");
        let before = actor(8, "vehicle.carlamotors.firetruck", at(8.5, 2.6, 0.3));
        let (both, alone) = (Looked::at(&[hidden, before], lens), Looked::at(&[hidden], lens));
        let (visible, amodal, whole) = (both.visible(7), both.amodal(7), alone.visible(7));
        let [part, all] = [count(&visible), count(&whole)];
        assert!(part > all / 5 && part < all * 4 / 5, "{part} of {all} pixels show");
        let [beyond, missing] = differences(&amodal, &whole);
        assert!(beyond + missing <= all / 100, "{beyond} and {missing} of {all} pixels");
        assert_eq!(differences(&visible, &amodal)[0], 0);
        let occluded = both.view(7).occluded_fraction;
        assert!((occluded - (1.0 - part as f32 / all as f32)).abs() < 0.01, "{occluded}");
    }
}

#[test]
fn a_mask_ends_at_the_edge_of_the_image() {
    let looked =
        Looked::at(&[moving(at(5.0, 3.6, 0.0), 7, "vehicle.tesla.model3")], LensSpec::default());
    let (visible, amodal) = (looked.visible(7), looked.amodal(7));
    assert!(visible[..SIZE[1] as usize].contains(&true), "it leaves the image on the left");
    let [missing, added] = differences(&visible, &amodal);
    assert!(missing == 0 && added <= count(&visible) / 100, "{added}");
}

#[test]
fn keypoints_of_a_walker_are_visible_from_the_side_that_shows_them() {
    let walker = |heading_rad| actor(7, "walker.pedestrian.0002", at(4.0, 0.0, heading_rad));
    for lens in [LensSpec::default(), fisheye()] {
        let facing = Looked::at(&[walker(std::f32::consts::PI)], lens);
        for name in KEYPOINTS {
            assert_eq!(facing.keypoint(7, name), 2, "{name} from the front");
        }
        // Its left is on the right of the image.
        let px = |name: &str| {
            let index = KEYPOINTS.iter().position(|one| *one == name).unwrap();
            facing.view(7).keypoints.as_ref().unwrap().px[index]
        };
        assert!(px("left_shoulder")[0] > px("right_shoulder")[0] + 10.0);
        assert!(px("nose")[1] < px("left_hip")[1] && px("left_hip")[1] < px("left_ankle")[1]);
        let away = Looked::at(&[walker(0.0)], lens);
        for name in ["nose", "left_eye", "right_eye"] {
            assert_eq!(away.keypoint(7, name), 1, "{name} from behind");
        }
        for name in ["left_shoulder", "right_hip", "left_knee", "right_ankle", "left_wrist"] {
            assert_eq!(away.keypoint(7, name), 2, "{name} from behind");
        }
        // It looks to the left of the image: its right side is hidden by its left one.
        let aside = Looked::at(&[walker(std::f32::consts::FRAC_PI_2)], lens);
        for part in ["shoulder", "elbow", "wrist", "ear"] {
            let sides = ["left", "right"].map(|side| aside.keypoint(7, &format!("{side}_{part}")));
            assert_eq!(sides, [2, 1], "{part} from its left");
        }
    }
}

#[test]
fn keypoints_behind_a_wall_are_occluded_and_those_above_it_visible() {
    let walker = actor(7, "walker.pedestrian.0002", at(6.0, 0.0, std::f32::consts::PI));
    // A car across the way hides the legs.
    let car = actor(8, "vehicle.tesla.model3", at(4.0, -1.4, std::f32::consts::FRAC_PI_2));
    let looked = Looked::at(&[walker, car], LensSpec::default());
    for name in ["left_knee", "right_knee", "left_ankle", "right_ankle"] {
        assert_eq!(looked.keypoint(7, name), 1, "{name}");
    }
    for name in ["nose", "left_eye", "right_ear", "left_shoulder"] {
        assert_eq!(looked.keypoint(7, name), 2, "{name}");
    }
    let near = Looked::at(&[ActorState { pose: at(0.8, 0.0, 3.1), ..walker }], LensSpec::default());
    assert_eq!(near.keypoint(7, "left_ankle"), 0, "below the image");
}
