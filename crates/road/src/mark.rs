//! Road marks: what is painted on a lane's border.

/// One `<roadMark>`: holds from `from_m` until the next of the same lane begins.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadMark {
    /// Metres of s from the start of the lane's section.
    pub from_m: f64,
    /// What is drawn.
    pub kind: MarkKind,
    /// In which colour.
    pub color: MarkColor,
    /// Metres; of each single line.
    pub width_m: f64,
    /// Drawn bold.
    pub bold: bool,
    /// Who may cross it.
    pub change: MarkChange,
    /// Single lines, where the file says them.
    pub lines: Vec<MarkLine>,
    /// How it sways from the border, in rising order.
    pub sways: Vec<MarkSway>,
}

/// A `<sway>` record: how far a mark lies to the left of its border, as a cubic of the metres
/// since it began to hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkSway {
    /// Metres of s from the start of the mark.
    pub from_m: f64,
    /// a, b, c, d.
    pub factors: [f64; 4],
}

/// One painted line of a mark, as the file says it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkLine {
    /// Metres painted; the whole way if `space_m` is zero.
    pub length_m: f64,
    /// Metres left out after it.
    pub space_m: f64,
    /// Metres from the border to the line's middle, in t.
    pub offset_t_m: f64,
    /// Metres from the mark's start to the first dash.
    pub offset_s_m: f64,
    /// Metres.
    pub width_m: f64,
    /// Drawn once, not repeated.
    pub once: bool,
}

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MarkKind {
    /// Nothing.
    None,
    /// One line.
    Solid,
    /// Dashes.
    Broken,
    /// Two lines.
    SolidSolid,
    /// Solid on the inner side, dashes on the outer one.
    SolidBroken,
    /// Dashes on the inner side, solid on the outer one.
    BrokenSolid,
    /// Two rows of dashes.
    BrokenBroken,
    /// Raised dots.
    BottsDots,
    /// Grass.
    Grass,
    /// A kerb stone.
    Curb,
    /// The edge of the pavement.
    Edge,
    /// Something else.
    Other,
}

/// The paint.
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
    /// The file does not say, or a colour that is none of these.
    Other,
}

/// Who may cross a mark, by the lane's ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MarkChange {
    /// Nobody.
    None,
    /// Only towards rising lane ids.
    Increase,
    /// Only towards falling lane ids.
    Decrease,
    /// Everybody.
    Both,
}

/// The mark that holds `ds` metres into the section.
pub(crate) fn mark_at(marks: &[RoadMark], ds: f64) -> Option<&RoadMark> {
    let after = marks.partition_point(|mark| mark.from_m <= ds + EARLY_M);
    after.checked_sub(1).map(|at| &marks[at])
}

/// A mark that begins this little ahead holds already: sums of lengths are rounded.
const EARLY_M: f64 = 1e-9;

impl RoadMark {
    /// Whether one may cross from lane `from` to lane `to`, by their ids.
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

    /// The kind of this number, in the order of the list above.
    pub fn from_number(number: u32) -> Option<MarkKind> {
        MarkKind::TEXTS.get(number as usize).map(|row| row.0)
    }

    /// The kind that OpenDRIVE calls `text`.
    pub fn from_text(text: &str) -> MarkKind {
        let row = MarkKind::TEXTS.iter().find(|row| row.1 == text);
        row.map_or(MarkKind::Other, |row| row.0)
    }

    /// OpenDRIVE's word for it.
    pub fn text(self) -> &'static str {
        MarkKind::TEXTS[self as usize].1
    }

    /// Who may cross such a mark where the file does not say.
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
            // Who stands beside the dashes may leave over them.
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

    /// The colour of this number, in the order of the list above.
    pub fn from_number(number: u32) -> Option<MarkColor> {
        MarkColor::TEXTS.get(number as usize).map(|row| row.0)
    }

    /// The colour that OpenDRIVE calls `text`; "standard" is white.
    pub fn from_text(text: &str) -> MarkColor {
        let row = MarkColor::TEXTS.iter().find(|row| row.1 == text);
        row.map_or(MarkColor::Other, |row| row.0)
    }

    /// OpenDRIVE's word for it.
    pub fn text(self) -> &'static str {
        MarkColor::TEXTS[self as usize].1
    }
}

impl MarkChange {
    /// OpenDRIVE's word for it.
    pub fn text(self) -> &'static str {
        match self {
            MarkChange::None => "none",
            MarkChange::Increase => "increase",
            MarkChange::Decrease => "decrease",
            MarkChange::Both => "both",
        }
    }
}
