//! Paints of vehicles in traffic and at the kerb.

use mesh::RandomStream;

use super::Blueprint;

/// Vehicles of a hundred, and their paint, sRGB. Sums over white, black and grey are those of Axalta's *Global
/// Automotive Color Popularity Report* of 2021, silver is that of 2020 and blue of 2018; the rest is divided
/// without a source.
const PAINTS: [(usize, [u8; 3]); 13] = [
    (22, [236, 236, 234]),
    (13, [222, 222, 218]),
    (19, [22, 23, 25]),
    (10, [66, 70, 76]),
    (9, [114, 118, 122]),
    (9, [176, 180, 183]),
    (4, [24, 46, 92]),
    (3, [52, 88, 138]),
    (4, [134, 22, 24]),
    (2, [186, 36, 32]),
    (2, [42, 70, 54]),
    (2, [104, 92, 76]),
    (1, [206, 166, 48]),
];

impl Blueprint {
    /// Draws the paint, sRGB, of one of many vehicles of this model; `None` where all look alike: emergency
    /// vehicles and taxis with their livery, and the Cybertruck of bare steel.
    pub fn random_paint(&self, random: &mut RandomStream) -> Option<[u8; 3]> {
        let mut drawn = random.below(100);
        let is_plain = !matches!(self.special_type, "emergency" | "taxi")
            && self.id != "vehicle.tesla.cybertruck";
        for (share, paint) in PAINTS {
            if drawn < share {
                return is_plain.then_some(paint);
            }
            drawn -= share;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blueprint;

    #[test]
    fn paints_have_their_shares_and_liveries_stay() {
        assert_eq!(PAINTS.iter().map(|(share, _)| share).sum::<usize>(), 100);
        let mut random = RandomStream::from_state(1);
        let mut draw = |id: &str| blueprint(id).unwrap().1.random_paint(&mut random);
        let paints: Vec<_> = (0..2000).map(|_| draw("vehicle.audi.a2").unwrap()).collect();
        for (share, paint) in PAINTS {
            let count = paints.iter().filter(|it| **it == paint).count();
            assert!(count.abs_diff(20 * share) < 10 + 5 * share, "{count} of {paint:?}");
        }
        for id in ["vehicle.ford.crown", "vehicle.ford.ambulance", "vehicle.tesla.cybertruck"] {
            assert_eq!(draw(id), None, "{id}");
        }
    }
}
