//! The attributes of blueprints that CARLA clients read, and set before a spawn.

use super::{
    blueprint::{Blueprint, Kind},
    walker,
};

/// The type of an attribute's value, with CARLA's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum AttributeType {
    /// `true` or `false`.
    Bool = 1,
    /// An integer.
    Int = 2,
    /// A floating-point number.
    Float = 3,
    /// A string.
    Text = 4,
    /// A colour: `red,green,blue`, each 0 to 255.
    Color = 5,
}

impl AttributeType {
    /// CARLA's name of the type.
    pub fn name(self) -> &'static str {
        ["", "bool", "int", "float", "string", "color"][self as usize]
    }
}

/// A property of a blueprint.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// CARLA's id, such as `number_of_wheels`.
    pub id: &'static str,
    /// The type of the value.
    pub kind: AttributeType,
    /// The values: the first is the default, the others are recommended for a modifiable attribute.
    pub values: Vec<String>,
    /// Whether clients may change the value.
    pub is_modifiable: bool,
    /// Whether only recommended values are accepted.
    pub only_recommended: bool,
}

use AttributeType::{Bool, Color, Float, Int, Text};

fn vary(id: &'static str, kind: AttributeType, values: &[&str]) -> Attribute {
    let values = values.iter().map(|value| (*value).to_owned()).collect();
    Attribute { id, kind, values, is_modifiable: true, only_recommended: false }
}

fn fix(id: &'static str, kind: AttributeType, value: impl ToString) -> Attribute {
    let values = vec![value.to_string()];
    Attribute { id, kind, values, is_modifiable: false, only_recommended: false }
}

pub(super) fn attributes_of(blueprint: &Blueprint) -> Vec<Attribute> {
    match blueprint.kind {
        Kind::Vehicle => vehicle(blueprint),
        Kind::Walker => walker_of(blueprint),
        Kind::Prop => prop(blueprint),
        Kind::TrafficLight => Vec::new(),
    }
}

/// Paint colours recommended beside a vehicle's default colour.
const PAINTS: [[u8; 3]; 5] =
    [[17, 37, 103], [180, 44, 43], [0, 0, 0], [255, 255, 255], [137, 137, 137]];

fn vehicle(blueprint: &Blueprint) -> Vec<Attribute> {
    let mut all = vec![
        vary("role_name", Text, &["autopilot", "scenario", "ego_vehicle"]),
        vary("ros_name", Text, &[blueprint.id]),
    ];
    let own = blueprint.default_color;
    let paints = PAINTS.into_iter().filter(|paint| *paint != own);
    let words = [own].into_iter().chain(paints).map(|[r, g, b]| format!("{r},{g},{b}"));
    all.push(Attribute { values: words.collect(), ..vary("color", Color, &[]) });
    if blueprint.wheels.len() == 2 {
        all.push(Attribute { only_recommended: true, ..vary("driver_id", Int, &["1"]) });
    }
    all.extend([
        vary("sticky_control", Bool, &["true"]),
        vary("terramechanics", Bool, &["false"]),
        fix("object_type", Text, ""),
        fix("base_type", Text, base_type(blueprint)),
        fix("special_type", Text, blueprint.special_type),
        fix("number_of_wheels", Int, blueprint.wheels.len()),
        fix("generation", Int, blueprint.generation),
        fix("has_dynamic_doors", Bool, blueprint.rig().door_count() > 0),
        fix("has_lights", Bool, true),
    ]);
    all
}

/// CARLA sorts two vehicles by what they are for, and `Blueprint::base_type` by how they are built.
fn base_type(blueprint: &Blueprint) -> &'static str {
    match blueprint.id {
        "vehicle.ford.ambulance" => "van",
        "vehicle.tesla.cybertruck" => "truck",
        _ => blueprint.base_type,
    }
}

fn walker_of(blueprint: &Blueprint) -> Vec<Attribute> {
    let person = walker::person(blueprint);
    vec![
        vary("role_name", Text, &["pedestrian"]),
        vary("ros_name", Text, &[blueprint.id]),
        vary("is_invincible", Bool, &["true"]),
        vary(
            "speed",
            Float,
            if person.is_child { &["0.0", "1.2", "2.2"] } else { &["0.0", "1.4", "2.6"] },
        ),
        Attribute { only_recommended: true, ..vary("use_wheelchair", Bool, &["false"]) },
        fix("gender", Text, if person.is_female { "female" } else { "male" }),
        fix("generation", Int, blueprint.generation),
        fix("age", Text, if person.is_child { "child" } else { "adult" }),
        fix("can_use_wheelchair", Bool, false),
    ]
}

fn prop(blueprint: &Blueprint) -> Vec<Attribute> {
    let half = blueprint.half_extents_m.max_element();
    let size = match half {
        half if half < 0.15 => "tiny",
        half if half < 0.5 => "small",
        half if half < 1.0 => "medium",
        _ => "big",
    };
    vec![
        vary("role_name", Text, &["prop"]),
        vary("ros_name", Text, &[blueprint.id]),
        fix("size", Text, size),
    ]
}
