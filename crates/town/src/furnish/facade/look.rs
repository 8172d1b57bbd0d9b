//! What a building looks like: its style, and one colour for each of its paints.

use mesh::{Material, RandomStream};

use crate::furnish::facade::book::{Book, Paint, RoofRule, SLOTS, Slot, StyleRule, Suits};

/// The style and the colours of one building.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Look {
    style: usize,
    paints: [Paint; SLOTS.len()],
    /// The seed of choices that hold for the whole building.
    pub(super) seed: u64,
}

/// How often colours are drawn again that a neighbour has.
const TRIES: usize = 12;

impl Look {
    /// Draws a look for a building of a kind with walls of a material, unlike those of its
    /// neighbours; `None` if no style suits it.
    pub(crate) fn draw(
        suits: Suits,
        walls: Material,
        neighbours: &[&Look],
        random: &mut RandomStream,
    ) -> Option<Look> {
        let book = Book::embedded();
        let all = || book.styles.iter().enumerate().filter(|(_, one)| one.suits.contains(&suits));
        let same: Vec<_> =
            all().filter(|(_, one)| book.material_of(one, Slot::Wall) == walls).collect();
        let fitting = if same.is_empty() { all().collect() } else { same };
        let mut drawn = None;
        for _ in 0..TRIES {
            let (style, rule) = weighted(&fitting, |(_, one)| one.weight, random)?;
            let seed = random.bits();
            let paints = SLOTS.map(|slot| {
                let rgb = *random.pick(book.colors_of(rule, slot));
                Paint { material: book.material_of(rule, slot), rgb }
            });
            let look = Look { style: *style, paints, seed };
            let is_new = neighbours.iter().all(|other| !look.resembles(other));
            drawn = Some(look);
            if is_new {
                break;
            }
        }
        drawn
    }

    /// Whether two buildings have the same style and walls of the same colour.
    pub(crate) fn resembles(&self, other: &Look) -> bool {
        self.style == other.style && self.paint(Slot::Wall) == other.paint(Slot::Wall)
    }

    pub(super) fn style(&self) -> &'static StyleRule {
        &Book::embedded().styles[self.style]
    }

    pub(super) fn paint(&self, slot: Slot) -> Paint {
        self.paints[slot as usize]
    }

    /// A stream of choices that hold for the whole building.
    pub(crate) fn stream(&self, name: u64) -> RandomStream {
        RandomStream::named(self.seed, name)
    }

    /// What stands on the roof.
    pub(crate) fn roof(&self) -> &'static RoofRule {
        &self.style().roof
    }

    /// The paints of walls, trims, frames and roofs.
    pub(crate) fn wall(&self) -> Paint {
        self.paint(Slot::Wall)
    }

    pub(crate) fn trim(&self) -> Paint {
        self.paint(Slot::Trim)
    }

    pub(crate) fn plinth(&self) -> Paint {
        self.paint(Slot::Plinth)
    }

    pub(crate) fn frame(&self) -> Paint {
        self.paint(Slot::Frame)
    }

    pub(crate) fn tiles(&self) -> Paint {
        self.paint(Slot::Roof)
    }
}

/// Draws one of `all` by weight; `None` if there are none.
pub(super) fn weighted<'a, T>(
    all: &'a [T],
    weight: impl Fn(&T) -> f32,
    random: &mut RandomStream,
) -> Option<&'a T> {
    let sum: f32 = all.iter().map(&weight).sum();
    let mut left = random.unit() * sum;
    for one in all {
        left -= weight(one);
        if left < 0.0 {
            return Some(one);
        }
    }
    all.last()
}
