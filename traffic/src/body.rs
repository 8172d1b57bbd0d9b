//! Dimensions and steering limits of vehicles, as far as the planner needs them.

use town::Blueprint;

/// Dimensions of one blueprint in vehicle space (origin in the middle of the wheelbase).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    /// Distance from the origin to the front bumper.
    pub(crate) front_m: f32,
    /// Distance from the origin to the rear bumper.
    pub(crate) rear_m: f32,
    /// Half the width.
    pub(crate) half_width_m: f32,
    /// Height of the roof above the origin.
    pub(crate) height_m: f32,
    /// Distance between the axles.
    pub(crate) wheelbase_m: f32,
    /// Largest steering angle of the front wheels at standstill.
    pub(crate) max_steer_rad: f32,
    /// Estimate of the speed that the vehicle reaches soon.
    pub(crate) cruise_speed_mps: f32,
    /// What kind of driver it has.
    pub(crate) class: Class,
}

/// Classes of vehicles whose drivers differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    /// A car or van.
    Car,
    Truck,
    Bus,
    Motorcycle,
    Bicycle,
}

/// A mid-size car: assumed for blueprints that the catalogue does not contain.
pub(crate) const CAR: Body = Body {
    front_m: 2.35,
    rear_m: 2.35,
    half_width_m: 0.95,
    height_m: 1.6,
    wheelbase_m: 2.8,
    max_steer_rad: 0.61,
    cruise_speed_mps: 40.0,
    class: Class::Car,
};

const GRAVITY_MPS2: f32 = 9.81;
/// Safety factor on the lateral force of tyres in the limit of braking: the rear tyres are unloaded.
const CURVE_SHARE: f32 = 1.5;

impl Body {
    /// Returns the distance between the bumpers.
    pub(crate) fn length_m(&self) -> f32 {
        self.front_m + self.rear_m
    }

    /// Returns the distance from the origin to the tracking point, which follows the centre of the
    /// lane. It is chosen so that in curves the front overhang swings out about as far as the rear
    /// axle cuts in.
    pub(crate) fn tracking_point_m(&self) -> f32 {
        self.wheelbase_m * if self.wheelbase_m > 3.5 { 0.34 } else { 0.15 }
    }

    /// Returns the distance from the rear axle to the tracking point.
    pub(crate) fn axle_to_tracking_point_m(&self) -> f32 {
        0.5 * self.wheelbase_m + self.tracking_point_m()
    }

    /// Returns whether the vehicle needs more room than a car.
    pub(crate) fn is_wide(&self) -> bool {
        self.length_m() > 5.6 || self.half_width_m > 1.15
    }

    /// Returns the ratio of the vehicle's speed in curves to that of a car: a long vehicle leaves
    /// its lane sooner, and a bicycle has to lean first.
    pub(crate) fn curve_speed_factor(&self) -> f32 {
        if self.cruise_speed_mps < 10.0 {
            0.7
        } else if self.is_wide() {
            0.82
        } else {
            1.0
        }
    }

    /// Returns the bound on the lateral acceleration of any steering command, metres per second
    /// squared. A two-wheeler falls over where a car would only slide.
    pub(crate) fn grip_mps2(&self) -> f32 {
        if self.half_width_m < 0.55 { 4.5 } else { 9.0 }
    }

    /// Returns the slip angles of the front and the rear tyres for each m/s² of lateral acceleration,
    /// in radians: the inverse cornering stiffness for each newton of load, suspension included, as
    /// the physics assumes it for the class.
    pub(crate) fn slip_radps2pm(&self) -> [f32; 2] {
        let stiffness = match self.class {
            Class::Car => [13.0, 20.0],
            Class::Truck | Class::Bus => [8.5, 11.0],
            Class::Motorcycle | Class::Bicycle => [21.0, 21.0],
        };
        stiffness.map(|of_axle: f32| 1.0 / (of_axle * GRAVITY_MPS2))
    }

    /// Returns the strongest braking that leaves the tyres the force for a lateral acceleration: both
    /// together stay within a circle.
    pub(crate) fn brake_max_mps2(&self, lateral_mps2: f32) -> f32 {
        let most = self.tyre_mps2();
        (most * most - (CURVE_SHARE * lateral_mps2).powi(2)).max(0.25 * most * most).sqrt()
    }

    /// Returns the radius of that circle, within the friction of the tyres. Two-wheelers, and light cars
    /// without stability control, fall over or spin where others only slide.
    fn tyre_mps2(&self) -> f32 {
        match self.class {
            Class::Car if self.wheelbase_m > 1.6 => 8.5,
            _ => 6.5,
        }
    }

    /// Returns the acceleration with which the vehicle starts at least.
    pub(crate) fn least_accel_mps2(&self) -> f32 {
        match self.class {
            Class::Car | Class::Motorcycle => 1.2,
            Class::Truck | Class::Bus => 0.7,
            Class::Bicycle => 0.5,
        }
    }

    fn of(blueprint: &Blueprint) -> Body {
        let (half, center) = (blueprint.half_extents_m, blueprint.center_m);
        Body {
            front_m: half.x + center.x,
            rear_m: half.x - center.x,
            half_width_m: half.y,
            height_m: half.z + center.z,
            wheelbase_m: if blueprint.wheelbase_m > 0.5 { blueprint.wheelbase_m } else { 2.8 },
            max_steer_rad: match blueprint.base_type {
                "truck" => 0.75,
                "bus" => 0.85,
                "motorcycle" => 0.6,
                "bicycle" => 0.8,
                _ => CAR.max_steer_rad,
            },
            cruise_speed_mps: if blueprint.base_type == "bicycle" {
                5.0
            } else {
                CAR.cruise_speed_mps
            },
            class: match blueprint.base_type {
                "truck" => Class::Truck,
                "bus" => Class::Bus,
                "motorcycle" => Class::Motorcycle,
                "bicycle" => Class::Bicycle,
                _ => Class::Car,
            },
        }
    }
}

/// The dimensions of the catalogue, by blueprint index.
pub(crate) struct Bodies {
    bodies: Vec<Body>,
    passable: Vec<bool>,
}

impl Bodies {
    /// Reads the catalogue.
    pub(crate) fn from_catalogue() -> Bodies {
        let catalogue = town::catalogue();
        Bodies {
            bodies: catalogue.iter().map(Body::of).collect(),
            passable: catalogue.iter().map(town::Blueprint::is_passable).collect(),
        }
    }

    /// Returns the dimensions of blueprint `index`.
    pub(crate) fn of(&self, index: u32) -> Body {
        self.bodies.get(index as usize).copied().unwrap_or(CAR)
    }

    /// Returns whether vehicles drive over actors of blueprint `index`.
    pub(crate) fn is_passable(&self, index: u32) -> bool {
        self.passable.get(index as usize).is_some_and(|passable| *passable)
    }
}
