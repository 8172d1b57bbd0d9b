//! A saved state: everything that decides the future, as bytes.
//!
//! What a fork goes on from, and what a recording's re-simulation begins with. Good for the build
//! and the map that made it.

use bytemuck::{Pod, Zeroable};
use protocol::{
    ActorState, BlendPose, Command, Episode, GivenPoses, HideObjects, LightState, Name, RawCommand,
    SetBones, SetStreetLights, Settings, Stamp, TrafficHeader, TrafficParam, VehicleControl,
    WalkerLimbs, Weather,
};

use crate::{drawings::SavedShape, hash::StateHash};

/// `omnistat`, and the form of what follows.
const MAGIC: u64 = u64::from_le_bytes(*b"omnistat");
const FORM: u32 = 6;

/// Everything that decides the future.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SavedState {
    /// The frame at whose end it was saved, and the simulated time.
    pub stamp: Stamp,
    /// Over the map and the seed: it is good for no other.
    pub map: u64,
    /// How time passed.
    pub settings: Settings,
    /// The sky, if anybody ever set it.
    pub weather: Option<Weather>,
    /// How traffic was told to drive.
    pub params: Vec<TrafficParam>,
    /// The sky decides how much wheels grip.
    pub weather_affects_grip: bool,
    /// Layers of the town that are switched off, as bits.
    pub hidden_layers: u32,
    /// Things of the town that are switched off.
    pub hidden_objects: Vec<HideObjects>,
    /// What street lamps were told.
    pub lamps: Vec<SetStreetLights>,
    /// What is drawn over the world.
    pub shapes: Vec<SavedShape>,
    /// Poses that clients gave walkers, and how much of each shows.
    pub bones: Vec<SetBones>,
    /// The latter.
    pub blends: Vec<BlendPose>,
    /// The id given out last.
    pub last_actor: u32,
    /// Every actor, by id.
    pub actors: Vec<ActorState>,
    /// What each is called, in the same order.
    pub roles: Vec<Name>,
    /// The limbs of fallen walkers, by id.
    pub limbs: Vec<WalkerLimbs>,
    /// Bodies, as [`crate::physics::Physics::save`] tells them.
    pub physics: Vec<u8>,
    /// What traffic decided last: controls, lights and its planner.
    pub decision: Option<(TrafficHeader, Vec<u8>)>,
    /// Commands that were not carried out yet.
    pub pending: Vec<Pending>,
}

/// A command that waits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pending {
    /// Whose.
    pub client: Name,
    /// Which of the client's.
    pub sequence: u64,
    /// What.
    pub command: RawCommand,
    /// 1: pedals, which come after commands.
    pub is_control: u64,
}

/// Why bytes are no state of this world.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// They are something else, or of another build.
    #[error("it is no saved state of this build: {0}")]
    Strange(&'static str),
    /// It was saved on another map or with another seed.
    #[error("it was saved on another map or seed; start the simulator as it ran then")]
    OtherMap,
    /// They contradict themselves.
    #[error("it is damaged: {0}")]
    Damaged(String),
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Head {
    magic: u64,
    form: u32,
    last_actor: u32,
    map: u64,
    stamp: Stamp,
    settings: Settings,
    weather: Weather,
    has_weather: u32,
    hidden_layers: u32,
    weather_affects_grip: u32,
    hidden_objects: u64,
    bones: u64,
    blends: u64,
    params: u64,
    lamps: u64,
    shapes: u64,
    actors: u64,
    limbs: u64,
    physics: u64,
    /// 0: nothing was decided; else one more than the payload's length.
    decision: u64,
    pending: u64,
    header: TrafficHeader,
    sum: u64,
}

/// What names a world: over its map and seed.
pub fn map_sum(episode: &Episode) -> u64 {
    let mut hash = StateHash::new();
    hash.word(episode.seed);
    hash.bytes(episode.open_drive.as_bytes());
    hash.value()
}

/// The hash over what traffic decided, as it enters the state hash.
pub fn decision_hash(payload: &[u8]) -> u64 {
    let mut hash = StateHash::new();
    hash.bytes(payload);
    hash.value()
}

impl SavedState {
    /// Its bytes; equal states have equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let (header, payload) = self.decision.as_ref().map_or_else(
            || (TrafficHeader::default(), &[][..]),
            |(header, payload)| (*header, &payload[..]),
        );
        let mut head = Head {
            magic: MAGIC,
            form: FORM,
            last_actor: self.last_actor,
            map: self.map,
            stamp: self.stamp,
            settings: self.settings,
            weather: self.weather.unwrap_or(Weather::zeroed()),
            has_weather: self.weather.is_some().into(),
            hidden_layers: self.hidden_layers,
            weather_affects_grip: self.weather_affects_grip.into(),
            hidden_objects: self.hidden_objects.len() as u64,
            bones: self.bones.len() as u64,
            blends: self.blends.len() as u64,
            params: self.params.len() as u64,
            lamps: self.lamps.len() as u64,
            shapes: self.shapes.len() as u64,
            actors: self.actors.len() as u64,
            limbs: self.limbs.len() as u64,
            physics: self.physics.len() as u64,
            decision: self.decision.as_ref().map_or(0, |(_, p)| 1 + p.len() as u64),
            pending: self.pending.len() as u64,
            header,
            sum: 0,
        };
        let parts: [&[u8]; 12] = [
            bytemuck::cast_slice(&self.hidden_objects),
            bytemuck::cast_slice(&self.bones),
            bytemuck::cast_slice(&self.blends),
            bytemuck::cast_slice(&self.params),
            bytemuck::cast_slice(&self.lamps),
            bytemuck::cast_slice(&self.shapes),
            bytemuck::cast_slice(&self.actors),
            bytemuck::cast_slice(&self.roles),
            bytemuck::cast_slice(&self.limbs),
            &self.physics,
            payload,
            bytemuck::cast_slice(&self.pending),
        ];
        let body = parts.concat();
        head.sum = sum(&head, &body);
        [bytemuck::bytes_of(&head), &body].concat()
    }

    /// From bytes, for the world of `map`.
    pub fn from_bytes(bytes: &[u8], map: u64) -> Result<SavedState, StateError> {
        let (head, body) = bytes
            .split_at_checked(size_of::<Head>())
            .ok_or(StateError::Strange("it is shorter than a state's head"))?;
        let head: Head = bytemuck::pod_read_unaligned(head);
        if head.magic != MAGIC {
            return Err(StateError::Strange("it begins differently"));
        }
        if head.form != FORM {
            return Err(StateError::Strange("its form has another number"));
        }
        if head.sum != sum(&Head { sum: 0, ..head }, body) {
            return Err(StateError::Damaged("its sum is wrong; was it cut off?".to_owned()));
        }
        if head.map != map {
            return Err(StateError::OtherMap);
        }
        let mut rest = body;
        let hidden_objects = list(&mut rest, head.hidden_objects)?;
        let bones = list(&mut rest, head.bones)?;
        let blends = list(&mut rest, head.blends)?;
        let params = list(&mut rest, head.params)?;
        let lamps = list(&mut rest, head.lamps)?;
        let shapes = list(&mut rest, head.shapes)?;
        let actors: Vec<ActorState> = list(&mut rest, head.actors)?;
        let roles = list(&mut rest, head.actors)?;
        let limbs = list(&mut rest, head.limbs)?;
        let physics = list(&mut rest, head.physics)?;
        let payload = list(&mut rest, head.decision.saturating_sub(1))?;
        let pending = list(&mut rest, head.pending)?;
        if !rest.is_empty() {
            return Err(StateError::Damaged(format!("{} bytes are left over", rest.len())));
        }
        Ok(SavedState {
            stamp: head.stamp,
            map,
            settings: head.settings,
            weather: (head.has_weather != 0).then_some(head.weather),
            weather_affects_grip: head.weather_affects_grip != 0,
            hidden_layers: head.hidden_layers,
            hidden_objects,
            bones,
            blends,
            params,
            lamps,
            shapes,
            last_actor: head.last_actor,
            actors,
            roles,
            limbs,
            physics,
            decision: (head.decision != 0).then_some((head.header, payload)),
            pending,
        })
    }

    /// Keeps the poses that clients gave walkers.
    pub(crate) fn set_poses(&mut self, poses: &GivenPoses) {
        for command in poses.commands() {
            match command {
                Command::SetBones(set) => self.bones.push(set),
                Command::BlendPose(blend) => self.blends.push(blend),
                _ => {}
            }
        }
    }

    /// The commands that give these poses again.
    pub(crate) fn poses(&self) -> impl Iterator<Item = Command> {
        let bones = self.bones.iter().copied().map(Command::SetBones);
        bones.chain(self.blends.iter().copied().map(Command::BlendPose))
    }

    /// What traffic decided: controls, lights, planner.
    pub fn decided(&self) -> Option<(Vec<VehicleControl>, Vec<LightState>, Vec<u8>)> {
        let (header, payload) = self.decision.as_ref()?;
        let blocks = bytemuck::pod_collect_to_vec::<u8, protocol::Block>(payload);
        let (controls, lights, planner) = header.parts(&blocks)?;
        Some((controls.to_vec(), lights.to_vec(), planner.to_vec()))
    }
}

fn sum(head: &Head, body: &[u8]) -> u64 {
    let mut hash = StateHash::new();
    hash.bytes(bytemuck::bytes_of(head));
    hash.bytes(body);
    hash.value()
}

fn list<T: Pod>(rest: &mut &[u8], count: u64) -> Result<Vec<T>, StateError> {
    let len = usize::try_from(count).ok().and_then(|n| n.checked_mul(size_of::<T>()));
    let split = len.and_then(|len| rest.split_at_checked(len));
    let (front, back) =
        split.ok_or_else(|| StateError::Damaged("it is shorter than it says".to_owned()))?;
    *rest = back;
    Ok(front.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> SavedState {
        SavedState {
            map: 7,
            weather_affects_grip: true,
            hidden_layers: 3,
            hidden_objects: vec![HideObjects::default(); 2],
            params: vec![TrafficParam::default()],
            lamps: vec![bytemuck::Zeroable::zeroed()],
            shapes: vec![bytemuck::Zeroable::zeroed(); 2],
            bones: vec![SetBones::default(); 2],
            blends: vec![BlendPose::default()],
            weather: Some(Weather::default()),
            actors: vec![ActorState::default(); 2],
            roles: vec![Name::new("a"), Name::new("b")],
            limbs: vec![WalkerLimbs::default()],
            physics: vec![1, 2, 3],
            decision: Some((TrafficHeader::default(), vec![4; 64])),
            pending: vec![Pending::default()],
            ..SavedState::default()
        }
    }

    #[test]
    fn bytes_come_back_as_they_were() {
        for state in [state(), SavedState { map: 7, ..SavedState::default() }] {
            assert_eq!(SavedState::from_bytes(&state.to_bytes(), 7), Ok(state));
        }
    }

    #[test]
    fn what_is_no_state_of_this_world_is_refused() {
        let bytes = state().to_bytes();
        assert_eq!(SavedState::from_bytes(&bytes, 8), Err(StateError::OtherMap));
        for len in 0..bytes.len() {
            assert!(SavedState::from_bytes(&bytes[..len], 7).is_err(), "{len} bytes");
            let mut bad = bytes.clone();
            bad[len] ^= 4;
            assert!(SavedState::from_bytes(&bad, 7).is_err(), "byte {len}");
        }
    }
}
