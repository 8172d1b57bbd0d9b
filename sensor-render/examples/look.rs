//! Renders a street pose of the made-up town into PNG pictures:
//! `look OUT_DIR [WIDTHxHEIGHT] [POSE,POSE…] [cpu|gpu:N] [noon|dusk|night|rain|fog|overcast]`.

mod sample;

use std::error::Error;
use std::path::Path;

use bus::{Frame, Pose, Stamp, Weather, layout, output};
use sensor_render::{BlueprintMesh, RigJob, Scene, Tracer, World, pose_planes};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |index: usize, or: &str| arguments.get(index).map_or(or.into(), String::clone);
    let folder = argument(0, "out");
    let size = argument(1, "800x600");
    let (width, height) = size.split_once('x').ok_or("the size is WIDTHxHEIGHT")?;
    let (width, height) = (width.parse()?, height.parse()?);
    let town = sample::Sample::new(6, 1);
    let meshes: Vec<BlueprintMesh> = town.cars.iter().map(|mesh| BlueprintMesh { mesh }).collect();
    let scene = Scene::new(&town.mesh, &meshes);
    let mut tracer = Tracer::open(argument(3, "cpu").parse()?, 0)?;
    std::fs::create_dir_all(&folder)?;
    let weathers = argument(4, "noon");
    for weather_name in weathers.split(',') {
        for pose in argument(2, "0,1,2,3").split(',') {
            let mut world = World::new();
            let stamp = Stamp { frame: Frame(1), sim_time_nanos: 50_000_000, ..Default::default() };
            let weather = weather(weather_name);
            world.place(&scene, stamp, 50_000_000, &weather, &town.traffic(100, 3), sample::paint);
            let sensors = [sample::camera("front", width, height)];
            let (mut planes, byte_len) = layout(&sensors);
            let world_from_sensor = town.street_pose(pose.parse()?);
            pose_planes(&mut planes, &sensors, &world_from_sensor.then(&Pose::IDENTITY));
            let mut words = vec![[0u64; 8]; byte_len as usize / 64];
            let out = bytemuck::cast_slice_mut(&mut words);
            tracer.measure(
                &scene,
                &world,
                &mut [RigJob { sensors: &sensors, planes: &planes, out }],
            )?;
            let color =
                planes.iter().find(|plane| plane.output == output::COLOR).ok_or("no colour")?;
            let bytes: &[u8] = bytemuck::cast_slice(&words);
            let path = Path::new(&folder).join(format!("{weather_name}-{pose}.png"));
            let file = std::io::BufWriter::new(std::fs::File::create(&path)?);
            let mut encoder = png::Encoder::new(file, width, height);
            encoder.set_color(png::ColorType::Rgba);
            encoder.set_depth(png::BitDepth::Eight);
            let pixels = &bytes[color.offset as usize..][..color.byte_len as usize];
            encoder.write_header()?.write_image_data(pixels)?;
            println!("{}", path.display());
        }
    }
    Ok(())
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
