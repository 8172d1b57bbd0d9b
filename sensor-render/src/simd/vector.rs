use std::ops::{Add, Mul, Neg, Sub};

use glam::Vec3;

use crate::simd::traits::Float;

/// Sixteen three-dimensional vectors, or colours.
#[derive(Clone, Copy, Debug)]
pub(crate) struct V3<F> {
    pub(crate) x: F,
    pub(crate) y: F,
    pub(crate) z: F,
}

impl<F: Float> V3<F> {
    #[inline(always)]
    pub(crate) fn splat(v: Vec3) -> Self {
        V3 { x: F::splat(v.x), y: F::splat(v.y), z: F::splat(v.z) }
    }

    /// Returns component `number`: x, y or z.
    #[inline(always)]
    pub(crate) fn axis(self, number: usize) -> F {
        match number {
            0 => self.x,
            1 => self.y,
            _ => self.z,
        }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> F {
        self.x.mul_add(other.x, self.y.mul_add(other.y, self.z * other.z))
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        V3 {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    #[inline(always)]
    pub(crate) fn mul_add(self, a: F, b: Self) -> Self {
        V3 { x: self.x.mul_add(a, b.x), y: self.y.mul_add(a, b.y), z: self.z.mul_add(a, b.z) }
    }

    /// Multiplies component by component.
    #[inline(always)]
    pub(crate) fn times(self, other: Self) -> Self {
        V3 { x: self.x * other.x, y: self.y * other.y, z: self.z * other.z }
    }

    #[inline(always)]
    pub(crate) fn lerp(self, to: Self, share: F) -> Self {
        V3 { x: self.x.lerp(to.x, share), y: self.y.lerp(to.y, share), z: self.z.lerp(to.z, share) }
    }

    /// Returns `self` where the mask is set, else `other`.
    #[inline(always)]
    pub(crate) fn or(self, mask: F::Mask, other: Self) -> Self {
        V3 { x: self.x.or(mask, other.x), y: self.y.or(mask, other.y), z: self.z.or(mask, other.z) }
    }
}

impl<F: Float> Add for V3<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        V3 { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<F: Float> Sub for V3<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        V3 { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<F: Float> Mul<F> for V3<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, scale: F) -> Self {
        V3 { x: self.x * scale, y: self.y * scale, z: self.z * scale }
    }
}

impl<F: Float> Neg for V3<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        V3 { x: -self.x, y: -self.y, z: -self.z }
    }
}
