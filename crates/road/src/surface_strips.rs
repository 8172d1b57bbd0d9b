//! The cross section surface of OpenDRIVE 1.8: the shape of the road's surface across the road, in
//! strips.

use crate::cubic::Profile;

/// Height over t of a whole road, by strips side by side from an offset outwards.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CrossSection {
    pub(crate) t_offset: Profile,
    /// Strips to the left of the offset, nearest first.
    pub(crate) left: Vec<Strip>,
    /// Strips to the right of the offset, nearest first.
    pub(crate) right: Vec<Strip>,
}

/// One strip: a cubic in t whose coefficients are functions of s.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Strip {
    pub(crate) id: i32,
    /// Whether it begins at the height at which the previous strip ends.
    pub(crate) is_relative: bool,
    /// The outermost strip may have no width and extends without limit.
    pub(crate) width: Profile,
    pub(crate) factors: [Profile; 4],
}

impl CrossSection {
    pub(crate) fn is_empty(&self) -> bool {
        self.left.is_empty() && self.right.is_empty()
    }

    /// Returns the height of the surface above the road's plane.
    pub(crate) fn height(&self, s: f64, t: f64) -> f64 {
        let t = t - self.t_offset.at(s);
        let strips = if t >= 0.0 { &self.left } else { &self.right };
        let (mut left, mut base) = (t.abs(), 0.0);
        for (place, strip) in strips.iter().enumerate() {
            let width = strip.width.at(s).max(0.0);
            let is_last = place + 1 == strips.len() || strip.width.is_empty();
            let across = if is_last { left } else { left.min(width) };
            let start = if strip.is_relative { base } else { 0.0 };
            // Slopes refer to rising t on both sides.
            let signed = across.copysign(t);
            let [a, b, c, d] = [0, 1, 2, 3].map(|power: usize| strip.factors[power].at(s));
            base = start + a + signed * (b + signed * (c + signed * d));
            if is_last || left <= width {
                break;
            }
            left -= width;
        }
        base
    }
}
