//! Road marks: paint on the borders of lanes.

/// One `<roadMark>`: applies from `from_m` until the next one of the same lane begins.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadMark {
    /// Metres of s from the start of the lane's section.
    pub from_m: f64,
    /// Type of the mark.
    pub kind: MarkKind,
    /// Colour of the paint.
    pub color: MarkColor,
    /// Width of each single line, metres.
    pub width_m: f64,
    /// Whether it is drawn bold.
    pub bold: bool,
    /// In which directions lanes may be changed across it.
    pub change: MarkChange,
    /// Single lines, if the file lists them.
    pub lines: Vec<MarkLine>,
    /// Lateral sway relative to the border, in rising order.
    pub sways: Vec<MarkSway>,
}

/// A `<sway>` record: how far a mark lies to the left of its border, as a cubic of the metres since
/// the mark began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkSway {
    /// Metres of s from the start of the mark.
    pub from_m: f64,
    /// The coefficients a, b, c, d.
    pub factors: [f64; 4],
}

/// One painted line of a mark, as the file describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkLine {
    /// Length of a dash, metres; the line is continuous if `space_m` is zero.
    pub length_m: f64,
    /// Length of the gap after a dash, metres.
    pub space_m: f64,
    /// Distance from the border to the line's middle, metres of t.
    pub offset_t_m: f64,
    /// Distance from the mark's start to the first dash, metres.
    pub offset_s_m: f64,
    /// Width in metres.
    pub width_m: f64,
    /// Whether it is drawn once instead of being repeated.
    pub once: bool,
}

/// Type of a road mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MarkKind {
    /// No mark.
    None,
    /// One continuous line.
    Solid,
    /// One dashed line.
    Broken,
    /// Two continuous lines.
    SolidSolid,
    /// Continuous on the inner side, dashed on the outer one.
    SolidBroken,
    /// Dashed on the inner side, continuous on the outer one.
    BrokenSolid,
    /// Two dashed lines.
    BrokenBroken,
    /// Raised dots.
    BottsDots,
    /// Edge of grass.
    Grass,
    /// Kerb stone.
    Curb,
    /// Edge of the pavement.
    Edge,
    /// Any other type.
    Other,
}

/// Colour of a road mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MarkColor {
    /// White, also where the file says "standard".
    White,
    /// Yellow.
    Yellow,
    /// Blue.
    Blue,
    /// Green.
    Green,
    /// Red.
    Red,
    /// Orange.
    Orange,
    /// Violet.
    Violet,
    /// Black.
    Black,
    /// Not given, or a colour that is none of these.
    Other,
}

/// In which directions lanes may be changed across a mark, by lane ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MarkChange {
    /// In no direction.
    None,
    /// Only towards rising lane ids.
    Increase,
    /// Only towards falling lane ids.
    Decrease,
    /// In both directions.
    Both,
}

/// Returns the mark that applies `ds` metres into the section.
pub(crate) fn mark_at(marks: &[RoadMark], ds: f64) -> Option<&RoadMark> {
    let after = marks.partition_point(|mark| mark.from_m <= ds + EARLY_M);
    after.checked_sub(1).map(|at| &marks[at])
}

/// A mark that begins this little ahead applies already, metres: sums of lengths are rounded.
const EARLY_M: f64 = 1e-9;

impl RoadMark {
    /// Returns whether a change from lane `from` to lane `to`, given by their ids, is allowed.
    pub fn allows(&self, from: i32, to: i32) -> bool {
        match self.change {
            MarkChange::Both => true,
            MarkChange::None => false,
            MarkChange::Increase => to > from,
            MarkChange::Decrease => to < from,
        }
    }
}

impl MarkKind {
    const TEXTS: [(MarkKind, &str); 12] = [
        (MarkKind::None, "none"),
        (MarkKind::Solid, "solid"),
        (MarkKind::Broken, "broken"),
        (MarkKind::SolidSolid, "solid solid"),
        (MarkKind::SolidBroken, "solid broken"),
        (MarkKind::BrokenSolid, "broken solid"),
        (MarkKind::BrokenBroken, "broken broken"),
        (MarkKind::BottsDots, "botts dots"),
        (MarkKind::Grass, "grass"),
        (MarkKind::Curb, "curb"),
        (MarkKind::Edge, "edge"),
        (MarkKind::Other, "custom"),
    ];

    /// Returns the type with this number, in the order of declaration.
    pub fn from_number(number: u32) -> Option<MarkKind> {
        MarkKind::TEXTS.get(number as usize).map(|row| row.0)
    }

    /// Returns the type that OpenDRIVE calls `text`.
    pub fn from_text(text: &str) -> MarkKind {
        let row = MarkKind::TEXTS.iter().find(|row| row.1 == text);
        row.map_or(MarkKind::Other, |row| row.0)
    }

    /// Returns OpenDRIVE's name of the type.
    pub fn text(self) -> &'static str {
        MarkKind::TEXTS[self as usize].1
    }

    /// Returns in which directions such a mark may be crossed if the file does not say.
    /// `outer_falls` says whether ids fall towards the outside.
    pub fn usual_change(self, outer_falls: bool) -> MarkChange {
        let (outwards, inwards) = if outer_falls {
            (MarkChange::Decrease, MarkChange::Increase)
        } else {
            (MarkChange::Increase, MarkChange::Decrease)
        };
        match self {
            MarkKind::None | MarkKind::Broken | MarkKind::BrokenBroken | MarkKind::BottsDots => {
                MarkChange::Both
            }
            // A lane may be left across the dashes beside it.
            MarkKind::BrokenSolid => outwards,
            MarkKind::SolidBroken => inwards,
            _ => MarkChange::None,
        }
    }
}

impl MarkColor {
    const TEXTS: [(MarkColor, &str); 10] = [
        (MarkColor::White, "white"),
        (MarkColor::Yellow, "yellow"),
        (MarkColor::Blue, "blue"),
        (MarkColor::Green, "green"),
        (MarkColor::Red, "red"),
        (MarkColor::Orange, "orange"),
        (MarkColor::Violet, "violet"),
        (MarkColor::Black, "black"),
        (MarkColor::Other, "other"),
        (MarkColor::White, "standard"),
    ];

    /// Returns the colour with this number, in the order of declaration.
    pub fn from_number(number: u32) -> Option<MarkColor> {
        MarkColor::TEXTS.get(number as usize).map(|row| row.0)
    }

    /// Returns the colour that OpenDRIVE calls `text`; "standard" is white.
    pub fn from_text(text: &str) -> MarkColor {
        let row = MarkColor::TEXTS.iter().find(|row| row.1 == text);
        row.map_or(MarkColor::Other, |row| row.0)
    }

    /// Returns OpenDRIVE's name of the colour.
    pub fn text(self) -> &'static str {
        MarkColor::TEXTS[self as usize].1
    }
}

impl MarkChange {
    /// Returns OpenDRIVE's name of the value.
    pub fn text(self) -> &'static str {
        match self {
            MarkChange::None => "none",
            MarkChange::Increase => "increase",
            MarkChange::Decrease => "decrease",
            MarkChange::Both => "both",
        }
    }
}
