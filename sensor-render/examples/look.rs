//! Renders street poses of a town into PNG pictures:
//! `look OUT_DIR [MAP] [WIDTHxHEIGHT] [POSE,…] [cpu|gpu:N] [noon,dusk,night,rain,fog,overcast] [low|standard|epic]
//! [pinhole|brown-conrady|fisheye] [EFFECTS,…]`, with the names of effects in sample/mod.rs. A pose is a number, or
//! the id of a vehicle, which stands in front of the camera of pose 0, twice: as it comes and goes, or turned by
//! the degrees after an `@` and the same from behind. The camera has driven 1 m and turned since
//! the frame before.

mod sample;

use std::error::Error;
use std::path::Path;

use glam::{Quat, Vec3};
use omnibus_sensor_render::{BundleJob, Scene, Tracer, World, pose_planes};
use protocol::{ActorId, ActorState, Frame, Pose, SensorSpec, Stamp, Weather, layout, output};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |index: usize, or: &str| arguments.get(index).map_or(or.into(), String::clone);
    let folder = argument(0, "out");
    let town = sample::Sample::named(&argument(1, "Millbrook"))?;
    let size = argument(2, "800x600");
    let (width, height) = size.split_once('x').ok_or("the size is WIDTHxHEIGHT")?;
    let (width, height) = (width.parse()?, height.parse()?);
    let scene = Scene::of_town(&town.town)?;
    let mut tracer = Tracer::open(argument(4, "cpu").parse()?, 0)?;
    std::fs::create_dir_all(&folder)?;
    let quality = argument(6, "low").parse()?;
    let lens_name = argument(7, "pinhole");
    let lens = sample::lens(&lens_name);
    let fov_rad = if lens_name == "fisheye" { 3.3 } else { std::f32::consts::FRAC_PI_2 };
    let actors = town.traffic(100, 3);
    for weather_name in argument(5, "noon").split(',') {
        let mut world = World::new();
        world.set_quality(quality);
        let stamp = Stamp { frame: Frame(1), sim_time_nanos: 50_000_000, ..Default::default() };
        let weather = weather(weather_name);
        for pose in argument(3, "0,1,2,3").split(',') {
            let (id, yaw_deg) = pose.split_once('@').unwrap_or((pose, "200"));
            let (vehicle, yaw_deg) = (town::blueprint(id), yaw_deg.parse::<f32>()?);
            let stand = town.street_pose(if vehicle.is_some() { 0 } else { pose.parse()? });
            let shown = vehicle.into_iter().flat_map(|(blueprint, one)| {
                let turned = [(2.6, yaw_deg, 1, 0x1816b0), (-2.6, yaw_deg - 222.0, 2, 0x827c78)];
                turned.map(|(left, yaw_deg, id, color)| ActorState {
                    actor_id: ActorId(2_000_000 + id),
                    blueprint,
                    kind: protocol::kind::VEHICLE,
                    pose: stand.then(&Pose::new(
                        Vec3::new(3.5 + one.half_extents_m.x, left, -1.7),
                        Quat::from_rotation_z(yaw_deg.to_radians()),
                    )),
                    color,
                    ..Default::default()
                })
            });
            let actors = [&actors[..], &shown.collect::<Vec<_>>()].concat();
            let back = Pose::new(Vec3::new(-1.0, 0.0, 0.0), Quat::from_rotation_z(0.03));
            let [now, before] = [stand, stand.then(&back)].map(|pose| {
                let id = ActorId(1_000_000);
                let carrier = ActorState {
                    actor_id: id,
                    blueprint: u32::MAX,
                    pose,
                    velocity_mps: (stand.rotation() * Vec3::X * 20.0).to_array(),
                    ..Default::default()
                };
                [&actors[..], &[carrier]].concat()
            });
            for effects_name in argument(8, "none").split(',') {
                let effects = sample::effects(effects_name);
                let camera =
                    SensorSpec { lens, fov_rad, effects, ..sample::camera("front", width, height) };
                let sensors = [SensorSpec { outputs: output::COLOR, ..camera }];
                world.place(&scene, stamp, 50_000_000, &weather, &now, sample::paint);
                world.track_motion(&scene, &before, &now);
                world.place_slices(&scene, &before, &now, &sensors, sample::paint);
                let (mut planes, byte_len) = layout(&sensors);
                pose_planes(&mut planes, &sensors, &stand);
                let mut words = vec![[0u64; 8]; byte_len as usize / 64];
                let out = bytemuck::cast_slice_mut(&mut words);
                let mut jobs = [BundleJob {
                    parent: ActorId(1_000_000),
                    sensors: &sensors,
                    planes: &planes,
                    out,
                }];
                tracer.measure(&scene, &world, &mut jobs)?;
                let bytes: &[u8] = bytemuck::cast_slice(&words);
                let pixels = &bytes[planes[0].offset as usize..][..planes[0].byte_len as usize];
                let path =
                    Path::new(&folder).join(format!("{weather_name}-{pose}-{effects_name}.png"));
                write(&path, width, height, pixels)?;
                println!("{}", path.display());
            }
        }
    }
    Ok(())
}

fn write(path: &Path, width: u32, height: u32, pixels: &[u8]) -> Result<(), Box<dyn Error>> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    Ok(encoder.write_header()?.write_image_data(pixels)?)
}

fn weather(name: &str) -> Weather {
    let noon = Weather::default();
    match name {
        "dusk" => Weather { sun_altitude_rad: 0.12, ..noon },
        "night" => Weather { sun_altitude_rad: -0.6, ..noon },
        "rain" => Weather {
            cloudiness: 90.0,
            precipitation: 60.0,
            precipitation_deposits: 60.0,
            wetness: 80.0,
            ..noon
        },
        "fog" => Weather { fog_density: 60.0, cloudiness: 60.0, ..noon },
        "overcast" => Weather { cloudiness: 95.0, ..noon },
        _ => noon,
    }
}
