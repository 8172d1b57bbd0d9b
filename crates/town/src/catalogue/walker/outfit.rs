//! What each person wears: which cages, and the colour of each of their slots.

use std::ops::Range;

use mesh::{Material, RandomStream};

use crate::catalogue::walker::{
    palette::{self, Rgb},
    people::{Bottom, Carries, Hair, Person, Top},
};

macro_rules! cages {
    ($($constant:ident $file:literal)*) => {
        $(pub(super) const $constant: &str = include_str!(concat!("cages/", $file, ".obj"));)*
        #[cfg(test)]
        pub(super) const ALL: &[(&str, &str)] = &[$(($file, $constant)),*];
    };
}

cages!(
    BODY "body" HEAD "head"
    SHIRT "shirt" TUCKED "tucked" SWEATER "sweater" JACKET "jacket" ZIPPED "zipped"
    ZIPPED_HEM "zipped_hem"
    SLEEVES "sleeves" WIDE_SLEEVES "wide_sleeves" SHORT_SLEEVES "short_sleeves"
    TROUSERS "trousers" SHORTS "shorts" SKIRT "skirt" DRESS_SKIRT "dress_skirt"
    COAT_SKIRT "coat_skirt" SHOES "shoes"
    CROP "hair_crop" SWEPT "hair_swept" CURLS "hair_curly" LONG "hair_long" BOB "hair_bob"
    BUN "hair_bun" TAIL "hair_tail" FRINGE "hair_fringe" BEARD "beard"
    CAP "cap" HAT "hat" BEANIE "beanie" HOOD "hood"
    SHIRT_FRONT "shirt_front" ZIP "zip" COLLAR "collar" FOLDED_HOOD "folded_hood" BELT "belt" PLACKET "placket" POCKETS "pockets"
    BADGE "badge" BACKPACK "backpack" STRAPS "straps" HANDBAG "handbag" BAG_STRAP "bag_strap"
);

/// A pattern of the upper garment, by the height above the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pattern {
    Plain,
    /// Stripes across, in a second colour.
    Stripes(Rgb),
    /// A broad stripe over the chest.
    Band(Rgb),
    /// Other shoulders.
    Yoke(Rgb),
}

/// The heights of stripes, along the rows of polygons of the upper garments.
const STRIPES: [Range<f32>; 6] =
    [0.535..0.552, 0.583..0.601, 0.6225..0.645, 0.6825..0.720, 0.746..0.772, 0.7875..0.8035];

/// Everything that decides how a person looks apart from the shape of the body.
#[derive(Debug)]
pub(super) struct Outfit {
    person: &'static Person,
    pattern: Pattern,
    inner: Rgb,
    shoe: Rgb,
    sole: Rgb,
    bag: Rgb,
    hat: Rgb,
    has_beard: bool,
}

fn shaded(color: Rgb, share: f32) -> Rgb {
    color.map(|part| (f32::from(part) * share).clamp(0.0, 255.0) as u8)
}

/// What covers a part of the body.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Cover {
    /// The height above which arms are covered, as a fraction of the body's.
    pub(super) sleeve: f32,
    /// The height above which legs are covered.
    pub(super) hem: f32,
}

impl Outfit {
    pub(super) fn new(number: usize, person: &'static Person) -> Outfit {
        use palette::*;
        let mut random = RandomStream::named(0xc107, number as u64);
        let other = *random.pick(&[WHITE, CREAM, NAVY, CHARCOAL, SILVER, BLACK, FADED]);
        let plain = matches!(person.top, Top::Tee | Top::Polo | Top::Sweater | Top::Blouse);
        let is_dress = person.bottom == Bottom::Dress;
        let pattern = match random.below(8) {
            0 if plain && !is_dress => Pattern::Stripes(other),
            1 | 2 if plain && !is_dress => Pattern::Band(other),
            3 if plain && !is_dress => Pattern::Yoke(other),
            _ => Pattern::Plain,
        };
        let bright =
            if person.is_child { [RED, WHITE, SKY, ROSE] } else { [WHITE, GREY, NAVY, WHITE] };
        let is_formal = matches!(person.top, Top::Coat | Top::Shirt | Top::Blouse | Top::Uniform);
        let shoe = if is_formal || random.chance(0.5) && !person.is_child {
            *random.pick(&[BLACK, BLACK, BROWN, CHARCOAL, NAVY])
        } else {
            *random.pick(&bright)
        };
        Outfit {
            person,
            pattern,
            inner: *random.pick(&[WHITE, SILVER, SKY, CHARCOAL, CREAM, WINE]),
            shoe,
            sole: if is_formal { shaded(shoe, 0.6) } else { [188, 186, 180] },
            has_beard: !person.is_female && !person.is_child && random.chance(0.35),
            bag: *random.pick(&[BLACK, CHARCOAL, BROWN, NAVY, OLIVE, WINE]),
            hat: match person.hair {
                Hair::Cap if person.top == Top::Uniform => person.colors[0],
                Hair::Hat => *random.pick(&[CHARCOAL, BROWN, BEIGE, BLACK]),
                _ => *random.pick(&[NAVY, BLACK, WINE, OLIVE, GREY]),
            },
        }
    }

    /// Whether the upper garment hangs over the lower one.
    fn hangs(&self) -> bool {
        !matches!(self.person.top, Top::Shirt | Top::Uniform)
            && !matches!(self.person.bottom, Bottom::Skirt | Bottom::Dress)
    }

    /// The height above which the upper garment hides the lower one, as a fraction of the body's.
    fn seat(&self) -> f32 {
        match self.person.top {
            Top::Coat => 0.46,
            _ if self.hangs() => 0.55,
            _ => 1.0,
        }
    }

    fn is_bulky(&self) -> bool {
        matches!(
            self.person.top,
            Top::Sweater | Top::Hoodie | Top::Jacket | Top::Anorak | Top::Coat
        )
    }

    /// The thickness of sleeves around the forearms, as a fraction of the height.
    pub(super) fn sleeve(&self) -> f32 {
        match self.person.top {
            Top::Vest | Top::Tee | Top::Polo => 0.0,
            _ if self.is_bulky() => 0.0067,
            _ => 0.0042,
        }
    }

    /// Which parts of arms and legs are covered.
    pub(super) fn cover(&self) -> Cover {
        let is_coat = self.person.top == Top::Coat;
        Cover {
            sleeve: match self.person.top {
                Top::Vest => 1.0,
                Top::Tee | Top::Polo => 0.70,
                _ => 0.0,
            },
            hem: match self.person.bottom {
                Bottom::Trousers => 0.0,
                Bottom::Shorts => 0.345,
                Bottom::Skirt if !is_coat => 0.315,
                _ => 0.303,
            },
        }
    }

    /// Calls `wear` with the text of each cage, the skin's first.
    pub(super) fn each_cage(&self, mut wear: impl FnMut(&'static str)) {
        let Person { top, bottom, hair, carries, .. } = *self.person;
        let mut all = vec![BODY, HEAD, SHOES];
        all.push(match top {
            Top::Jacket => JACKET,
            Top::Anorak | Top::Coat => ZIPPED,
            Top::Sweater | Top::Hoodie => SWEATER,
            _ if self.hangs() => SHIRT,
            _ => TUCKED,
        });
        match top {
            Top::Jacket => all.push(SHIRT_FRONT),
            Top::Anorak => all.extend([ZIPPED_HEM, ZIP]),
            Top::Coat => all.push(ZIP),
            _ => {}
        }
        match top {
            Top::Vest => {}
            Top::Tee | Top::Polo => all.push(SHORT_SLEEVES),
            _ if self.is_bulky() => all.push(WIDE_SLEEVES),
            _ => all.push(SLEEVES),
        }
        match bottom {
            Bottom::Trousers => all.push(TROUSERS),
            Bottom::Shorts => all.push(SHORTS),
            Bottom::Skirt => all.push(SKIRT),
            Bottom::Dress if top == Top::Coat => {}
            Bottom::Dress => all.push(DRESS_SKIRT),
        }
        if top == Top::Coat {
            all.push(COAT_SKIRT);
        }
        if matches!(top, Top::Polo | Top::Shirt | Top::Uniform | Top::Jacket | Top::Coat) {
            all.push(COLLAR);
        }
        if matches!(top, Top::Shirt | Top::Uniform) {
            all.extend([PLACKET, BELT]);
        }
        if top == Top::Uniform {
            all.extend([POCKETS, BADGE]);
        }
        if matches!(top, Top::Hoodie) && hair != Hair::Hood {
            all.push(FOLDED_HOOD);
        }
        all.push(match hair {
            Hair::Crop => CROP,
            Hair::Swept => SWEPT,
            Hair::Curls => CURLS,
            Hair::Long => LONG,
            Hair::Bob => BOB,
            Hair::Bun => BUN,
            Hair::Tail => TAIL,
            Hair::Bald => FRINGE,
            Hair::Cap => CAP,
            Hair::Hat => HAT,
            Hair::Beanie => BEANIE,
            Hair::Hood => HOOD,
        });
        if self.has_beard {
            all.push(BEARD);
        }
        match carries {
            Carries::Nothing => {}
            Carries::Backpack => all.extend([BACKPACK, STRAPS]),
            Carries::Handbag => all.extend([HANDBAG, BAG_STRAP]),
        }
        all.into_iter().for_each(&mut wear);
    }

    /// The material and the colour of a slot at a height, a fraction of the body's; `None` for a
    /// surface that is covered.
    pub(super) fn paint(&self, slot: &str, at: f32) -> Option<(Material, Rgb)> {
        let [top, bottom, hair, skin] = self.person.colors;
        let cover = self.cover();
        let skin_if = |is_bare: bool| is_bare.then_some((Material::Skin, skin));
        let cloth = |color: Rgb| Some((Material::Cloth, color));
        match slot {
            "skin" => skin_if(true),
            "bare_arm" => {
                skin_if(cover.sleeve > 0.9 || cover.sleeve > 0.5 && at < cover.sleeve + 0.02)
            }
            "bare_forearm" => skin_if(cover.sleeve > 0.0),
            "bare_thigh" | "bare_leg" => skin_if(at < cover.hem + 0.03),
            "top" => cloth(self.patterned(top, at)),
            "inner" => cloth(self.inner),
            // Coats are open below the waist.
            "trim" if self.person.top == Top::Coat && at < 0.61 => None,
            "trim" => Some((Material::Plastic, shaded(top, 0.55))),
            "bottom" => (at < self.seat()).then_some((Material::Cloth, bottom)),
            "collar" => cloth(match self.person.top {
                Top::Shirt | Top::Uniform => shaded(top, 1.12),
                Top::Jacket if self.person.is_female => shaded(top, 1.0),
                _ => shaded(top, 0.82),
            }),
            "belt" => Some((Material::Plastic, palette::BLACK)),
            "badge" => Some((Material::Metal, palette::MUSTARD)),
            "hair" => Some((Material::Bark, hair)),
            "hat" => cloth(self.hat),
            "band" => cloth(shaded(self.hat, 0.5)),
            "shoe" => Some((Material::Rubber, self.shoe)),
            "sole" => Some((Material::Rubber, self.sole)),
            "bag" => cloth(self.bag),
            "bag_dark" => cloth(shaded(self.bag, 0.75)),
            _ => None,
        }
    }

    fn patterned(&self, own: Rgb, at: f32) -> Rgb {
        match self.pattern {
            Pattern::Stripes(other) if STRIPES.iter().any(|stripe| stripe.contains(&at)) => other,
            Pattern::Band(other) if (0.675..0.725).contains(&at) => other,
            Pattern::Yoke(other) if at > 0.755 => other,
            _ => own,
        }
    }
}
