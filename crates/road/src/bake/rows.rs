//! The fields of every type in a network. A missing field is a compile error.

use super::fields::{Field, baked, baked_enum};
use crate::{
    MapError,
    arclength::ArcLength,
    cubic::{Cubic, Profile},
    curve::{Curve, Shape as CurveShape},
    grid::LaneIndexGrid,
    junction::{Connection, Joint, Junction, JunctionGroup, JunctionKind},
    lane::{
        Lane, LaneAccess, LaneHeight, LaneIndex, LaneLinks, LaneMaterial, LaneRule, LaneSpeed,
        LaneType,
    },
    mark::{MarkChange, MarkColor, MarkKind, MarkLine, MarkSway, RoadMark},
    network::Network,
    object::{
        Corner, ObjectBorder, ObjectMarking, ObjectPlace, ObjectReference, OutlineShape, Repeat,
        RoadObject, Span,
    },
    placement::Placement,
    records::{Header, Owner, UserData},
    road::{Road, RoadLink, RoadType, Section, Shape, Switch},
    signal::{Controller, Orientation, Signal, SignalPosition, SignalReference, SignalUse},
    surface_strips::{CrossSection, Strip},
};

/// Appends everything except lanes, roads and the slabs of the index.
pub(super) fn put_rest(network: &Network, bytes: &mut Vec<u8>) {
    let Network {
        header,
        origin,
        lanes: _,
        roads: _,
        junctions,
        signals,
        controllers,
        objects,
        spans,
        object_references,
        junction_groups,
        user_data,
        uses,
        findings,
        grid,
        bounds,
        // Determined again on first use.
        contradictions: _,
    } = network;
    header.put(bytes);
    origin.put(bytes);
    junctions.put(bytes);
    signals.put(bytes);
    controllers.put(bytes);
    objects.put(bytes);
    spans.put(bytes);
    object_references.put(bytes);
    junction_groups.put(bytes);
    user_data.put(bytes);
    uses.put(bytes);
    findings.put(bytes);
    grid.put(bytes);
    bounds.put(bytes);
}

/// Reads a network without lanes, roads and the slabs of its index.
pub(super) fn take_rest(mut bytes: &[u8]) -> Option<Network> {
    let bytes = &mut bytes;
    let network = Network {
        header: Field::take(bytes)?,
        origin: Field::take(bytes)?,
        lanes: Vec::new(),
        roads: Vec::new(),
        junctions: Field::take(bytes)?,
        signals: Field::take(bytes)?,
        controllers: Field::take(bytes)?,
        objects: Field::take(bytes)?,
        spans: Field::take(bytes)?,
        object_references: Field::take(bytes)?,
        junction_groups: Field::take(bytes)?,
        user_data: Field::take(bytes)?,
        uses: Field::take(bytes)?,
        findings: Field::take(bytes)?,
        grid: LaneIndexGrid::take(bytes)?,
        bounds: Field::take(bytes)?,
        contradictions: Default::default(),
    };
    bytes.is_empty().then_some(network)
}

impl Field for LaneIndex {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.0.put(bytes);
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<LaneIndex> {
        u32::take(bytes).map(LaneIndex)
    }
}

impl Field for LaneType {
    fn put(&self, bytes: &mut Vec<u8>) {
        bytes.push((*self as u32).trailing_zeros() as u8);
    }

    #[inline]
    fn take(bytes: &mut &[u8]) -> Option<LaneType> {
        // Each type has one bit, in this order.
        LaneType::ALL.get(usize::from(u8::take(bytes)?)).copied()
    }
}

/// Everything except the slabs.
impl Field for LaneIndexGrid {
    fn put(&self, bytes: &mut Vec<u8>) {
        self.types.put(bytes);
        self.low.put(bytes);
        self.base_m.put(bytes);
        self.cell_m.put(bytes);
        self.columns.put(bytes);
        self.rows.put(bytes);
    }

    fn take(bytes: &mut &[u8]) -> Option<LaneIndexGrid> {
        Some(LaneIndexGrid {
            types: Field::take(bytes)?,
            low: Field::take(bytes)?,
            base_m: Field::take(bytes)?,
            cell_m: Field::take(bytes)?,
            columns: Field::take(bytes)?,
            rows: Field::take(bytes)?,
            ..Default::default()
        })
    }
}

baked! {
    Header { revision, name, vendor, geo_reference, license, offset_m, offset_heading_rad }
    UserData { owner, code, value }
    MapError { line, reason }
    Lane {
        index, road, section, id, kind, length_m, forward, junction, successors, predecessors, left,
        right, left_change, right_change, speed_limit_mps, marks, level, materials, access, rules,
        widths, borders, heights, speeds, declared,
    }
    LaneMaterial { from_m, surface, friction, roughness }
    LaneAccess { from_m, rule, restrictions }
    LaneRule { from_m, text }
    LaneHeight { from_m, inner_m, outer_m }
    LaneSpeed { from_m, limit_mps }
    LaneLinks { predecessors, successors, offset }
    RoadMark { from_m, kind, color, width_m, bold, change, lines, sways }
    MarkSway { from_m, factors }
    MarkLine { length_m, space_m, offset_t_m, offset_s_m, width_m, once }
    Road {
        id, name, length_m, junction, left_hand, sections, predecessor, successor, types, switches,
        curves, elevation, superelevation, crossfall, shapes, cross_section, lane_offset,
    }
    Section { start_m, length_m, lanes, marks, left }
    RoadType { from_m, kind, limit_mps }
    Switch { id, name, position, s, side_track }
    Shape { from_m, over_t }
    CrossSection { t_offset, left, right }
    Strip { id, is_relative, width, factors }
    Junction { id, name, kind, connections, roads, controllers, priorities }
    Connection {
        incoming, connecting, at_start, lane_links, predecessor, successor, offset,
    }
    Joint { road, s, forward }
    JunctionGroup { id, name, kind, junctions }
    Signal {
        id, name, road, s, t, z_offset_m, h_offset_rad, pitch_rad, roll_rad, kind, subtype, country,
        value, unit, text, dynamic, orientation, width_m, height_m, pose, lanes, dependencies,
        references, controller, position, uses,
    }
    SignalReference { element, id, kind }
    SignalUse { road, s, t, orientation, validity, is_reference }
    Controller { id, name, sequence, signals }
    Placement { position, heading_rad, pitch_rad, roll_rad, curvature_per_m }
    RoadObject {
        id, name, kind, road, s, t, z_offset_m, heading_rad, orientation, length_m, width_m,
        height_m, radius_m, outlines, places, parking, subtype, dynamic, validity, markings,
        borders, runs, corner_ids, shapes, corners, repeats,
    }
    OutlineShape { id, fill, is_closed, heights_m }
    ObjectMarking {
        side, color, bold, width_m, z_offset_m, length_m, space_m, start_offset_m, stop_offset_m,
        corners,
    }
    ObjectBorder { kind, width_m, outline, is_complete, corners }
    ObjectReference { object, road, s, t, z_offset_m, valid_length_m, orientation, validity }
    Span { id, name, is_tunnel, kind, road, s, length_m, validity, lighting, daylight }
    ObjectPlace { position, heading_rad, length_m, width_m, height_m, radius_m }
    Repeat { s, length_m, distance_m, t, z_offset_m, sizes_m }
    Curve { from_m, length_m, start, heading_rad, ahead, shape }
    ArcLength { lengths, rates, u, v, p_end, stretch }
    Cubic { from_m, factors }
    Profile { pieces }
}

baked_enum! { Owner { 0 => Map, 1 => Road(road), 2 => Junction(junction) } }
baked_enum! { MarkKind {
    0 => None, 1 => Solid, 2 => Broken, 3 => SolidSolid, 4 => SolidBroken, 5 => BrokenSolid,
    6 => BrokenBroken, 7 => BottsDots, 8 => Grass, 9 => Curb, 10 => Edge, 11 => Other,
} }
baked_enum! { MarkColor {
    0 => White, 1 => Yellow, 2 => Blue, 3 => Green, 4 => Red, 5 => Orange, 6 => Violet, 7 => Black,
    8 => Other,
} }
baked_enum! { MarkChange { 0 => None, 1 => Increase, 2 => Decrease, 3 => Both } }
baked_enum! { RoadLink { 0 => Road { road, at_start }, 1 => Junction(junction) } }
baked_enum! { JunctionKind { 0 => Common, 1 => Direct, 2 => Virtual } }
baked_enum! { Orientation { 0 => Forward, 1 => Backward, 2 => Both } }
baked_enum! { SignalPosition {
    0 => Road { road, s, t, z_offset_m, h_offset_rad }, 1 => Inertial { position, heading_rad },
} }
baked_enum! { Corner { 0 => Road { s, t, dz }, 1 => Local { u, v, z } } }
baked_enum! { CurveShape {
    0 => Line, 1 => Arc { curvature }, 2 => Spiral { from, slope }, 3 => Cubic { u, v, arc },
} }
