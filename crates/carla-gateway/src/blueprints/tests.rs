//! The catalogue of CARLA, and what clients are told of ours.

use std::{collections::BTreeMap, fmt};

use super::*;

/// CARLA's catalogue; its head describes the format.
const CARLA: &str = include_str!("carla.txt");

/// Differences that are meant: how a line of [`differences`] begins.
const MEANT: [&str; 7] = [
    // The standard package of CARLA has no RSS either.
    "sensor.other.rss: missing",
    // It shows a mesh of Unreal's, which this simulator cannot read.
    "static.prop.mesh: missing",
    // One that CARLA's towns contain and its catalogue does not.
    "static.prop.hydrant: not CARLA's",
    // All vehicles have lamps here, and those with doors open them.
    "vehicle: has_lights is",
    "vehicle: has_dynamic_doors is",
    // No walker here uses a wheelchair.
    "walker: use_wheelchair is",
    "walker: can_use_wheelchair is",
];

/// CARLA's types of attributes by their numbers.
const KINDS: [&str; 6] = ["", "bool", "int", "float", "string", "color"];

/// What clients are told of an attribute.
#[derive(Clone, PartialEq)]
struct Told {
    kind: u8,
    /// The default and the other recommended values, `*` for any.
    values: String,
    is_modifiable: bool,
    only_recommended: bool,
}

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fixed = if self.is_modifiable { "" } else { " fixed" };
        let only = if self.only_recommended { " only" } else { "" };
        write!(f, "{} {:?}{fixed}{only}", KINDS[usize::from(self.kind)], self.values)
    }
}

/// Returns the attributes of each blueprint of CARLA.
fn carla() -> BTreeMap<String, BTreeMap<String, Told>> {
    let mut groups: BTreeMap<&str, Vec<(String, Told)>> = BTreeMap::new();
    let mut all: BTreeMap<String, BTreeMap<String, Told>> = BTreeMap::new();
    let mut heading: Vec<&str> = Vec::new();
    for line in CARLA.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let words: Vec<&str> = line.split(' ').collect();
        let told = |kind: &str, values: &str, note: Option<&&str>| Told {
            kind: KINDS.iter().position(|name| *name == kind).unwrap() as u8,
            values: values.to_owned(),
            is_modifiable: note != Some(&"fixed"),
            only_recommended: note == Some(&"only"),
        };
        if ["group", "actors", "vehicles"].contains(&words[0]) {
            heading = words;
        } else if heading[0] == "group" {
            let [id, kind, values] = words[..3] else { unreachable!() };
            let one = (id.to_owned(), told(kind, values, words.get(3)));
            groups.entry(heading[1]).or_default().push(one);
        } else if heading[0] == "actors" {
            for id in words {
                let attributes = heading[1..].iter().flat_map(|group| groups[group].clone());
                // One id contains a space.
                all.insert(id.replace("bike_helmet", "bike helmet"), attributes.collect());
            }
        } else {
            let [id, base, special, generation, lights, doors] = words[..] else { unreachable!() };
            let is_bike = matches!(base, "motorcycle" | "bicycle");
            let more = if is_bike { &groups["driver"][..] } else { &[] };
            let mut attributes: BTreeMap<_, _> =
                groups["vehicle"].iter().chain(more).cloned().collect();
            for (name, kind, value) in [
                ("base_type", "string", base),
                ("special_type", "string", special.trim_matches('-')),
                ("generation", "int", generation),
                ("number_of_wheels", "int", if is_bike { "2" } else { "4" }),
                ("has_lights", "bool", lights),
                ("has_dynamic_doors", "bool", doors),
            ] {
                attributes.insert(name.to_owned(), told(kind, value, Some(&"fixed")));
            }
            all.insert(id.to_owned(), attributes);
        }
    }
    all
}

/// Returns the differences between CARLA's catalogue and ours, and the blueprints that have them.
fn differences() -> BTreeMap<String, Vec<String>> {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut add = |what: String, id: &str| found.entry(what).or_default().push(id.to_owned());
    let wanted = carla();
    let ours: BTreeMap<_, _> = definitions().iter().map(|d| (d.id.as_str(), d)).collect();
    for id in wanted.keys().filter(|id| !ours.contains_key(id.as_str())) {
        add(format!("{id}: missing"), id);
    }
    for (id, definition) in &ours {
        let Some(attributes) = wanted.get(*id) else {
            add(format!("{id}: not CARLA's"), id);
            continue;
        };
        if definition.tags != id.replace('.', ",") {
            add(format!("{id}: tags are {}", definition.tags), id);
        }
        let kind = id.split('.').next().unwrap_or_default();
        let told: BTreeMap<_, _> =
            definition.attributes.iter().map(|v| (v.attribute.id.as_str(), v)).collect();
        for name in attributes.keys().filter(|name| !told.contains_key(name.as_str())) {
            add(format!("{kind}: {name} is missing"), id);
        }
        for (name, v) in told {
            let Some(told) = attributes.get(name) else {
                add(format!("{kind}: {name} is not CARLA's"), id);
                continue;
            };
            let values =
                if v.is_modifiable { v.recommended.join("|") } else { v.attribute.value.clone() };
            let ours = Told {
                kind: v.attribute.kind,
                values: if told.values == "*" { told.values.clone() } else { values },
                is_modifiable: v.is_modifiable,
                only_recommended: v.only_recommended,
            };
            let told = Told { values: told.values.replace("ID", id), ..told.clone() };
            if ours != told {
                add(format!("{kind}: {name} is {ours}, CARLA's {told}"), id);
            }
            if v.is_modifiable && v.recommended.first() != Some(&v.attribute.value) {
                add(format!("{kind}: {name} has a default that is not the first value"), id);
            }
        }
    }
    found
}

#[test]
fn blueprints_and_attributes_are_those_of_carla() {
    let found = differences();
    let is_meant = |what: &str| MEANT.iter().any(|meant| what.starts_with(meant));
    let lines: Vec<String> = found
        .iter()
        .filter(|(what, _)| !is_meant(what))
        .map(|(what, ids)| format!("{what} ({}: {})", ids.len(), ids.join(", ")))
        .collect();
    assert!(lines.is_empty(), "{} differences:\n{}", lines.len(), lines.join("\n"));
    for meant in MEANT {
        assert!(found.keys().any(|what| what.starts_with(meant)), "no longer different: {meant}");
    }
}

#[test]
fn ids_and_numbers_of_blueprints_are_unique() {
    let mut ids: Vec<_> = definitions().iter().map(|d| d.id.as_str()).collect();
    let mut uids: Vec<_> = definitions().iter().map(|d| d.uid).collect();
    let count = ids.len();
    ids.sort_unstable();
    ids.dedup();
    uids.sort_unstable();
    uids.dedup();
    assert_eq!((ids.len(), uids.len()), (count, count));
    assert!(definition("traffic.traffic_light").is_none());
}
