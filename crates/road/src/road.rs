use crate::{
    axes::{RoadAxes, Station},
    cubic::{Jet, Profile},
    curve::Curve,
    lane::{Lane, LaneIndex},
    mark::RoadMark,
    surface_strips::CrossSection,
};

/// A road: a reference line with lanes along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Road {
    /// OpenDRIVE's id.
    pub id: String,
    /// Name in the file.
    pub name: String,
    /// Length in metres of s.
    pub length_m: f64,
    /// Index into [`crate::Network::junctions`] of the junction that it belongs to.
    pub junction: Option<u32>,
    /// Whether traffic keeps left.
    pub left_hand: bool,
    /// Lane sections in rising s.
    pub sections: Vec<Section>,
    /// What precedes the road at its start.
    pub predecessor: Option<RoadLink>,
    /// What follows the road at its end.
    pub successor: Option<RoadLink>,
    /// Types of the road, in rising s.
    pub types: Vec<RoadType>,
    /// Switches of a railway.
    pub switches: Vec<Switch>,
    pub(crate) curves: Vec<Curve>,
    pub(crate) elevation: Profile,
    pub(crate) superelevation: Profile,
    pub(crate) crossfall: [Profile; 2],
    pub(crate) shapes: Vec<Shape>,
    pub(crate) cross_section: CrossSection,
    pub(crate) lane_offset: Profile,
}

/// A lane section: the part of a road up to the next section.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Where it begins, metres of s.
    pub start_m: f64,
    /// Length in metres of s.
    pub length_m: f64,
    /// Lanes from left to right, that is by falling id.
    pub lanes: Vec<LaneIndex>,
    /// Marks on the centre lane, in rising order.
    pub marks: Vec<RoadMark>,
    /// Number of `lanes` left of the centre.
    pub(crate) left: usize,
}

/// A `<type>` record of a road.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadType {
    /// Where it begins, metres of s.
    pub from_m: f64,
    /// OpenDRIVE's type: town, motorway, rural ...
    pub kind: String,
    /// Speed limit of all lanes that have none of their own, metres per second.
    pub limit_mps: Option<f64>,
}

/// A `<switch>` of a railway.
#[derive(Clone, Debug, PartialEq)]
pub struct Switch {
    /// OpenDRIVE's id.
    pub id: String,
    /// Name in the file.
    pub name: String,
    /// OpenDRIVE's position: dynamic, straight, turn.
    pub position: String,
    /// Position along its road, metres of s.
    pub s: f64,
    /// Id of the road that it leads to, and its s there in metres.
    pub side_track: (String, f64),
}

/// What a road is connected to at one of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoadLink {
    /// Another road.
    Road {
        /// Index into [`crate::Network::roads`].
        road: u32,
        /// Whether it is connected at its start, not at its end.
        at_start: bool,
    },
    /// Index into [`crate::Network::junctions`].
    Junction(u32),
}

/// A `<shape>` record: height over t from `from_m` on, blended linearly to the next station.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape {
    pub(crate) from_m: f64,
    pub(crate) over_t: Profile,
}

/// A lane's borders at one s, as unsigned distances from the centre lane, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Borders {
    pub(crate) inner: Jet,
    pub(crate) outer: Jet,
    /// The part of `inner` on lanes that stay level.
    pub(crate) level: Jet,
}

impl Road {
    /// Returns the index of the section at `s`.
    pub fn section_at(&self, s: f64) -> usize {
        self.sections.partition_point(|section| section.start_m <= s).max(1) - 1
    }

    /// Returns the reference line at `s`.
    pub(crate) fn station(&self, s: f64) -> Station {
        let after = self.curves.partition_point(|curve| curve.from_m <= s);
        let curve = &self.curves[after.max(1) - 1];
        let point = curve.at(s - curve.from_m);
        Station {
            x: point.position.x,
            y: point.position.y,
            heading_rad: point.heading_rad,
            curvature: point.curvature_per_m,
            curvature_slope: point.curvature_slope,
            elevation: self.elevation.jet(s),
            roll: self.superelevation.jet(s),
        }
    }

    /// Returns whether the reference line is straight at `s`, seen from above.
    pub(crate) fn is_line_at(&self, s: f64) -> bool {
        let after = self.curves.partition_point(|curve| curve.from_m <= s);
        self.curves[after.max(1) - 1].is_line()
    }

    /// Returns the axes at `s`, and the curvature of the reference line seen from above and from
    /// the side, per metre.
    pub(crate) fn axes_and_bend(&self, s: f64) -> (RoadAxes, f64) {
        let after = self.curves.partition_point(|curve| curve.from_m <= s);
        let curve = &self.curves[after.max(1) - 1];
        let (position, ahead, curvature) = curve.ray(s - curve.from_m);
        let elevation = self.elevation.jet(s);
        let roll = self.superelevation.at(s);
        let axes = RoadAxes::along(position, ahead, curvature, elevation, roll);
        (axes, curvature.abs() + elevation.bend.abs())
    }

    /// Returns whether the surface may bend across a lane.
    pub(crate) fn bends_across(&self) -> bool {
        !self.shapes.is_empty() || !self.cross_section.is_empty()
    }

    /// Returns whether the surface is the banked plane everywhere.
    pub(crate) fn is_even(&self) -> bool {
        self.shapes.is_empty()
            && self.cross_section.is_empty()
            && self.crossfall.iter().all(|side| side.is_empty())
    }

    /// Returns the height of the surface above the banked plane at `t`: crossfall and shapes.
    pub(crate) fn unevenness(&self, s: f64, t: f64) -> f64 {
        let mut height = 0.0;
        let side = &self.crossfall[usize::from(t < 0.0)];
        if !side.is_empty() {
            height -= t.abs() * side.at(s).tan();
        }
        if !self.cross_section.is_empty() {
            height += self.cross_section.height(s, t);
        }
        if !self.shapes.is_empty() {
            let after = self.shapes.partition_point(|shape| shape.from_m <= s);
            if after > 0 {
                let here = &self.shapes[after - 1];
                let low = here.over_t.at(t);
                height += match self.shapes.get(after) {
                    Some(next) => {
                        let share = (s - here.from_m) / (next.from_m - here.from_m).max(1e-9);
                        low + (next.over_t.at(t) - low) * share.clamp(0.0, 1.0)
                    }
                    None => low,
                };
            }
        }
        height
    }

    /// Returns the type record that applies at `s`.
    pub fn type_at(&self, s: f64) -> Option<&RoadType> {
        let after = self.types.partition_point(|kind| kind.from_m <= s + 1e-6);
        self.types.get(after.max(1) - 1)
    }
}

/// At a section's very end its own lane offset still applies, not the next one's. Metres.
const BEFORE_END_M: f64 = 1e-5;

impl Section {
    /// Returns the lane offset of this section's lanes at `s`.
    pub(crate) fn lane_offset(&self, road: &Road, s: f64) -> Jet {
        let end = self.start_m + self.length_m - BEFORE_END_M;
        road.lane_offset.jet(s.min(end.max(self.start_m)))
    }

    /// Returns the borders of the lane at `position` of `lanes`, `ds` metres into the section.
    pub(crate) fn borders(&self, lanes: &[Lane], position: usize, ds: f64) -> Borders {
        let mut borders =
            Borders { inner: Jet::default(), outer: Jet::default(), level: Jet::default() };
        let mut step = |at: usize| {
            let lane = &lanes[self.lanes[at].0 as usize];
            borders.inner = borders.outer;
            if at != position {
                borders.outer = lane.outer(borders.inner, ds);
                if lane.level {
                    borders.level = borders.level + borders.outer + borders.inner.scaled(-1.0);
                }
            } else {
                borders.outer = lane.outer(borders.inner, ds);
            }
        };
        if position < self.left {
            (position..self.left).rev().for_each(&mut step);
        } else {
            (self.left..=position).for_each(&mut step);
        }
        borders
    }
}

impl Lane {
    /// Returns the distance of the outer border from the centre, given that of the inner one.
    fn outer(&self, inner: Jet, ds: f64) -> Jet {
        if !self.widths.is_empty() {
            let width = self.widths.jet(ds);
            // Rounding may give a vanishing lane a slightly negative width.
            return if width.value > 0.0 { inner + width } else { inner };
        }
        if !self.borders.is_empty() {
            let border = self.borders.jet(ds);
            let border = if border.value < 0.0 { border.scaled(-1.0) } else { border };
            return if border.value > inner.value { border } else { inner };
        }
        inner
    }

    /// Returns the lane's width where its inner border is `inner` metres from the centre.
    pub(crate) fn width_from(&self, inner: f64, ds: f64) -> f64 {
        if !self.widths.is_empty() {
            self.widths.at(ds).max(0.0)
        } else if !self.borders.is_empty() {
            (self.borders.at(ds).abs() - inner).max(0.0)
        } else {
            0.0
        }
    }

    /// Returns the height of the middle of the lane's surface above the road's.
    pub(crate) fn rise_at_centre(&self, ds: f64) -> f64 {
        if self.heights.is_empty() {
            return 0.0;
        }
        let (inner, outer) = self.rise(ds);
        0.5 * (inner + outer)
    }

    /// Returns the heights of the lane's surface above the road's at its inner and outer border;
    /// linear between records.
    pub(crate) fn rise(&self, ds: f64) -> (f64, f64) {
        let after = self.heights.partition_point(|height| height.from_m <= ds + 1e-6);
        let Some(here) = self.heights.get(after.max(1) - 1) else { return (0.0, 0.0) };
        match self.heights.get(after) {
            Some(next) if after > 0 => {
                let share = ((ds - here.from_m) / (next.from_m - here.from_m)).clamp(0.0, 1.0);
                let mix = |from: f64, to: f64| from + (to - from) * share;
                (mix(here.inner_m, next.inner_m), mix(here.outer_m, next.outer_m))
            }
            _ => (here.inner_m, here.outer_m),
        }
    }

    /// Returns +1 left of the reference line, -1 right of it.
    pub(crate) fn sign(&self) -> f64 {
        if self.id > 0 { 1.0 } else { -1.0 }
    }
}
