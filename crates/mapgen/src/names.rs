//! Towns that ship under a name.

use crate::{
    generate::write_plan,
    layouts::style::{Blocks, Course, Style},
    plan::{Character, Plan},
};

/// Returns the default map: its name and its OpenDRIVE text.
pub fn default_map() -> (&'static str, String) {
    (OWN_TOWNS[0].name, OWN_TOWNS[0].text())
}

/// Returns the OpenDRIVE text of a named town: one of [`names`] or [`carla_names`], in any
/// spelling.
///
/// Under a name of CARLA's stands a generated town of the same kind, not CARLA's map.
pub fn named(name: &str) -> Option<String> {
    OWN_TOWNS.iter().chain(&CARLA_TOWNS).find(|row| row.has_name(name)).map(Row::text)
}

/// The names of the towns that ship; the first is the default.
pub fn names() -> impl Iterator<Item = &'static str> {
    OWN_TOWNS.iter().map(|row| row.name)
}

/// The names of CARLA's maps under which [`named`] returns generated towns of the same kind.
pub fn carla_names() -> impl Iterator<Item = &'static str> {
    CARLA_TOWNS.iter().map(|row| row.name)
}

/// A short description of a named town.
pub fn description(name: &str) -> Option<&'static str> {
    OWN_TOWNS.iter().chain(&CARLA_TOWNS).find(|row| row.has_name(name)).map(|row| row.description)
}

struct Row {
    name: &'static str,
    description: &'static str,
    character: Character,
    style: Style,
    seed: u64,
    size_m: f64,
    relief_m: f64,
}

impl Row {
    /// Whether this is its name in any letter case, with or without CARLA's suffix `_Opt` of maps
    /// with layers.
    fn has_name(&self, name: &str) -> bool {
        let plain = name.len().checked_sub(4).and_then(|end| name.split_at_checked(end));
        let plain =
            plain.filter(|(_, mark)| mark.eq_ignore_ascii_case("_opt")).map(|(stem, _)| stem);
        let is = |name: &str| self.name.eq_ignore_ascii_case(name);
        is(name) || plain.is_some_and(|stem| stem.starts_with(['T', 't']) && is(stem))
    }

    fn text(&self) -> String {
        let plan = Plan {
            name: self.name.to_string(),
            seed: self.seed,
            size_m: self.size_m,
            character: self.character,
            relief_m: self.relief_m,
        };
        write_plan(&plan, self.style)
    }
}

const fn row(
    (name, description): (&'static str, &'static str),
    (character, style): (Character, Style),
    seed: u64,
    size_m: f64,
    relief_m: f64,
) -> Row {
    Row { name, description, character, style, seed, size_m, relief_m }
}

const MIXED: (Character, Style) = (Character::Grid, Style::Grid(Blocks::Mixed));
const BROAD: (Character, Style) = (Character::Grid, Style::Grid(Blocks::Broad));
const TEES: (Character, Style) = (Character::Grid, Style::Grid(Blocks::Tees));
const OLD: (Character, Style) = (Character::OldTown, Style::OldTown);
const SUBURB: (Character, Style) = (Character::Suburb, Style::Suburb);
const ROUND: (Character, Style) = (Character::Roundabouts, Style::Roundabouts);
const COUNTRY: (Character, Style) = (Character::Countryside, Style::Countryside);
const RING: (Character, Style) = (Character::Highway, Style::Highway(Course::Ring, Blocks::Mixed));
const BROAD_RING: (Character, Style) =
    (Character::Highway, Style::Highway(Course::Ring, Blocks::Broad));
const EIGHT: (Character, Style) =
    (Character::Highway, Style::Highway(Course::Eight, Blocks::Mixed));

const OWN_TOWNS: [Row; 8] = [
    row(("Millbrook", "city grid with avenues"), MIXED, 7, 640.0, 5.0),
    row(("Flatford", "small city grid, level"), MIXED, 3, 480.0, 0.0),
    row(("Greatmoor", "large city grid"), MIXED, 11, 1100.0, 12.0),
    row(("Altmarkt", "old town with one-way lanes"), OLD, 4, 500.0, 6.0),
    row(("Fernhill", "suburb with closes and crescents"), SUBURB, 2, 860.0, 12.0),
    row(("Swanringway", "town of roundabouts"), ROUND, 5, 760.0, 6.0),
    row(("Longreach", "motorway round a small town"), RING, 1, 1280.0, 4.0),
    row(("Hollowdale", "villages and country roads over hills"), COUNTRY, 6, 1700.0, 40.0),
];

const CARLA_TOWNS: [Row; 8] = [
    row(("Town01", "small town of T-junctions"), TEES, 1, 400.0, 0.0),
    row(("Town02", "smaller town of T-junctions"), TEES, 2, 270.0, 0.0),
    row(("Town03", "city with roundabouts"), ROUND, 3, 620.0, 6.0),
    row(("Town04", "motorway in a figure of eight by a small town"), EIGHT, 4, 1280.0, 5.0),
    row(("Town05", "squared grid of avenues in a motorway"), BROAD_RING, 5, 1400.0, 4.0),
    row(("Town06", "long motorway with many lanes"), RING, 6, 1900.0, 2.0),
    row(("Town07", "rural roads and villages"), COUNTRY, 7, 900.0, 25.0),
    row(("Town10HD", "inner city of avenues"), BROAD, 10, 480.0, 0.0),
];
