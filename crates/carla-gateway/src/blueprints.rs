//! The blueprints that CARLA's clients can spawn: the catalogue of the town, and sensors.

use std::sync::OnceLock;

use town::Kind;

use crate::{
    msgpack::Pack,
    wire::{Attribute, Description},
};

/// The attributes of every sensor: `blueprint,attribute,type,values,only_recommended`. The first
/// value is the default.
const SENSORS: &str = include_str!("sensors.csv");
const ROLES: &str = "default|front|back|left|right|front_left|front_right|back_left|back_right";

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
        let mut controller = Definition::new(all.len() as u32 + 100, "controller.ai.walker");
        controller.add_variable("role_name", STRING, "default", false);
        all.push(controller);
        let mut trigger = Definition::new(all.len() as u32 + 100, FRICTION_TRIGGER);
        trigger.add_variable("role_name", STRING, "default", false);
        trigger.add_variable("friction", FLOAT, "3.5", false);
        for extent in ["extent_x", "extent_y", "extent_z"] {
            trigger.add_variable(extent, FLOAT, "1.0", false);
        }
        all.push(trigger);
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
            d.add_variable("role_name", STRING, ROLES, false);
            d.add_variable("ros_name", STRING, blueprint, false);
            d.add_variable("sensor_tick", FLOAT, "0.0", false);
            all.push(d);
        }
        if let (Some(d), false) = (all.last_mut(), attribute.is_empty()) {
            d.add_variable(attribute, kind.parse().unwrap_or(STRING), values, only == "1");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sensor_of_the_table_is_a_blueprint_once() {
        let mut ids: Vec<_> = definitions().iter().map(|d| d.id.as_str()).collect();
        let mut uids: Vec<_> = definitions().iter().map(|d| d.uid).collect();
        let count = ids.len();
        ids.sort_unstable();
        ids.dedup();
        uids.sort_unstable();
        uids.dedup();
        assert_eq!((ids.len(), uids.len()), (count, count));
        let camera = definition("sensor.camera.rgb").map(Definition::describe);
        assert_eq!(camera.as_ref().and_then(|d| d.get("image_size_x")), Some("800"));
        assert!(definition("sensor.other.collision").is_some());
        assert!(definition("traffic.traffic_light").is_none());
    }
}
