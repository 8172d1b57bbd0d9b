//! Colours of clothes, hair and skin, sRGB: as on a street most of them dark and muted.

pub(super) type Rgb = [u8; 3];

pub(super) const BLACK: Rgb = [27, 27, 30];
pub(super) const CHARCOAL: Rgb = [52, 54, 58];
pub(super) const GREY: Rgb = [100, 102, 106];
pub(super) const SILVER: Rgb = [150, 152, 155];
pub(super) const WHITE: Rgb = [206, 204, 198];
pub(super) const CREAM: Rgb = [184, 176, 158];
pub(super) const BEIGE: Rgb = [150, 137, 116];
pub(super) const KHAKI: Rgb = [114, 106, 88];
pub(super) const OLIVE: Rgb = [72, 73, 60];
pub(super) const BROWN: Rgb = [76, 60, 50];
pub(super) const RUST: Rgb = [112, 74, 57];
pub(super) const NAVY: Rgb = [35, 39, 53];
pub(super) const DENIM: Rgb = [57, 66, 84];
pub(super) const FADED: Rgb = [96, 107, 124];
pub(super) const BLUE: Rgb = [64, 82, 112];
pub(super) const SKY: Rgb = [140, 157, 174];
pub(super) const TEAL: Rgb = [56, 78, 80];
pub(super) const GREEN: Rgb = [58, 73, 63];
pub(super) const WINE: Rgb = [80, 42, 48];
pub(super) const RED: Rgb = [122, 50, 48];
pub(super) const ROSE: Rgb = [162, 134, 134];
pub(super) const PLUM: Rgb = [74, 59, 76];
pub(super) const MUSTARD: Rgb = [150, 122, 76];
pub(super) const ORANGE: Rgb = [176, 98, 58];

pub(super) const RAVEN: Rgb = [26, 22, 20];
pub(super) const UMBER: Rgb = [46, 36, 29];
pub(super) const CHESTNUT: Rgb = [66, 49, 37];
pub(super) const AUBURN: Rgb = [82, 54, 40];
pub(super) const BLOND: Rgb = [132, 112, 82];
pub(super) const ASH: Rgb = [134, 132, 130];
pub(super) const SNOW: Rgb = [182, 180, 176];

pub(super) const FAIR: Rgb = [192, 147, 124];
pub(super) const LIGHT: Rgb = [174, 127, 101];
pub(super) const TAN: Rgb = [144, 100, 75];
pub(super) const UMBRE: Rgb = [106, 71, 53];
pub(super) const DARK: Rgb = [70, 48, 38];
