//! `frames.jsonl`: lists a frame if and only if all its files are complete.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::{self, Write},
    path::{Path, PathBuf},
};

use crate::collect::{CollectError, format::FrameLine};

/// The list of complete frames, which grows in order.
pub(crate) struct FrameList {
    path: PathBuf,
    file: File,
    /// Bytes of complete lines.
    len: u64,
    /// The position of the next frame to append.
    next: u64,
    /// Frames that were complete before the frames ahead of them.
    early: BTreeMap<u64, String>,
}

impl FrameList {
    /// Continues after the complete lines of `path`; a torn last line is cut off. Returns the
    /// lines.
    pub(crate) fn open(path: &Path) -> Result<(FrameList, Vec<FrameLine>), CollectError> {
        let (lines, len) = read(path)?;
        let open = OpenOptions::new().create(true).append(true).open(path);
        let file = open.map_err(|e| CollectError::io(path, e))?;
        file.set_len(len).map_err(|e| CollectError::io(path, e))?;
        let next = lines.len() as u64;
        let frame_list =
            FrameList { path: path.to_owned(), file, len, next, early: BTreeMap::new() };
        Ok((frame_list, lines))
    }

    /// Returns the number of complete frames.
    pub(crate) fn complete(&self) -> u64 {
        self.next
    }

    /// Notes that the frame at position `index` is complete; it is written once all before it are.
    pub(crate) fn append(&mut self, index: u64, line: &FrameLine) -> Result<(), CollectError> {
        let mut text = serde_json::to_string(line).expect("plain data has a JSON form");
        text.push('\n');
        self.early.insert(index, text);
        while let Some(text) = self.early.remove(&self.next) {
            if let Err(e) = self.file.write_all(text.as_bytes()) {
                // A torn line would be cut off by the next run; readers should not see it.
                let _ = self.file.set_len(self.len);
                return Err(CollectError::io(&self.path, e));
            }
            self.len += text.len() as u64;
            self.next += 1;
        }
        Ok(())
    }
}

/// Reads the complete lines of a list and their length in bytes. A missing file has no lines.
pub(crate) fn read(path: &Path) -> Result<(Vec<FrameLine>, u64), CollectError> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok((Vec::new(), 0)),
        Err(e) => return Err(CollectError::io(path, e)),
    };
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    let parse = |(index, line): (usize, &str)| {
        let parsed = serde_json::from_str(line);
        parsed.map_err(|e| CollectError::damaged(path, format!("line {}: {e}", index + 1)))
    };
    let lines = text[..whole].lines().enumerate().map(parse).collect::<Result<_, _>>()?;
    Ok((lines, whole as u64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collect::testing::{Scratch, line};

    #[test]
    fn frames_are_listed_in_order_whatever_the_order_of_completion() {
        let scratch = Scratch::new("order");
        let path = scratch.path().join("frames.jsonl");
        let (mut frame_list, lines) = FrameList::open(&path).unwrap();
        assert!(lines.is_empty());
        for index in [2, 0, 3, 1] {
            frame_list.append(index, &line(100 + index)).unwrap();
        }
        assert_eq!(frame_list.complete(), 4);
        let frames: Vec<_> = read(&path).unwrap().0.iter().map(|l| l.frame).collect();
        assert_eq!(frames, [100, 101, 102, 103]);
    }

    #[test]
    fn a_frame_is_not_listed_before_the_one_ahead_of_it() {
        let scratch = Scratch::new("gap");
        let path = scratch.path().join("frames.jsonl");
        let (mut frame_list, _) = FrameList::open(&path).unwrap();
        frame_list.append(0, &line(5)).unwrap();
        frame_list.append(2, &line(7)).unwrap();
        assert_eq!(frame_list.complete(), 1);
        assert_eq!(read(&path).unwrap().0.len(), 1);
    }

    #[test]
    fn a_torn_line_is_cut_off_and_the_list_continues_after_the_complete_ones() {
        let scratch = Scratch::new("torn");
        let path = scratch.path().join("frames.jsonl");
        let (mut frame_list, _) = FrameList::open(&path).unwrap();
        frame_list.append(0, &line(5)).unwrap();
        frame_list.append(1, &line(6)).unwrap();
        drop(frame_list);
        let whole = fs::read_to_string(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 9]).unwrap();
        let (mut frame_list, lines) = FrameList::open(&path).unwrap();
        assert_eq!(lines.len(), 1);
        frame_list.append(1, &line(6)).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), whole);
    }

    #[test]
    fn a_line_that_is_not_a_frame_is_named_by_its_number() {
        let scratch = Scratch::new("damaged");
        let path = scratch.path().join("frames.jsonl");
        let good = serde_json::to_string(&line(5)).unwrap();
        fs::write(&path, format!("{good}\n{{\"frame\":6}}\n")).unwrap();
        let error = FrameList::open(&path).err().unwrap().to_string();
        assert!(error.contains("line 2") && error.contains("missing field"), "{error}");
    }
}
