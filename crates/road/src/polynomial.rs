//! Cubic polynomials as four factors, lowest power first, and the quadrature rule for integrals
//! along curves.

/// Nodes and weights of the seven-point Gauss-Legendre rule (Abramowitz and Stegun, table 25.4).
pub(crate) const GAUSS_7: [(f64, f64); 7] = [
    (0.0, 0.417_959_183_673_469_4),
    (-0.405_845_151_377_397_2, 0.381_830_050_505_118_9),
    (0.405_845_151_377_397_2, 0.381_830_050_505_118_9),
    (-0.741_531_185_599_394_4, 0.279_705_391_489_276_7),
    (0.741_531_185_599_394_4, 0.279_705_391_489_276_7),
    (-0.949_107_912_342_758_5, 0.129_484_966_168_869_7),
    (0.949_107_912_342_758_5, 0.129_484_966_168_869_7),
];

/// Returns the value of the cubic with these factors at `p`.
pub(crate) fn value(f: &[f64; 4], p: f64) -> f64 {
    f[0] + p * (f[1] + p * (f[2] + p * f[3]))
}

/// Returns its first derivative.
pub(crate) fn slope(f: &[f64; 4], p: f64) -> f64 {
    f[1] + p * (2.0 * f[2] + p * 3.0 * f[3])
}

/// Returns its second derivative.
pub(crate) fn bend(f: &[f64; 4], p: f64) -> f64 {
    2.0 * f[2] + 6.0 * f[3] * p
}
