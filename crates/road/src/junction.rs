/// Where roads meet.
#[derive(Clone, Debug, PartialEq)]
pub struct Junction {
    /// OpenDRIVE's id.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// Common, direct or virtual.
    pub kind: JunctionKind,
    /// Ways through.
    pub connections: Vec<Connection>,
    /// Roads that lie inside, each once, in the order of the file.
    pub roads: Vec<u32>,
    /// Controllers that rule its signals.
    pub controllers: Vec<u32>,
    /// Which connecting road goes before which, by road index.
    pub priorities: Vec<(u32, u32)>,
}

/// How a junction joins its roads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JunctionKind {
    /// By connecting roads.
    Common,
    /// Roads touch each other.
    Direct,
    /// A road goes on, others join at its side.
    Virtual,
}

/// A place at the side of a road where a virtual connection begins or ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Which of [`crate::Network::roads`].
    pub road: u32,
    /// Metres of its s.
    pub s: f64,
    /// Leads along rising s.
    pub forward: bool,
}

/// Junctions that belong together, such as the entries of a roundabout.
#[derive(Clone, Debug, PartialEq)]
pub struct JunctionGroup {
    /// OpenDRIVE's id.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// OpenDRIVE's word: roundabout, complexJunction, highwayInterchange, unknown.
    pub kind: String,
    /// Which of [`crate::Network::junctions`].
    pub junctions: Vec<u32>,
}

/// One way through a junction.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// The road that leads in.
    pub incoming: u32,
    /// The road inside (common), or on the other side (direct).
    pub connecting: u32,
    /// The connecting road is entered at its start, not at its end.
    pub at_start: bool,
    /// Lane ids, from the incoming to the connecting road.
    pub lane_links: Vec<(i32, i32)>,
    /// Of a virtual connection: where it leaves the road that goes on.
    pub predecessor: Option<Joint>,
    /// Of a virtual connection: where it joins the road that goes on.
    pub successor: Option<Joint>,
    /// Where it stands in the text, in bytes.
    pub(crate) offset: usize,
}
