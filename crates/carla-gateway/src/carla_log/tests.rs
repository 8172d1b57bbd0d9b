use std::io::Cursor;

use super::*;

/// A log as CARLA's recorder writes it: two frames, with an unknown packet between them.
fn golden() -> Vec<u8> {
    let mut log = Vec::new();
    let mut put = |bytes: &[u8]| log.extend_from_slice(bytes);
    put(&[1, 0]); // Version.
    put(b"\x0e\0CARLA_RECORDER");
    put(&1_550_745_980i64.to_le_bytes());
    put(b"\x06\0Town03");
    // Frame 1 at 0 s.
    put(&[0, 24, 0, 0, 0]);
    put(&[1, 0, 0, 0, 0, 0, 0, 0]);
    put(&[0; 8]);
    put(&[0; 8]);
    // An actor is spawned: id 7, a vehicle at (100, -200, 50) cm, yaw 90 degrees, blueprint 3.
    put(&[2, 72, 0, 0, 0, 1, 0]);
    put(&[7, 0, 0, 0, 1]);
    put(&[0, 0, 0xc8, 0x42, 0, 0, 0x48, 0xc3, 0, 0, 0x48, 0x42]);
    put(&[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xb4, 0x42]);
    put(&[3, 0, 0, 0]);
    put(b"\x0f\0vehicle.audi.tt");
    put(&[1, 0, 3]);
    put(b"\x09\0role_name\x04\0hero");
    // A collision without a second actor.
    put(&[5, 16, 0, 0, 0, 1, 0]);
    put(&[0, 0, 0, 0, 7, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 1, 0]);
    put(&[1, 0, 0, 0, 0]);
    // An unknown packet.
    put(&[200, 3, 0, 0, 0, 1, 2, 3]);
    // Frame 2 after half a second.
    put(&[0, 24, 0, 0, 0]);
    put(&[2, 0, 0, 0, 0, 0, 0, 0]);
    put(&[0, 0, 0, 0, 0, 0, 0xe0, 0x3f]);
    put(&[0, 0, 0, 0, 0, 0, 0xe0, 0x3f]);
    put(&[6, 30, 0, 0, 0, 1, 0, 7, 0, 0, 0]);
    put(&[0, 0, 0x96, 0x43, 0, 0, 0x48, 0xc3, 0, 0, 0x48, 0x42]);
    put(&[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xb4, 0x42]);
    put(&[7, 12, 0, 0, 0, 1, 0, 9, 0, 0, 0, 1, 0, 0, 0x20, 0x40, 2]);
    put(&[8, 23, 0, 0, 0, 1, 0, 7, 0, 0, 0]);
    put(&[0, 0, 0x80, 0x3e, 0, 0, 0, 0x3f, 0, 0, 0, 0, 1, 0xff, 0xff, 0xff, 0xff]);
    put(&[10, 10, 0, 0, 0, 1, 0, 7, 0, 0, 0, 2, 0, 0, 0]);
    put(&[1, 0, 0, 0, 0]);
    log
}

fn read_all(bytes: &[u8]) -> (Header, Vec<Frame>) {
    let mut reader = Reader::new(bytes).unwrap();
    let mut frames = Vec::new();
    while let Some(frame) = reader.frame().unwrap() {
        frames.push(frame);
    }
    (reader.header().clone(), frames)
}

#[test]
fn a_log_of_carla_is_read_and_written_back_without_change() {
    let golden = golden();
    let (head, frames) = read_all(&golden);
    assert_eq!(head, Header { version: 1, date_secs: 1_550_745_980, map: "Town03".into() });
    let created = &frames[0].created[0];
    assert_eq!((created.id, created.kind, created.uid), (7, 1, 3));
    assert_eq!((created.location, created.rotation), ([100.0, -200.0, 50.0], [0.0, 0.0, 90.0]));
    assert_eq!(created.blueprint, "vehicle.audi.tt");
    assert_eq!(created.attribute("role_name"), Some("hero"));
    let hit = Collision { id: 0, actors: [7, u32::MAX], heroes: [true, false] };
    assert_eq!(frames[0].collisions, [hit]);
    assert_eq!((frames[1].number, frames[1].elapsed_s), (2, 0.5));
    assert_eq!(frames[1].places[0].location, [300.0, -200.0, 50.0]);
    let light = TrafficLight { id: 9, frozen: true, elapsed_s: 2.5, state: 2 };
    assert_eq!(frames[1].lights, [light]);
    let pedals = VehicleAnimation {
        id: 7,
        steer: 0.25,
        throttle: 0.5,
        brake: 0.0,
        handbrake: true,
        gear: -1,
    };
    assert_eq!(frames[1].pedals, [pedals]);
    assert_eq!(frames[1].lamps, [(7, 2)]);
    let mut writer = Writer::new(Vec::new(), &head).unwrap();
    frames.iter().for_each(|frame| writer.put(frame).unwrap());
    let unknown = golden.windows(8).position(|w| w == [200, 3, 0, 0, 0, 1, 2, 3]).unwrap();
    let mut known = golden;
    known.drain(unknown..unknown + 8);
    assert_eq!(writer.finish().unwrap(), known);
}

#[test]
fn a_truncated_log_is_read_to_its_last_complete_frame() {
    let golden = golden();
    let mut counts = Vec::new();
    for len in 0..=golden.len() {
        let Ok(mut reader) = Reader::new(Cursor::new(&golden[..len])) else { continue };
        let mut count = 0;
        while let Ok(Some(_)) = reader.frame() {
            count += 1;
        }
        counts.push(count);
    }
    assert!(counts.is_sorted() && counts[0] == 0 && counts.contains(&1), "{counts:?}");
    assert_eq!(counts.last(), Some(&2));
}

#[test]
fn changed_bytes_give_an_error_or_valid_frames() {
    let golden = golden();
    let mut refused = 0;
    for at in 0..golden.len() {
        let mut bad = golden.clone();
        bad[at] ^= 0x81;
        let mut builder = MomentBuilder::default();
        let read = Reader::new(&bad[..]).and_then(|mut reader| {
            while let Some(frame) = reader.frame()? {
                let moment = builder.moment(&frame);
                assert!(moment.actors.iter().all(|actor| actor.pose.is_valid()));
            }
            Ok(())
        });
        refused += u32::from(read.is_err());
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn the_actors_of_a_log_are_converted_to_our_axes() {
    let (_, frames) = read_all(&golden());
    let mut builder = MomentBuilder::default();
    let moments: Vec<_> = frames.iter().map(|frame| builder.moment(frame)).collect();
    assert_eq!((moments[0].delta_nanos, moments[1].delta_nanos), (1, 500_000_000));
    let state = moments[1].actors[0];
    assert_eq!(state.pose.position_m, [3.0, 2.0, 0.5]);
    let ahead = state.pose.rotation() * glam::Vec3::X;
    assert!(ahead.abs_diff_eq(glam::Vec3::NEG_Y, 1e-5), "{ahead}");
    assert_eq!((state.steer, state.gear, state.lamps), (-0.25, -1, 2));
    assert_eq!(moments[0].collisions[0].other, ActorId::NONE);
    assert!(builder.unknown_blueprints().is_empty());
}
