//! The blueprints that CARLA's clients can spawn: the catalogue of the town, and sensors.

use std::sync::OnceLock;

use town::Kind;

use crate::{
    msgpack::Pack,
    wire::{Attribute, Description},
};

/// The attributes of every sensor: `blueprint,attribute,type,values,only_recommended`. The first
/// value is the default. All have `ros_name` besides.
const SENSORS: &str = include_str!("sensors.csv");

/// The blueprint of an actor without a body, which carries sensors.
pub(crate) const EMPTY: &str = "util.actor.empty";
/// The blueprint of boxes in which tyres have another friction.
pub(crate) const FRICTION_TRIGGER: &str = "static.trigger.friction";

const FLOAT: u8 = 3;
const STRING: u8 = 4;

/// A blueprint as clients see it.
pub(crate) struct Definition {
    pub(crate) uid: u32,
    pub(crate) id: String,
    tags: String,
    attributes: Vec<Variation>,
}

struct Variation {
    attribute: Attribute,
    recommended: Vec<String>,
    is_modifiable: bool,
    only_recommended: bool,
}

impl Definition {
    fn new(uid: u32, id: &str) -> Definition {
        Definition { uid, id: id.to_owned(), tags: id.replace('.', ","), attributes: Vec::new() }
    }

    fn add_variable(&mut self, id: &str, kind: u8, values: &str, only_recommended: bool) {
        let recommended: Vec<String> = values.split('|').map(str::to_owned).collect();
        self.attributes.push(Variation {
            attribute: Attribute { id: id.to_owned(), kind, value: recommended[0].clone() },
            recommended,
            is_modifiable: true,
            only_recommended,
        });
    }

    /// Adds an attribute of the catalogue.
    fn add_attribute(&mut self, found: town::Attribute) {
        let value = found.values.first().cloned().unwrap_or_default();
        self.attributes.push(Variation {
            attribute: Attribute { id: found.id.to_owned(), kind: found.kind as u8, value },
            recommended: if found.is_modifiable { found.values } else { Vec::new() },
            is_modifiable: found.is_modifiable,
            only_recommended: found.only_recommended,
        });
    }

    /// Returns the description of an actor that is spawned with all default values.
    pub(crate) fn describe(&self) -> Description {
        let attributes = self.attributes.iter().map(|v| v.attribute.clone()).collect();
        Description { uid: self.uid, id: self.id.clone(), attributes }
    }

    pub(crate) fn write(&self, out: &mut Pack) {
        out.list(4).uint(self.uid.into()).text(&self.id).text(&self.tags);
        out.list(self.attributes.len());
        for v in &self.attributes {
            let Attribute { id, kind, value } = &v.attribute;
            out.list(6).text(id).uint((*kind).into()).text(value).list(v.recommended.len());
            for value in &v.recommended {
                out.text(value);
            }
            out.bool(v.is_modifiable).bool(v.only_recommended);
        }
    }
}

/// Returns every blueprint that can be spawned.
pub(crate) fn definitions() -> &'static [Definition] {
    static ALL: OnceLock<Vec<Definition>> = OnceLock::new();
    ALL.get_or_init(|| {
        let mut all = Vec::new();
        for (index, blueprint) in town::catalogue().iter().enumerate() {
            if blueprint.kind == Kind::TrafficLight {
                continue;
            }
            let mut definition = Definition::new(index as u32 + 1, blueprint.id);
            blueprint
                .attributes()
                .into_iter()
                .for_each(|attribute| definition.add_attribute(attribute));
            all.push(definition);
        }
        for id in ["controller.ai.walker", EMPTY, FRICTION_TRIGGER] {
            let mut definition = Definition::new(all.len() as u32 + 100, id);
            definition.add_variable("role_name", STRING, "default", false);
            definition.add_variable("ros_name", STRING, id, false);
            all.push(definition);
        }
        if let Some(trigger) = all.last_mut() {
            trigger.add_variable("friction", FLOAT, "3.5f", false);
            for extent in ["extent_x", "extent_y", "extent_z"] {
                trigger.add_variable(extent, FLOAT, "1.0f", false);
            }
        }
        sensors(&mut all);
        all
    })
}

/// Returns the blueprint with this id.
pub(crate) fn definition(id: &str) -> Option<&'static Definition> {
    definitions().iter().find(|d| d.id == id)
}

fn sensors(all: &mut Vec<Definition>) {
    let first = all.len() as u32 + 200;
    for line in SENSORS.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let [blueprint, attribute, kind, values, only] = fields[..] else { continue };
        if all.last().is_none_or(|d| d.id != blueprint) {
            let mut d = Definition::new(first + all.len() as u32, blueprint);
            d.add_variable("ros_name", STRING, blueprint, false);
            all.push(d);
        }
        if let Some(d) = all.last_mut() {
            d.add_variable(attribute, kind.parse().unwrap_or(STRING), values, only == "1");
        }
    }
}

#[cfg(test)]
mod tests;
