//! Piecewise cubic functions of a length: elevation, widths, offsets.

/// The cubic a + b·ds + c·ds² + d·ds³, where ds counts from `from_m`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cubic {
    /// Where the piece begins, metres.
    pub(crate) from_m: f64,
    /// The coefficients a, b, c, d.
    pub(crate) factors: [f64; 4],
}

/// A value with its first and second derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Jet {
    pub(crate) value: f64,
    pub(crate) slope: f64,
    pub(crate) bend: f64,
}

impl Jet {
    pub(crate) fn constant(value: f64) -> Jet {
        Jet { value, slope: 0.0, bend: 0.0 }
    }

    pub(crate) fn scaled(self, by: f64) -> Jet {
        Jet { value: self.value * by, slope: self.slope * by, bend: self.bend * by }
    }
}

impl std::ops::Add for Jet {
    type Output = Jet;
    fn add(self, other: Jet) -> Jet {
        Jet {
            value: self.value + other.value,
            slope: self.slope + other.slope,
            bend: self.bend + other.bend,
        }
    }
}

impl Cubic {
    pub(crate) fn at(&self, along: f64) -> f64 {
        let ds = along - self.from_m;
        let [a, b, c, d] = self.factors;
        a + ds * (b + ds * (c + ds * d))
    }

    pub(crate) fn jet(&self, along: f64) -> Jet {
        let ds = along - self.from_m;
        let [_, b, c, d] = self.factors;
        Jet {
            value: self.at(along),
            slope: b + ds * (2.0 * c + ds * 3.0 * d),
            bend: 2.0 * c + 6.0 * d * ds,
        }
    }
}

/// Cubics in rising order; each one applies until the next begins. Zero before the first one and if
/// there is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Profile {
    pub(crate) pieces: Vec<Cubic>,
}

impl Profile {
    /// Sorts the pieces. Of two that begin at the same place, the later one in the file applies.
    pub(crate) fn new(mut pieces: Vec<Cubic>) -> Profile {
        pieces.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
        Profile { pieces }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Returns whether it is zero everywhere.
    pub(crate) fn is_zero(&self) -> bool {
        self.pieces.iter().all(|piece| piece.factors == [0.0; 4])
    }

    pub(crate) fn pieces(&self) -> &[Cubic] {
        &self.pieces
    }

    /// Returns the lowest value from `from` to just before `to`, between which a single piece
    /// applies.
    pub(crate) fn lowest(&self, from: f64, to: f64) -> f64 {
        let Some(piece) = self.piece(from) else { return 0.0 };
        let [_, b, c, d] = piece.factors;
        // Roots of the slope b + 2c·x + 3d·x².
        let root = (c * c - 3.0 * b * d).max(0.0).sqrt();
        let turns = if d != 0.0 {
            [(-c + root) / (3.0 * d), (-c - root) / (3.0 * d)]
        } else {
            [-b / (2.0 * c); 2]
        };
        let turns = turns.map(|turn| piece.from_m + turn);
        let inside = turns.into_iter().filter(|turn| *turn > from && *turn < to);
        inside.chain([from, to]).map(|along| piece.at(along)).fold(f64::INFINITY, f64::min)
    }

    /// Returns where the pieces begin.
    pub(crate) fn knots(&self) -> impl Iterator<Item = f64> {
        self.pieces.iter().map(|piece| piece.from_m)
    }

    /// Returns whether the piece at `along` is linear.
    pub(crate) fn is_straight(&self, along: f64) -> bool {
        self.piece(along).is_none_or(|piece| piece.factors[2] == 0.0 && piece.factors[3] == 0.0)
    }

    /// Returns the piece that applies at `along`; `None` before the first piece.
    pub(crate) fn piece(&self, along: f64) -> Option<&Cubic> {
        match self.pieces.as_slice() {
            [] => None,
            [only] => (only.from_m <= along + EARLY_M).then_some(only),
            several => {
                let after = several.partition_point(|piece| piece.from_m <= along);
                match after {
                    0 => several.first().filter(|piece| piece.from_m <= along + EARLY_M),
                    n => several.get(n - 1),
                }
            }
        }
    }

    pub(crate) fn at(&self, along: f64) -> f64 {
        self.piece(along).map_or(0.0, |piece| piece.at(along))
    }

    pub(crate) fn jet(&self, along: f64) -> Jet {
        self.piece(along).map_or(Jet::default(), |piece| piece.jet(along))
    }
}

/// A first piece that begins this little after the start, metres, applies from the start.
const EARLY_M: f64 = 1e-3;
