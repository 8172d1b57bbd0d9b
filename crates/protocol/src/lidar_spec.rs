//! What makes a lidar more than an even grid of ideal beams.

use bytemuck::{Pod, Zeroable};

/// Bits of [`LidarSpec::flags`].
pub mod lidar_flag {
    /// Each column starts at the pose that the sensor had at the time of the column. Without it all
    /// columns start at the pose of the frame.
    pub const SWEEP: u32 = 1 << 0;
    /// Fog, rain and spray of the simulated weather attenuate pulses and reflect them.
    pub const WEATHER: u32 = 1 << 1;
    /// [`super::LidarSpec::elevations`] has the elevation of each channel.
    pub const ELEVATIONS: u32 = 1 << 2;
}

/// The most channels of a table of elevations.
pub const ELEVATIONS_MAX: usize = 128;

/// Unit of the elevations in a table, radians: 0.0029°.
pub const ELEVATION_STEP_RAD: f64 = 5e-5;

/// Beams of a lidar; all 0 is an even grid of ideal beams.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LidarSpec {
    /// Bits of [`lidar_flag`].
    pub flags: u32,
    /// Full angle of the cone of a beam; 0: a ray without width.
    pub divergence_rad: f32,
    /// Turns per second of the two prisms of a Risley scanner, positive to the left seen from behind;
    /// both 0: the beams are a grid.
    pub prism_hz: [f32; 2],
    /// Elevations of the channels in units of [`ELEVATION_STEP_RAD`], the highest first.
    pub elevations: [i16; ELEVATIONS_MAX],
}

const _: () = assert!(size_of::<LidarSpec>() == 272);

impl Default for LidarSpec {
    fn default() -> LidarSpec {
        LidarSpec::zeroed()
    }
}

impl LidarSpec {
    /// Returns whether a bit of [`lidar_flag`] is set.
    pub fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }

    /// Returns whether the beams are those of a pair of rotating prisms.
    pub fn has_prisms(&self) -> bool {
        self.prism_hz != [0.0; 2]
    }

    /// Stores the elevations of the channels, in radians; those after [`ELEVATIONS_MAX`] are left out.
    pub fn set_elevations(&mut self, elevations_rad: &[f32]) {
        self.flags |= lidar_flag::ELEVATIONS;
        for (stored, rad) in self.elevations.iter_mut().zip(elevations_rad) {
            *stored = (f64::from(*rad) / ELEVATION_STEP_RAD).round() as i16;
        }
    }

    /// Returns the elevation of a channel of the table, in radians.
    pub fn elevation_rad(&self, channel: u32) -> f64 {
        f64::from(self.elevations[channel as usize % ELEVATIONS_MAX]) * ELEVATION_STEP_RAD
    }

    /// Checks the range of each number of a lidar with so many channels, this field of view and rate; the
    /// error names the first that is out of range.
    pub(crate) fn check(
        &self,
        channels: u32,
        fov_rad: f32,
        rotation_rate_hz: f32,
    ) -> Result<(), String> {
        let known = lidar_flag::SWEEP | lidar_flag::WEATHER | lidar_flag::ELEVATIONS;
        if self.flags & !known != 0 {
            return Err(format!("lidar flags {:#x} have unknown bits; use {known:#x}", self.flags));
        }
        if !(0.0..=0.1).contains(&self.divergence_rad) {
            return Err(format!("divergence_rad is {}, not 0 to 0.1", self.divergence_rad));
        }
        if let Some(hz) = self.prism_hz.iter().find(|hz| !(-1000.0..=1000.0).contains(*hz)) {
            return Err(format!("prism_hz is {hz}, not -1000 to 1000"));
        }
        if self.has_prisms() {
            self.check_prisms(fov_rad, rotation_rate_hz)?;
        }
        if self.has(lidar_flag::ELEVATIONS) {
            self.check_elevations(channels as usize)?;
        }
        if self.has(lidar_flag::SWEEP) && rotation_rate_hz <= 0.0 && !self.has_prisms() {
            return Err(
                "sweep is on, but rotation_rate_hz and prism_hz are 0: all rays start at one \
                        instant; give a rate"
                    .into(),
            );
        }
        Ok(())
    }

    fn check_prisms(&self, fov_rad: f32, rotation_rate_hz: f32) -> Result<(), String> {
        if rotation_rate_hz > 0.0 {
            return Err(format!(
                "prism_hz is {:?} and rotation_rate_hz is {rotation_rate_hz}; a lidar has prisms or turns",
                self.prism_hz
            ));
        }
        if self.has(lidar_flag::ELEVATIONS) {
            return Err("prism_hz and elevations are given; prisms have no channels".into());
        }
        if fov_rad > 3.1 {
            return Err(format!(
                "fov_rad is {fov_rad}, not 0.01 to 3.1 as with prisms; it is the diameter of the pattern"
            ));
        }
        Ok(())
    }

    fn check_elevations(&self, count: usize) -> Result<(), String> {
        if count > ELEVATIONS_MAX {
            return Err(format!(
                "{count} channels have elevations of their own; the limit is {ELEVATIONS_MAX}"
            ));
        }
        let table = &self.elevations[..count];
        let most = (1.6 / ELEVATION_STEP_RAD) as i16;
        for (channel, elevation) in table.iter().enumerate() {
            if !(-most..=most).contains(elevation) {
                let rad = self.elevation_rad(channel as u32);
                return Err(format!("elevation {channel} is {rad:.4} rad, not -1.6 to 1.6"));
            }
        }
        if let Some(at) = table.windows(2).position(|pair| pair[0] < pair[1]) {
            let [above, below] = [at, at + 1].map(|channel| self.elevation_rad(channel as u32));
            return Err(format!(
                "elevation {at} is {above:.4} rad and elevation {} is {below:.4}; give the highest first",
                at + 1
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lidar(channels: u32, lidar: LidarSpec) -> Result<(), String> {
        lidar.check(channels, 1.0, 0.0)
    }

    #[test]
    fn a_table_of_elevations_comes_back_within_half_a_step() {
        let mut spec = LidarSpec::default();
        let table = [0.0345f32, 0.0289, -0.1, -0.4333];
        spec.set_elevations(&table);
        for (channel, rad) in table.iter().enumerate() {
            assert!((spec.elevation_rad(channel as u32) - f64::from(*rad)).abs() <= 2.6e-5);
        }
        assert_eq!(lidar(4, spec), Ok(()));
    }

    #[test]
    fn numbers_out_of_range_are_refused_by_name() {
        let table = |table: &[f32]| {
            let mut spec = LidarSpec::default();
            spec.set_elevations(table);
            spec
        };
        let none = LidarSpec::default();
        let flag = |flags: u32| LidarSpec { flags, ..LidarSpec::default() };
        for (channels, spec, said) in [
            (4, flag(64), "lidar flags 0x40 have unknown bits; use 0x7"),
            (
                4,
                LidarSpec { divergence_rad: f32::NAN, ..none },
                "divergence_rad is NaN, not 0 to 0.1",
            ),
            (4, LidarSpec { prism_hz: [0.0, 2e3], ..none }, "prism_hz is 2000, not -1000 to 1000"),
            (
                2,
                table(&[0.1, 0.2]),
                "elevation 0 is 0.1000 rad and elevation 1 is 0.2000; give the highest first",
            ),
            (2, table(&[1.63, 0.2]), "elevation 0 is 1.6300 rad, not -1.6 to 1.6"),
            (129, table(&[0.1]), "129 channels have elevations of their own; the limit is 128"),
            (
                4,
                flag(lidar_flag::SWEEP),
                "sweep is on, but rotation_rate_hz and prism_hz are 0: all rays start at one instant; give a rate",
            ),
            (
                4,
                LidarSpec { prism_hz: [9.0, 1.0], ..table(&[0.1]) },
                "prism_hz and elevations are given; prisms have no channels",
            ),
        ] {
            assert_eq!(lidar(channels, spec), Err(said.into()));
        }
        assert_eq!(lidar(512, none), Ok(()));
    }
}
