//! Crosswalks: objects whose outline pedestrians cross the road in.

use glam::DVec3;

use crate::{network::Network, object::RoadObject};

/// An area in which pedestrians may cross the road.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crosswalk<'a> {
    /// The object that the file records.
    pub object: &'a RoadObject,
    /// Its polygon in world space, metres; the first corner is not repeated.
    pub corners: &'a [DVec3],
}

impl Network {
    /// Returns every outline of every crosswalk, in the order of the file.
    pub fn crosswalks(&self) -> impl Iterator<Item = Crosswalk<'_>> {
        let objects = self.objects().iter().filter(|object| object.is_crosswalk());
        objects.flat_map(|object| {
            object.outlines.iter().map(move |corners| Crosswalk { object, corners })
        })
    }
}

impl RoadObject {
    /// Returns whether the object is a crosswalk.
    pub fn is_crosswalk(&self) -> bool {
        self.kind.eq_ignore_ascii_case("crosswalk")
    }
}
