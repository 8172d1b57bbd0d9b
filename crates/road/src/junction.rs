/// A junction: where roads meet.
#[derive(Clone, Debug, PartialEq)]
pub struct Junction {
    /// OpenDRIVE's id.
    pub id: String,
    /// Name in the file.
    pub name: String,
    /// How the junction connects its roads.
    pub kind: JunctionKind,
    /// Connections from incoming roads.
    pub connections: Vec<Connection>,
    /// Indices of the roads inside, each once, in the order of the file.
    pub roads: Vec<u32>,
    /// Indices of the controllers of its signals.
    pub controllers: Vec<u32>,
    /// Pairs of road indices: the first connecting road has priority over the second.
    pub priorities: Vec<(u32, u32)>,
}

/// How a junction connects its roads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JunctionKind {
    /// By connecting roads.
    Common,
    /// Roads touch each other without connecting roads.
    Direct,
    /// A main road continues; others join it at its side.
    Virtual,
}

/// A place at the side of a road where a virtual connection begins or ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Index into [`crate::Network::roads`].
    pub road: u32,
    /// Position along that road, metres of s.
    pub s: f64,
    /// Whether it leads along rising s.
    pub forward: bool,
}

/// Junctions that belong together, such as the entries of a roundabout.
#[derive(Clone, Debug, PartialEq)]
pub struct JunctionGroup {
    /// OpenDRIVE's id.
    pub id: String,
    /// Name in the file.
    pub name: String,
    /// OpenDRIVE's type: roundabout, complexJunction, highwayInterchange, unknown.
    pub kind: String,
    /// Indices into [`crate::Network::junctions`].
    pub junctions: Vec<u32>,
}

/// One connection of a junction.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// Index of the road that leads in.
    pub incoming: u32,
    /// Index of the road inside (common junction) or on the other side (direct junction).
    pub connecting: u32,
    /// Whether the connecting road is entered at its start, not at its end.
    pub at_start: bool,
    /// Pairs of lane ids, from the incoming to the connecting road.
    pub lane_links: Vec<(i32, i32)>,
    /// Of a virtual connection: where it leaves the main road.
    pub predecessor: Option<Joint>,
    /// Of a virtual connection: where it joins the main road.
    pub successor: Option<Joint>,
    /// Byte offset in the text.
    pub(crate) offset: usize,
}
