//! What an actor is, in the words of other formats.

use crate::collect::format::ActorBox;

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
}

/// Returns the class of an actor; none for props and signs, which most formats do not name.
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
        "TrafficSign" if actor.blueprint.contains("stop") => Some(Class::StopSign),
        _ => None,
    }
}

/// Returns the number and name of a class in COCO. A van is a car there.
pub(crate) fn coco(class: Class) -> (u32, &'static str) {
    match class {
        Class::Pedestrian => (1, "person"),
        Class::Bicycle => (2, "bicycle"),
        Class::Car | Class::Van => (3, "car"),
        Class::Motorcycle => (4, "motorcycle"),
        Class::Bus => (6, "bus"),
        Class::Train => (7, "train"),
        Class::Truck => (8, "truck"),
        Class::TrafficLight => (10, "traffic light"),
        Class::StopSign => (13, "stop sign"),
    }
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
