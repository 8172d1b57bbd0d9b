//! Logs of CARLA's recorder.

use carla_gateway::carla_log::{Frame, Header, MomentBuilder, Reader, Writer};

/// Reads a log, converts its frames to those of a recording, and writes the log back.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let Some((header, frames)) = read(bytes) else { return false };
    let mut builder = MomentBuilder::default();
    for frame in &frames {
        let moment = builder.moment(frame);
        assert!(moment.delta_nanos > 0);
        let wrong = moment.actors.iter().find(|actor| !actor.is_valid());
        assert!(wrong.is_none(), "{wrong:?}");
    }
    // What is written of what was read is read back the same.
    let Some(written) = write(&header, &frames) else { return true };
    let (again, frames) = read(&written).expect("a written log");
    assert_eq!(Some(&written), write(&again, &frames).as_ref());
    true
}

fn read(bytes: &[u8]) -> Option<(Header, Vec<Frame>)> {
    let mut reader = Reader::new(bytes).ok()?;
    let mut frames = Vec::new();
    while let Some(frame) = reader.frame().ok()? {
        frames.push(frame);
    }
    Some((reader.header().clone(), frames))
}

fn write(header: &Header, frames: &[Frame]) -> Option<Vec<u8>> {
    let mut writer = Writer::new(std::io::Cursor::new(Vec::new()), header).ok()?;
    for frame in frames {
        writer.put(frame).ok()?;
    }
    Some(writer.finish().ok()?.into_inner())
}
