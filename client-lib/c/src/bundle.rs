//! Cameras and lidars, and what they measured.
#![expect(unsafe_code, reason = "names of C functions")]

use std::{
    ffi::{c_char, c_void},
    mem::MaybeUninit,
    ptr,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU32, Ordering},
    },
    time::Duration,
};

use client_lib::{
    ActorId, CameraEffects, CameraOptions, CameraOutputs, Elevations, Exposure, Intrinsics, Lens,
    LidarModel, LidarOptions, LidarOutputs, Measurement, Sensor, SensorBundle, ToneCurve,
    UnknownLidarModel, wire::ELEVATIONS_MAX,
};

use crate::{
    argument::{place, text, values},
    client::{OmnibusClient, enter, lock},
    radar_model::RadarModel,
    status::{Fault, OmnibusStatus, call},
    world::OmnibusPose,
};

/// Camera: red, green, blue, 255; sRGB, 4 bytes a pixel.
pub const OMNIBUS_OUTPUT_COLOR: u32 = 1;
/// Camera: metres along the optical axis, of a fisheye from the camera; one float a pixel.
pub const OMNIBUS_OUTPUT_DEPTH: u32 = 2;
/// Camera: the semantic tag, one byte a pixel.
pub const OMNIBUS_OUTPUT_TAG: u32 = 4;
/// Camera: the actor's id, or that of a static object with the top bit set; one uint32_t a pixel.
pub const OMNIBUS_OUTPUT_INSTANCE: u32 = 8;
/// Lidar: x, y, z in sensor space (metres) and intensity (0 to 1), four floats a ray; zeros where
/// nothing was hit. Column by column, and in each column from the highest channel down.
pub const OMNIBUS_OUTPUT_POINTS: u32 = 16;
/// Lidar: instance and semantic tag, two uint32_t a ray.
pub const OMNIBUS_OUTPUT_LABELS: u32 = 32;
/// Lidar: as OMNIBUS_OUTPUT_POINTS, of the last return of each ray, or of the second strongest if the last
/// is the strongest.
pub const OMNIBUS_OUTPUT_LAST_POINTS: u32 = 256;
/// Lidar: as OMNIBUS_OUTPUT_LABELS, of the returns of OMNIBUS_OUTPUT_LAST_POINTS.
pub const OMNIBUS_OUTPUT_LAST_LABELS: u32 = 512;

/// Lidar: each column starts where the sensor was at its time, and its points are in sensor space at that
/// time. Needs rotation_rate_hz or prism_hz.
pub const OMNIBUS_LIDAR_SWEEP: u32 = 1;
/// Lidar: fog, rain and spray attenuate pulses and reflect them.
pub const OMNIBUS_LIDAR_WEATHER: u32 = 2;

/// The most measurements of one bundle that may be held at a time.
pub const OMNIBUS_HELD_MAX: u32 = 7;

/// Lens: a pinhole.
pub const OMNIBUS_LENS_PINHOLE: u32 = 0;
/// Lens: radial and tangential distortion (Brown 1971); coefficients k1, k2, p1, p2, k3 as in OpenCV's calib3d.
pub const OMNIBUS_LENS_BROWN_CONRADY: u32 = 1;
/// Lens: a fisheye (Kannala and Brandt 2006); coefficients k1 to k4 as in OpenCV's fisheye. Depth is the
/// distance from the camera.
pub const OMNIBUS_LENS_FISHEYE: u32 = 2;

/// Lens of a camera; all 0 is a pinhole with the field of view of its camera.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct OmnibusLens {
    /// One of OMNIBUS_LENS_….
    pub model: u32,
    /// Focal lengths along the rows and the columns of the image, pixels. Both 0: the field of view gives
    /// them, and the principal point is the middle of the image.
    pub focal_px: [f32; 2],
    /// Column and row of the principal point, pixels. The centre of pixel (0, 0) lies at (0.5, 0.5): add 0.5
    /// to the numbers of OpenCV and ROS.
    pub center_px: [f32; 2],
    /// Coefficients in the order of the model; the others are 0.
    pub coefficients: [f32; 5],
    /// Fisheye: largest angle between ray and optical axis, radians, at most pi; the image is black beyond.
    /// 0: as far as the formula holds.
    pub max_angle_rad: f32,
}

impl OmnibusLens {
    fn checked(&self) -> Result<Lens, Fault> {
        let [a, b, c, d, e] = self.coefficients;
        let unused = |from: usize| match self.coefficients.iter().skip(from).find(|k| **k != 0.0) {
            Some(k) => Err(Fault::argument(format!(
                "lens.coefficients has {k} after the {from} coefficients of model {}",
                self.model
            ))),
            None => Ok(()),
        };
        let max_angle_rad = Some(self.max_angle_rad).filter(|angle| *angle != 0.0);
        match self.model {
            OMNIBUS_LENS_FISHEYE => {
                unused(4).map(|()| Lens::Fisheye { k: [a, b, c, d], max_angle_rad })
            }
            _ if max_angle_rad.is_some() => {
                Err(Fault::argument("lens.max_angle_rad is only for OMNIBUS_LENS_FISHEYE"))
            }
            OMNIBUS_LENS_PINHOLE => unused(0).map(|()| Lens::Pinhole),
            OMNIBUS_LENS_BROWN_CONRADY => {
                Ok(Lens::BrownConrady { k1: a, k2: b, p1: c, p2: d, k3: e })
            }
            other => Err(Fault::argument(format!(
                "lens.model is {other}, not 0 (pinhole), 1 (Brown-Conrady) or 2 (fisheye)"
            ))),
        }
    }
}

/// Exposure: by the weather, the same for every image of a weather.
pub const OMNIBUS_EXPOSURE_WEATHER: u32 = 0;
/// Exposure: by the brightness of the image itself.
pub const OMNIBUS_EXPOSURE_AUTOMATIC: u32 = 1;
/// Exposure: by iso, shutter_secs and f_number.
pub const OMNIBUS_EXPOSURE_MANUAL: u32 = 2;

/// Effects of a camera on its colour image; all 0 is none. docs/sensors.md has the formulas.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct OmnibusEffects {
    /// One of OMNIBUS_EXPOSURE_….
    pub exposure: u32,
    /// Exposure compensation, stops; an image is twice as bright with each.
    pub compensation_ev: f32,
    /// Automatic exposure: smallest and largest exposure value at ISO 100. Both 0: 11 and 17.
    pub ev_limits: [f32; 2],
    /// Manual exposure: sensitivity, ISO 12232.
    pub iso: f32,
    /// Manual exposure: exposure time.
    pub shutter_secs: f32,
    /// Manual exposure: focal length divided by the diameter of the entrance pupil.
    pub f_number: f32,
    /// Share of the natural vignetting (the fourth power of the cosine of the angle from the axis), 0 to 1.
    pub vignette: f32,
    /// Share of the light that the lens scatters around each point, 0 to 1.
    pub bloom: f32,
    /// Standard deviation of the inner part of that light, as a share of the width of the image. 0: 0.01.
    pub bloom_radius: f32,
    /// Share by which the red image is larger than the green one, and the green one than the blue one.
    pub chromatic_aberration: f32,
    /// Electrons in a pixel of exposed radiance 1 at ISO 100. 0: no noise.
    pub white_electrons: f32,
    /// Standard deviation of the noise of reading a pixel, electrons.
    pub read_electrons: f32,
    /// Colour temperature of the light that is shown white, kelvin. 0: 6500.
    pub temperature_k: f32,
    /// Offset of that light towards magenta, -1 to 1.
    pub tint: f32,
    /// The image is encoded with the power 1 / gamma. 0: with the curve of sRGB.
    pub gamma: f32,
    /// Slope, toe, shoulder, black clip and white clip of Unreal's filmic tone curve. All 0: the tone curve
    /// of cameras without effects.
    pub filmic: [f32; 5],
    /// Rolling shutter: time from the reading of the first row to that of the last, which is the time of the
    /// frame. It bends every image of the camera.
    pub readout_secs: f32,
    /// Motion blur: time before that of the frame during which each row is exposed. 0: an instant.
    pub blur_secs: f32,
    /// Diameter of the entrance pupil, metres, which gives the depth of field. 0: everything is sharp.
    pub aperture_m: f32,
    /// Distance along the optical axis of what is sharp, metres.
    pub focus_m: f32,
}

impl OmnibusEffects {
    fn checked(&self) -> Result<CameraEffects, Fault> {
        let given = |value: f32| Some(value).filter(|value| *value != 0.0);
        let exposure = match self.exposure {
            OMNIBUS_EXPOSURE_WEATHER => Exposure::Weather,
            OMNIBUS_EXPOSURE_AUTOMATIC if self.ev_limits == [0.0; 2] => Exposure::AUTOMATIC,
            OMNIBUS_EXPOSURE_AUTOMATIC => {
                let [ev_min, ev_max] = self.ev_limits;
                Exposure::Automatic { ev_min, ev_max }
            }
            OMNIBUS_EXPOSURE_MANUAL => Exposure::Manual {
                iso: self.iso,
                shutter_secs: self.shutter_secs,
                f_number: self.f_number,
            },
            other => {
                return Err(Fault::argument(format!(
                    "effects.exposure is {other}, not 0 (weather), 1 (automatic) or 2 (manual)"
                )));
            }
        };
        let none = CameraEffects::NONE;
        let [slope, toe, shoulder, black_clip, white_clip] = self.filmic;
        let tone_curve = if self.filmic == [0.0; 5] {
            ToneCurve::Hable
        } else {
            ToneCurve::Filmic { slope, toe, shoulder, black_clip, white_clip }
        };
        Ok(none
            .exposure(exposure)
            .compensation_ev(self.compensation_ev)
            .vignette(self.vignette)
            .bloom(self.bloom)
            .bloom_radius(given(self.bloom_radius).unwrap_or(none.bloom_radius))
            .chromatic_aberration(self.chromatic_aberration)
            .white_electrons(given(self.white_electrons))
            .read_electrons(self.read_electrons)
            .temperature_k(given(self.temperature_k).unwrap_or(none.temperature_k))
            .tint(self.tint)
            .gamma(given(self.gamma))
            .tone_curve(tone_curve)
            .readout_secs(self.readout_secs)
            .blur_secs(self.blur_secs)
            .aperture_m(self.aperture_m)
            .focus_m(self.focus_m))
    }
}

/// A camera; pixel (0, 0) is at the top left.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct OmnibusCamera {
    /// parent_from_sensor: in the space of the actor that carries it. Sensor space is x forward,
    /// y left, z up.
    pub pose: OmnibusPose,
    /// Width of the image, pixels.
    pub width: u32,
    /// Height of the image, pixels.
    pub height: u32,
    /// Horizontal field of view, radians, above 0 and below pi, of a fisheye below 2 pi; pixels are square.
    /// Without effect if the lens has focal lengths.
    pub fov_rad: f32,
    /// Bits OMNIBUS_OUTPUT_… of a camera, at least one.
    pub outputs: u32,
    /// How many measurements may be held at a time, 1 to OMNIBUS_HELD_MAX.
    pub held_max: u32,
    /// Lens.
    pub lens: OmnibusLens,
    /// Effects on the colour image.
    pub effects: OmnibusEffects,
}

/// A lidar. All fields from rotation_rate_hz on may be 0: it measures its whole field of view in every
/// frame, without noise.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct OmnibusLidar {
    /// parent_from_sensor: in the space of the actor that carries it. Sensor space is x forward,
    /// y left, z up.
    pub pose: OmnibusPose,
    /// Number of channels (beams), spaced equally between the two elevations.
    pub channels: u32,
    /// Azimuth steps.
    pub columns: u32,
    /// Horizontal field of view, radians; 2 pi is a full turn.
    pub fov_rad: f32,
    /// Elevation of the lowest channel, radians, positive upwards.
    pub lower_rad: f32,
    /// Elevation of the highest channel, radians, positive upwards.
    pub upper_rad: f32,
    /// Longest range, metres.
    pub range_m: f32,
    /// Bits OMNIBUS_OUTPUT_… of a lidar, at least one.
    pub outputs: u32,
    /// How many measurements may be held at a time, 1 to OMNIBUS_HELD_MAX.
    pub held_max: u32,
    /// Revolutions per second; 0: the whole field of view at one instant.
    pub rotation_rate_hz: f32,
    /// Turns per second of the two prisms of a Risley scanner, whose beams draw a rosette with the diameter
    /// fov_rad; both 0: columns and channels.
    pub prism_hz: [f32; 2],
    /// Standard deviation of the range, metres.
    pub noise_m: f32,
    /// Full angle of the cone of a beam, radians, at most 0.1; 0: a ray.
    pub divergence_rad: f32,
    /// Bits OMNIBUS_LIDAR_….
    pub flags: u32,
    /// Elevations of the channels, the highest first, radians; at most 128. NULL: spaced equally between
    /// lower_rad and upper_rad. Read by omnibus_create_lidar() only.
    pub elevations_rad: *const f32,
}

/// A camera, lidar or radar in the simulator, and the stream of its measurements. One thread at a time
/// uses it.
pub struct OmnibusBundle {
    bundle: Mutex<SensorBundle>,
    held: Arc<AtomicU32>,
    held_max: u32,
    /// If it is a radar.
    radar: Option<RadarModel>,
}

impl OmnibusBundle {
    /// Calls `receive` if one more measurement may be held.
    fn take(
        &self,
        receive: impl FnOnce(&mut SensorBundle) -> Result<Option<Measurement>, Fault>,
    ) -> Result<Option<Box<OmnibusMeasurement>>, Fault> {
        let mut bundle = lock(&self.bundle, "bundle")?;
        let held = self.held.load(Ordering::Acquire);
        if held >= self.held_max {
            return Err(Fault::new(
                OmnibusStatus::Held,
                format!(
                    "{held} measurements of this bundle are held, its held_max; release one, or \
                     create the bundle with a larger held_max, at most {OMNIBUS_HELD_MAX}"
                ),
            ));
        }
        let measured = receive(&mut bundle)?;
        Ok(measured.map(|measured| {
            self.held.fetch_add(1, Ordering::AcqRel);
            let (held, radar) = (Arc::clone(&self.held), self.radar);
            Box::new(OmnibusMeasurement { measured, held, radar })
        }))
    }
}

/// What a bundle measured at one frame, in the renderer's own memory. Any number of threads may
/// read it.
pub struct OmnibusMeasurement {
    pub(crate) measured: Measurement,
    /// Of its bundle.
    held: Arc<AtomicU32>,
    /// Of its bundle.
    pub(crate) radar: Option<RadarModel>,
}

impl Drop for OmnibusMeasurement {
    fn drop(&mut self) {
        self.held.fetch_sub(1, Ordering::AcqRel);
    }
}

/// One output of a measurement.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct OmnibusData {
    /// The values, as the output says. Read-only, in shared memory; valid until the measurement is
    /// released.
    pub bytes: *const c_void,
    /// Their size in bytes.
    pub byte_len: usize,
    /// Camera: pixels across. Lidar: azimuth steps.
    pub width: u32,
    /// Camera: pixels down. Lidar: channels.
    pub height: u32,
    /// The measured frame.
    pub frame: u64,
    /// Simulated time of that frame.
    pub sim_time_nanos: u64,
    /// world_from_sensor at that frame.
    pub world_from_sensor: OmnibusPose,
}

pub(crate) fn create(
    client: Option<&OmnibusClient>,
    parent: u32,
    sensor: Sensor,
    held_max: u32,
    radar: Option<RadarModel>,
    bundle: Option<&mut MaybeUninit<Box<OmnibusBundle>>>,
) -> Result<(), Fault> {
    let place = place(bundle, "bundle")?;
    if !(1..=OMNIBUS_HELD_MAX).contains(&held_max) {
        let text = format!("held_max is {held_max}, not 1 to OMNIBUS_HELD_MAX, {OMNIBUS_HELD_MAX}");
        return Err(Fault::argument(text));
    }
    let name = sensor.name.clone();
    let mut client = enter(client)?;
    // One more than may be held: the one that arrives.
    let created = client.create_bundle(&name, ActorId(parent), [sensor], held_max + 1)?;
    place.write(Box::new(OmnibusBundle {
        bundle: Mutex::new(created),
        held: Arc::default(),
        held_max,
        radar,
    }));
    Ok(())
}

fn unknown_outputs(outputs: u32) -> Fault {
    Fault::argument(format!("outputs are {outputs:#x}, which has bits of no output of this sensor"))
}

/// Mounts a camera on an actor, or in the world (`parent` 0). It measures from the next frame on.
/// `*bundle` belongs to the caller until it is given to omnibus_destroy_bundle().
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_create_camera(
    client: Option<&OmnibusClient>,
    name: *const c_char,
    parent: u32,
    camera: Option<&OmnibusCamera>,
    bundle: Option<&mut MaybeUninit<Box<OmnibusBundle>>>,
) -> OmnibusStatus {
    call("omnibus_create_camera", || {
        let OmnibusCamera { pose, width, height, fov_rad, outputs, held_max, lens, effects } =
            *camera.ok_or_else(|| Fault::null("camera"))?;
        let outputs = CameraOutputs::from_bits(outputs).ok_or_else(|| unknown_outputs(outputs))?;
        let intrinsics = ([lens.focal_px, lens.center_px] != [[0.0; 2]; 2])
            .then(|| Intrinsics::new(lens.focal_px, lens.center_px));
        let options = CameraOptions::new(width, height, fov_rad)
            .outputs(outputs)
            .intrinsics(intrinsics)
            .lens(lens.checked()?)
            .effects(effects.checked()?);
        let sensor = Sensor::new(text(name, "name")?, pose.checked("pose")?, options);
        create(client, parent, sensor, held_max, None, bundle)
    })
}

/// Mounts a lidar: as omnibus_create_camera().
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_create_lidar(
    client: Option<&OmnibusClient>,
    name: *const c_char,
    parent: u32,
    lidar: Option<&OmnibusLidar>,
    bundle: Option<&mut MaybeUninit<Box<OmnibusBundle>>>,
) -> OmnibusStatus {
    call("omnibus_create_lidar", || {
        let lidar = *lidar.ok_or_else(|| Fault::null("lidar"))?;
        let outputs = LidarOutputs::from_bits(lidar.outputs);
        let outputs = outputs.ok_or_else(|| unknown_outputs(lidar.outputs))?;
        let between = [lidar.lower_rad, lidar.upper_rad];
        let options = LidarOptions::new(lidar.channels, lidar.columns, between, lidar.range_m)
            .fov_rad(lidar.fov_rad)
            .noise_m(lidar.noise_m)
            .rotation_rate_hz(Some(lidar.rotation_rate_hz).filter(|hz| *hz != 0.0))
            .prism_hz(Some(lidar.prism_hz).filter(|hz| *hz != [0.0; 2]))
            .divergence_rad(lidar.divergence_rad)
            .sweep(lidar.flags & OMNIBUS_LIDAR_SWEEP != 0)
            .weather(lidar.flags & OMNIBUS_LIDAR_WEATHER != 0)
            .elevations(lidar.elevations()?)
            .outputs(outputs);
        let sensor = Sensor::lidar(text(name, "name")?, lidar.pose.checked("pose")?, options);
        create(client, parent, sensor, lidar.held_max, None, bundle)
    })
}

impl OmnibusLidar {
    /// Reads the table of elevations and checks the flags.
    fn elevations(&self) -> Result<Option<Elevations>, Fault> {
        let known = OMNIBUS_LIDAR_SWEEP | OMNIBUS_LIDAR_WEATHER;
        if self.flags & !known != 0 {
            let flags = self.flags;
            return Err(Fault::argument(format!("flags are {flags:#x}; use bits of {known:#x}")));
        }
        if self.elevations_rad.is_null() {
            return Ok(None);
        }
        let count = self.channels as usize;
        if count > ELEVATIONS_MAX {
            return Err(Fault::argument(format!(
                "{count} channels have elevations of their own; the limit is {ELEVATIONS_MAX}"
            )));
        }
        let table = values(self.elevations_rad, "elevations_rad", count)?;
        Ok(Some(Elevations::from(table)))
    }
}

/// Sets the fields of a lidar by the data sheet of a model ("vlp-16", "hdl-64e", "os1-128" or
/// "livox-mid-40"), with as many columns as it fires in `frame_secs`, the time step of the world. Pose,
/// outputs, held_max, divergence_rad and flags are left to the caller.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_lidar_model(
    model: *const c_char,
    frame_secs: f64,
    lidar: Option<&mut OmnibusLidar>,
) -> OmnibusStatus {
    call("omnibus_lidar_model", || {
        let lidar = lidar.ok_or_else(|| Fault::null("lidar"))?;
        let model: LidarModel = text(model, "model")?
            .parse()
            .map_err(|why: UnknownLidarModel| Fault::argument(why.to_string()))?;
        let frame = Duration::try_from_secs_f64(frame_secs)
            .map_err(|why| Fault::argument(format!("frame_secs is {frame_secs}: {why}")))?;
        let options = model.options(frame);
        *lidar = OmnibusLidar {
            channels: options.channels,
            columns: options.columns,
            fov_rad: options.fov_rad,
            lower_rad: options.lower_rad,
            upper_rad: options.upper_rad,
            range_m: options.range_m,
            rotation_rate_hz: options.rotation_rate_hz.unwrap_or(0.0),
            prism_hz: options.prism_hz.unwrap_or_default(),
            noise_m: options.noise_m,
            elevations_rad: model.elevations_rad().map_or(ptr::null(), <[f32]>::as_ptr),
            ..*lidar
        };
        Ok(())
    })
}

/// Returns the newest measurement that was not received yet; older ones are dropped. `*measurement`
/// is NULL if there is none. Does not wait. The caller gives it to omnibus_release().
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_latest(
    bundle: Option<&OmnibusBundle>,
    measurement: Option<&mut MaybeUninit<Option<Box<OmnibusMeasurement>>>>,
) -> OmnibusStatus {
    call("omnibus_latest", || {
        let place = place(measurement, "measurement")?;
        let bundle = bundle.ok_or_else(|| Fault::null("bundle"))?;
        place.write(bundle.take(|bundle| Ok(bundle.latest()?))?);
        Ok(())
    })
}

/// Waits for the next measurement of a bundle: for pipelined worlds, and those on their own clock.
/// The caller gives it to omnibus_release().
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_await_measurement(
    client: Option<&OmnibusClient>,
    bundle: Option<&OmnibusBundle>,
    measurement: Option<&mut MaybeUninit<Option<Box<OmnibusMeasurement>>>>,
) -> OmnibusStatus {
    call("omnibus_await_measurement", || {
        let place = place(measurement, "measurement")?;
        let bundle = bundle.ok_or_else(|| Fault::null("bundle"))?;
        let measured = bundle.take(|bundle| Ok(Some(enter(client)?.await_measurement(bundle)?)))?;
        // It returns a measurement or an error.
        place.write(measured);
        Ok(())
    })
}

/// Returns one output of a measurement, OMNIBUS_OUTPUT_…: where it lies, without a copy.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_data(
    measurement: Option<&OmnibusMeasurement>,
    output: u32,
    data: Option<&mut MaybeUninit<OmnibusData>>,
) -> OmnibusStatus {
    call("omnibus_data", || {
        let place = place(data, "data")?;
        let measured = &measurement.ok_or_else(|| Fault::null("measurement"))?.measured;
        let found = measured.plane(0, output).zip(measured.data(0, output));
        let (plane, bytes) = found.ok_or_else(|| {
            Fault::argument(format!(
                "the sensor has no output {output:#x}; set it in outputs when it is created"
            ))
        })?;
        place.write(OmnibusData {
            bytes: ptr::from_ref(bytes).cast(),
            byte_len: bytes.len(),
            width: plane.width,
            height: plane.height,
            frame: measured.frame().0,
            sim_time_nanos: measured.header().stamp.sim_time_nanos,
            world_from_sensor: plane.world_from_sensor.into(),
        });
        Ok(())
    })
}

/// Gives a measurement's memory back to the renderer; NULL is ignored.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_release(measurement: Option<Box<OmnibusMeasurement>>) {
    call("omnibus_release", || {
        drop(measurement);
        Ok(())
    });
}

/// Destroys a bundle; NULL is ignored. Its measurements stay valid until they are released.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_destroy_bundle(bundle: Option<Box<OmnibusBundle>>) {
    call("omnibus_destroy_bundle", || {
        drop(bundle);
        Ok(())
    });
}
