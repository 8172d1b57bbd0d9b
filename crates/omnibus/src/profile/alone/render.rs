//! The renderer alone: all sensors together, then split by sensor, shadow rays and encoding.

use anyhow::Context;
use bake::Cache;
use bus::clock;
use protocol::{ActorId, Episode, Plane, SensorSpec, flag, layout, output};
use sensor_render::{BundleJob, Quality, Scene, Tracer, World, pose_planes};

use super::input::{RecordedInput, series};
use crate::{
    collect::{CAMERA_OUTPUTS, Encoder, ImageStorage, default_sensors},
    profile::{args::ProfileArgs, report::Series},
    sensors_file::sensors_of,
};

/// What the renderer took.
pub(super) struct Measured {
    pub(super) series: Vec<Series>,
    pub(super) notes: Vec<String>,
}

/// Measures the sensors on the first vehicle of each frame.
pub(super) fn measure(
    args: &ProfileArgs,
    episode: &Episode,
    inputs: &[RecordedInput],
) -> anyhow::Result<Measured> {
    let config = args.world.render()?;
    let Episode { map, open_drive, seed } = episode;
    let scene = Scene::of_town(&Cache::from_environment().town(map, open_drive, *seed)?)?;
    let mut tracer =
        if config.null { Tracer::Null } else { Tracer::open(config.device, config.threads)? };
    let sensors = match &args.sensors {
        Some(file) => sensors_of(file)?,
        None => default_sensors(args.width, args.height),
    };
    let parent = carrier(inputs)?;
    let quality = config.quality;
    let mut bench = Bench { scene: &scene, tracer: &mut tracer, inputs, parent, quality };
    // The first pass warms caches and the device.
    bench.pass(&sensors, true, &mut |_, _, _| Ok(()))?;
    let mut encoder = Encoder::default();
    let mut encoding = Vec::new();
    let whole = bench.pass(&sensors, true, &mut |sensors, planes, out| {
        let begin = clock::now_nanos();
        encode(&mut encoder, sensors, planes, out)?;
        encoding.push(clock::now_nanos() - begin);
        Ok(())
    })?;
    let total = whole.update.iter().zip(&whole.trace).map(|(update, trace)| update + trace);
    let mut all = vec![
        series("render", total),
        series("scene update", whole.update.iter().copied()),
        series("all sensors", whole.trace.iter().copied()),
    ];
    for sensor in &sensors {
        let alone = bench.pass(&[*sensor], true, &mut |_, _, _| Ok(()))?;
        let name = format!("sensor {}", sensor.name);
        all.push(series(&name, alone.trace.into_iter()));
    }
    let dark = bench.pass(&sensors, false, &mut |_, _, _| Ok(()))?;
    // In the same frame, with and without; a difference below zero is noise.
    let shadows = whole.trace.iter().zip(&dark.trace).map(|(with, out)| with.saturating_sub(*out));
    all.push(series("shadow rays", shadows));
    all.push(series("encoding", encoding.into_iter()));
    let notes = vec![
        format!("tracer: {}", bench.tracer.describe()),
        "a sensor's time is that of a pass with this sensor alone; shadow rays are the difference \
         to a pass without them; encoding is that of `omnibus collect`, in one thread, after the frame"
            .to_owned(),
    ];
    Ok(Measured { series: all, notes })
}

/// Returns the first vehicle that exists in every frame.
fn carrier(inputs: &[RecordedInput]) -> anyhow::Result<ActorId> {
    let is_vehicle = |id: ActorId| {
        let mut frames = inputs.iter();
        frames.all(|input| input.actors.iter().any(|actor| actor.actor_id == id))
    };
    let first = inputs.first().context("the recording holds no frame")?;
    let vehicles = first.actors.iter().filter(|actor| actor.has(flag::AUTOPILOT));
    let mut ids = vehicles.map(|actor| actor.actor_id);
    ids.find(|id| is_vehicle(*id)).context("no vehicle on autopilot exists in every frame")
}

struct Bench<'a> {
    scene: &'a Scene,
    tracer: &'a mut Tracer,
    inputs: &'a [RecordedInput],
    parent: ActorId,
    quality: Quality,
}

/// The times of one pass over all frames, in nanoseconds.
#[derive(Default)]
struct Pass {
    update: Vec<u64>,
    trace: Vec<u64>,
}

type See<'a> = dyn FnMut(&[SensorSpec], &[Plane], &[u8]) -> anyhow::Result<()> + 'a;

impl Bench<'_> {
    fn pass(
        &mut self,
        sensors: &[SensorSpec],
        has_shadows: bool,
        see: &mut See,
    ) -> anyhow::Result<Pass> {
        let (mut planes, byte_len) = layout(sensors);
        let mut bytes = vec![0u64; byte_len.div_ceil(8) as usize];
        let mut world = World::new();
        world.set_shadows(has_shadows);
        world.set_quality(self.quality);
        let mut before = Vec::new();
        let has_flow = sensors.iter().any(|sensor| sensor.outputs & output::FLOW != 0);
        let mut pass = Pass::default();
        for input in self.inputs {
            let begin = clock::now_nanos();
            world.place(
                self.scene,
                input.stamp,
                input.delta_nanos,
                &input.standing.weather,
                &input.actors,
                |actor| {
                    let [r, g, b, _] = actor.color.to_le_bytes();
                    [r, g, b]
                },
            );
            if has_flow {
                world.track_motion(self.scene, &before, &input.actors);
                before.clone_from(&input.actors);
            }
            let ego = input.actors.iter().find(|actor| actor.actor_id == self.parent);
            pose_planes(&mut planes, sensors, &ego.context("the vehicle is gone")?.pose);
            let placed = clock::now_nanos();
            let out = bytemuck::cast_slice_mut(&mut bytes);
            let job = BundleJob { parent: self.parent, sensors, planes: &planes, out };
            self.tracer.measure(self.scene, &world, &mut [job])?;
            let traced = clock::now_nanos();
            pass.update.push(placed - begin);
            pass.trace.push(traced - placed);
            see(sensors, &planes, bytemuck::cast_slice(&bytes))?;
        }
        Ok(pass)
    }
}

/// Encodes the images of a frame as the collector does.
fn encode(
    encoder: &mut Encoder,
    sensors: &[SensorSpec],
    planes: &[Plane],
    out: &[u8],
) -> anyhow::Result<()> {
    for plane in planes {
        let spec = &sensors[plane.sensor as usize];
        let size = [spec.width, spec.height];
        let data = &out[plane.offset as usize..][..plane.byte_len as usize];
        if CAMERA_OUTPUTS & plane.output != 0 {
            encoder.image(ImageStorage::default(), plane.output, size, data)?;
        }
    }
    Ok(())
}
