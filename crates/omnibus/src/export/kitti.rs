//! KITTI's object detection: image, points, calibration and labels of a frame, for one camera.

use std::{
    fmt::Write as _,
    fs::{self, File},
    io::{BufWriter, Write as _},
    path::Path,
};

use anyhow::{Context, ensure};
use glam::{DAffine3, DVec3};

use crate::{
    collect::format::{ActorBox, Camera, Sensor, View},
    export::{
        class::{Class, class},
        geometry::{affine, affine_of_rows, intrinsics_of_centres, without_lens},
        images::{Images, link},
        parallel::Threads,
        set::{Frame, Scene, Set},
        split::{PARTS, Split},
    },
};

/// Objects with fewer visible pixels are areas without a label.
const LABELLED_FROM_PX: u32 = 10;

/// Writes the data set.
pub(crate) fn write(
    set: &Set,
    root: &Path,
    images: &Images,
    split: &Split,
    threads: Threads,
) -> anyhow::Result<()> {
    for scene in set.scenes() {
        let name = &scene.name;
        ensure!(scene.cameras().next().is_some(), "{name} has no camera, which KITTI needs");
        let (sensor, camera) = forward_camera(scene);
        without_lens("KITTI", name, sensor, camera)?;
    }
    for folder in ["image_2", "velodyne", "calib", "label_2"] {
        let path = root.join("training").join(folder);
        fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
    }
    for folder in ["ImageSets", "poses"] {
        let path = root.join(folder);
        fs::create_dir(&path).with_context(|| path.display().to_string())?;
    }
    let create = |path: &Path| {
        File::create(path).map(BufWriter::new).with_context(|| path.display().to_string())
    };
    let mut parts = Vec::new();
    for part in PARTS {
        parts.push(create(&root.join(format!("ImageSets/{part}.txt")))?);
    }
    let mut list = create(&root.join("frames.txt"))?;
    let mut poses: Option<(usize, DAffine3, BufWriter<File>)> = None;
    let convert = |index: usize| {
        let frame = set.frame(index)?;
        if !is_whole(&frame) {
            return Ok(None);
        }
        write_frame(&frame, index, &root.join("training"), images)?;
        let (sensor, camera) = forward_camera(frame.scene);
        let pose = affine(&frame.line.ego.world_from_vehicle)
            * affine_of_rows(&camera.vehicle_from_optical);
        let origin = format!("{} {} {}", frame.scene.name, frame.line.frame, sensor.name);
        Ok(Some((set.place(index), pose, origin)))
    };
    threads.in_order(set.frames(), convert, |index, written| {
        let Some((place, world_from_camera, origin)) = written else { return Ok(()) };
        writeln!(parts[split.part(place)], "{index:06}")?;
        writeln!(list, "{index:06} {origin}")?;
        if poses.as_ref().is_none_or(|(scene, ..)| *scene != place.0) {
            let path = root.join(format!("poses/{}.txt", set.scenes()[place.0].name));
            if let Some((.., mut file)) = poses.take() {
                file.flush()?;
            }
            poses = Some((place.0, world_from_camera.inverse(), create(&path)?));
        }
        if let Some((_, first_from_world, file)) = &mut poses {
            writeln!(file, "{}", rows(&(*first_from_world * world_from_camera)))?;
        }
        Ok(())
    })?;
    for mut file in parts.into_iter().chain([list]).chain(poses.map(|(.., file)| file)) {
        file.flush().with_context(|| root.display().to_string())?;
    }
    Ok(())
}

/// Returns the camera whose axis is nearest to straight ahead; of equals, the first.
fn forward_camera(scene: &Scene) -> (&Sensor, &Camera) {
    let ahead = |camera: &Camera| camera.vehicle_from_optical[0][2];
    let mut cameras = scene.cameras();
    let first = cameras.next().expect("checked before the first frame");
    cameras.fold(first, |best, other| if ahead(other.1) > ahead(best.1) { other } else { best })
}

/// Returns whether the camera and the lidar measured in a frame. Numbers of others are left out.
fn is_whole(frame: &Frame) -> bool {
    let (camera, _) = forward_camera(frame.scene);
    let lidar = frame.scene.lidars().next();
    frame.line.measures(&camera.name)
        && lidar.is_none_or(|(lidar, _)| frame.line.measures(&lidar.name))
}

fn write_frame(frame: &Frame, index: usize, root: &Path, images: &Images) -> anyhow::Result<()> {
    let (sensor, camera) = forward_camera(frame.scene);
    let at = |folder: &str, extension: &str| root.join(format!("{folder}/{index:06}.{extension}"));
    images.place(frame, sensor, camera, &at("image_2", images.extension()))?;
    let lidar = frame.scene.lidars().next().map(|(lidar, _)| lidar);
    if let Some(lidar) = lidar {
        // The same bytes: x, y, z and a reflectance from 0 to 1, x forward and z up.
        link(&frame.path(&format!("{}/points", lidar.name), "bin"), &at("velodyne", "bin"))?;
    }
    let calibration = calibration(frame.scene, camera, lidar);
    let put =
        |path: &Path, text: &str| fs::write(path, text).with_context(|| path.display().to_string());
    put(&at("calib", "txt"), &calibration)?;
    put(&at("label_2", "txt"), &labels(&frame.boxes()?, &sensor.name))
}

/// Returns the text of a calibration file. All four cameras are the one that there is, and rectified
/// space is its optical space. Without a lidar its space is that of the vehicle.
fn calibration(scene: &Scene, camera: &Camera, lidar: Option<&Sensor>) -> String {
    let [x, y, z] = intrinsics_of_centres(&camera.intrinsics_px);
    let row = |row: [f64; 3]| format!("{:e} {:e} {:e} {:e}", row[0], row[1], row[2], 0.0);
    let projection = [x, y, z].map(row).join(" ");
    let vehicle_from = |sensor: Option<&Sensor>| {
        sensor.map_or(DAffine3::IDENTITY, |s| affine_of_rows(&s.vehicle_from_sensor))
    };
    let vehicle_from_lidar = vehicle_from(lidar);
    let vehicle_from_imu = vehicle_from(scene.sensor_of_kind("imu"));
    let optical_from_lidar =
        affine_of_rows(&camera.vehicle_from_optical).inverse() * vehicle_from_lidar;
    let lidar_from_imu = vehicle_from_lidar.inverse() * vehicle_from_imu;
    let mut text = String::new();
    for number in 0..4 {
        let _ = writeln!(text, "P{number}: {projection}");
    }
    let _ = writeln!(text, "R0_rect: 1 0 0 0 1 0 0 0 1");
    let _ = writeln!(text, "Tr_velo_to_cam: {}", rows(&optical_from_lidar));
    let _ = writeln!(text, "Tr_imu_to_velo: {}", rows(&lidar_from_imu));
    text
}

/// Returns the upper three rows of a transform as text.
fn rows(transform: &DAffine3) -> String {
    let m = transform.matrix3.transpose().to_cols_array_2d();
    let t = transform.translation.to_array();
    let row = |i: usize| format!("{:e} {:e} {:e} {:e}", m[i][0], m[i][1], m[i][2], t[i]);
    [0, 1, 2].map(row).join(" ")
}

/// Returns the lines of a label file.
fn labels(boxes: &[ActorBox], camera: &str) -> String {
    let mut text = String::new();
    for actor in boxes {
        let (Some(view), Some(name)) = (actor.cameras.get(camera), class(actor).and_then(kind))
        else {
            continue;
        };
        // Whole coordinates are the centres of pixels.
        let [left, top, right, bottom] = view.projected_box_px.map(|edge| edge - 0.5);
        let edges = format!("{left:.2} {top:.2} {right:.2} {bottom:.2}");
        if view.visible_px < LABELLED_FROM_PX {
            let nothing = "-1 -1 -1 -1000 -1000 -1000 -10";
            let _ = writeln!(text, "DontCare -1 -1 -10 {edges} {nothing}");
            continue;
        }
        let placed = Placed::of(actor, view);
        let [x, y, z] = placed.bottom.to_array();
        let [length, width, height] = actor.size_m;
        let alpha = wrapped(placed.rotation_y - x.atan2(z));
        let _ = writeln!(
            text,
            "{name} {:.2} {} {alpha:.4} {edges} {height:.4} {width:.4} {length:.4} {x:.4} {y:.4} \
             {z:.4} {:.4}",
            view.truncated_fraction,
            occlusion(view.occluded_fraction),
            placed.rotation_y
        );
    }
    text
}

/// A box that stands upright in camera space.
struct Placed {
    /// Half the height below the centre of the box.
    bottom: DVec3,
    /// The angle from the camera's x axis to the object's forward, about the camera's y axis.
    rotation_y: f64,
}

impl Placed {
    fn of(actor: &ActorBox, view: &View) -> Placed {
        let optical_from_box = affine(&view.optical_from_box);
        let forward = optical_from_box.matrix3.x_axis;
        let down = DVec3::Y * 0.5 * f64::from(actor.size_m[2]);
        Placed {
            bottom: optical_from_box.translation + down,
            rotation_y: (-forward.z).atan2(forward.x),
        }
    }
}

/// Returns an angle in (−π, π].
fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(std::f64::consts::TAU);
    if turned > std::f64::consts::PI { turned - std::f64::consts::TAU } else { turned }
}

/// Returns KITTI's level: 0 fully visible, 1 partly, 2 largely occluded.
fn occlusion(fraction: f32) -> u32 {
    match fraction {
        f if f < 0.1 => 0,
        f if f < 0.5 => 1,
        _ => 2,
    }
}

/// Returns KITTI's name of a class.
fn kind(class: Class) -> Option<&'static str> {
    match class {
        Class::Pedestrian => Some("Pedestrian"),
        Class::Bicycle => Some("Cyclist"),
        Class::Car => Some("Car"),
        Class::Van => Some("Van"),
        Class::Truck => Some("Truck"),
        Class::Train => Some("Tram"),
        Class::Bus | Class::Motorcycle => Some("Misc"),
        Class::TrafficLight | Class::StopSign | Class::Cone | Class::Barrier => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_wrapped_to_one_turn() {
        for (angle, expected) in [(0.5, 0.5), (-0.5, -0.5), (4.0, 4.0 - std::f64::consts::TAU)] {
            assert!((wrapped(angle) - expected).abs() < 1e-12, "{angle}");
        }
    }

    #[test]
    fn occlusion_has_the_levels_of_the_format() {
        assert_eq!([0.0, 0.05, 0.3, 0.7, 1.0].map(occlusion), [0, 0, 1, 2, 2]);
    }
}
