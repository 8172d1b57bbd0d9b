use glam::DVec3;

use crate::{
    MapError,
    contradictions::Contradictions,
    geo::{GeoPoint, TransverseMercator},
    grid::LaneIndexGrid,
    junction::{Junction, JunctionGroup},
    lane::{Lane, LaneIndex, LanePoint},
    object::{ObjectReference, RoadObject, Span},
    records::{Header, UserData},
    road::{Borders, Road},
    signal::{Controller, Signal},
};

/// A road network. It does not change once parsed.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    pub(crate) header: Header,
    pub(crate) origin: DVec3,
    pub(crate) lanes: Vec<Lane>,
    pub(crate) roads: Vec<Road>,
    pub(crate) junctions: Vec<Junction>,
    pub(crate) signals: Vec<Signal>,
    pub(crate) controllers: Vec<Controller>,
    pub(crate) objects: Vec<RoadObject>,
    pub(crate) spans: Vec<Span>,
    pub(crate) object_references: Vec<ObjectReference>,
    pub(crate) junction_groups: Vec<JunctionGroup>,
    pub(crate) user_data: Vec<UserData>,
    /// See `Network::sorted_uses`.
    pub(crate) uses: Vec<(u32, u32, u32)>,
    pub(crate) findings: Vec<MapError>,
    pub(crate) grid: LaneIndexGrid,
    pub(crate) bounds: (DVec3, DVec3),
    pub(crate) contradictions: Contradictions,
}

impl Network {
    /// Returns every lane except centre lanes, of every section of every road.
    pub fn lanes(&self) -> &[Lane] {
        &self.lanes
    }

    /// Returns one lane.
    pub fn lane(&self, index: LaneIndex) -> &Lane {
        &self.lanes[index.0 as usize]
    }

    /// Returns every road, in the order of the file.
    pub fn roads(&self) -> &[Road] {
        &self.roads
    }

    /// Returns every junction, in the order of the file.
    pub fn junctions(&self) -> &[Junction] {
        &self.junctions
    }

    /// Returns every sign and traffic light, in the order of the file.
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// Returns every controller, in the order of the file.
    pub fn controllers(&self) -> &[Controller] {
        &self.controllers
    }

    /// Returns every object, in the order of the file.
    pub fn objects(&self) -> &[RoadObject] {
        &self.objects
    }

    /// Returns every bridge and tunnel, in the order of the file.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// Returns references from roads to objects of other roads.
    pub fn object_references(&self) -> &[ObjectReference] {
        &self.object_references
    }

    /// Returns groups of junctions that belong together.
    pub fn junction_groups(&self) -> &[JunctionGroup] {
        &self.junction_groups
    }

    /// Returns the user data of the file.
    pub fn user_data(&self) -> &[UserData] {
        &self.user_data
    }

    /// Returns the header of the file.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Returns contradictions in the file that did not make it unusable.
    pub fn findings(&self) -> &[MapError] {
        &self.findings
    }

    /// Returns the origin of world space in the file's coordinates. Zero unless the file's roads
    /// are so far from its origin that f32 would not resolve them.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Converts a point from world space to the projected coordinates of the header's geoReference.
    pub fn to_projected(&self, point: DVec3) -> DVec3 {
        let point = point + self.origin;
        let (sin, cos) = self.header.offset_heading_rad.sin_cos();
        DVec3::new(cos * point.x - sin * point.y, sin * point.x + cos * point.y, point.z)
            + self.header.offset_m
    }

    /// Converts a point from projected coordinates to world space.
    pub fn from_projected(&self, point: DVec3) -> DVec3 {
        let point = point - self.header.offset_m;
        let (sin, cos) = self.header.offset_heading_rad.sin_cos();
        DVec3::new(cos * point.x + sin * point.y, cos * point.y - sin * point.x, point.z)
            - self.origin
    }

    /// Returns latitude and longitude of a point in world space, by the header's projection; `None`
    /// if the header has none, or one that is not a transverse Mercator projection.
    pub fn geo(&self, point: DVec3) -> Option<GeoPoint> {
        let projection = TransverseMercator::from_proj(&self.header.geo_reference)?;
        let projected = self.to_projected(point);
        Some(projection.unproject(projected.x, projected.y, projected.z))
    }

    /// Returns the point in world space at a latitude and longitude: the inverse of
    /// [`Network::geo`].
    pub fn from_geo(&self, point: GeoPoint) -> Option<DVec3> {
        let projection = TransverseMercator::from_proj(&self.header.geo_reference)?;
        let (east, north) = projection.project(point);
        Some(self.from_projected(DVec3::new(east, north, point.altitude_m)))
    }

    /// Returns a lane by OpenDRIVE's ids; sections count from 0.
    pub fn find_lane(&self, road_id: &str, section: usize, lane_id: i32) -> Option<LaneIndex> {
        let road = self.roads.iter().find(|road| road.id == road_id)?;
        self.lane_of(road, section, lane_id)
    }

    pub(crate) fn lane_of(&self, road: &Road, section: usize, lane_id: i32) -> Option<LaneIndex> {
        let section = road.sections.get(section)?;
        section.lanes.iter().copied().find(|lane| self.lane(*lane).id == lane_id)
    }

    /// Returns the lowest and highest corner of the bounding box of all lanes.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.bounds
    }

    /// Returns the road, section, lane id and s of a point.
    pub fn road_space(&self, at: LanePoint) -> (&Road, usize, i32, f64) {
        let lane = self.lane(at.lane);
        let s = self.s_of(lane, at.along_m);
        (&self.roads[lane.road as usize], lane.section as usize, lane.id, s)
    }

    /// Returns the point on the centre of a lane at the road's `s`: the inverse of
    /// [`Network::road_space`]. `None` if there is no such lane.
    pub fn lane_point(&self, road_id: &str, lane_id: i32, s: f64) -> Option<LanePoint> {
        let road = self.roads.iter().find(|road| road.id == road_id)?;
        if !(-1e-6..=road.length_m + 1e-6).contains(&s) {
            return None;
        }
        let lane = self.lane_of(road, road.section_at(s), lane_id)?;
        Some(self.point_at_s(self.lane(lane), s))
    }

    pub(crate) fn point_at_s(&self, lane: &Lane, s: f64) -> LanePoint {
        let start = self.roads[lane.road as usize].sections[lane.section as usize].start_m;
        let from_start = (s - start).clamp(0.0, lane.length_m);
        let along_m = if lane.forward { from_start } else { lane.length_m - from_start };
        LanePoint { lane: lane.index, along_m }
    }

    /// Returns the road's s at `along_m`, clamped to the lane.
    pub(crate) fn s_of(&self, lane: &Lane, along_m: f64) -> f64 {
        let start = self.roads()[lane.road as usize].sections[lane.section as usize].start_m;
        let along = along_m.clamp(0.0, lane.length_m);
        if lane.forward { start + along } else { start + lane.length_m - along }
    }

    pub(crate) fn borders(&self, lane: &Lane, s: f64) -> Borders {
        let section = &self.roads()[lane.road as usize].sections[lane.section as usize];
        let position = (lane.index.0 - section.lanes[0].0) as usize;
        section.borders(self.lanes(), position, s - section.start_m)
    }

    /// Returns the roads as up to `parts` ranges with about equally many lanes.
    pub(crate) fn road_ranges(&self, parts: usize) -> Vec<std::ops::Range<usize>> {
        let roads = self.roads();
        let (mut shares, mut from, mut lanes) = (Vec::new(), 0, 0);
        for (index, road) in roads.iter().enumerate() {
            lanes += road.sections.iter().map(|section| section.lanes.len()).sum::<usize>();
            if lanes * parts >= self.lanes().len() * (shares.len() + 1) {
                shares.push(from..index + 1);
                from = index + 1;
            }
        }
        if from < roads.len() {
            shares.push(from..roads.len());
        }
        shares
    }
}
