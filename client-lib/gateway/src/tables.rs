//! What is in a recording, in CARLA's own words: the tables of `show_recorder_file_info`,
//! `show_recorder_collisions` and `show_recorder_actors_blocked`, which programs parse, and the
//! same as JSON. Centimetres, degrees and the left hand, as CARLA writes them.

mod number;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

use ::record::{Moment, RecordError, Recording};
use anyhow::ensure;
use client_lib::{ActorId, ActorState, Wish, carla_axes::CarlaTransform, flag, kind};
use serde_json::{Value, json};

use number::{date, general};

/// What CARLA calls who is no actor.
const NOBODY: u32 = u32::MAX;

/// Who somebody is, for the tables.
struct Known {
    blueprint: String,
    /// CARLA's number of its kind.
    kind: u8,
    role: Option<String>,
}

/// A pass over a recording's frames, with what is known of their actors.
struct Pass {
    known: BTreeMap<ActorId, Known>,
    there: BTreeSet<ActorId>,
    roles: BTreeMap<ActorId, String>,
    /// CARLA counts from 1; time counts from the first frame.
    frame: u64,
    elapsed_s: f64,
}

/// Centimetres.
fn location(state: &ActorState) -> [f32; 3] {
    CarlaTransform::from_pose(&state.pose).location_m.map(|m| m * 100.0)
}

fn kind_of(state: &ActorState) -> u8 {
    match state.kind {
        kind::VEHICLE => 1,
        kind::WALKER => 2,
        kind::TRAFFIC_LIGHT => 3,
        _ => 0,
    }
}

const LETTERS: [char; 4] = ['o', 'v', 'w', 't'];

impl Pass {
    fn new(recording: &Recording) -> Pass {
        Pass {
            known: BTreeMap::new(),
            there: BTreeSet::new(),
            roles: recording.told().roles.iter().cloned().collect(),
            frame: 0,
            elapsed_s: 0.0,
        }
    }

    /// The next frame: who came, who went.
    fn turn<'a>(
        &mut self,
        blueprints: &[String],
        moment: &'a Moment,
    ) -> (Vec<&'a ActorState>, Vec<ActorId>) {
        if self.frame > 0 {
            self.elapsed_s += moment.delta_nanos as f64 / 1e9;
        }
        self.frame += 1;
        for entry in moment.journal.iter().filter(|e| e.outcome.result().is_ok()) {
            if let Some(Wish::Spawn(spawn)) = entry.command.wish()
                && !spawn.role.as_str().is_empty()
            {
                self.roles.insert(ActorId(entry.outcome.id), spawn.role.to_string());
            }
        }
        let now: BTreeSet<_> = moment.actors.iter().map(|a| a.actor_id).collect();
        let gone: Vec<_> = self.there.difference(&now).copied().collect();
        let came: Vec<_> =
            moment.actors.iter().filter(|a| !self.there.contains(&a.actor_id)).collect();
        for state in &came {
            let blueprint = blueprints.get(state.blueprint as usize).cloned().unwrap_or_default();
            let role = self.roles.get(&state.actor_id).cloned();
            self.known.insert(state.actor_id, Known { blueprint, kind: kind_of(state), role });
        }
        self.there = now;
        (came, gone)
    }

    fn is_hero(&self, id: ActorId) -> bool {
        self.known.get(&id).is_some_and(|k| k.role.as_deref() == Some("hero"))
    }

    fn letter(&self, id: ActorId) -> char {
        self.known.get(&id).map_or('o', |k| LETTERS[usize::from(k.kind)])
    }

    fn blueprint(&self, id: ActorId) -> &str {
        self.known.get(&id).map_or("", |k| &k.blueprint)
    }
}

fn head(recording: &Recording) -> String {
    let told = recording.told();
    format!("Version: 1\nMap: {}\nDate: {}\n\n", told.episode.map, date(told.date_secs))
}

fn each(recording: &mut Recording, mut look: impl FnMut(&Moment)) -> Result<(), RecordError> {
    for segment in 0..recording.segments() {
        recording.moments(segment)?.iter().for_each(&mut look);
    }
    Ok(())
}

fn check(recording: &Recording, what: &str, needs_inputs: bool) -> anyhow::Result<()> {
    let profile = recording.told().profile;
    ensure!(
        profile.has_states() && (profile.has_inputs() || !needs_inputs),
        "{} is a recording of profile {}, which keeps no {what}; record with --profile state",
        recording.path().display(),
        profile.name()
    );
    Ok(())
}

/// The table of `show_recorder_file_info`; `all`: with every position.
pub fn file_info(recording: &mut Recording, all: bool) -> anyhow::Result<String> {
    check(recording, "states", false)?;
    let mut text = head(recording);
    let blueprints = recording.told().blueprints.clone();
    let mut pass = Pass::new(recording);
    let mut phases = BTreeMap::new();
    each(recording, |moment| {
        let (came, gone) = pass.turn(&blueprints, moment);
        let mut lines = String::new();
        for state in came {
            tell_new(&mut lines, &pass, state);
        }
        for id in gone {
            let _ = writeln!(lines, " Destroy {}", id.0);
        }
        for (index, hit) in moment.collisions.iter().enumerate() {
            let other = if hit.other == ActorId::NONE { NOBODY } else { hit.other.0 };
            let hero = |id| if pass.is_hero(id) { " (hero) " } else { "" };
            let _ = writeln!(
                lines,
                " Collision id {index} between {}{} with {other}{}",
                hit.actor.0,
                hero(hit.actor),
                hero(hit.other),
            );
        }
        if all {
            tell_all(&mut lines, moment, &mut phases, pass.elapsed_s);
        }
        if all || !lines.is_empty() {
            let _ = writeln!(text, "Frame {} at {} seconds", pass.frame, general(pass.elapsed_s));
            text.push_str(&lines);
        }
    })?;
    let _ =
        write!(text, "\nFrames: {}\nDuration: {} seconds\n", pass.frame, general(pass.elapsed_s));
    Ok(text)
}

fn tell_new(lines: &mut String, pass: &Pass, state: &ActorState) {
    let id = state.actor_id;
    let [x, y, z] = location(state).map(general);
    let (name, kind) = (pass.blueprint(id), kind_of(state));
    let _ = writeln!(lines, " Create {}: {name} ({kind}) at ({x}, {y}, {z})", id.0);
    if state.kind == kind::VEHICLE {
        let [r, g, b, _] = state.color.to_le_bytes();
        let _ = writeln!(lines, "  color = {r},{g},{b}");
    }
    let autopilot = state.has(flag::AUTOPILOT).then_some("autopilot");
    let role = pass.known.get(&id).and_then(|k| k.role.as_deref()).or(autopilot);
    if let Some(role) = role {
        let _ = writeln!(lines, "  role_name = {role}");
    }
}

/// Everything of a frame, list by list.
fn tell_all(
    lines: &mut String,
    moment: &Moment,
    phases: &mut BTreeMap<ActorId, (u32, f64)>,
    now_s: f64,
) {
    let of = |wanted: u32| moment.actors.iter().filter(move |a| a.kind == wanted);
    let movable = || moment.actors.iter().filter(|a| a.kind != kind::TRAFFIC_LIGHT);
    let _ = writeln!(lines, " Positions: {}", movable().count());
    for state in movable() {
        let [x, y, z] = location(state).map(general);
        let turn = CarlaTransform::from_pose(&state.pose);
        let [roll, pitch, yaw] = [turn.roll_deg, turn.pitch_deg, turn.yaw_deg].map(general);
        let id = state.actor_id.0;
        let _ = writeln!(
            lines,
            "  Id: {id} Location: ({x}, {y}, {z}) Rotation: ({roll}, {pitch}, {yaw})"
        );
    }
    let _ = writeln!(lines, " State traffic lights: {}", of(kind::TRAFFIC_LIGHT).count());
    for state in of(kind::TRAFFIC_LIGHT) {
        let since = phases.entry(state.actor_id).or_insert((state.phase, now_s));
        if since.0 != state.phase {
            *since = (state.phase, now_s);
        }
        let _ = writeln!(
            lines,
            "  Id: {} state: {} frozen: {} elapsedTime: {}",
            state.actor_id.0,
            state.phase,
            u8::from(state.has(flag::HELD)),
            general(now_s - since.1)
        );
    }
    let _ = writeln!(lines, " Vehicle animations: {}", of(kind::VEHICLE).count());
    for state in of(kind::VEHICLE) {
        let _ = writeln!(
            lines,
            "  Id: {} Steering: {} Throttle: {} Brake: {} Handbrake: {} Gear: {}",
            state.actor_id.0,
            general(0.0 - state.steer),
            general(state.throttle),
            general(state.brake),
            u8::from(state.has(flag::HANDBRAKE)),
            state.gear
        );
    }
    let _ = writeln!(lines, " Walker animations: {}", of(kind::WALKER).count());
    for state in of(kind::WALKER) {
        let speed = state.velocity().truncate().length() * 100.0;
        let _ = writeln!(lines, "  Id: {} speed: {}", state.actor_id.0, general(speed));
    }
}

/// One collision as it begins.
struct Began {
    time_s: f64,
    letters: [char; 2],
    ids: [u32; 2],
    names: [String; 2],
}

/// Collisions between two kinds: `h` hero, `v` vehicle, `w` walker, `t` traffic light, `o` other,
/// `a` any.
pub struct Collisions {
    rows: Vec<Began>,
    head: String,
    frames: u64,
    elapsed_s: f64,
}

/// The collisions of a recording between two kinds of actors.
pub fn collisions(recording: &mut Recording, kinds: [char; 2]) -> anyhow::Result<Collisions> {
    check(recording, "collisions", true)?;
    for kind in kinds {
        ensure!("hvwtoa".contains(kind), "a kind of collision is {kind:?}, not h, v, w, t, o or a");
    }
    let blueprints = recording.told().blueprints.clone();
    let head = head(recording);
    let mut pass = Pass::new(recording);
    let (mut rows, mut before) = (Vec::new(), BTreeSet::new());
    each(recording, |moment| {
        pass.turn(&blueprints, moment);
        let mut now = BTreeSet::new();
        for hit in &moment.collisions {
            let ends = [hit.actor, hit.other];
            let fits = ends.iter().zip(kinds).all(|(id, kind)| {
                kind == 'a' || kind == pass.letter(*id) || (kind == 'h' && pass.is_hero(*id))
            });
            if !fits {
                continue;
            }
            if !before.contains(&ends) {
                rows.push(Began {
                    time_s: pass.elapsed_s,
                    letters: ends.map(|id| pass.letter(id)),
                    ids: ends.map(|id| if id == ActorId::NONE { NOBODY } else { id.0 }),
                    names: ends.map(|id| pass.blueprint(id).to_owned()),
                });
            }
            now.insert(ends);
        }
        before = now;
    })?;
    Ok(Collisions { rows, head, frames: pass.frame, elapsed_s: pass.elapsed_s })
}

impl Collisions {
    /// The table of `show_recorder_collisions`.
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
        // A row sets the precision of all that follows, in CARLA's own stream.
        let seconds = if self.rows.is_empty() {
            general(self.elapsed_s)
        } else {
            format!("{:.0}", self.elapsed_s)
        };
        let _ = write!(text, "\nFrames: {}\nDuration: {seconds} seconds\n", self.frames);
        text
    }

    /// The same.
    pub fn json(&self) -> Value {
        let rows = self.rows.iter().map(|row| {
            let ids = row.ids.map(|id| (id != NOBODY).then_some(id));
            json!({ "time_s": row.time_s, "kinds": row.letters.map(String::from), "actor_ids": ids,
                "blueprints": row.names })
        });
        json!({ "collisions": rows.collect::<Vec<_>>(), "frames": self.frames,
            "duration_s": self.elapsed_s })
    }
}

/// Somebody who stood still.
#[derive(Clone)]
struct Stood {
    since_s: f64,
    id: u32,
    name: String,
    seconds: f64,
}

/// Those who stood still for long.
pub struct Blocked {
    rows: Vec<Stood>,
    head: String,
    frames: u64,
    elapsed_s: f64,
}

/// Those who moved less than `distance_cm` between frames for at least `time_s`.
pub fn blocked(
    recording: &mut Recording,
    time_s: f64,
    distance_cm: f64,
) -> anyhow::Result<Blocked> {
    check(recording, "states", false)?;
    let blueprints = recording.told().blueprints.clone();
    let head = head(recording);
    let mut pass = Pass::new(recording);
    let mut rows: Vec<Stood> = Vec::new();
    let mut standing: BTreeMap<ActorId, ([f32; 3], Stood)> = BTreeMap::new();
    each(recording, |moment| {
        let delta_s = if pass.frame == 0 { 0.0 } else { moment.delta_nanos as f64 / 1e9 };
        pass.turn(&blueprints, moment);
        standing.retain(|id, _| pass.there.contains(id));
        for state in moment.actors.iter().filter(|a| a.kind != kind::TRAFFIC_LIGHT) {
            let id = state.actor_id;
            let (last, stood) = standing.entry(id).or_insert_with(|| {
                let name = pass.blueprint(id).to_owned();
                ([0.0; 3], Stood { since_s: 0.0, id: id.0, name, seconds: 0.0 })
            });
            let at = location(state);
            let off_cm = at.iter().zip(&*last).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            if off_cm.sqrt() < distance_cm {
                if stood.seconds == 0.0 {
                    stood.since_s = pass.elapsed_s;
                }
                stood.seconds += delta_s;
                continue;
            }
            if stood.seconds >= time_s {
                rows.push(stood.clone());
            }
            stood.seconds = 0.0;
            *last = at;
        }
    })?;
    let still = standing.into_values().map(|(_, stood)| stood);
    rows.extend(still.filter(|stood| stood.seconds >= time_s));
    rows.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    Ok(Blocked { rows, head, frames: pass.frame, elapsed_s: pass.elapsed_s })
}

impl Blocked {
    /// The table of `show_recorder_actors_blocked`.
    pub fn text(&self) -> String {
        let mut text = self.head.clone();
        let _ = writeln!(text, "{:>8} {:>6} {:<35} {:>10}", "Time", "Id", "Actor", "Duration");
        for Stood { since_s, id, name, seconds } in &self.rows {
            let _ = writeln!(text, "{since_s:>8.0} {id:>6} {name:<35} {seconds:>10.0}");
        }
        let seconds = general(self.elapsed_s);
        let _ = write!(text, "\nFrames: {}\nDuration: {seconds} seconds\n", self.frames);
        text
    }

    /// The same.
    pub fn json(&self) -> Value {
        let rows = self.rows.iter().map(|row| {
            json!({ "time_s": row.since_s, "actor_id": row.id, "blueprint": row.name,
                "duration_s": row.seconds })
        });
        json!({ "blocked": rows.collect::<Vec<_>>(), "frames": self.frames,
            "duration_s": self.elapsed_s })
    }
}
