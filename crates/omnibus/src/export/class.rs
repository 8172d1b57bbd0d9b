//! What an actor is, in the words of other formats.

use crate::collect::{STATIC_BIT, format::ActorBox};

/// A class of objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Class {
    Pedestrian,
    Bicycle,
    Motorcycle,
    Car,
    Van,
    Truck,
    Bus,
    Train,
    TrafficLight,
    StopSign,
    Cone,
    Barrier,
}

/// Returns the class of an actor; none for what no format names, as most props.
pub(crate) fn class(actor: &ActorBox) -> Option<Class> {
    let base_type = town::blueprint(&actor.blueprint).map_or("", |(_, made)| made.base_type);
    match base_type {
        "car" => return Some(Class::Car),
        "van" => return Some(Class::Van),
        "truck" => return Some(Class::Truck),
        "bus" => return Some(Class::Bus),
        "motorcycle" => return Some(Class::Motorcycle),
        "bicycle" => return Some(Class::Bicycle),
        _ => {}
    }
    match &actor.tag_name[..] {
        "Pedestrian" => Some(Class::Pedestrian),
        "Bicycle" => Some(Class::Bicycle),
        "Motorcycle" => Some(Class::Motorcycle),
        "Car" => Some(Class::Car),
        "Truck" => Some(Class::Truck),
        "Bus" => Some(Class::Bus),
        "Train" => Some(Class::Train),
        "TrafficLight" => Some(Class::TrafficLight),
        _ if actor.blueprint.ends_with("barrier") => Some(Class::Barrier),
        _ if actor.blueprint.contains("cone") && actor.blueprint.contains("prop") => {
            Some(Class::Cone)
        }
        "TrafficSign" if actor.blueprint.contains("stop") => Some(Class::StopSign),
        _ => None,
    }
}

/// Returns whether an object belongs to the town, and never moves. Its id tells.
pub(crate) fn is_static(actor: &ActorBox) -> bool {
    actor.actor_id >= STATIC_BIT
}

/// Returns the number of a class in COCO. A van is a car there.
pub(crate) fn coco(class: Class) -> Option<u32> {
    Some(match class {
        Class::Pedestrian => 1,
        Class::Bicycle => 2,
        Class::Car | Class::Van => 3,
        Class::Motorcycle => 4,
        Class::Bus => 6,
        Class::Train => 7,
        Class::Truck => 8,
        Class::TrafficLight => 10,
        Class::StopSign => 13,
        Class::Cone | Class::Barrier => return None,
    })
}

/// The categories of COCO that occur, in the order of their numbers: number, name, supercategory.
pub(crate) const COCO: [(u32, &str, &str); 9] = [
    (1, "person", "person"),
    (2, "bicycle", "vehicle"),
    (3, "car", "vehicle"),
    (4, "motorcycle", "vehicle"),
    (6, "bus", "vehicle"),
    (7, "train", "vehicle"),
    (8, "truck", "vehicle"),
    (10, "traffic light", "outdoor"),
    (13, "stop sign", "outdoor"),
];
