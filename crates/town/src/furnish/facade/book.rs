//! The rules of façades as data: what `rules.toml` may contain, and the checks of it.

use std::{collections::BTreeMap, sync::OnceLock};

use mesh::Material;
use serde::Deserialize;

use crate::{furnish::facade::split::Extent, mesh_builder::MeshBuilder};

/// All rules, styles and colours.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Book {
    colors: BTreeMap<String, Vec<[u8; 3]>>,
    pub(super) words: Vec<String>,
    paint: BTreeMap<Slot, PaintRule>,
    #[serde(rename = "style")]
    pub(super) styles: Vec<StyleRule>,
    #[serde(rename = "rule")]
    pub(super) rules: BTreeMap<String, Rule>,
}

/// A surface of a building that has one paint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Slot {
    #[default]
    Wall,
    Second,
    Plinth,
    Trim,
    Frame,
    Door,
    Accent,
    Rail,
    Roof,
}

pub(super) const SLOTS: [Slot; 9] = [
    Slot::Wall,
    Slot::Second,
    Slot::Plinth,
    Slot::Trim,
    Slot::Frame,
    Slot::Door,
    Slot::Accent,
    Slot::Rail,
    Slot::Roof,
];

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PaintRule {
    stuff: Stuff,
    colors: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Stuff {
    Brick,
    Plaster,
    Slab,
    Glazing,
    Stone,
    Metal,
    Wood,
    Plastic,
    Cloth,
    Tiles,
}

/// A kind of building that a style suits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Suits {
    Block,
    Tower,
    Row,
    Terrace,
    Villa,
    Hall,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StyleRule {
    pub(super) name: String,
    pub(super) suits: Vec<Suits>,
    pub(super) weight: f32,
    paint: BTreeMap<Slot, PaintRule>,
    pub(super) front: String,
    pub(super) side: String,
    pub(super) back: String,
    pub(super) roof: RoofRule,
}

/// What stands on a roof, as probabilities, and its shape.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct RoofRule {
    /// The rise of a pitched roof over half its depth: least and greatest; no entry for a flat roof.
    pub(crate) pitch: Option<[f32; 2]>,
    pub(crate) hipped: f32,
    pub(crate) dormers: f32,
    pub(crate) skylights: f32,
    pub(crate) solar: f32,
    pub(crate) antenna: f32,
    pub(crate) chimneys: u32,
    /// The height of the parapet of a flat roof. Metres.
    pub(crate) parapet: f32,
}

/// A rule: how a rectangle of wall is divided or filled.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Rule {
    /// Parts from left to right.
    X(Vec<Part>),
    /// Parts upwards.
    Z(Vec<Part>),
    /// One of several rules, drawn for the whole building.
    Choose(Vec<Choice>),
    /// One of several rules, drawn for every place.
    Vary(Vec<Choice>),
    /// Several rules over the same rectangle.
    Over(Vec<String>),
    Wall(WallPart),
    Ledge(LedgePart),
    Quoins(QuoinPart),
    Window(WindowPart),
    Glazing(GlazingPart),
    Door(DoorPart),
    Shop(ShopPart),
    Gate(GatePart),
    Balcony(BalconyPart),
    Pipe(PipePart),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Part {
    #[serde(rename = "use")]
    pub(super) name: String,
    size: Option<f32>,
    share: Option<f32>,
    each: Option<f32>,
}

impl Part {
    /// How much the part takes; `None` unless exactly one of its three entries is given.
    fn checked(&self) -> Option<Extent> {
        match (self.size, self.share, self.each) {
            (Some(size), None, None) => Some(Extent::Size(size)),
            (None, Some(share), None) => Some(Extent::Share(share)),
            (None, None, Some(each)) => Some(Extent::Each(each)),
            _ => None,
        }
    }

    pub(super) fn extent(&self) -> Extent {
        self.checked().unwrap_or(Extent::Share(1.0))
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Choice {
    #[serde(rename = "use")]
    pub(super) name: String,
    pub(super) weight: f32,
}

/// Flat wall.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WallPart {
    pub(super) paint: Slot,
    /// How far it projects. Metres.
    pub(super) out: f32,
    /// The width of the dark joint round it. Metres.
    pub(super) joint: f32,
}

/// A course, a cornice or a fascia.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LedgePart {
    pub(super) paint: Slot,
    /// The height of its middle above the foot of the rectangle, or below its head if negative.
    pub(super) at: f32,
    pub(super) height: f32,
    pub(super) out: f32,
    /// The distance between blocks below it; 0 for none. Metres.
    pub(super) blocks: f32,
}

/// Corner stones, alternately long and short.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct QuoinPart {
    pub(super) paint: Slot,
    pub(super) size: [f32; 2],
    pub(super) out: f32,
}

/// A window in a wall.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct WindowPart {
    pub(super) wall: Slot,
    /// Width and height of the opening; a width of 0 is that of the rectangle. Metres.
    pub(super) size: [f32; 2],
    /// The height of the opening above the foot of the rectangle. Metres.
    pub(super) sill: f32,
    /// How far the frame stands behind the wall. Metres.
    pub(super) depth: f32,
    /// The number of casements, and of rows of panes.
    pub(super) panes: [u32; 2],
    /// The height of the lower row as a fraction, where there are two rows.
    pub(super) lower: f32,
    /// The width of frames. Metres.
    pub(super) frame: f32,
    /// The projection of the sill; 0 for none. Metres.
    pub(super) ledge: f32,
    /// The width of the surround, in the paint of trims; 0 for none. Metres.
    pub(super) surround: f32,
    /// The height of the lintel; 0 for none. Metres.
    pub(super) lintel: f32,
    /// The width of the dark joint round the rectangle; 0 for none. Metres.
    pub(super) joint: f32,
    /// Probabilities of a blind, shutters, a flower box and an air conditioner.
    pub(super) blind: f32,
    pub(super) shutters: f32,
    pub(super) flowers: f32,
    pub(super) cooler: f32,
}

/// Panes over the whole rectangle, with a spandrel below them.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct GlazingPart {
    /// The height of the spandrel. Metres.
    pub(super) spandrel: f32,
    /// The paint of the spandrel.
    pub(super) paint: Slot,
    /// How far mullions project; 0 for none. Metres.
    pub(super) fin: f32,
    pub(super) frame: f32,
}

/// The door of a building.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct DoorPart {
    pub(super) size: [f32; 2],
    pub(super) depth: f32,
    pub(super) leaves: u32,
    /// The height of the window above it; 0 for none. Metres.
    pub(super) light: f32,
    /// Whether the leaves are glazed.
    pub(super) glazed: bool,
    /// The projection of the canopy; 0 for none. Metres.
    pub(super) canopy: f32,
    /// The width of the surround; 0 for none. Metres.
    pub(super) surround: f32,
    pub(super) wall: Slot,
}

/// A shop: window, door, sign board and sometimes an awning.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ShopPart {
    /// The heights of the riser below the window, of the head of the window, and of the sign.
    pub(super) riser: f32,
    pub(super) head: f32,
    pub(super) sign: f32,
    /// The recess of the window. Metres.
    pub(super) depth: f32,
    /// The probability of an awning, and how far it projects. Metres.
    pub(super) awning: f32,
    pub(super) shade: f32,
    pub(super) wall: Slot,
}

/// A gate of slats for vehicles.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct GatePart {
    pub(super) size: [f32; 2],
    pub(super) depth: f32,
    pub(super) wall: Slot,
}

/// A slab with a railing at the foot of the rectangle.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct BalconyPart {
    pub(super) out: f32,
    /// The distance from the sides of the rectangle. Metres.
    pub(super) inset: f32,
    pub(super) rail: Railing,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Railing {
    #[default]
    Bars,
    Plate,
    Glass,
}

/// A downpipe in the middle of the rectangle.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct PipePart {
    pub(super) radius: f32,
}

/// A material and its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Paint {
    pub(crate) material: Material,
    pub(crate) rgb: [u8; 3],
}

impl Paint {
    /// Sets the paint of further triangles.
    pub(crate) fn apply(self, builder: &mut MeshBuilder) {
        builder.tinted(self.material, self.rgb);
    }
}

impl Stuff {
    fn material(self) -> Material {
        match self {
            Stuff::Brick => Material::FacadeBrick,
            Stuff::Plaster => Material::FacadePlaster,
            Stuff::Slab => Material::FacadeConcrete,
            Stuff::Glazing => Material::FacadeGlass,
            Stuff::Stone => Material::Concrete,
            Stuff::Metal => Material::Metal,
            Stuff::Wood => Material::Wood,
            Stuff::Plastic => Material::Plastic,
            Stuff::Cloth => Material::Cloth,
            Stuff::Tiles => Material::RoofTiles,
        }
    }
}

impl Book {
    /// The embedded rules; without styles if they are wrong, which a test excludes.
    pub(crate) fn embedded() -> &'static Book {
        static BOOK: OnceLock<Book> = OnceLock::new();
        BOOK.get_or_init(|| Book::parse(include_str!("rules.toml")).unwrap_or_default())
    }

    /// Reads and checks rules.
    ///
    /// # Errors
    ///
    /// One sentence about the first mistake, with the name of the rule or style.
    pub(super) fn parse(text: &str) -> Result<Book, String> {
        let book: Book = toml::from_str(text).map_err(|error| error.to_string())?;
        for (name, rule) in &book.rules {
            book.check_rule(rule).map_err(|error| format!("rule {name}: {error}"))?;
        }
        for name in book.rules.keys() {
            book.check_end(name, 0).map_err(|error| format!("rule {name}: {error}"))?;
        }
        for style in &book.styles {
            book.check_style(style).map_err(|error| format!("style {}: {error}", style.name))?;
        }
        Ok(book)
    }

    fn check_style(&self, style: &StyleRule) -> Result<(), String> {
        for slot in SLOTS {
            if self.colors_of(style, slot).is_empty() {
                return Err(format!("no colours for the paint {slot:?}"));
            }
        }
        for name in [&style.front, &style.side, &style.back] {
            self.known(name)?;
        }
        if style.weight.is_nan() || style.weight <= 0.0 || style.suits.is_empty() {
            return Err("needs a weight above 0 and a kind of building".to_string());
        }
        Ok(())
    }

    fn known(&self, name: &str) -> Result<(), String> {
        match self.rules.contains_key(name) {
            true => Ok(()),
            false => Err(format!("there is no rule {name}")),
        }
    }

    fn check_rule(&self, rule: &Rule) -> Result<(), String> {
        match rule {
            Rule::X(parts) | Rule::Z(parts) => {
                for part in parts {
                    self.known(&part.name)?;
                    let positive = |extent: Extent| {
                        let (Extent::Size(x) | Extent::Share(x) | Extent::Each(x)) = extent;
                        x > 0.0 && x.is_finite()
                    };
                    if !part.checked().is_some_and(positive) {
                        let name = &part.name;
                        return Err(format!("{name} needs one of size, share or each, above 0"));
                    }
                }
                if parts.is_empty() { Err("no parts".to_string()) } else { Ok(()) }
            }
            Rule::Choose(choices) | Rule::Vary(choices) => {
                choices.iter().try_for_each(|choice| self.known(&choice.name))?;
                let bad = |choice: &Choice| choice.weight.is_nan() || choice.weight <= 0.0;
                if choices.is_empty() || choices.iter().any(bad) {
                    return Err("needs choices with weights above 0".to_string());
                }
                Ok(())
            }
            Rule::Over(names) => names.iter().try_for_each(|name| self.known(name)),
            _ => Ok(()),
        }
    }

    /// Checks that a rule does not contain itself.
    fn check_end(&self, name: &str, depth: usize) -> Result<(), String> {
        if depth > self.rules.len() {
            return Err(format!("contains itself by way of {name}"));
        }
        let inner = |name: &String| self.check_end(name, depth + 1);
        match &self.rules[name] {
            Rule::X(parts) | Rule::Z(parts) => parts.iter().try_for_each(|p| inner(&p.name)),
            Rule::Choose(all) | Rule::Vary(all) => all.iter().try_for_each(|c| inner(&c.name)),
            Rule::Over(names) => names.iter().try_for_each(inner),
            _ => Ok(()),
        }
    }

    /// The colours that a paint of a style may have; empty without such a paint.
    pub(super) fn colors_of(&self, style: &StyleRule, slot: Slot) -> &[[u8; 3]] {
        let rule = style.paint.get(&slot).or_else(|| self.paint.get(&slot));
        rule.and_then(|rule| self.colors.get(&rule.colors)).map_or(&[], Vec::as_slice)
    }

    /// The material of a paint of a style.
    pub(super) fn material_of(&self, style: &StyleRule, slot: Slot) -> Material {
        let rule = style.paint.get(&slot).or_else(|| self.paint.get(&slot));
        rule.map_or(Material::Concrete, |rule| rule.stuff.material())
    }
}
