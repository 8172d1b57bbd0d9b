//! Which town to generate: its character, size and relief.

/// The smallest size that has room for a motorway and its interchanges. Metres.
const MOTORWAY_SIZE_MIN_M: f64 = 1000.0;

/// What kind of town to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Character {
    /// Blocks of varied size between avenues and streets, lights at the crossings, a few bends.
    Grid,
    /// Crooked narrow lanes round a market square, many of them one-way.
    OldTown,
    /// Collector roads, curved residential loops between them, cul-de-sacs with turning loops.
    Suburb,
    /// A motorway of two carriageways with ramps and overpasses round a small town; it crosses
    /// itself where the seed is a multiple of three.
    Highway,
    /// Streets that meet at roundabouts.
    Roundabouts,
    /// Long curved two-lane roads over hills, and villages where some of them meet.
    Countryside,
}

impl Character {
    /// Every one, in the order of their names' list.
    pub const ALL: [Character; 6] = [
        Character::Grid,
        Character::OldTown,
        Character::Suburb,
        Character::Highway,
        Character::Roundabouts,
        Character::Countryside,
    ];

    /// What it is called: `old-town`.
    pub fn name(self) -> &'static str {
        match self {
            Character::Grid => "grid",
            Character::OldTown => "old-town",
            Character::Suburb => "suburb",
            Character::Highway => "highway",
            Character::Roundabouts => "roundabouts",
            Character::Countryside => "countryside",
        }
    }

    /// The one of this name.
    pub fn by_name(name: &str) -> Option<Character> {
        Character::ALL.into_iter().find(|one| one.name() == name)
    }

    /// From edge to edge, least and most. Metres.
    pub fn sizes_m(self) -> (f64, f64) {
        let least = match self {
            Character::Grid | Character::OldTown => 250.0,
            Character::Roundabouts | Character::Suburb => 400.0,
            Character::Countryside => 600.0,
            Character::Highway => MOTORWAY_SIZE_MIN_M,
        };
        (least, 3000.0)
    }

    /// The size and the relief of a usual one. Metres.
    pub fn usual_m(self) -> (f64, f64) {
        match self {
            Character::Grid | Character::Roundabouts => (640.0, 5.0),
            Character::OldTown => (500.0, 6.0),
            Character::Suburb => (860.0, 10.0),
            Character::Highway => (1280.0, 4.0),
            Character::Countryside => (1300.0, 35.0),
        }
    }
}

/// What to generate.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Goes into the header.
    pub name: String,
    /// Same seed, same town.
    pub seed: u64,
    /// From edge to edge. Metres; held within [`Character::sizes_m`].
    pub size_m: f64,
    /// The style.
    pub character: Character,
    /// From the lowest to the highest ground. Metres; held within 0 and what streets can climb.
    pub relief_m: f64,
}
