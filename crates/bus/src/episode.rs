//! The files in an instance's folder that describe its world; the host writes them before other
//! processes join.

use std::{fs, str::FromStr};

use protocol::{BlueprintInfo, Episode};

use crate::{BusError, Instance};

fn map_file(number: u32) -> String {
    format!("map-{number}.xodr")
}

fn error(what: impl Into<String>) -> BusError {
    BusError::Instance(what.into())
}

impl Instance {
    /// For the host: writes the inputs of the world. The files are replaced atomically; those of the
    /// previous episode stay for readers that are still at it.
    pub fn write_episode(&self, number: u32, episode: &Episode) -> Result<(), BusError> {
        let root = self.root();
        let write = || {
            fs::write(root.join(map_file(number)), &episode.open_drive)?;
            let words = format!("{number}\n{}\n{}\n", episode.seed, episode.map);
            fs::write(root.join("episode.part"), words)?;
            fs::rename(root.join("episode.part"), root.join("episode"))
        };
        write().map_err(|e| error(format!("{}: {e}", root.display())))?;
        if let Some(old) = number.checked_sub(2) {
            let _ = fs::remove_file(root.join(map_file(old)));
        }
        Ok(())
    }

    /// For the host: writes the names of the maps that it can load.
    pub fn write_maps(&self, names: &[String]) -> Result<(), BusError> {
        let path = self.root().join("maps");
        fs::write(&path, names.join("\n")).map_err(|e| error(format!("{}: {e}", path.display())))
    }

    /// The names of the maps that the host can load.
    pub fn maps(&self) -> Result<Vec<String>, BusError> {
        Ok(self.read("maps")?.lines().map(str::to_owned).collect())
    }

    /// For the host: writes the list of blueprints.
    pub fn write_blueprints(&self, blueprints: &[BlueprintInfo]) -> Result<(), BusError> {
        let mut list = String::new();
        for b in blueprints {
            let numbers = b.half_extents_m.iter().chain(&b.center_m).map(f32::to_string);
            let numbers: Vec<_> = numbers.collect();
            list += &format!("{} {} {}\n", b.id, b.tag, numbers.join(" "));
        }
        let path = self.root().join("blueprints");
        fs::write(&path, list).map_err(|e| error(format!("{}: {e}", path.display())))
    }

    fn read(&self, name: &str) -> Result<String, BusError> {
        let path = self.root().join(name);
        fs::read_to_string(&path).map_err(|e| error(format!("{}: {e}", path.display())))
    }

    /// The inputs of the current world.
    pub fn episode(&self) -> Result<Episode, BusError> {
        self.numbered_episode().map(|(_, episode)| episode)
    }

    /// The number of the current episode, and its inputs.
    pub fn numbered_episode(&self) -> Result<(u32, Episode), BusError> {
        let mut last = 0;
        loop {
            let text = self.read("episode")?;
            let mut lines = text.splitn(3, '\n');
            let number = lines.next().and_then(|word| word.parse().ok());
            let seed = lines.next().and_then(|word| word.parse().ok());
            let (Some(number), Some(seed), Some(map)) = (number, seed, lines.next()) else {
                return Err(error(format!(
                    "{}/episode is damaged: it does not hold a number, a seed and a name",
                    self.root().display()
                )));
            };
            match self.read(&map_file(number)) {
                Ok(open_drive) => {
                    let map = map.trim_end().to_owned();
                    return Ok((number, Episode { map, seed, open_drive }));
                }
                // The host has loaded two worlds since the line above.
                Err(_) if number > last => last = number,
                Err(e) => return Err(e),
            }
        }
    }

    /// The list of blueprints.
    pub fn blueprints(&self) -> Result<Vec<BlueprintInfo>, BusError> {
        let parse = |line: &str| -> Option<BlueprintInfo> {
            // One id of CARLA contains a space.
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
        all.ok_or_else(|| {
            error(format!(
                "{}/blueprints is damaged: a line does not hold an id, a tag and six numbers",
                self.root().display()
            ))
        })
    }
}
