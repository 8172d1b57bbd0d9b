//! Which town to generate: its character, size and relief.

/// The smallest size that has room for a motorway and its interchanges. Metres.
const MOTORWAY_SIZE_MIN_M: f64 = 1000.0;

/// The kind of a generated town.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Character {
    /// Blocks of varied size between avenues and streets, with signals at the crossings.
    Grid,
    /// Narrow winding lanes round a market square, many of them one-way.
    OldTown,
    /// Collector roads, curved residential streets between them, cul-de-sacs with turning loops.
    Suburb,
    /// A motorway with ramps and overpasses round a small town. It crosses itself where the seed is
    /// a multiple of three.
    Highway,
    /// Streets that meet at roundabouts.
    Roundabouts,
    /// Long curved two-lane roads over hills, and villages at some of their crossings.
    Countryside,
}

impl Character {
    /// Every character, in the order of the documentation.
    pub const ALL: [Character; 6] = [
        Character::Grid,
        Character::OldTown,
        Character::Suburb,
        Character::Highway,
        Character::Roundabouts,
        Character::Countryside,
    ];

    /// The name on the command line, such as `old-town`.
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

    /// The character of this name.
    pub fn by_name(name: &str) -> Option<Character> {
        Character::ALL.into_iter().find(|one| one.name() == name)
    }

    /// The smallest and the largest size, from edge to edge. Metres.
    pub fn size_range_m(self) -> (f64, f64) {
        let least = match self {
            Character::Grid | Character::OldTown => 250.0,
            Character::Roundabouts | Character::Suburb => 400.0,
            Character::Countryside => 600.0,
            Character::Highway => MOTORWAY_SIZE_MIN_M,
        };
        (least, 3000.0)
    }

    /// The default size and relief. Metres.
    pub fn default_size_and_relief_m(self) -> (f64, f64) {
        match self {
            Character::Grid | Character::Roundabouts => (640.0, 5.0),
            Character::OldTown => (500.0, 6.0),
            Character::Suburb => (860.0, 10.0),
            Character::Highway => (1280.0, 4.0),
            Character::Countryside => (1300.0, 35.0),
        }
    }
}

/// A description of the town to generate.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The name in the header of the OpenDRIVE text.
    pub name: String,
    /// The seed: the same seed gives the same town.
    pub seed: u64,
    /// The size from edge to edge. Metres; limited to [`Character::size_range_m`].
    pub size_m: f64,
    /// The kind of town.
    pub character: Character,
    /// The height of the highest ground above the lowest. Metres; limited to 0 and what streets can
    /// climb.
    pub relief_m: f64,
}
