//! Towns that nobody has drawn: a seed in, OpenDRIVE text out.

mod curve;
mod junction;
mod layout;
mod write;

#[cfg(test)]
mod tests;

/// What kind of town to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Character {
    /// Blocks of varied size between avenues and streets, signals at the crossings, a few bends.
    Grid,
}

/// What to generate.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Goes into the header.
    pub name: String,
    /// Same seed, same town.
    pub seed: u64,
    /// From edge to edge. Metres; held within 250 and 3000.
    pub size_m: f64,
    /// The style.
    pub character: Character,
    /// From the lowest to the highest junction. Metres; held within 0 and what streets can climb.
    pub relief_m: f64,
}

/// The OpenDRIVE 1.4 text of a town after this plan.
///
/// Every driving lane reaches every other; junctions carry signals with controllers, or stop signs
/// at their minor arm; every street has sidewalks, speed limits and crosswalks.
pub fn generate(plan: &Plan) -> String {
    let layout = match plan.character {
        Character::Grid => layout::grid(plan),
    };
    let junctions = junction::junctions(&layout);
    write::document(plan, &layout, &junctions)
}

/// The map that is used where none is named: its name and its OpenDRIVE text.
pub fn default_map() -> (&'static str, String) {
    (NAMED[0].0, generate(&plan(&NAMED[0])))
}

/// The OpenDRIVE text of one of our own towns; see [`names`].
pub fn named(name: &str) -> Option<String> {
    let row = NAMED.iter().find(|row| row.0.eq_ignore_ascii_case(name))?;
    Some(generate(&plan(row)))
}

/// The names that [`named`] knows; the first is the default.
pub fn names() -> impl Iterator<Item = &'static str> {
    NAMED.iter().map(|row| row.0)
}

/// Name, seed, size in metres, relief in metres.
const NAMED: [(&str, u64, f64, f64); 3] =
    [("Millbrook", 7, 640.0, 5.0), ("Flatford", 3, 480.0, 0.0), ("Greatmoor", 11, 1100.0, 12.0)];

fn plan((name, seed, size_m, relief_m): &(&str, u64, f64, f64)) -> Plan {
    Plan {
        name: (*name).to_string(),
        seed: *seed,
        size_m: *size_m,
        character: Character::Grid,
        relief_m: *relief_m,
    }
}
