//! `tracks.json`: when each actor and object had a box.

use std::{collections::BTreeMap, fs};

use serde::{Deserialize, Serialize};

use crate::collect::{
    CollectError,
    folder::{Folder, write_atomically},
    format::FrameLine,
    sensors::BOXES,
};

/// `tracks.json`. Keys are the ids in images and boxes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tracks {
    pub(crate) actors: BTreeMap<u32, Track>,
    pub(crate) objects: BTreeMap<u32, Track>,
}

/// The frames in which one actor or object has a box.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Track {
    pub(crate) tag_name: String,
    pub(crate) first_frame: u64,
    pub(crate) last_frame: u64,
    pub(crate) box_count: u64,
}

/// What is read of a file of boxes.
#[derive(Deserialize)]
struct Ids {
    actors: Vec<Actor>,
    objects: Vec<Object>,
}

#[derive(Deserialize)]
struct Actor {
    actor_id: u32,
    tag_name: String,
}

#[derive(Deserialize)]
struct Object {
    object_id: u32,
    tag_name: String,
}

impl Tracks {
    /// Reads the boxes of all frames.
    pub(crate) fn read(folder: &Folder, lines: &[FrameLine]) -> Result<Tracks, CollectError> {
        let mut tracks = Tracks::default();
        for line in lines {
            let path = folder.frame_file(BOXES, line.frame, "json");
            let text = fs::read(&path).map_err(|e| CollectError::io(&path, e))?;
            let ids: Ids =
                serde_json::from_slice(&text).map_err(|e| CollectError::damaged(&path, e))?;
            for one in ids.actors {
                add(&mut tracks.actors, one.actor_id, one.tag_name, line.frame);
            }
            for one in ids.objects {
                add(&mut tracks.objects, one.object_id, one.tag_name, line.frame);
            }
        }
        Ok(tracks)
    }

    /// Writes the file.
    pub(crate) fn write(&self, folder: &Folder) -> Result<(), CollectError> {
        let mut text = serde_json::to_vec_pretty(self).expect("plain data has a JSON form");
        text.push(b'\n');
        write_atomically(&folder.root().join(TRACKS), &text)
    }
}

/// The name of the file.
pub(crate) const TRACKS: &str = "tracks.json";

fn add(tracks: &mut BTreeMap<u32, Track>, id: u32, tag_name: String, frame: u64) {
    let new = Track { tag_name, first_frame: frame, last_frame: frame, box_count: 0 };
    let track = tracks.entry(id).or_insert(new);
    track.last_frame = frame;
    track.box_count += 1;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::testing::{Scratch, line};

    #[test]
    fn a_track_spans_the_frames_of_its_boxes() {
        let scratch = Scratch::new("tracks");
        let folder = Folder::new(scratch.path());
        fs::create_dir(scratch.path().join(BOXES)).unwrap();
        let car = r#"{"actor_id":7,"tag_name":"Car","size_m":[4,2,1]}"#;
        let pole = r#"{"object_id":8388610,"tag_name":"Pole"}"#;
        for (frame, actors, objects) in [(5, car, ""), (6, "", pole), (7, car, pole)] {
            let text = format!(r#"{{"frame":{frame},"actors":[{actors}],"objects":[{objects}]}}"#);
            fs::write(folder.frame_file(BOXES, frame, "json"), text).unwrap();
        }
        let tracks = Tracks::read(&folder, &[line(5), line(6), line(7)]).unwrap();
        let track = |tag_name: &str, first_frame, last_frame, box_count| Track {
            tag_name: tag_name.to_owned(),
            first_frame,
            last_frame,
            box_count,
        };
        assert_eq!(tracks.actors, BTreeMap::from([(7, track("Car", 5, 7, 2))]));
        assert_eq!(tracks.objects, BTreeMap::from([(8_388_610, track("Pole", 6, 7, 2))]));
    }
}
