//! Recordings as MCAP with the schemas of Foxglove: where everything is, the map, and what happens.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use ::mcap::Compression;
use anyhow::{Context, bail, ensure};
use bake::Cache;
use carla_gateway::carla_log;
use foxglove::{Entity, Message, WORLD, light_color, scene, timestamp, transform};
use glam::{DAffine3, DQuat, DVec3};
use protocol::{ActorId, ActorState, Command, Pose, kind};
use record::{Collision, RecordedFrame, Recording};

use crate::{
    collect::map_lines::LaneMap,
    export::mcap_file::{McapFile, Stamped},
    saved::existing_recording,
};

/// `foxglove.Log.Level`.
const INFO: u64 = 2;
const WARNING: u64 = 3;

/// Writes a file `STEM.mcap` for each recording, and returns the number of frames.
pub(crate) fn write(names: &[PathBuf], root: &Path) -> anyhow::Result<u64> {
    let mut frames = 0;
    let mut written = BTreeSet::new();
    for name in names {
        let path = existing_recording(name)?;
        ensure!(
            !carla_log::is_log(&path),
            "{} is a CARLA log, which holds no map; export a recording of omnibus record",
            path.display()
        );
        let mut recording = Recording::open(&path)?;
        let profile = recording.info().profile;
        ensure!(
            profile.has_states(),
            "{} is a recording of profile {}, which keeps no states to show; record with --profile \
             state or compact",
            path.display(),
            profile.name()
        );
        let stem = path.file_stem().context("a recording without a name")?.to_string_lossy();
        if !written.insert(stem.to_string()) {
            bail!("two recordings are named {stem}; export them apart");
        }
        frames += Export::of(&mut recording, &root.join(format!("{stem}.mcap")))?;
    }
    Ok(frames)
}

/// A recording that is written.
struct Export {
    file: McapFile,
    /// The blueprint of each index, where this program has it.
    blueprints: Vec<(String, Option<&'static town::Blueprint>)>,
    roles: BTreeMap<ActorId, String>,
    /// The names of the actors of the frame before.
    there: BTreeMap<ActorId, String>,
}

impl Export {
    fn of(recording: &mut Recording, path: &Path) -> anyhow::Result<u64> {
        let info = recording.info();
        let blueprint = |id: &String| {
            let found = town::blueprint(id).map(|(_, made)| made);
            if found.is_none() {
                log::warn!("unknown blueprint {id:?}; its actors have no boxes");
            }
            (id.clone(), found)
        };
        let mut export = Export {
            file: McapFile::create(path, Some(Compression::Zstd))?,
            blueprints: info.blueprints.iter().map(blueprint).collect(),
            roles: info.roles.iter().cloned().collect(),
            there: BTreeMap::new(),
        };
        let (map, xodr) = (info.episode.map.clone(), info.episode.open_drive.clone());
        let about = serde_json::json!({ "map": map, "seed": info.episode.seed,
            "profile": info.profile.name(), "unix_time_secs": info.unix_time_secs,
            "omnibus_version": info.omnibus_version, "is_complete": info.is_complete });
        let network = Cache::from_environment().network(&map, &xodr)?;
        let lanes = LaneMap::new(&network, &[], &[]);
        export.file.attach("recording.json", "application/json", about.to_string().into())?;
        export.file.attach("map.xodr", "application/xml", xodr.into())?;
        let mut frames = 0;
        for segment in 0..recording.segments() {
            for frame in recording.recorded_frames(segment)? {
                if frames == 0 {
                    export.file.put(&Stamped::map(&lanes, frame.stamp.sim_time_nanos))?;
                }
                export.put(frame)?;
                frames += 1;
            }
        }
        export.file.finish()?;
        Ok(frames)
    }

    fn put(&mut self, frame: &RecordedFrame) -> anyhow::Result<()> {
        let time_nanos = frame.stamp.sim_time_nanos;
        let time = timestamp(time_nanos);
        for entry in frame.journal.iter().filter(|entry| entry.outcome.result().is_ok()) {
            if let Some(Command::Spawn(spawn)) = entry.command.decode()
                && !spawn.role.as_str().is_empty()
            {
                self.roles.insert(ActorId(entry.outcome.id), spawn.role.to_string());
            }
        }
        let names: BTreeMap<_, _> =
            frame.actors.iter().map(|actor| (actor.actor_id, self.name(actor))).collect();
        let mut events = Vec::new();
        let came = |(id, _): &(&ActorId, &String)| !self.there.contains_key(id);
        events.extend(names.iter().filter(came).map(|(_, name)| (INFO, format!("{name} appears"))));
        let gone = self.there.iter().filter(|(id, _)| !names.contains_key(id));
        events.extend(gone.map(|(_, name)| (INFO, format!("{name} disappears"))));
        let hits = frame.collisions.iter().filter(|collision| collision.began != 0);
        events.extend(hits.map(|collision| (WARNING, collision_text(collision, &names))));

        let mut entities = Vec::new();
        let mut transforms = Message::new();
        for actor in &frame.actors {
            let space = format!("actor/{}", actor.actor_id.0);
            let world_from_actor = affine(&actor.pose);
            let edge = transform(&time, [WORLD, &space], &world_from_actor);
            transforms = transforms.message(1, &edge);
            entities.extend(self.entity(&time, actor, &names[&actor.actor_id]));
        }
        self.there = names;
        let mut messages = vec![("/tf", "foxglove.FrameTransforms", transforms)];
        messages.push(("/actors", "foxglove.SceneUpdate", scene(&time, entities)));
        messages.extend(events.iter().map(|(level, text)| {
            let log = Message::new().message(1, &time).integer(2, *level);
            ("/events", "foxglove.Log", log.text(3, text).text(4, "omnibus"))
        }));
        messages.into_iter().try_for_each(|(topic, schema, message)| {
            self.file.put(&Stamped { topic: topic.into(), schema, time_nanos, data: message.0 })
        })
    }

    /// Returns `vehicle.tesla.model3 17`.
    fn name(&self, actor: &ActorState) -> String {
        let blueprint = self.blueprints.get(actor.blueprint as usize);
        let blueprint = blueprint.map_or("unknown", |(id, _)| id);
        format!("{blueprint} {}", actor.actor_id.0)
    }

    /// Returns the box of an actor; none if its blueprint is unknown.
    fn entity(&self, time: &Message, actor: &ActorState, name: &str) -> Option<Message> {
        let made = self.blueprints.get(actor.blueprint as usize)?.1?;
        let center = DAffine3::from_translation(made.center_m.as_dvec3());
        let speed = actor.velocity().length().to_string();
        let tag_name = format!("{:?}", made.tag);
        let mut metadata = vec![("blueprint", made.id), ("tag_name", &tag_name)];
        let role = self.roles.get(&actor.actor_id);
        metadata.extend(role.map(|role| ("role_name", &role[..])));
        metadata.push(("speed_mps", &speed));
        let entity = Entity {
            id: &actor.actor_id.0.to_string(),
            name,
            world_from_box: affine(&actor.pose) * center,
            size_m: (made.half_extents_m * 2.0).to_array(),
            color: color(actor, made),
            has_heading: matches!(actor.kind, kind::VEHICLE | kind::WALKER),
            metadata: &metadata,
        };
        Some(entity.message(time))
    }
}

/// Returns the colour of a box: that of the phase of a traffic light, else that of the class.
fn color(actor: &ActorState, made: &town::Blueprint) -> [u8; 3] {
    if actor.kind == kind::TRAFFIC_LIGHT { light_color(actor.phase) } else { made.tag.color() }
}

fn collision_text(collision: &Collision, names: &BTreeMap<ActorId, String>) -> String {
    let name = |id: ActorId| match names.get(&id) {
        Some(name) => name.clone(),
        None if id == ActorId::NONE => "something static".to_owned(),
        None => id.to_string(),
    };
    let impulse_ns = DVec3::from_array(collision.impulse_ns.map(f64::from)).length();
    let (actor, other) = (name(collision.actor), name(collision.other));
    format!("{actor} collides with {other}: {impulse_ns:.0} N s")
}

fn affine(pose: &Pose) -> DAffine3 {
    let rotation = DQuat::from_array(pose.rotation.map(f64::from)).normalize();
    DAffine3::from_rotation_translation(rotation, DVec3::from_array(pose.position_m.map(f64::from)))
}
