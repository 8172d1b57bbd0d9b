//! CARLA's 49 pedestrians: build, clothes and colours of each.

use crate::catalogue::walker::palette::{self, Rgb};

/// The description of a walker.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Person {
    pub(super) id: &'static str,
    pub(crate) is_female: bool,
    pub(crate) is_child: bool,
    pub(super) height_m: f32,
    /// The breadth relative to an average person.
    pub(super) girth: f32,
    pub(super) top: Top,
    pub(super) bottom: Bottom,
    pub(super) hair: Hair,
    pub(super) carries: Carries,
    /// The colours of upper garment, lower garment, hair and skin.
    pub(super) colors: [Rgb; 4],
}

/// The upper garment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Top {
    /// A T-shirt.
    Tee,
    /// A T-shirt with a collar.
    Polo,
    /// A close garment without sleeves.
    Vest,
    /// A shirt with a collar, a strip of buttons and long sleeves, under a belt.
    Shirt,
    /// A close garment with long sleeves.
    Blouse,
    Sweater,
    /// A sweater whose hood hangs down.
    Hoodie,
    /// A jacket that is open over a shirt.
    Jacket,
    /// A jacket that is closed by a zip.
    Anorak,
    /// A coat to the knee.
    Coat,
    Uniform,
}

/// The lower garment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Bottom {
    Trousers,
    Shorts,
    Skirt,
    Dress,
}

/// Hair, or what covers it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Hair {
    Crop,
    Swept,
    Curls,
    Long,
    Bob,
    Bun,
    Tail,
    Bald,
    Cap,
    Hat,
    Beanie,
    Hood,
}

/// Luggage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Carries {
    Nothing,
    Backpack,
    Handbag,
}

macro_rules! people {
    ($($number:literal $gender:ident $age:ident $height:literal $girth:literal $top:ident $bottom:ident $hair:ident $carries:ident $a:ident $b:ident $c:ident $d:ident)*) => {
        [$(Person {
            id: concat!("walker.pedestrian.", $number),
            is_female: people!(@ $gender),
            is_child: people!(@ $age),
            height_m: $height,
            girth: $girth,
            top: Top::$top,
            bottom: Bottom::$bottom,
            hair: Hair::$hair,
            carries: Carries::$carries,
            colors: [palette::$a, palette::$b, palette::$c, palette::$d],
        }),*]
    };
    (@ female) => { true };
    (@ male) => { false };
    (@ child) => { true };
    (@ adult) => { false };
}

#[rustfmt::skip]
pub(super) const PEOPLE: [Person; 49] = people!(
    "0001" female adult 1.68 0.94 Tee     Trousers Long   Nothing  WINE     DENIM    CHESTNUT LIGHT
    "0002" male   adult 1.82 1.02 Sweater Trousers Crop   Nothing  GREY     BLACK    RAVEN    TAN
    "0003" male   adult 1.78 0.98 Jacket  Trousers Swept  Backpack NAVY     KHAKI    CHESTNUT FAIR
    "0004" male   adult 1.85 1.08 Coat    Trousers Bald   Nothing  BLACK    CHARCOAL RAVEN    UMBRE
    "0005" female adult 1.64 0.92 Blouse  Skirt    Bun    Handbag  WHITE    BLACK    BLOND    FAIR
    "0006" female adult 1.72 0.96 Jacket  Trousers Tail   Handbag  PLUM     NAVY     RAVEN    LIGHT
    "0007" female adult 1.60 1.06 Coat    Dress    Hat    Handbag  BROWN    BROWN    ASH      FAIR
    "0008" female adult 1.66 0.90 Vest    Shorts   Tail   Backpack MUSTARD  FADED    BLOND    LIGHT
    "0009" female child 1.16 0.92 Tee     Skirt    Long   Nothing  ROSE     PLUM     BLOND    FAIR
    "0010" male   child 1.24 0.96 Tee     Shorts   Cap    Backpack RED      DENIM    CHESTNUT LIGHT
    "0011" male   child 1.36 0.94 Anorak  Trousers Crop   Backpack GREEN    NAVY     RAVEN    UMBRE
    "0012" female child 1.30 0.92 Sweater Trousers Bun    Nothing  MUSTARD  DENIM    RAVEN    DARK
    "0013" male   child 1.12 1.00 Polo    Shorts   Swept  Nothing  SKY      BEIGE    BLOND    FAIR
    "0014" female child 1.40 0.92 Vest    Dress    Tail   Nothing  TEAL     TEAL     AUBURN   LIGHT
    "0015" male   adult 1.76 1.14 Tee     Trousers Crop   Nothing  WHITE    DENIM    RAVEN    DARK
    "0016" male   adult 1.88 1.00 Jacket  Trousers Cap    Nothing  OLIVE    BLACK    RAVEN    UMBRE
    "0017" male   adult 1.74 0.95 Hoodie  Trousers Hood   Backpack GREY     NAVY     RAVEN    TAN
    "0018" female adult 1.70 0.92 Coat    Trousers Long   Handbag  BEIGE    BLACK    CHESTNUT FAIR
    "0019" male   adult 1.80 1.20 Polo    Shorts   Bald   Nothing  GREEN    KHAKI    ASH      FAIR
    "0020" female adult 1.62 1.12 Blouse  Dress    Bun    Handbag  NAVY     NAVY     RAVEN    DARK
    "0021" female adult 1.75 0.90 Vest    Trousers Long   Nothing  RUST     BLACK    RAVEN    TAN
    "0022" male   adult 1.79 1.00 Coat    Trousers Hat    Nothing  NAVY     GREY     ASH      FAIR
    "0023" male   adult 1.72 1.06 Anorak  Trousers Crop   Nothing  BROWN    DENIM    SNOW     LIGHT
    "0024" male   adult 1.91 0.96 Tee     Trousers Swept  Backpack SKY      CHARCOAL CHESTNUT FAIR
    "0025" male   adult 1.77 1.04 Vest    Shorts   Cap    Nothing  RED      BLACK    RAVEN    DARK
    "0026" female adult 1.67 0.94 Jacket  Skirt    Bob    Handbag  BLACK    GREY     RAVEN    FAIR
    "0027" female adult 1.71 0.92 Tee     Shorts   Bun    Backpack TEAL     FADED    BLOND    LIGHT
    "0028" male   adult 1.83 1.10 Sweater Trousers Bald   Nothing  WINE     NAVY     RAVEN    DARK
    "0029" female adult 1.63 1.00 Coat    Dress    Hood   Nothing  TEAL     TEAL     RAVEN    TAN
    "0030" male   adult 1.84 1.06 Uniform Trousers Cap    Nothing  NAVY     NAVY     RAVEN    FAIR
    "0031" male   adult 1.81 0.98 Hoodie  Trousers Beanie Backpack CHARCOAL BLACK    RAVEN    UMBRE
    "0032" male   adult 1.78 1.02 Uniform Trousers Cap    Nothing  NAVY     NAVY     CHESTNUT TAN
    "0033" male   adult 1.73 1.16 Coat    Trousers Hat    Nothing  CHARCOAL BLACK    SNOW     FAIR
    "0034" female adult 1.69 0.93 Sweater Trousers Long   Backpack ROSE     DENIM    AUBURN   FAIR
    "0035" female adult 1.65 0.98 Tee     Skirt    Curls  Handbag  MUSTARD  GREEN    RAVEN    DARK
    "0036" male   adult 1.86 1.00 Shirt   Trousers Swept  Nothing  BLUE     BEIGE    BLOND    FAIR
    "0037" male   adult 1.75 1.08 Hoodie  Shorts   Swept  Nothing  SILVER   OLIVE    CHESTNUT LIGHT
    "0038" female adult 1.58 1.04 Anorak  Trousers Bob    Handbag  WINE     BLACK    SNOW     FAIR
    "0039" male   adult 1.70 1.12 Polo    Trousers Cap    Nothing  OLIVE    BROWN    RAVEN    DARK
    "0040" female adult 1.74 0.91 Coat    Trousers Bun    Nothing  CREAM    NAVY     RAVEN    UMBRE
    "0041" male   adult 1.89 1.04 Anorak  Trousers Crop   Nothing  BLACK    FADED    RAVEN    LIGHT
    "0042" female adult 1.66 0.95 Vest    Skirt    Tail   Nothing  GREEN    CREAM    CHESTNUT FAIR
    "0043" male   adult 1.76 0.94 Tee     Trousers Bob    Backpack CHARCOAL BLACK    UMBER    FAIR
    "0044" female adult 1.61 1.08 Jacket  Trousers Crop   Handbag  BEIGE    BROWN    ASH      LIGHT
    "0045" male   adult 1.82 1.00 Shirt   Trousers Curls  Backpack SILVER   CHARCOAL RAVEN    DARK
    "0046" female adult 1.73 0.92 Blouse  Dress    Long   Handbag  RED      RED      RAVEN    FAIR
    "0047" male   adult 1.79 1.06 Anorak  Trousers Beanie Nothing  ORANGE   CHARCOAL RAVEN    UMBRE
    "0048" male   child 1.20 0.98 Anorak  Trousers Beanie Nothing  BLUE     CHARCOAL RAVEN    DARK
    "0049" female child 1.26 0.92 Blouse  Dress    Curls  Backpack PLUM     PLUM     UMBER    UMBRE
);
