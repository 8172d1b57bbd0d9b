/// Nothing, where an index of a triangle or an instance stands.
pub(crate) const NONE: u32 = u32::MAX;

/// How far outside a triangle's edge a ray may pass and still hit, as a share of the edge: closes
/// the cracks that rounding leaves between neighbours.
pub(crate) const EDGE_SLACK: f32 = 1e-6;

/// Hits nearer than this are the sensor's own skin.
pub(crate) const T_MIN: f32 = 1e-3;

/// What a ray met first. From it every output of every sensor is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Along the ray, in lengths of its direction.
    pub(crate) t: f32,
    /// Index into the scene's triangles; [`NONE`]: nothing was met.
    pub(crate) triangle: u32,
    /// Index into the world's instances; [`NONE`]: it is part of the town.
    pub(crate) instance: u32,
    /// Share of the triangle's second corner.
    pub(crate) u: f32,
    /// Share of the triangle's third corner.
    pub(crate) v: f32,
}

impl Hit {
    /// Nothing up to `t`.
    pub(crate) fn none(t: f32) -> Hit {
        Hit { t, triangle: NONE, instance: NONE, u: 0.0, v: 0.0 }
    }

    pub(crate) fn is_some(&self) -> bool {
        self.triangle != NONE
    }
}
