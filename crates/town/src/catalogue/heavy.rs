//! Trucks and buses: a cab or body from a control cage, and what is behind the cab.

use glam::vec3;
use mesh::{Material, Tag};

use crate::{
    catalogue::{
        bus,
        car::{self, Livery},
        cargo, chassis,
        end::End,
        fittings,
        profile::{Measure, Silhouette},
        tall,
        trim::{self, Extra, Grille, Lamps, Tail, Trim},
    },
    mesh_builder::MeshBuilder,
};

/// How a large vehicle is composed.
#[derive(Debug)]
pub(super) struct Heavy {
    pub(super) tag: Tag,
    pub(super) base_type: &'static str,
    load: Load,
}

/// The part behind the cab.
#[derive(Debug, PartialEq)]
enum Load {
    /// None: one body with windows along its whole length.
    Seats,
    /// A closed box of this material. The numbers are the length and the height of the cab as
    /// fractions of the vehicle's.
    Box(f32, f32, Material),
    /// Pumps, lockers and a ladder.
    Fire(f32, f32),
    /// A patient compartment with beacons.
    Bay(f32, f32),
}

pub(super) const BUS: Heavy = Heavy { tag: Tag::Bus, base_type: "bus", load: Load::Seats };
pub(super) const BOX_TRUCK: Heavy =
    Heavy { tag: Tag::Truck, base_type: "truck", load: Load::Box(0.36, 0.88, Material::CarPaint) };
pub(super) const LORRY: Heavy =
    Heavy { tag: Tag::Truck, base_type: "truck", load: Load::Box(0.27, 0.86, Material::Metal) };
pub(super) const FIRE_TRUCK: Heavy =
    Heavy { tag: Tag::Truck, base_type: "truck", load: Load::Fire(0.33, 0.80) };
pub(super) const AMBULANCE: Heavy =
    Heavy { tag: Tag::Truck, base_type: "truck", load: Load::Bay(0.40, 0.82) };

/// The part of the vehicle that is made from a cage, and its dimensions.
pub(super) fn cab<'a>(heavy: &Heavy, measure: &Measure<'a>) -> (&'static Silhouette, Measure<'a>) {
    let (shape, fraction, height) = match heavy.load {
        Load::Seats => (&tall::COACH, 1.0, 1.0),
        Load::Box(fraction, height, _) | Load::Fire(fraction, height) => {
            (&tall::CAB, fraction, height)
        }
        Load::Bay(fraction, height) => (&tall::SNOUT, fraction, height),
    };
    let size_m = vec3(measure.size_m.x * fraction, measure.size_m.y, measure.size_m.z * height);
    let wheels = if fraction < 1.0 { &measure.wheels[..2] } else { measure.wheels };
    (shape, Measure { size_m, wheels, ..*measure })
}

/// Builds the body, without wheels.
pub(super) fn body(builder: &mut MeshBuilder, heavy: &Heavy, measure: &Measure, number: usize) {
    let (shape, front) = cab(heavy, measure);
    let livery = match heavy.load {
        Load::Box(_, _, Material::CarPaint) => Livery { upper: Some([232, 230, 226]), doors: None },
        Load::Fire(..) => Livery { upper: Some([236, 234, 230]), doors: None },
        _ => Livery::default(),
    };
    let surface = car::body(builder, shape, &front, livery, number);
    let trim = match heavy.load {
        Load::Seats => Trim(Lamps::Wide, Grille::Bare, Tail::Upright, Extra::Nothing),
        _ => Trim(Lamps::Wide, Grille::Frame, Tail::Upright, Extra::Nothing),
    };
    if heavy.load == Load::Seats {
        trim::fit(builder, shape, &front, &trim, &surface);
        let end = End { shape, measure, is_front: true, surface: &surface };
        return bus::fit(builder, &end, number);
    }
    trim::front(builder, shape, &front, &trim, &surface);
    let rear = front.nose_m - front.size_m.x;
    chassis::build(builder, measure, rear);
    match heavy.load {
        Load::Seats => {}
        Load::Box(_, height, material) => {
            let space = chassis::load_space(measure, rear, 1.0);
            cargo::container(builder, space, material);
            if material == Material::Metal {
                let roof = measure.size_m.z * height;
                cargo::deflector(builder, &front, roof, measure.size_m.z);
            }
        }
        Load::Bay(..) => {
            let mut space = chassis::load_space(measure, rear, 0.95);
            space[1].x = rear + 0.02;
            cargo::patients(builder, measure, space);
        }
        Load::Fire(fraction, height) => {
            let space = chassis::load_space(measure, rear, 0.84);
            cargo::engine(builder, measure, space);
            let front = measure.nose_m - measure.size_m.x * fraction * 0.62;
            let top = measure.size_m.z * height + 0.16;
            let at = vec3(front, 0.0, top);
            fittings::beacons(builder, at, measure.body_m * 0.40, 0.18);
        }
    }
    chassis::tail_lamps(builder, measure);
}
