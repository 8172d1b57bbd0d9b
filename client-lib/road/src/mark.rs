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

impl MarkKind {
    /// The kind that OpenDRIVE calls `text`.
    pub fn from_text(text: &str) -> MarkKind {
        match text {
            "none" => MarkKind::None,
            "solid" => MarkKind::Solid,
            "broken" => MarkKind::Broken,
            "solid solid" => MarkKind::SolidSolid,
            "solid broken" => MarkKind::SolidBroken,
            "broken solid" => MarkKind::BrokenSolid,
            "broken broken" => MarkKind::BrokenBroken,
            "botts dots" => MarkKind::BottsDots,
            "grass" => MarkKind::Grass,
            "curb" => MarkKind::Curb,
            "edge" => MarkKind::Edge,
            _ => MarkKind::Other,
        }
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
    /// The colour that OpenDRIVE calls `text`.
    pub fn from_text(text: &str) -> MarkColor {
        match text {
            "yellow" => MarkColor::Yellow,
            "blue" => MarkColor::Blue,
            "green" => MarkColor::Green,
            "red" => MarkColor::Red,
            "orange" => MarkColor::Orange,
            "violet" => MarkColor::Violet,
            "black" => MarkColor::Black,
            _ => MarkColor::White,
        }
    }
}
