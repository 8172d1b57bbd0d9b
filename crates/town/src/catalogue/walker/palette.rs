//! Colours of clothes, hair and skin, sRGB: as on a street most of them dark and muted.

pub(super) type Rgb = [u8; 3];

pub(super) const BLACK: Rgb = [27, 27, 30];
pub(super) const CHARCOAL: Rgb = [52, 54, 58];
pub(super) const GREY: Rgb = [100, 102, 106];
pub(super) const SILVER: Rgb = [150, 152, 155];
pub(super) const WHITE: Rgb = [206, 204, 198];
pub(super) const CREAM: Rgb = [190, 179, 156];
pub(super) const BEIGE: Rgb = [158, 139, 110];
pub(super) const KHAKI: Rgb = [118, 107, 80];
pub(super) const OLIVE: Rgb = [72, 76, 55];
pub(super) const BROWN: Rgb = [80, 59, 44];
pub(super) const RUST: Rgb = [124, 70, 48];
pub(super) const NAVY: Rgb = [31, 38, 58];
pub(super) const DENIM: Rgb = [54, 70, 98];
pub(super) const FADED: Rgb = [92, 109, 134];
pub(super) const BLUE: Rgb = [54, 84, 130];
pub(super) const SKY: Rgb = [130, 157, 184];
pub(super) const TEAL: Rgb = [46, 84, 86];
pub(super) const GREEN: Rgb = [52, 78, 60];
pub(super) const WINE: Rgb = [90, 36, 45];
pub(super) const RED: Rgb = [142, 46, 44];
pub(super) const ROSE: Rgb = [172, 128, 130];
pub(super) const PLUM: Rgb = [78, 54, 82];
pub(super) const MUSTARD: Rgb = [170, 130, 60];
pub(super) const ORANGE: Rgb = [196, 98, 46];

pub(super) const RAVEN: Rgb = [26, 22, 20];
pub(super) const UMBER: Rgb = [50, 36, 27];
pub(super) const CHESTNUT: Rgb = [80, 55, 37];
pub(super) const AUBURN: Rgb = [98, 56, 36];
pub(super) const BLOND: Rgb = [150, 121, 79];
pub(super) const ASH: Rgb = [134, 132, 130];
pub(super) const SNOW: Rgb = [182, 180, 176];

pub(super) const FAIR: Rgb = [192, 147, 124];
pub(super) const LIGHT: Rgb = [174, 127, 101];
pub(super) const TAN: Rgb = [144, 100, 75];
pub(super) const UMBRE: Rgb = [106, 71, 53];
pub(super) const DARK: Rgb = [70, 48, 38];
