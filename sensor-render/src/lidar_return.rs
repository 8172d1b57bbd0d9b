use mesh::Material;

/// Receiver of a lidar, the same for all beams.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    pub(crate) range_m: f32,
    /// Negative: points report the cosine of incidence.
    pub(crate) attenuation_per_m: f32,
    /// Standard deviation of the range.
    pub(crate) noise_m: f32,
    /// Share of dropped returns.
    pub(crate) dropoff: f32,
    /// Seed of the noise of this frame.
    pub(crate) seed: u32,
}

/// Return of a laser pulse from a surface.
///
/// `intensity = ρ · (1 − s + s · cos θ) · exp(−a · d)`, where ρ is the material's reflectivity at
/// 905 nm, s its diffuse share (retroreflective sheeting of a sign reflects towards the sensor at
/// any angle), θ the angle of incidence, a the sensor's attenuation per metre and d the distance in
/// metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LidarReturn {
    /// Distance in metres, including the range noise of the sensor.
    pub(crate) distance_m: f32,
    /// Intensity above 0, up to 1; or the cosine of incidence, if the sensor reports that.
    pub(crate) intensity: f32,
}

impl LidarReturn {
    /// Returns the return of beam number `beam` from a surface at distance `t` in metres, whose
    /// normal makes an angle with the given cosine with the beam; `None` if the return is dropped.
    pub(crate) fn of(
        receiver: &Receiver,
        beam: u32,
        t: f32,
        cosine: f32,
        material: u8,
    ) -> Option<LidarReturn> {
        let start = mixed(receiver.seed ^ beam);
        let [a, b, c] = [1, 2, 3].map(|step| mixed(start.wrapping_add(step)));
        if (a >> 8) as f32 * (1.0 / 16_777_216.0) < receiver.dropoff {
            return None;
        }
        let noise = normal(b, c);
        if receiver.attenuation_per_m < 0.0 {
            let distance_m = t + noise * receiver.noise_m;
            return Some(LidarReturn { distance_m, intensity: cosine.clamp(1e-6, 1.0) });
        }
        let [reflectivity, facing] = reflected(cosine, material);
        let intensity = reflectivity * facing * (-receiver.attenuation_per_m * t).exp();
        Some(LidarReturn {
            distance_m: t + noise * receiver.noise_m,
            intensity: intensity.max(1e-6),
        })
    }
}

/// Returns the reflectivity of a material, and its share towards a sensor whose beam makes an angle with
/// this cosine with the normal.
pub(crate) fn reflected(cosine: f32, material: u8) -> [f32; 2] {
    let [reflectivity, diffuse] =
        REFLECTIVITIES[usize::from(material).min(REFLECTIVITIES.len() - 1)];
    [reflectivity, 1.0 - diffuse + diffuse * cosine]
}

/// Returns a random number of mean 0 and standard deviation 1, from two random words. The sum of four
/// uniform numbers approximates a normal distribution and never exceeds 3.5 standard deviations.
pub(crate) fn normal(b: u32, c: u32) -> f32 {
    let sum = ((b & 0xffff) + (b >> 16) + (c & 0xffff) + (c >> 16)) as f32;
    (sum * (1.0 / 65_536.0) - 2.0) * 1.732_050_8
}

/// Returns a hash of one word: Wellons' low-bias 32-bit hash.
pub(crate) fn mixed(word: u32) -> u32 {
    let mut x = word;
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

/// Reflectivity ρ and diffuse share s, by the code of the [`Material`].
pub(crate) const REFLECTIVITIES: [[f32; 2]; Material::ALL.len()] = {
    let mut table = [[0.3, 0.9]; Material::ALL.len()];
    let mut index = 0;
    while index < Material::ALL.len() {
        let material = Material::ALL[index];
        table[material as usize] = match material {
            Material::Asphalt => [0.17, 0.9],
            Material::PaintWhite => [0.75, 0.6],
            Material::PaintYellow => [0.6, 0.6],
            Material::Paving | Material::Kerb | Material::Concrete => [0.35, 0.9],
            Material::Grass | Material::Leaves | Material::Needles => [0.5, 0.7],
            Material::Soil => [0.25, 0.9],
            Material::FacadeBrick => [0.35, 0.9],
            Material::FacadePlaster | Material::FacadeConcrete => [0.5, 0.9],
            Material::FacadeGlass | Material::Glass => [0.1, 1.0],
            Material::RoofFlat => [0.2, 0.9],
            Material::RoofTiles => [0.3, 0.9],
            Material::Bark | Material::Wood => [0.35, 0.9],
            Material::Metal => [0.55, 0.95],
            Material::CarPaint => [0.5, 0.95],
            Material::Rubber => [0.05, 0.9],
            Material::Plastic => [0.15, 0.9],
            Material::LampWhite
            | Material::LampRed
            | Material::LampAmber
            | Material::IndicatorLeft
            | Material::IndicatorRight
            | Material::LampReverse
            | Material::LampFog
            | Material::LampInterior
            | Material::Beacon
            | Material::LampHigh => [0.8, 0.3],
            Material::SignalRed | Material::SignalYellow | Material::SignalGreen => [0.6, 0.4],
            Material::Sign => [1.0, 0.1],
            Material::Skin => [0.5, 0.8],
            Material::Cloth => [0.4, 0.9],
            Material::Water => [0.05, 1.0],
        };
        index += 1;
    }
    table
};
