//! SIMD vectors of four lanes: four wheels are computed by one instruction.

use std::ops::{Add, Mul, Sub};

use glam::{Mat3, Vec3};

/// One number in each of four lanes. Not glam's `Vec4`, which is scalar in deterministic builds.
pub(super) type Lanes = wide::f32x4;

/// Returns `masked` where the mask is set, and `other` elsewhere.
#[inline]
pub(super) fn select(mask: Lanes, masked: Lanes, other: Lanes) -> Lanes {
    mask.bitselect(masked, other)
}

/// Returns the lanes in the order 1, 0, 3, 2.
#[inline]
pub(super) fn neighbours(v: Lanes) -> Lanes {
    let [a, b, c, d] = v.to_array();
    Lanes::new([b, a, d, c])
}

/// One vector in each of four lanes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lanes3 {
    pub x: Lanes,
    pub y: Lanes,
    pub z: Lanes,
}

impl Lanes3 {
    /// Returns the same vector in every lane.
    #[inline]
    pub(super) fn splat(v: Vec3) -> Lanes3 {
        Lanes3 { x: Lanes::splat(v.x), y: Lanes::splat(v.y), z: Lanes::splat(v.z) }
    }

    /// Returns `matrix * v` in every lane.
    #[inline]
    pub(super) fn turned(self, matrix: &Mat3) -> Lanes3 {
        Lanes3::splat(matrix.x_axis) * self.x
            + Lanes3::splat(matrix.y_axis) * self.y
            + Lanes3::splat(matrix.z_axis) * self.z
    }

    #[inline]
    pub(super) fn dot(self, other: Lanes3) -> Lanes {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline]
    pub(super) fn cross(self, other: Lanes3) -> Lanes3 {
        Lanes3 {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// Returns the sum over the lanes.
    #[inline]
    pub(super) fn sum(self) -> Vec3 {
        Vec3::new(self.x.reduce_add(), self.y.reduce_add(), self.z.reduce_add())
    }

    pub(super) fn set(&mut self, lane: usize, v: Vec3) {
        self.x.as_mut_array()[lane] = v.x;
        self.y.as_mut_array()[lane] = v.y;
        self.z.as_mut_array()[lane] = v.z;
    }
}

impl Add for Lanes3 {
    type Output = Lanes3;

    #[inline]
    fn add(self, other: Lanes3) -> Lanes3 {
        Lanes3 { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl Sub for Lanes3 {
    type Output = Lanes3;

    #[inline]
    fn sub(self, other: Lanes3) -> Lanes3 {
        Lanes3 { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl Mul<Lanes> for Lanes3 {
    type Output = Lanes3;

    #[inline]
    fn mul(self, scale: Lanes) -> Lanes3 {
        Lanes3 { x: self.x * scale, y: self.y * scale, z: self.z * scale }
    }
}
