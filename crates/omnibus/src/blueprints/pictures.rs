//! Pictures of blueprints, drawn by the tracer that also serves cameras.

use std::{fs, io::BufWriter, path::Path};

use anyhow::Context;
use glam::{Quat, vec3};
use mesh::{Face, Material, Mesh, Tag};
use protocol::{
    ActorId, ActorState, Frame, Name, Pose, STRIDE, SensorSpec, Stamp, Weather, kind, lamp, layout,
    output, sensor,
};
use sensor_render::{BundleJob, Device, Quality, Scene, Tracer, World, pose_planes};
use town::{Blueprint, Kind};

use crate::map::glyphs;

/// Width and height of one picture, in pixels.
const SIZE: [u32; 2] = [480, 360];
/// Width and height of one picture in a contact sheet, without its id.
const TILE: [usize; 2] = [240, 180];
/// Height of an id in a contact sheet, in pixels.
const WORDS: usize = 16;

/// Draws each blueprint into `folder`/id.png, and a contact sheet of each kind.
pub(super) fn draw(all: &[&Blueprint], folder: &Path, meshes: Option<&Path>) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let mut studio = Studio::open(meshes)?;
    for kind in [Kind::Vehicle, Kind::Walker, Kind::Prop, Kind::TrafficLight] {
        let of_kind: Vec<&Blueprint> = all.iter().filter(|b| b.kind == kind).copied().collect();
        if of_kind.is_empty() {
            continue;
        }
        let columns = if kind == Kind::Walker { 10 } else { 8 };
        let mut sheet = Sheet::new(columns, of_kind.len().div_ceil(columns));
        for (place, blueprint) in of_kind.iter().enumerate() {
            let picture = studio.portrait(blueprint)?;
            let name = format!("{}.png", blueprint.id.replace(' ', "_"));
            write(&folder.join(name), SIZE, &picture)?;
            sheet.put(place, &picture, blueprint.id);
        }
        let path = folder.join(format!("sheet-{}s.png", kind_name(kind)));
        write(&path, sheet.size, &sheet.pixels)?;
        print_line!("{}: {} pictures", path.display(), of_kind.len());
    }
    Ok(())
}

/// A floor in sunlight, and a camera.
struct Studio {
    scene: Scene,
    tracer: Tracer,
    world: World,
}

impl Studio {
    fn open(meshes: Option<&Path>) -> anyhow::Result<Studio> {
        let mut floor = Mesh::default();
        let face = Face {
            tint: Face::tint([150, 152, 156]),
            ..Face::new(Tag::Ground, Material::RoofFlat, 0)
        };
        let far = 400.0;
        floor.quad([[-far, -far, 0.0], [far, -far, 0.0], [far, far, 0.0], [-far, far, 0.0]], face);
        let scene = sensor_render::scene_with(&floor, meshes)?;
        let mut world = World::new();
        world.set_quality(Quality::Epic);
        Ok(Studio { scene, tracer: Tracer::open(Device::Cpu, 0)?, world })
    }

    /// Draws a blueprint from ahead and the right, a little above, as RGB. Vehicles steer with
    /// their lights on; walkers walk.
    fn portrait(&mut self, blueprint: &Blueprint) -> anyhow::Result<Vec<u8>> {
        let (index, _) = town::blueprint(blueprint.id).context("not in the catalogue")?;
        let [r, g, b] = blueprint.default_color;
        let mut actor = ActorState {
            actor_id: ActorId(1),
            blueprint: index,
            color: u32::from_le_bytes([r, g, b, 255]),
            ..ActorState::default()
        };
        match blueprint.kind {
            Kind::Vehicle => {
                actor.kind = kind::VEHICLE;
                actor.wheel_steer_rad = 0.25;
                actor.wheel_spin_rad = 0.5;
                actor.lamps = lamp::LOW_BEAM | lamp::LEFT_BLINKER | lamp::SPECIAL1;
            }
            Kind::Walker => {
                actor.kind = kind::WALKER;
                actor.phase = STRIDE / 4;
                actor.velocity_mps = [1.4, 0.0, 0.0];
            }
            Kind::Prop => actor.kind = kind::PROP,
            Kind::TrafficLight => actor.kind = kind::TRAFFIC_LIGHT,
        }
        let stamp = Stamp { frame: Frame(1), sim_time_nanos: 50_000_000, ..Stamp::default() };
        let weather =
            Weather { sun_azimuth_rad: -0.35, sun_altitude_rad: 0.8, ..Weather::default() };
        let actors = [actor];
        self.world.place(&self.scene, stamp, 50_000_000, &weather, &actors, |_| [r, g, b]);

        let (half, center) = (blueprint.half_extents_m, blueprint.center_m);
        let (bearing, rise): (f32, f32) = (-0.66, 0.27);
        let out = vec3(bearing.cos() * rise.cos(), bearing.sin() * rise.cos(), rise.sin());
        let fov_rad: f32 = 0.42;
        let reach = (half.length() * 0.78).max(half.z * 1.2);
        let eye = center + out * reach * 1.12 / (fov_rad * 0.5 * 0.75).tan();
        let turn =
            Quat::from_rotation_z(bearing + std::f32::consts::PI) * Quat::from_rotation_y(rise);
        let camera = SensorSpec {
            name: Name::new("portrait"),
            kind: sensor::CAMERA,
            outputs: output::COLOR,
            width: SIZE[0],
            height: SIZE[1],
            fov_rad,
            parent_from_sensor: Pose::new(eye, turn),
            ..SensorSpec::default()
        };
        let sensors = [camera];
        let (mut planes, byte_len) = layout(&sensors);
        pose_planes(&mut planes, &sensors, &Pose::IDENTITY);
        let mut words = vec![[0u64; 8]; byte_len as usize / 64];
        let bytes = bytemuck::cast_slice_mut(&mut words);
        let mut jobs = [BundleJob {
            parent: protocol::ActorId::NONE,
            sensors: &sensors,
            planes: &planes,
            out: bytes,
        }];
        self.tracer.measure(&self.scene, &self.world, &mut jobs)?;
        let bytes: &[u8] = bytemuck::cast_slice(&words);
        let pixels = &bytes[planes[0].offset as usize..][..planes[0].byte_len as usize];
        Ok(pixels.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect())
    }
}

/// Pictures side by side in one image.
struct Sheet {
    columns: usize,
    size: [u32; 2],
    pixels: Vec<u8>,
}

impl Sheet {
    fn new(columns: usize, rows: usize) -> Sheet {
        let size = [columns * TILE[0], rows * (TILE[1] + WORDS)];
        let pixels = vec![250; size[0] * size[1] * 3];
        Sheet { columns, size: size.map(|side| side as u32), pixels }
    }

    fn put(&mut self, place: usize, picture: &[u8], id: &str) {
        let (left, top) =
            (place % self.columns * TILE[0], place / self.columns * (TILE[1] + WORDS));
        let fine = SIZE[0] as usize / TILE[0];
        for y in 0..TILE[1] {
            for x in 0..TILE[0] {
                let mean = |channel: usize| {
                    let sum: u32 = (0..fine * fine)
                        .map(|k| {
                            let at = (y * fine + k / fine) * SIZE[0] as usize + x * fine + k % fine;
                            u32::from(picture[at * 3 + channel])
                        })
                        .sum();
                    (sum / (fine * fine) as u32) as u8
                };
                self.dot(left + x, top + y, [mean(0), mean(1), mean(2)]);
            }
        }
        // The prefix that all ids of a kind share is left out.
        let short = id.trim_start_matches("vehicle.").trim_start_matches("static.prop.");
        let short = short.trim_start_matches("walker.pedestrian.");
        let [across, down] = glyphs::SIZE;
        for (letter, character) in short.chars().enumerate() {
            for (column, row) in (0..across).flat_map(|c| (0..down).map(move |r| (c, r))) {
                if glyphs::is_set(character, column, row) {
                    let (x, y) = (left + 6 + letter * 8 + column * 2, top + TILE[1] + 3 + row * 2);
                    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                        self.dot(x + dx, y + dy, [20, 20, 24]);
                    }
                }
            }
        }
    }

    fn dot(&mut self, x: usize, y: usize, rgb: [u8; 3]) {
        let width = self.size[0] as usize;
        if x < width && y < self.size[1] as usize {
            self.pixels[(y * width + x) * 3..][..3].copy_from_slice(&rgb);
        }
    }
}

fn write(path: &Path, [width, height]: [u32; 2], pixels: &[u8]) -> anyhow::Result<()> {
    let file = fs::File::create(path).with_context(|| path.display().to_string())?;
    let mut encoder = png::Encoder::new(BufWriter::new(file), width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(())
}

/// Returns the name of a kind, as in file names and JSON.
pub(super) fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Vehicle => "vehicle",
        Kind::Walker => "walker",
        Kind::Prop => "prop",
        Kind::TrafficLight => "traffic_light",
    }
}
