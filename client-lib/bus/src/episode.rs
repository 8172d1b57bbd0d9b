//! What world an instance runs: files in its folder, written by the host before anybody joins.

use std::{fs, str::FromStr};

use crate::{BusError, Instance};

/// What world an instance runs: every stage builds the same from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Episode {
    /// The map's name.
    pub map: String,
    /// Decides scenery and traffic.
    pub seed: u64,
    /// The map itself.
    pub open_drive: String,
}

/// What a client knows of a blueprint; its place in the list is [`crate::ActorState::blueprint`].
#[derive(Clone, Debug, PartialEq)]
pub struct BlueprintInfo {
    /// As `vehicle.tesla.model3`.
    pub id: String,
    /// The semantic tag's code (`road::Tag`).
    pub tag: u8,
    /// Half the size of its bounding box.
    pub half_extents_m: [f32; 3],
    /// The middle of its bounding box, in actor space.
    pub center_m: [f32; 3],
}

fn error(what: impl Into<String>) -> BusError {
    BusError::Instance(what.into())
}

impl Instance {
    /// For the host: tells the stages what world to build, and clients what stands in it.
    pub fn write_episode(
        &self,
        episode: &Episode,
        blueprints: &[BlueprintInfo],
    ) -> Result<(), BusError> {
        let root = self.root();
        let mut list = String::new();
        for b in blueprints {
            let numbers = b.half_extents_m.iter().chain(&b.center_m).map(f32::to_string);
            let numbers: Vec<_> = numbers.collect();
            list += &format!("{} {} {}\n", b.id, b.tag, numbers.join(" "));
        }
        let write = || {
            fs::write(root.join("map.xodr"), &episode.open_drive)?;
            fs::write(root.join("blueprints"), list)?;
            fs::write(root.join("episode"), format!("{}\n{}\n", episode.seed, episode.map))
        };
        write().map_err(|e| error(format!("{}: {e}", root.display())))
    }

    fn read(&self, name: &str) -> Result<String, BusError> {
        let path = self.root().join(name);
        fs::read_to_string(&path).map_err(|e| error(format!("{}: {e}", path.display())))
    }

    /// What world it runs.
    pub fn episode(&self) -> Result<Episode, BusError> {
        let text = self.read("episode")?;
        let (seed, map) = text.trim_end().split_once('\n').unwrap_or(("", ""));
        let seed = seed
            .parse()
            .map_err(|_| error(format!("{}/episode holds no seed", self.root().display())))?;
        Ok(Episode { map: map.to_owned(), seed, open_drive: self.read("map.xodr")? })
    }

    /// What can stand in it.
    pub fn blueprints(&self) -> Result<Vec<BlueprintInfo>, BusError> {
        let parse = |line: &str| -> Option<BlueprintInfo> {
            // One of CARLA's ids has a space in it.
            let mut words: Vec<&str> = line.rsplitn(8, ' ').collect();
            words.reverse();
            let [id, tag, ref numbers @ ..] = words[..] else { return None };
            let (id, tag) = (id.to_owned(), tag.parse().ok()?);
            let numbers = numbers.iter().map(|word| f32::from_str(word));
            let numbers: Vec<f32> = numbers.collect::<Result<_, _>>().ok()?;
            let [hx, hy, hz, cx, cy, cz] = numbers.try_into().ok()?;
            Some(BlueprintInfo { id, tag, half_extents_m: [hx, hy, hz], center_m: [cx, cy, cz] })
        };
        let text = self.read("blueprints")?;
        let all: Option<Vec<_>> = text.lines().map(parse).collect();
        all.ok_or_else(|| error(format!("{}/blueprints is damaged", self.root().display())))
    }
}
