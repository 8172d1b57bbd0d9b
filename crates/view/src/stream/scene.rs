//! The world at one frame in Foxglove's messages.

use client_lib::{
    Actor, ActorFlags, ActorKind, BlueprintInfo, Client, Pose, Tag, World, glam::DAffine3,
};
use foxglove::{Entity, Message, WORLD, light_color, scene, transform};

/// The space of the ego.
const EGO: &str = "ego";

/// Returns the vehicle that carries the sensors: the first one that traffic does not drive, else the
/// first one.
pub(crate) fn ego(world: &World) -> Option<&Actor> {
    let vehicles = || world.actors().iter().filter(|actor| actor.kind() == ActorKind::Vehicle);
    let is_free = |actor: &&Actor| !actor.flags().contains(ActorFlags::AUTOPILOT);
    vehicles().find(is_free).or_else(|| vehicles().next())
}

/// Returns a transform in double precision.
pub(crate) fn affine(pose: &Pose) -> DAffine3 {
    let rotation = pose.rotation().as_dquat().normalize();
    DAffine3::from_rotation_translation(rotation, pose.position().as_dvec3())
}

/// Returns `foxglove.FrameTransforms`: `world` to `actor/ID` of each actor, `world` to `ego`, and `ego` to
/// the spaces of its sensors.
pub(crate) fn transforms(time: &Message, world: &World, sensors: &[(&str, DAffine3)]) -> Message {
    let mut edges: Vec<Message> = Vec::new();
    for actor in world.actors() {
        let space = format!("actor/{}", actor.id().0);
        edges.push(transform(time, [WORLD, &space], &affine(&actor.pose())));
    }
    if let Some(ego) = ego(world) {
        edges.push(transform(time, [WORLD, EGO], &affine(&ego.pose())));
        edges.extend(sensors.iter().map(|(space, of)| transform(time, [EGO, space], of)));
    }
    edges.iter().fold(Message::new(), |all, edge| all.message(1, edge))
}

/// Returns `foxglove.SceneUpdate`: a box for each actor.
pub(crate) fn actors(time: &Message, client: &Client) -> Message {
    let blueprints = client.blueprints();
    scene(
        time,
        client
            .world()
            .actors()
            .iter()
            .filter_map(|actor| Some(entity(time, actor, blueprints.get(actor.blueprint())?))),
    )
}

fn entity(time: &Message, actor: &Actor, blueprint: &BlueprintInfo) -> Message {
    let tag = Tag::from_code(blueprint.tag);
    let (id, speed) = (actor.id().0.to_string(), actor.speed_mps().to_string());
    let tag_name = tag.map_or_else(|| blueprint.tag.to_string(), |tag| format!("{tag:?}"));
    let center = client_lib::glam::Vec3::from_array(blueprint.center_m).as_dvec3();
    let color = match actor.traffic_light() {
        Some(light) => light_color(light.phase as u32),
        None => tag.map_or([128; 3], Tag::color),
    };
    Entity {
        id: &id,
        name: &format!("{} {id}", blueprint.id),
        world_from_box: affine(&actor.pose()) * DAffine3::from_translation(center),
        size_m: blueprint.half_extents_m.map(|half| 2.0 * half),
        color,
        has_heading: matches!(actor.kind(), ActorKind::Vehicle | ActorKind::Walker),
        metadata: &[("blueprint", &blueprint.id), ("tag_name", &tag_name), ("speed_mps", &speed)],
    }
    .message(time)
}
