//! A sensor of a bundle, described by types.

use std::time::Duration;

use protocol::{Name, Pose, SensorSpec};

use crate::{
    CameraEffects, CameraOptions, CameraOutputs, GnssOptions, ImuOptions, Lens, LidarOptions,
    ObstacleOptions, OdometryOptions, SensorKind, V2xAwarenessOptions, V2xRadioOptions,
};

/// One sensor of a bundle: its name, its pose, when it measures, and its kind with the parameters
/// of that kind.
///
/// [`Client::create_bundle`](crate::Client::create_bundle) mounts sensors on an actor or in the
/// world. Sensor space is right-handed: x forward, y left, z up.
///
/// ```
/// use std::time::Duration;
///
/// use omnibus_client_lib::{CameraOutputs, Pose, Sensor, glam::{Quat, Vec3}};
///
/// let windscreen = Pose::new(Vec3::new(1.5, 0.0, 1.5), Quat::IDENTITY);
/// let front = Sensor::camera("front", windscreen, 800, 600, 1.4)
///     .outputs(CameraOutputs::COLOR | CameraOutputs::DEPTH)
///     .period(Duration::from_millis(100));
/// assert_eq!(front.name, "front");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[must_use = "pass it to Client::create_bundle"]
pub struct Sensor {
    /// Name, unique within the bundle. At most 40 bytes; a longer name is cut.
    pub name: String,
    /// Pose of the sensor in the space of its parent: the actor that carries the bundle, or the
    /// world. Metres, unit quaternion.
    pub parent_from_sensor: Pose,
    /// Simulated time between two measurements, counted from the first frame of the bundle, which
    /// is measured; `None`: every frame. Collisions, lane invasions
    /// and radio messages are reported in the frame in which they happen, whatever the period.
    pub period: Option<Duration>,
    /// Seed of the sensor's noise. The same seed gives the same noise at the same simulated time.
    pub seed: u64,
    /// Kind and parameters.
    pub kind: SensorKind,
}

impl Sensor {
    /// Returns a sensor of a kind at `parent_from_sensor` that measures in every frame, with
    /// seed 0.
    pub fn new(name: &str, parent_from_sensor: Pose, kind: impl Into<SensorKind>) -> Sensor {
        let kind = kind.into();
        Sensor { name: name.to_owned(), parent_from_sensor, period: None, seed: 0, kind }
    }

    /// Returns a pinhole camera of `width` × `height` pixels with a horizontal field of view of
    /// `fov_rad` radians; its output is colour until [`Sensor::outputs`] sets another.
    pub fn camera(
        name: &str,
        parent_from_sensor: Pose,
        width: u32,
        height: u32,
        fov_rad: f32,
    ) -> Sensor {
        Sensor::new(name, parent_from_sensor, CameraOptions::new(width, height, fov_rad))
    }

    /// Returns a lidar.
    pub fn lidar(name: &str, parent_from_sensor: Pose, options: LidarOptions) -> Sensor {
        Sensor::new(name, parent_from_sensor, options)
    }

    /// Returns an inertial measurement unit.
    ///
    /// This and the following sensors are physics sensors, which the host measures in the substeps
    /// of physics. A bundle has either physics sensors or cameras and lidars;
    /// [`Client::tick_and_collect`](crate::Client::tick_and_collect) takes bundles of both.
    pub fn imu(name: &str, parent_from_sensor: Pose, options: ImuOptions) -> Sensor {
        Sensor::new(name, parent_from_sensor, options)
    }

    /// Returns a GNSS receiver.
    pub fn gnss(name: &str, parent_from_sensor: Pose, options: GnssOptions) -> Sensor {
        Sensor::new(name, parent_from_sensor, options)
    }

    /// Returns a speedometer and odometer.
    pub fn odometry(name: &str, parent_from_sensor: Pose, options: OdometryOptions) -> Sensor {
        Sensor::new(name, parent_from_sensor, options)
    }

    /// Returns a sensor of the contacts of its carrier with actors and static objects.
    pub fn collision(name: &str) -> Sensor {
        Sensor::new(name, Pose::IDENTITY, SensorKind::Collision)
    }

    /// Returns a sensor of the lane markings that its carrier crosses.
    pub fn lane_invasion(name: &str) -> Sensor {
        Sensor::new(name, Pose::IDENTITY, SensorKind::LaneInvasion)
    }

    /// Returns a sensor of the nearest obstacle ahead: the first hit of a sphere that is swept
    /// along x.
    pub fn obstacle(name: &str, parent_from_sensor: Pose, options: ObstacleOptions) -> Sensor {
        Sensor::new(name, parent_from_sensor, options)
    }

    /// Returns a V2X station that sends and receives cooperative awareness messages.
    pub fn v2x_awareness(
        name: &str,
        parent_from_sensor: Pose,
        options: V2xAwarenessOptions,
    ) -> Sensor {
        Sensor::new(name, parent_from_sensor, options)
    }

    /// Returns a V2X station that receives texts and sends those of
    /// [`Client::transmit`](crate::Client::transmit).
    pub fn v2x_messages(name: &str, parent_from_sensor: Pose, radio: V2xRadioOptions) -> Sensor {
        Sensor::new(name, parent_from_sensor, SensorKind::V2xMessages(radio))
    }

    /// Sets the outputs of a camera.
    ///
    /// # Panics
    ///
    /// If the sensor is not a camera. The outputs of a lidar are set by
    /// [`LidarOptions::outputs`](LidarOptions::outputs()); other sensors have one output each.
    pub fn outputs(mut self, outputs: CameraOutputs) -> Sensor {
        match &mut self.kind {
            SensorKind::Camera(camera) => camera.outputs = outputs,
            other => panic!("sensor {:?} is not a camera: {other:?}", self.name),
        }
        self
    }

    /// Sets the lens of a camera.
    ///
    /// # Panics
    ///
    /// If the sensor is not a camera.
    pub fn lens(mut self, lens: Lens) -> Sensor {
        match &mut self.kind {
            SensorKind::Camera(camera) => camera.lens = lens,
            other => panic!("sensor {:?} is not a camera: {other:?}", self.name),
        }
        self
    }

    /// Sets the effects of a camera on its colour image.
    ///
    /// # Panics
    ///
    /// If the sensor is not a camera.
    pub fn effects(mut self, effects: CameraEffects) -> Sensor {
        match &mut self.kind {
            SensorKind::Camera(camera) => camera.effects = effects,
            other => panic!("sensor {:?} is not a camera: {other:?}", self.name),
        }
        self
    }

    /// Sets the simulated time between two measurements; zero: every frame.
    pub fn period(mut self, period: Duration) -> Sensor {
        self.period = (!period.is_zero()).then_some(period);
        self
    }

    /// Sets the seed of the sensor's noise.
    pub fn seed(mut self, seed: u64) -> Sensor {
        self.seed = seed;
        self
    }
}

impl From<&Sensor> for SensorSpec {
    fn from(sensor: &Sensor) -> SensorSpec {
        let period = sensor.period.unwrap_or_default();
        SensorSpec {
            name: Name::new(&sensor.name),
            parent_from_sensor: sensor.parent_from_sensor,
            seed: sensor.seed,
            // More than 584 years saturate.
            period_nanos: u64::try_from(period.as_nanos()).unwrap_or(u64::MAX),
            ..sensor.kind.wire()
        }
    }
}

impl From<Sensor> for SensorSpec {
    fn from(sensor: Sensor) -> SensorSpec {
        SensorSpec::from(&sensor)
    }
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};
    use protocol::{
        CamSpec, GnssSpec, ImuSpec, LidarSpec, MessageSpec, ObstacleSpec, OdometrySpec, RadioSpec,
        geodesy, lidar_flag, output, point_attribute, radio,
    };

    use super::*;
    use crate::{
        Geodesy, LidarOutputs, PointAttribute, V2xRadioFlags, V2xScenario,
        wire::{
            cam, camera, collision, gnss, imu, lane_invasion, lidar, message, obstacle, odometry,
        },
    };

    #[track_caller]
    fn assert_same(typed: Sensor, wire: SensorSpec) {
        let typed = SensorSpec::from(typed);
        assert_eq!(typed, wire);
        assert_eq!(bytemuck::bytes_of(&typed), bytemuck::bytes_of(&wire));
    }

    fn mast() -> Pose {
        Pose::new(Vec3::new(0.5, 0.2, 1.5), Quat::from_rotation_z(0.3))
    }

    #[test]
    fn typed_cameras_and_lidars_have_the_bytes_of_the_wire_constructors() {
        let flags = CameraOutputs::DEPTH | CameraOutputs::FLOW;
        assert_same(
            Sensor::camera("front", mast(), 800, 600, 1.4),
            camera("front", mast(), 800, 600, 1.4, output::COLOR),
        );
        assert_same(
            Sensor::camera("front", mast(), 800, 600, 1.4)
                .outputs(flags)
                .seed(9)
                .period(Duration::from_millis(100)),
            SensorSpec {
                seed: 9,
                period_nanos: 100_000_000,
                ..camera("front", mast(), 800, 600, 1.4, output::DEPTH | output::FLOW)
            },
        );
        let options = LidarOptions::new(32, 360, [-0.4, 0.2], 80.0);
        let wire = lidar("roof", mast(), 32, 360, [-0.4, 0.2], 80.0);
        assert_same(Sensor::lidar("roof", mast(), options), wire);
        let options = options
            .outputs(LidarOutputs::POINTS)
            .fov_rad(1.5)
            .noise_m(0.02)
            .dropoff(0.1)
            .attenuation_per_m(0.01)
            .rotation_rate_hz(Some(10.0))
            .point_attribute(PointAttribute::CosIncidence)
            .sweep(true)
            .weather(true)
            .divergence_rad(0.003);
        assert_same(
            Sensor::lidar("roof", mast(), options),
            SensorSpec {
                outputs: output::POINTS,
                fov_rad: 1.5,
                noise_m: 0.02,
                dropoff: 0.1,
                attenuation_per_m: 0.01,
                rotation_rate_hz: 10.0,
                point_attribute: point_attribute::COS_INCIDENCE,
                lidar: LidarSpec {
                    flags: lidar_flag::SWEEP | lidar_flag::WEATHER,
                    divergence_rad: 0.003,
                    ..LidarSpec::default()
                },
                ..wire
            },
        );
        let table = [0.1, -0.05, -0.3];
        let options = LidarOptions::new(9, 360, [0.0; 2], 80.0).prism_hz(Some([100.0, -63.0]));
        let mut beams = LidarSpec { prism_hz: [100.0, -63.0], ..LidarSpec::default() };
        beams.set_elevations(&table);
        assert_same(
            Sensor::lidar("roof", mast(), options.elevations(Some(table[..].into()))),
            SensorSpec { lidar: beams, ..lidar("roof", mast(), 3, 360, [-0.3, 0.1], 80.0) },
        );
    }

    #[test]
    fn typed_physics_sensors_have_the_bytes_of_the_wire_constructors() {
        let default = |sensor: Sensor, wire| assert_same(sensor, wire);
        default(
            Sensor::imu("imu", mast(), ImuOptions::default()),
            imu("imu", mast(), ImuSpec::default()),
        );
        default(
            Sensor::gnss("gnss", mast(), GnssOptions::default()),
            gnss("gnss", mast(), GnssSpec::default()),
        );
        default(
            Sensor::odometry("odometry", mast(), OdometryOptions::default()),
            odometry("odometry", mast(), OdometrySpec::default()),
        );
        default(Sensor::collision("hits"), collision("hits"));
        default(Sensor::lane_invasion("lanes"), lane_invasion("lanes"));
        default(
            Sensor::obstacle("ahead", mast(), ObstacleOptions::default()),
            obstacle("ahead", mast(), ObstacleSpec::default()),
        );
        default(
            Sensor::v2x_awareness("cam", mast(), V2xAwarenessOptions::default()),
            cam("cam", mast(), CamSpec::default()),
        );
        default(
            Sensor::v2x_messages("text", mast(), V2xRadioOptions::default()),
            message("text", mast(), MessageSpec::default()),
        );
    }

    #[test]
    fn every_option_of_a_motion_sensor_is_in_the_wire_record() {
        let errors = ImuOptions::default()
            .accelerometer_stddev(Vec3::new(1.0, 2.0, 3.0))
            .gyroscope_stddev(Vec3::new(4.0, 5.0, 6.0))
            .gyroscope_bias(Vec3::new(7.0, 8.0, 9.0))
            .accelerometer_walk(10.0)
            .gyroscope_walk(11.0)
            .gravity_mps2(1.6)
            .accelerometer_max_mps2(Some(12.0));
        let wire = ImuSpec {
            accelerometer_stddev_mps2: [1.0, 2.0, 3.0],
            gyroscope_stddev_radps: [4.0, 5.0, 6.0],
            gyroscope_bias_radps: [7.0, 8.0, 9.0],
            accelerometer_walk: 10.0,
            gyroscope_walk: 11.0,
            gravity_mps2: 1.6,
            accelerometer_max_mps2: 12.0,
        };
        assert_same(Sensor::imu("imu", mast(), errors), imu("imu", mast(), wire));
        let errors = GnssOptions::default()
            .latitude_stddev_deg(1.0)
            .latitude_bias_deg(2.0)
            .longitude_stddev_deg(3.0)
            .longitude_bias_deg(4.0)
            .altitude_stddev_m(5.0)
            .altitude_bias_m(6.0)
            .wander_m(7.0)
            .wander_up_m(8.0)
            .wander_time(Duration::from_secs(9))
            .geodesy(Geodesy::Carla);
        let wire = GnssSpec {
            latitude_stddev_deg: 1.0,
            latitude_bias_deg: 2.0,
            longitude_stddev_deg: 3.0,
            longitude_bias_deg: 4.0,
            altitude_stddev_m: 5.0,
            altitude_bias_m: 6.0,
            wander_m: 7.0,
            wander_up_m: 8.0,
            wander_secs: 9.0,
            geodesy: geodesy::CARLA,
        };
        assert_same(Sensor::gnss("gnss", mast(), errors), gnss("gnss", mast(), wire));
        let errors =
            OdometryOptions::default().scale_error(0.1).stddev_mps(0.2).step_mps(Some(0.3));
        let wire = OdometrySpec { scale_error: 0.1, stddev_mps: 0.2, step_mps: 0.3 };
        assert_same(Sensor::odometry("o", mast(), errors), odometry("o", mast(), wire));
    }

    #[test]
    fn every_option_of_an_obstacle_sensor_and_of_a_station_is_in_the_wire_record() {
        let sweep = ObstacleOptions::default().distance_m(9.0).hit_radius_m(0.2).only_actors(true);
        let wire = ObstacleSpec { distance_m: 9.0, hit_radius_m: 0.2, only_dynamics: 1 };
        assert_same(Sensor::obstacle("o", mast(), sweep), obstacle("o", mast(), wire));
        let typed = V2xRadioOptions::default()
            .frequency_ghz(1.0)
            .transmit_power_dbm(2.0)
            .sensitivity_dbm(3.0)
            .antenna_gain_db(4.0)
            .path_loss_exponent(5.0)
            .reference_m(6.0)
            .range_m(7.0)
            .fading_stddev_db(8.0)
            .scenario(V2xScenario::Urban)
            .flags(V2xRadioFlags::GEOMETRIC | V2xRadioFlags::AS_CARLA);
        let wire = RadioSpec {
            frequency_ghz: 1.0,
            transmit_power_dbm: 2.0,
            sensitivity_dbm: 3.0,
            antenna_gain_db: 4.0,
            path_loss_exponent: 5.0,
            reference_m: 6.0,
            range_m: 7.0,
            fading_stddev_db: 8.0,
            scenario: radio::URBAN,
            flags: radio::GEOMETRIC | radio::AS_CARLA,
        };
        let station = V2xAwarenessOptions::default()
            .radio(typed)
            .interval_min(Duration::from_millis(200))
            .interval_max(Duration::from_millis(700))
            .latitude_stddev_deg(1.0)
            .latitude_bias_deg(2.0)
            .longitude_stddev_deg(3.0)
            .longitude_bias_deg(4.0)
            .altitude_stddev_m(5.0)
            .altitude_bias_m(6.0)
            .heading_stddev_rad(7.0)
            .heading_bias_rad(8.0)
            .acceleration_stddev(Vec3::new(9.0, 10.0, 11.0))
            .yaw_rate_stddev_radps(12.0)
            .yaw_rate_bias_radps(13.0)
            .speed_stddev_mps(14.0);
        let cam_spec = CamSpec {
            radio: wire,
            interval_min_secs: 0.2,
            interval_max_secs: 0.7,
            latitude_stddev_deg: 1.0,
            latitude_bias_deg: 2.0,
            longitude_stddev_deg: 3.0,
            longitude_bias_deg: 4.0,
            altitude_stddev_m: 5.0,
            altitude_bias_m: 6.0,
            heading_stddev_rad: 7.0,
            heading_bias_rad: 8.0,
            acceleration_stddev_mps2: [9.0, 10.0, 11.0],
            yaw_rate_stddev_radps: 12.0,
            yaw_rate_bias_radps: 13.0,
            speed_stddev_mps: 14.0,
        };
        assert_same(Sensor::v2x_awareness("c", mast(), station), cam("c", mast(), cam_spec));
        let text = MessageSpec { radio: wire };
        assert_same(Sensor::v2x_messages("m", mast(), typed), message("m", mast(), text));
    }

    #[test]
    #[should_panic(expected = "is not a camera")]
    fn only_a_camera_takes_camera_outputs() {
        let _ = Sensor::collision("hits").outputs(CameraOutputs::COLOR);
    }
}
