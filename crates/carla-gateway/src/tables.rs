//! The tables of a recording in CARLA's format: `show_recorder_file_info`,
//! `show_recorder_collisions` and `show_recorder_actors_blocked`, which programs parse, and the
//! same as JSON.
//!
//! Units are CARLA's: centimetres, degrees, left-handed axes.

mod number;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

use anyhow::ensure;
use serde_json::{Value, json};

use crate::carla_log::{CreatedActor, Frame, NO_ACTOR, Source};
use number::{date, general};

/// What the tables show of an actor.
struct ActorInfo {
    blueprint: String,
    letter: char,
    is_hero: bool,
}

/// All actors up to a frame.
#[derive(Default)]
struct ActorTable {
    known: BTreeMap<u32, ActorInfo>,
    there: BTreeSet<u32>,
    frames: u64,
    elapsed_s: f64,
}

const LETTERS: [char; 4] = ['o', 'v', 'w', 't'];

impl ActorTable {
    fn update(&mut self, frame: &Frame) {
        (self.frames, self.elapsed_s) = (frame.number, frame.elapsed_s);
        for id in &frame.destroyed {
            self.there.remove(id);
        }
        for created in &frame.created {
            self.there.insert(created.id);
            let known = ActorInfo {
                blueprint: created.blueprint.clone(),
                letter: LETTERS.get(usize::from(created.kind)).copied().unwrap_or('o'),
                is_hero: created.attribute("role_name") == Some("hero"),
            };
            self.known.insert(created.id, known);
        }
    }

    fn is_hero(&self, id: u32) -> bool {
        self.known.get(&id).is_some_and(|known| known.is_hero)
    }

    fn letter(&self, id: u32) -> char {
        self.known.get(&id).map_or('o', |known| known.letter)
    }

    fn blueprint(&self, id: u32) -> &str {
        self.known.get(&id).map_or("", |known| &known.blueprint)
    }
}

fn head(source: &Source) -> anyhow::Result<String> {
    let head = source.header()?;
    let date = date(head.date_secs.max(0) as u64);
    Ok(format!("Version: {}\nMap: {}\nDate: {date}\n\n", head.version, head.map))
}

fn check(source: &Source, what: &str, needs_inputs: bool) -> anyhow::Result<()> {
    let Source::Recording(recording) = source else { return Ok(()) };
    let profile = recording.info().profile;
    ensure!(
        profile.has_states() && (profile.has_inputs() || !needs_inputs),
        "{} is a recording with profile {}, which contains no {what}; record with --profile state",
        recording.path().display(),
        profile.name()
    );
    Ok(())
}

/// Returns the table of `show_recorder_file_info`; `all`: with every position.
///
/// # Errors
///
/// Returns an error if the file cannot be read, or the table is longer than `most` bytes.
pub fn file_info(source: &mut Source, all: bool, most: usize) -> anyhow::Result<String> {
    check(source, "states", false)?;
    let mut text = head(source)?;
    let mut actors = ActorTable::default();
    source.each(|frame| {
        actors.update(frame);
        if text.len() > most {
            return;
        }
        let mut lines = String::new();
        frame.created.iter().for_each(|created| write_created(&mut lines, created));
        for id in &frame.destroyed {
            let _ = writeln!(lines, " Destroy {id}");
        }
        for [child, parent] in &frame.parents {
            let _ = writeln!(lines, " Parenting {child} with {parent} (parent)");
        }
        for touch in &frame.collisions {
            let [first, second] = touch.heroes.map(|hero| if hero { " (hero) " } else { "" });
            let _ = writeln!(
                lines,
                " Collision id {} between {}{first} with {}{second}",
                touch.id, touch.actors[0], touch.actors[1],
            );
        }
        if all {
            write_lists(&mut lines, frame);
        }
        if all || !lines.is_empty() {
            let _ =
                writeln!(text, "Frame {} at {} seconds", frame.number, general(frame.elapsed_s));
            text.push_str(&lines);
        }
    })?;
    ensure!(
        text.len() <= most,
        "the table has more than {} MiB; leave show_all out, or use omnibus inspect",
        most >> 20
    );
    let _ = write!(
        text,
        "\nFrames: {}\nDuration: {} seconds\n",
        actors.frames,
        general(actors.elapsed_s)
    );
    Ok(text)
}

fn write_created(lines: &mut String, created: &CreatedActor) {
    let [x, y, z] = created.location.map(general);
    let CreatedActor { id, blueprint, kind, .. } = created;
    let _ = writeln!(lines, " Create {id}: {blueprint} ({kind}) at ({x}, {y}, {z})");
    for (_, name, value) in &created.attributes {
        let _ = writeln!(lines, "  {name} = {value}");
    }
}

/// Writes all lists of a frame.
fn write_lists(lines: &mut String, frame: &Frame) {
    let _ = writeln!(lines, " Positions: {}", frame.places.len());
    for place in &frame.places {
        let [x, y, z] = place.location.map(general);
        let [roll, pitch, yaw] = place.rotation.map(general);
        let id = place.id;
        let _ = writeln!(
            lines,
            "  Id: {id} Location: ({x}, {y}, {z}) Rotation: ({roll}, {pitch}, {yaw})"
        );
    }
    let _ = writeln!(lines, " State traffic lights: {}", frame.lights.len());
    for light in &frame.lights {
        let _ = writeln!(
            lines,
            "  Id: {} state: {} frozen: {} elapsedTime: {}",
            light.id,
            light.state,
            u8::from(light.frozen),
            general(light.elapsed_s)
        );
    }
    let _ = writeln!(lines, " Vehicle animations: {}", frame.pedals.len());
    for pedals in &frame.pedals {
        let _ = writeln!(
            lines,
            "  Id: {} Steering: {} Throttle: {} Brake: {} Handbrake: {} Gear: {}",
            pedals.id,
            general(pedals.steer),
            general(pedals.throttle),
            general(pedals.brake),
            u8::from(pedals.handbrake),
            pedals.gear
        );
    }
    let _ = writeln!(lines, " Walker animations: {}", frame.walkers.len());
    for (id, speed) in &frame.walkers {
        let _ = writeln!(lines, "  Id: {id} speed: {}", general(*speed));
    }
}

/// The first frame of a collision.
struct CollisionStart {
    time_s: f64,
    letters: [char; 2],
    ids: [u32; 2],
    names: [String; 2],
}

/// The collisions between two kinds of actors, and the totals of the recording.
pub struct Collisions {
    rows: Vec<CollisionStart>,
    head: String,
    frames: u64,
    elapsed_s: f64,
}

/// Returns the collisions between two kinds: `h` hero, `v` vehicle, `w` walker, `t` traffic light,
/// `o` other, `a` any.
///
/// # Errors
///
/// Returns an error for another kind, or if the recording contains no inputs or cannot be read.
pub fn collisions(source: &mut Source, kinds: [char; 2]) -> anyhow::Result<Collisions> {
    check(source, "collisions", true)?;
    for kind in kinds {
        ensure!(
            "hvwtoa".contains(kind),
            "unknown kind of actor {kind:?}, must be h, v, w, t, o or a"
        );
    }
    let head = head(source)?;
    let mut actors = ActorTable::default();
    let (mut rows, mut before) = (Vec::new(), BTreeSet::new());
    source.each(|frame| {
        actors.update(frame);
        let mut now = BTreeSet::new();
        for ends in frame.collisions.iter().map(|touch| touch.actors) {
            let fits = ends.iter().zip(kinds).all(|(id, kind)| {
                kind == 'a' || kind == actors.letter(*id) || (kind == 'h' && actors.is_hero(*id))
            });
            if !fits {
                continue;
            }
            if !before.contains(&ends) {
                rows.push(CollisionStart {
                    time_s: actors.elapsed_s,
                    letters: ends.map(|id| actors.letter(id)),
                    ids: ends,
                    names: ends.map(|id| actors.blueprint(id).to_owned()),
                });
            }
            now.insert(ends);
        }
        before = now;
    })?;
    Ok(Collisions { rows, head, frames: actors.frames, elapsed_s: actors.elapsed_s })
}

impl Collisions {
    /// Returns the table of `show_recorder_collisions`.
    pub fn text(&self) -> String {
        let mut text = self.head.clone();
        let _ = writeln!(
            text,
            "{:>8} {:>6} {:>6} {:<35} {:>6} {:<35}",
            "Time", "Types", "Id", "Actor 1", "Id", "Actor 2"
        );
        for row in &self.rows {
            let [a, b] = row.letters;
            let [(first, name), (second, other)] =
                [0, 1].map(|end| (row.ids[end], &row.names[end]));
            let _ = writeln!(
                text,
                "{:>8.0}   {a} {b}  {first:>6} {name:<35} {second:>6} {other:<35}",
                row.time_s
            );
        }
        // In CARLA's stream, the precision of a row holds for the total after it.
        let seconds = if self.rows.is_empty() {
            general(self.elapsed_s)
        } else {
            format!("{:.0}", self.elapsed_s)
        };
        let _ = write!(text, "\nFrames: {}\nDuration: {seconds} seconds\n", self.frames);
        text
    }

    /// Returns the collisions as JSON.
    pub fn json(&self) -> Value {
        let rows = self.rows.iter().map(|row| {
            let ids = row.ids.map(|id| (id != NO_ACTOR).then_some(id));
            json!({ "time_s": row.time_s, "kinds": row.letters.map(String::from), "actor_ids": ids,
                "blueprints": row.names })
        });
        json!({ "collisions": rows.collect::<Vec<_>>(), "frames": self.frames,
            "duration_s": self.elapsed_s })
    }
}

/// An actor that did not move.
#[derive(Clone)]
struct BlockedActor {
    since_s: f64,
    id: u32,
    name: String,
    seconds: f64,
}

/// The actors that did not move for a while, and the totals of the recording.
pub struct Blocked {
    rows: Vec<BlockedActor>,
    head: String,
    frames: u64,
    elapsed_s: f64,
}

/// Returns the actors that moved less than `distance_cm` between frames for at least `time_s`.
///
/// # Errors
///
/// Returns an error if the recording contains no states or cannot be read.
pub fn blocked(source: &mut Source, time_s: f64, distance_cm: f64) -> anyhow::Result<Blocked> {
    check(source, "states", false)?;
    let head = head(source)?;
    let mut actors = ActorTable::default();
    let mut rows: Vec<BlockedActor> = Vec::new();
    let mut standing: BTreeMap<u32, ([f32; 3], BlockedActor)> = BTreeMap::new();
    source.each(|frame| {
        let delta_s = if actors.frames == 0 { 0.0 } else { frame.duration_s };
        actors.update(frame);
        standing.retain(|id, _| actors.there.contains(id));
        for place in &frame.places {
            let id = place.id;
            let (last, blocked) = standing.entry(id).or_insert_with(|| {
                let name = actors.blueprint(id).to_owned();
                ([0.0; 3], BlockedActor { since_s: 0.0, id, name, seconds: 0.0 })
            });
            let at = place.location;
            let off_cm = at.iter().zip(&*last).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            if off_cm.sqrt() < distance_cm {
                if blocked.seconds == 0.0 {
                    blocked.since_s = actors.elapsed_s;
                }
                blocked.seconds += delta_s;
                continue;
            }
            if blocked.seconds >= time_s {
                rows.push(blocked.clone());
            }
            blocked.seconds = 0.0;
            *last = at;
        }
    })?;
    let still = standing.into_values().map(|(_, blocked)| blocked);
    rows.extend(still.filter(|blocked| blocked.seconds >= time_s));
    rows.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    Ok(Blocked { rows, head, frames: actors.frames, elapsed_s: actors.elapsed_s })
}

impl Blocked {
    /// Returns the table of `show_recorder_actors_blocked`.
    pub fn text(&self) -> String {
        let mut text = self.head.clone();
        let _ = writeln!(text, "{:>8} {:>6} {:<35} {:>10}", "Time", "Id", "Actor", "Duration");
        for BlockedActor { since_s, id, name, seconds } in &self.rows {
            let _ = writeln!(text, "{since_s:>8.0} {id:>6} {name:<35} {seconds:>10.0}");
        }
        let seconds = general(self.elapsed_s);
        let _ = write!(text, "\nFrames: {}\nDuration: {seconds} seconds\n", self.frames);
        text
    }

    /// Returns the blocked actors as JSON.
    pub fn json(&self) -> Value {
        let rows = self.rows.iter().map(|row| {
            json!({ "time_s": row.since_s, "actor_id": row.id, "blueprint": row.name,
                "duration_s": row.seconds })
        });
        json!({ "blocked": rows.collect::<Vec<_>>(), "frames": self.frames,
            "duration_s": self.elapsed_s })
    }
}
