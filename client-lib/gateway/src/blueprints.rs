//! What CARLA's clients can spawn: the catalogue of the town, and sensors.

use std::sync::OnceLock;

use town::Kind;

use crate::{
    msgpack::Pack,
    wire::{Attribute, Description},
};

/// Every sensor's attributes: `blueprint,attribute,type,values,only`, the first value the default.
const SENSORS: &str = include_str!("sensors.csv");
const ROLES: &str = "default|front|back|left|right|front_left|front_right|back_left|back_right";

const BOOL: u8 = 1;
const INT: u8 = 2;
const FLOAT: u8 = 3;
const STRING: u8 = 4;
const COLOR: u8 = 5;

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

    fn vary(&mut self, id: &str, kind: u8, values: &str, only_recommended: bool) {
        let recommended: Vec<String> = values.split('|').map(str::to_owned).collect();
        self.attributes.push(Variation {
            attribute: Attribute { id: id.to_owned(), kind, value: recommended[0].clone() },
            recommended,
            is_modifiable: true,
            only_recommended,
        });
    }

    fn fix(&mut self, id: &str, kind: u8, value: &str) {
        self.attributes.push(Variation {
            attribute: Attribute { id: id.to_owned(), kind, value: value.to_owned() },
            recommended: Vec::new(),
            is_modifiable: false,
            only_recommended: false,
        });
    }

    /// As if it were spawned without any change.
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

/// Every blueprint that can be spawned.
pub(crate) fn definitions() -> &'static [Definition] {
    static ALL: OnceLock<Vec<Definition>> = OnceLock::new();
    ALL.get_or_init(|| {
        let mut all = Vec::new();
        for (index, blueprint) in town::catalogue().iter().enumerate() {
            let mut definition = Definition::new(index as u32 + 1, blueprint.id);
            match blueprint.kind {
                Kind::Vehicle => vehicle(&mut definition, blueprint),
                Kind::Walker => walker(&mut definition, blueprint),
                Kind::Prop => prop(&mut definition, blueprint),
                Kind::TrafficLight => continue,
            }
            all.push(definition);
        }
        let mut controller = Definition::new(all.len() as u32 + 100, "controller.ai.walker");
        controller.vary("role_name", STRING, "default", false);
        all.push(controller);
        sensors(&mut all);
        all
    })
}

/// The blueprint with this id.
pub(crate) fn definition(id: &str) -> Option<&'static Definition> {
    definitions().iter().find(|d| d.id == id)
}

fn vehicle(d: &mut Definition, blueprint: &town::Blueprint) {
    let [r, g, b] = blueprint.default_color;
    d.vary("role_name", STRING, "autopilot|scenario|ego_vehicle|hero", false);
    d.vary("ros_name", STRING, blueprint.id, false);
    let colors = format!("{r},{g},{b}|17,37,103|180,44,43|0,0,0|255,255,255|137,137,137");
    d.vary("color", COLOR, &colors, false);
    d.vary("sticky_control", BOOL, "true", false);
    d.vary("terramechanics", BOOL, "false", false);
    d.fix("object_type", STRING, "");
    d.fix("base_type", STRING, blueprint.base_type);
    d.fix("special_type", STRING, blueprint.special_type);
    let wheels = if blueprint.wheels.len() == 2 { 2 } else { 4 };
    d.fix("number_of_wheels", INT, &wheels.to_string());
    d.fix("generation", INT, "2");
    d.fix("has_dynamic_doors", BOOL, "false");
    d.fix("has_lights", BOOL, "true");
}

fn walker(d: &mut Definition, blueprint: &town::Blueprint) {
    let is_child = blueprint.half_extents_m.z < 0.7;
    let number: u32 = blueprint.id.rsplit('.').next().and_then(|n| n.parse().ok()).unwrap_or(0);
    d.vary("role_name", STRING, "pedestrian", false);
    d.vary("ros_name", STRING, blueprint.id, false);
    d.vary("is_invincible", BOOL, "true", false);
    d.vary("speed", FLOAT, "0.0|1.4|2.6", false);
    d.vary("use_wheelchair", BOOL, "false", true);
    d.fix("gender", STRING, if number.is_multiple_of(2) { "female" } else { "male" });
    d.fix("generation", INT, "2");
    d.fix("age", STRING, if is_child { "child" } else { "adult" });
    d.fix("can_use_wheelchair", BOOL, "false");
}

fn prop(d: &mut Definition, blueprint: &town::Blueprint) {
    d.vary("role_name", STRING, "prop", false);
    d.vary("ros_name", STRING, blueprint.id, false);
    let size = blueprint.half_extents_m.max_element();
    d.fix("size", STRING, if size > 1.0 { "big" } else { "small" });
}

fn sensors(all: &mut Vec<Definition>) {
    let first = all.len() as u32 + 200;
    for line in SENSORS.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let [blueprint, attribute, kind, values, only] = fields[..] else { continue };
        if all.last().is_none_or(|d| d.id != blueprint) {
            let mut d = Definition::new(first + all.len() as u32, blueprint);
            d.vary("role_name", STRING, ROLES, false);
            d.vary("ros_name", STRING, blueprint, false);
            d.vary("sensor_tick", FLOAT, "0.0", false);
            all.push(d);
        }
        if let (Some(d), false) = (all.last_mut(), attribute.is_empty()) {
            d.vary(attribute, kind.parse().unwrap_or(STRING), values, only == "1");
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
