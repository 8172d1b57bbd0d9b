/// In place of the index of a triangle or instance: none.
pub(crate) const NONE: u32 = u32::MAX;

/// Distance outside of a triangle's edge at which a ray still hits, as a share of the edge. Closes
/// the cracks that rounding leaves between neighbouring triangles.
pub(crate) const EDGE_SLACK: f32 = 1e-6;

/// Smallest ray parameter that counts as a hit.
pub(crate) const T_MIN: f32 = 1e-3;

/// First intersection along a ray. Every output of every sensor is derived from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Ray parameter, in lengths of the ray's direction.
    pub(crate) t: f32,
    /// Index into the triangles of the scene; [`NONE`] if the ray hit nothing.
    pub(crate) triangle: u32,
    /// Index into the instances of the world; [`NONE`] if the triangle belongs to the town.
    pub(crate) instance: u32,
    /// Barycentric coordinate of the second corner of the triangle.
    pub(crate) u: f32,
    /// Barycentric coordinate of the third corner of the triangle.
    pub(crate) v: f32,
}

impl Hit {
    /// Returns a miss, for a ray that ends at parameter `t`.
    pub(crate) fn none(t: f32) -> Hit {
        Hit { t, triangle: NONE, instance: NONE, u: 0.0, v: 0.0 }
    }

    #[cfg(test)]
    pub(crate) fn is_some(&self) -> bool {
        self.triangle != NONE
    }
}
