//! Typical vehicle parameters of each class, derived from size, mass and wheels.

use glam::Vec3;

use super::{
    model::{Class, GRAVITY_MPS2, LeanModel, VehicleModel, WHEELS_MAX, WheelModel, WheelPlace},
    powertrain,
    tyre::TyreModel,
};

/// Angle by which a body at rest is lower in front: 5 mm over the wheelbase of a car. Radians.
///
/// No vehicle is level to the last bit, and programs rely on it: CARLA's agents look for vehicles
/// and red lights at angles greater than 0 from the direction of travel, which rounds to exactly 0
/// when a level vehicle follows another one in the middle of a straight lane.
const RAKE_RAD: f32 = 0.00175;

/// Distance from the middle to the centre of mass of a car with front-wheel drive, as a fraction of
/// half of the wheelbase: 60 % of its weight is in front.
const FRONT_DRIVE_SHIFT: f32 = 0.2;

/// The parameters in which the classes differ.
struct Defaults {
    /// Height of the centre of mass, as a fraction of the body's height above ground.
    com_height: f32,
    ride_hz: f32,
    damping_ratio: f32,
    anti_roll: f32,
    grip: f32,
    /// Cornering stiffness of the front and the rear axle, with their suspension and steering.
    stiffness: [f32; 2],
    braking_g: f32,
    steer_max_rad: f32,
    drag_coefficient: f32,
    wheel_kg: f32,
}

fn defaults(class: Class) -> Defaults {
    let car = Defaults {
        com_height: 0.36,
        ride_hz: 1.4,
        damping_ratio: 0.35,
        anti_roll: 0.5,
        grip: 1.08,
        stiffness: [13.0, 20.0],
        braking_g: 0.97,
        steer_max_rad: 0.61,
        drag_coefficient: 0.30,
        wheel_kg: 20.0,
    };
    match class {
        Class::Car => car,
        Class::Van => Defaults { com_height: 0.38, drag_coefficient: 0.36, braking_g: 0.9, ..car },
        Class::Truck => Defaults {
            com_height: 0.40,
            ride_hz: 1.6,
            anti_roll: 1.0,
            grip: 0.85,
            stiffness: [8.5, 11.0],
            braking_g: 0.65,
            steer_max_rad: 0.75,
            drag_coefficient: 0.7,
            ..car
        },
        Class::Bus => Defaults {
            com_height: 0.36,
            ride_hz: 1.3,
            anti_roll: 1.0,
            grip: 0.85,
            stiffness: [8.5, 11.0],
            braking_g: 0.65,
            steer_max_rad: 0.85,
            drag_coefficient: 0.6,
            ..car
        },
        Class::Motorcycle => Defaults {
            com_height: 0.40,
            ride_hz: 2.0,
            anti_roll: 0.0,
            stiffness: [21.0, 21.0],
            braking_g: 0.65,
            steer_max_rad: 0.6,
            drag_coefficient: 0.7,
            wheel_kg: 12.0,
            ..car
        },
        Class::Bicycle => Defaults {
            com_height: 0.52,
            ride_hz: 4.0,
            anti_roll: 0.0,
            stiffness: [21.0, 21.0],
            grip: 0.9,
            braking_g: 0.5,
            steer_max_rad: 0.8,
            drag_coefficient: 0.9,
            wheel_kg: 1.5,
            ..car
        },
    }
}

impl VehicleModel {
    /// Returns a typical vehicle of a class. `half_extents_m` and `center_m` describe the bounding
    /// box of the whole body in vehicle space.
    pub fn new(
        class: Class,
        half_extents_m: Vec3,
        center_m: Vec3,
        mass_kg: f32,
        places: &[WheelPlace],
    ) -> VehicleModel {
        let given = defaults(class);
        let places = &places[..places.len().min(WHEELS_MAX)];
        let top = center_m.z + half_extents_m.z;
        let middle_x = mean(places.iter().map(|p| p.hub_m.x));
        // Engine and gearbox of a front-wheel drive lie before the front axle.
        let front_x = places.iter().map(|p| p.hub_m.x).fold(middle_x, f32::max);
        let is_front_drive = places.iter().all(|p| p.driven == (p.hub_m.x > middle_x));
        let ahead = if is_front_drive { FRONT_DRIVE_SHIFT * (front_x - middle_x) } else { 0.0 };
        let com_m = Vec3::new(middle_x + ahead, 0.0, top * given.com_height);
        let size = half_extents_m * 2.0;
        // The inertia of a box, reduced by 10 %: a vehicle's mass is concentrated near its centre.
        let inertia_kgm2 = Vec3::new(
            size.y * size.y + size.z * size.z,
            size.x * size.x + size.z * size.z,
            size.x * size.x + size.y * size.y,
        ) * (mass_kg / 12.0 * 0.9);

        // The collision box ends half a wheel radius above the ground, so that it clears kerbs.
        let radius = mean(places.iter().map(|p| p.radius_m)).max(0.1);
        let bottom = (center_m.z - half_extents_m.z).max(0.5 * radius).min(top - 0.1);
        let box_center_m = Vec3::new(center_m.x, center_m.y, (top + bottom) / 2.0);
        let box_half_m = Vec3::new(half_extents_m.x, half_extents_m.y, (top - bottom) / 2.0);

        let driven = places.iter().filter(|p| p.driven).count();
        let hubs: Vec<Vec3> = places.iter().map(|p| p.hub_m).collect();
        let at_rest = loads(&hubs, com_m, mass_kg, 0.0);
        let braked = loads(&hubs, com_m, mass_kg, given.braking_g);
        let wheels = places
            .iter()
            .enumerate()
            .map(|(i, place)| {
                let load = at_rest[i];
                let omega = std::f32::consts::TAU * given.ride_hz;
                let spring_npm = load / GRAVITY_MPS2 * omega * omega;
                let damping = 2.0 * given.damping_ratio * load / GRAVITY_MPS2 * omega;
                let radius_m = place.radius_m.max(0.05);
                let wheel_kg = given.wheel_kg * (radius_m / 0.33).powi(2);
                let rear = place.hub_m.x <= middle_x;
                WheelModel {
                    hub_m: place.hub_m,
                    radius_m,
                    inertia_kgm2: 0.55 * wheel_kg * radius_m * radius_m,
                    steered: place.steered,
                    drive_share: if place.driven { 1.0 / driven as f32 } else { 0.0 },
                    brake_torque_nm: braked[i] * given.braking_g * radius_m,
                    handbrake_torque_nm: if rear { 1.3 * load * radius_m } else { 0.0 },
                    static_load_n: load,
                    stance_m: RAKE_RAD * (place.hub_m.x - middle_x),
                    spring_npm,
                    bump_damping_nspm: 0.8 * damping,
                    rebound_damping_nspm: 1.2 * damping,
                    bump_travel_m: 0.09 * (1.4 / given.ride_hz),
                    partner: partner(places, i),
                    anti_roll_npm: spring_npm * given.anti_roll * if rear { 0.7 } else { 1.0 },
                    roll_center_m: if class.leans() { 0.0 } else { 0.1 * com_m.z },
                    camber_radpm: 0.0,
                    steer_share: 1.0,
                    damping_nmsprad: 0.0,
                    grip: 1.0,
                    tyre: TyreModel {
                        grip_x: given.grip * 1.04,
                        grip_y: given.grip,
                        stiffness_x: given.stiffness[1],
                        stiffness_y: given.stiffness[usize::from(rear)],
                        shape_x: 1.64,
                        shape_y: 1.35,
                        curvature_x: 0.46,
                        curvature_y: 0.0,
                        load_sensitivity: 0.08,
                        nominal_load_n: load,
                        stiff_load: 8.0,
                        camber_stiffness: 0.0,
                        relaxation_x_m: 0.1 + 0.2 * radius_m,
                        relaxation_y_m: 0.1 + 0.5 * radius_m,
                        rolling_resistance: 0.012,
                    },
                }
            })
            .collect();

        let (engine, gearbox) = powertrain::typical(class, mass_kg, radius);
        VehicleModel {
            class,
            mass_kg,
            inertia_kgm2,
            com_m,
            box_center_m,
            box_half_m,
            wheels,
            engine,
            gearbox,
            drag_coefficient: given.drag_coefficient,
            frontal_m2: size.y * top * 0.85,
            downforce_area_m2: 0.0,
            steer_max_rad: given.steer_max_rad,
            steer_rate_radps: 2.5,
            steer_curve: vec![[0.0, 1.0], [5.6, 0.9], [16.7, 0.8], [33.3, 0.7]],
            lean: class.leans().then_some(LeanModel { max_rad: 0.75, frequency_radps: 8.0 }),
            abs: class != Class::Bicycle,
            stability_control: !class.leans(),
        }
    }

    /// Gives the vehicle brakes that decelerate it by `braking_g` at full load of each wheel, and
    /// `spare` times the torque of that.
    pub(super) fn brake_with(&mut self, braking_g: f32, spare: f32) {
        let hubs: Vec<Vec3> = self.wheels.iter().map(|wheel| wheel.hub_m).collect();
        let loads = loads(&hubs, self.com_m, self.mass_kg, braking_g);
        for (wheel, load_n) in self.wheels.iter_mut().zip(loads) {
            wheel.brake_torque_nm = spare * load_n * braking_g * wheel.radius_m;
        }
    }

    /// Returns a mid-size car, the most common kind in the catalogue.
    pub fn sedan() -> VehicleModel {
        let places =
            [(1.44, 0.79), (1.44, -0.79), (-1.44, 0.79), (-1.44, -0.79)].map(|(x, y)| WheelPlace {
                hub_m: Vec3::new(x, y, 0.34),
                radius_m: 0.34,
                steered: x > 0.0,
                driven: x < 0.0,
            });
        let half = Vec3::new(2.35, 0.93, 0.72);
        VehicleModel::new(Class::Car, half, Vec3::new(0.0, 0.0, 0.72), 1700.0, &places)
    }
}

fn mean(values: impl ExactSizeIterator<Item = f32>) -> f32 {
    let count = values.len().max(1) as f32;
    values.sum::<f32>() / count
}

/// Returns the load of each wheel when the vehicle brakes with `braking_g`. With more than two
/// axles the loads are linear in x, as on equal springs.
pub(super) fn loads(places: &[Vec3], com_m: Vec3, mass_kg: f32, braking_g: f32) -> Vec<f32> {
    let weight = mass_kg * GRAVITY_MPS2;
    let middle = mean(places.iter().map(|p| p.x));
    let spread: f32 = places.iter().map(|p| (p.x - middle).powi(2)).sum();
    // The point on the ground through which the resultant of gravity and inertia passes.
    let pull = com_m.x + com_m.z * braking_g - middle;
    places
        .iter()
        .map(|p| {
            let even = 1.0 / places.len() as f32;
            let lever = (p.x - middle) * pull / spread.max(1e-3);
            weight * (even + lever).max(0.05 * even)
        })
        .collect()
}

/// Returns the index of the wheel at the other end of the axle of wheel `index`.
fn partner(places: &[WheelPlace], index: usize) -> Option<u8> {
    let own = places[index].hub_m;
    let across = |p: &WheelPlace| {
        (p.hub_m.x - own.x).abs() < 0.1 && p.hub_m.y * own.y < 0.0 && own.y.abs() > 0.1
    };
    places.iter().position(across).map(|i| i as u8)
}
