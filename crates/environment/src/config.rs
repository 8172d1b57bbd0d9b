//! The configuration of an environment.

use crate::{birds_eye::BirdsEye, camera::Camera, error::EnvironmentError};

/// What decides an episode beside its seed and the actions.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Ego vehicles, each on a route of its own. 1 to 64.
    pub egos: usize,
    /// Other vehicles, driven by traffic.
    pub vehicles: usize,
    /// Which vehicles are rigid bodies on wheels.
    pub physics: Physics,
    /// Length of a frame, rounded to a microsecond. Seconds, 0.005 to 0.1.
    pub frame_s: f32,
    /// Frames for each step, which all have the same action. 1 to 100.
    pub frames_per_step: u32,
    /// Length of the route. Metres, 10 to 10 000.
    pub route_m: f32,
    /// Steps after which an episode is truncated; 0: never.
    pub steps_max: u32,
    /// Rays of the lidar, 0 to 4096.
    pub lidar_rays: usize,
    /// Range of the lidar. Metres, 1 to 500.
    pub lidar_range_m: f32,
    /// The bird's-eye raster.
    pub birds_eye: BirdsEye,
    /// The camera.
    pub camera: Camera,
    /// How far beside its lane the vehicle's middle may be. Metres.
    pub off_route_m: f32,
    /// Rewards.
    pub reward: Reward,
}

impl Default for Config {
    fn default() -> Config {
        Config {
            egos: 1,
            vehicles: 12,
            physics: Physics::All,
            frame_s: 0.05,
            frames_per_step: 2,
            route_m: 300.0,
            steps_max: 1000,
            lidar_rays: 240,
            lidar_range_m: 50.0,
            birds_eye: BirdsEye::default(),
            camera: Camera::default(),
            off_route_m: 0.5,
            reward: Reward::default(),
        }
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), EnvironmentError> {
        let range = |name, value: f64, low: f64, high: f64, range| match value {
            v if (low..=high).contains(&v) => Ok(()),
            value => Err(EnvironmentError::Config { name, value, range }),
        };
        range("egos", self.egos as f64, 1.0, 64.0, "1 to 64")?;
        range("vehicles", self.vehicles as f64, 0.0, 1000.0, "0 to 1000")?;
        range("frame_s", self.frame_s.into(), 0.005, 0.100_01, "0.005 to 0.1")?;
        range("frames_per_step", self.frames_per_step.into(), 1.0, 100.0, "1 to 100")?;
        range("route_m", self.route_m.into(), 10.0, 10_000.0, "10 to 10000")?;
        range("lidar_rays", self.lidar_rays as f64, 0.0, 4096.0, "0 to 4096")?;
        range("lidar_range_m", self.lidar_range_m.into(), 1.0, 500.0, "1 to 500")?;
        let BirdsEye { size_px, pixel_m } = self.birds_eye;
        range("birds_eye.size_px", size_px as f64, 8.0, 512.0, "8 to 512")?;
        range("birds_eye.pixel_m", pixel_m.into(), 0.099_99, 4.0, "0.1 to 4")?;
        let Camera { width_px, height_px, fov_rad, mount, .. } = self.camera;
        range("camera.width_px", width_px.into(), 8.0, 2048.0, "8 to 2048")?;
        range("camera.height_px", height_px.into(), 8.0, 2048.0, "8 to 2048")?;
        range("camera.fov_rad", fov_rad.into(), 0.099_99, 3.000_01, "0.1 to 3")?;
        if !mount.is_valid() {
            return Err(EnvironmentError::Mount(mount));
        }
        range("off_route_m", self.off_route_m.into(), 0.0, 1000.0, "0 to 1000")?;
        let reward = &self.reward;
        for (name, value) in [
            ("reward.per_metre", reward.per_metre),
            ("reward.speed", reward.speed),
            ("reward.speeding", reward.speeding),
            ("reward.off_centre", reward.off_centre),
            ("reward.steering", reward.steering),
            ("reward.arrival", reward.arrival),
            ("reward.collision", reward.collision),
            ("reward.off_route", reward.off_route),
        ] {
            range(name, value.into(), -1e6, 1e6, "-1000000 to 1000000")?;
        }
        Ok(())
    }
}

/// Which vehicles of an environment are rigid bodies on wheels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Physics {
    /// All: frames have the state hashes of a run with processes.
    #[default]
    All,
    /// The ego vehicles. Others move exactly as traffic means, and nothing pushes them aside. That is
    /// faster, and frames have other state hashes.
    Ego,
}

/// The rewards of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reward {
    /// For each metre along the route.
    pub per_metre: f32,
    /// Times the speed as a fraction of the speed limit, at most 1.
    pub speed: f32,
    /// Times the speed above the limit, as a fraction of the limit.
    pub speeding: f32,
    /// Times the distance from the middle of the lane, as a fraction of half its width, at most 1.
    pub off_centre: f32,
    /// Times the change of the steering wheel since the step before, 0 to 2.
    pub steering: f32,
    /// At the end of the route.
    pub arrival: f32,
    /// At a collision.
    pub collision: f32,
    /// Beside the route.
    pub off_route: f32,
}

impl Default for Reward {
    fn default() -> Reward {
        Reward {
            per_metre: 1.0,
            speed: 0.1,
            speeding: -5.0,
            off_centre: -0.1,
            steering: -0.1,
            arrival: 10.0,
            collision: -5.0,
            off_route: -5.0,
        }
    }
}
