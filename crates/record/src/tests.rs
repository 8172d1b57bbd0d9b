use std::{fs, path::PathBuf};

use glam::{Quat, Vec3};
use protocol::{
    ActorId, ActorState, Command, Episode, Frame, JournalEntry, LIMBS, Name, Outcome, Pose,
    Refusal, Stamp, WalkerLimbs, parts,
};

use crate::{
    Collision, Decision, Profile, RecordError, RecordedFrame, Recording, RecordingConfig, Writer,
};

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Scratch {
        let path =
            std::env::temp_dir().join(format!("omnibus-record-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Scratch(path)
    }

    fn config(&self, profile: Profile) -> RecordingConfig {
        RecordingConfig {
            path: self.0.join(format!("{}.mcap", profile.name())),
            profile,
            episode: Episode { map: "Test".into(), seed: 3, open_drive: "<OpenDRIVE/>".into() },
            blueprints: vec!["vehicle.a".into(), "vehicle.b".into()],
            roles: vec![(ActorId(1), "hero".into())],
        }
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Twelve cars on circles; one leaves and one arrives every seven frames; one has a value that is
/// not a number.
fn recorded_frame(frame: u64) -> RecordedFrame {
    let time = frame as f32 * 0.05;
    let gone = (frame / 7) as u32;
    let ids = (1 + gone..=12 + gone).filter(|id| *id != 5 || frame > 3);
    let actors = ids.map(|id| {
        let (speed, radius) = (5.0 + id as f32, 20.0 + 3.0 * id as f32);
        let angle = time * speed / radius;
        let way = Vec3::new(angle.cos(), angle.sin(), 0.0);
        let velocity = Vec3::new(-angle.sin(), angle.cos(), 1e-4 * (time * 9.0).sin()) * speed;
        ActorState {
            actor_id: ActorId(id),
            blueprint: id % 2,
            kind: 1,
            flags: if frame.is_multiple_of(9) { 4 } else { 0 },
            pose: Pose::new(way * radius, Quat::from_rotation_z(angle + 1.5)),
            velocity_mps: velocity.to_array(),
            angular_velocity_radps: [0.0, 0.0, speed / radius],
            acceleration_mps2: if id == 7 { [f32::NAN, f32::INFINITY, -0.0] } else { [0.1; 3] },
            steer: (time * 0.3).sin(),
            gear: -1,
            color: 0xff00_ff00 + id,
            ..ActorState::default()
        }
    });
    let entry = JournalEntry {
        client: Name::new("tester"),
        sequence: frame,
        command: Command::Destroy(ActorId(9)).into(),
        outcome: Outcome::refused(&Refusal::unknown_actor("not there")),
    };
    RecordedFrame {
        stamp: Stamp {
            frame: Frame(100 + frame),
            sim_time_nanos: frame * 50_000_000,
            episode: 1,
            reserved: 0,
        },
        delta_nanos: 50_000_000,
        substep_max_nanos: 10_000_000,
        state_hash: frame.wrapping_mul(0x9e37_79b9_7f4a_7c15),
        decision: Decision {
            frame: Frame(99 + frame),
            hash: frame,
            whole: frame.is_multiple_of(50).then(|| (Default::default(), vec![7; 130])),
        },
        early: (frame % 3 == 2).into(),
        journal: vec![entry; (frame % 3) as usize],
        collisions: vec![
            Collision { actor: ActorId(1), ..Default::default() };
            (frame % 2) as usize
        ],
        actors: actors.collect(),
        limbs: vec![
            WalkerLimbs { actor_id: ActorId(frame as u32), rotations: [[0.5; 4]; LIMBS] };
            (frame % 4) as usize
        ],
        shown: 0,
        world: frame.is_multiple_of(150).then(|| vec![1, 2, 3]),
    }
}

fn write(config: &RecordingConfig, frames: std::ops::Range<u64>) {
    let mut writer = Writer::create(config).unwrap();
    for frame in frames.clone() {
        writer.put(recorded_frame(frame)).unwrap();
    }
    assert_eq!(writer.finish().unwrap(), frames.end - frames.start);
}

/// Compares floats by their bits, and the hash, which only the reader computes.
fn check_same(read: &RecordedFrame, expected: &RecordedFrame) {
    let bits =
        |m: &RecordedFrame| bytemuck::cast_slice::<ActorState, [u32; 32]>(&m.actors).to_vec();
    assert_eq!(bits(read), bits(expected), "{:?}", expected.stamp);
    let plain = |m: &RecordedFrame| RecordedFrame { actors: vec![], shown: 0, ..m.clone() };
    assert_eq!(plain(read), plain(expected));
}

#[test]
fn a_recording_is_read_to_the_bit() {
    let scratch = Scratch::new("exact");
    let config = scratch.config(Profile::State);
    write(&config, 0..400);
    let mut recording = Recording::open(&config.path).unwrap();
    assert!(recording.info().is_complete);
    assert_eq!(recording.info().episode, config.episode);
    assert_eq!(recording.info().roles, config.roles);
    let mut frame = 0;
    for segment in 0..recording.segments() {
        for read in recording.recorded_frames(segment).unwrap() {
            assert!(read.is_as_shown());
            check_same(read, &recorded_frame(frame));
            frame += 1;
        }
    }
    assert_eq!(frame, 400);
    assert_eq!(recording.duration_nanos().unwrap(), 400 * 50_000_000);
}

#[test]
fn motion_on_its_grid_takes_less_room_and_is_read_to_the_bit() {
    let scratch = Scratch::new("grid");
    let config = scratch.config(Profile::State);
    let rounded = |frame: u64| {
        let mut recorded_frame = recorded_frame(frame);
        for state in &mut recorded_frame.actors {
            let parts = parts::MOTION as f32;
            let motion = state.velocity_mps.iter_mut().chain(&mut state.angular_velocity_radps);
            motion.for_each(|v| *v = (*v * parts).round() / parts + 0.0);
        }
        recorded_frame
    };
    let size = |of: &dyn Fn(u64) -> RecordedFrame| {
        let mut writer = Writer::create(&config).unwrap();
        (0..200).for_each(|frame| writer.put(of(frame)).unwrap());
        writer.finish().unwrap();
        fs::metadata(&config.path).unwrap().len()
    };
    let (whole, less) = (size(&recorded_frame), size(&rounded));
    assert!(less * 10 < whole * 9, "{less} bytes, {whole} where nothing is rounded");
    let mut recording = Recording::open(&config.path).unwrap();
    let mut frame = 0;
    for segment in 0..recording.segments() {
        for read in recording.recorded_frames(segment).unwrap() {
            check_same(read, &rounded(frame));
            frame += 1;
        }
    }
    assert_eq!(frame, 200);
}

#[test]
fn a_recording_without_frames_is_valid() {
    let scratch = Scratch::new("empty");
    for profile in [Profile::State, Profile::Inputs, Profile::Compact] {
        let config = scratch.config(profile);
        write(&config, 0..0);
        let mut recording = Recording::open(&config.path).unwrap();
        assert!(recording.info().is_complete);
        assert_eq!(recording.info().episode, config.episode);
        assert_eq!((recording.segments(), recording.duration_nanos().unwrap()), (0, 0));
        assert_eq!(recording.world_before(recording.segment_at(0)), None);
    }
}

#[test]
fn any_segment_can_be_read_first() {
    let scratch = Scratch::new("seek");
    let config = scratch.config(Profile::State);
    write(&config, 0..400);
    for segment in [19, 3, 4, 12, 0, 12, 13] {
        let mut recording = Recording::open(&config.path).unwrap();
        for segment in [segment, segment / 2, segment] {
            let start = recording.start_nanos(segment);
            assert_eq!(recording.segment_at(start + 10), segment);
            check_same(
                &recording.recorded_frames(segment).unwrap()[0],
                &recorded_frame(start / 50_000_000),
            );
        }
    }
}

#[test]
fn a_file_that_was_cut_off_is_read_up_to_its_last_complete_segment() {
    let scratch = Scratch::new("cut");
    let config = scratch.config(Profile::State);
    write(&config, 0..200);
    let bytes = fs::read(&config.path).unwrap();
    let mut counts = Vec::new();
    for len in (0..bytes.len()).step_by(97) {
        fs::write(&config.path, &bytes[..len]).unwrap();
        let Ok(mut recording) = Recording::open(&config.path) else { continue };
        let mut count = 0;
        for segment in 0..recording.segments() {
            for read in recording.recorded_frames(segment).unwrap() {
                check_same(read, &recorded_frame(count));
                count += 1;
            }
        }
        counts.push(count);
    }
    assert!(counts.is_sorted() && counts.contains(&20) && counts.contains(&170), "{counts:?}");
}

#[test]
fn changed_bytes_are_an_error_or_change_nothing() {
    let scratch = Scratch::new("flip");
    let config = scratch.config(Profile::State);
    write(&config, 0..60);
    let bytes = fs::read(&config.path).unwrap();
    let mut refused = 0;
    for at in (0..bytes.len()).step_by(31) {
        let mut bad = bytes.clone();
        bad[at] ^= 1 << (at % 8);
        fs::write(&config.path, &bad).unwrap();
        let read = Recording::open(&config.path).and_then(|mut recording| {
            for segment in 0..recording.segments() {
                for (read, frame) in
                    recording.recorded_frames(segment)?.iter().zip(segment as u64 * 20..)
                {
                    check_same(read, &recorded_frame(frame));
                }
            }
            Ok(())
        });
        refused += u32::from(read.is_err());
    }
    assert!(refused > 20, "{refused}");
}

#[test]
fn other_files_are_refused_by_name() {
    let scratch = Scratch::new("strange");
    let path = scratch.0.join("strange.mcap");
    assert!(matches!(Recording::open(&path), Err(RecordError::File { .. })));
    let Err(why) = Recording::open(&scratch.0) else { panic!("a folder was taken") };
    assert!(why.to_string().contains("a folder"), "{why}");
    let mut noise = vec![0u8; 5000];
    noise.iter_mut().enumerate().for_each(|(i, b)| *b = ((i * i) >> 3) as u8);
    for bytes in [&b""[..], b"hello", &noise, mcap::MAGIC] {
        fs::write(&path, bytes).unwrap();
        let Err(e) = Recording::open(&path) else { panic!("it was taken") };
        assert!(matches!(e, RecordError::NotARecording { .. }), "{e}");
    }
}

#[test]
fn compact_poses_are_within_a_centimetre_and_a_tenth_of_a_degree() {
    let scratch = Scratch::new("compact");
    let config = scratch.config(Profile::Compact);
    write(&config, 0..200);
    let mut recording = Recording::open(&config.path).unwrap();
    let mut frame = 0;
    for segment in 0..recording.segments() {
        for read in recording.recorded_frames(segment).unwrap() {
            let expected = recorded_frame(frame);
            assert_eq!(read.state_hash, expected.state_hash);
            assert_eq!(read.limbs, expected.limbs);
            assert_eq!(read.actors.len(), expected.actors.len());
            for (read, expected) in read.actors.iter().zip(&expected.actors) {
                assert_eq!((read.actor_id, read.flags), (expected.actor_id, expected.flags));
                let off_m = read.pose.position().distance(expected.pose.position());
                let off_rad = read.pose.rotation().angle_between(expected.pose.rotation());
                assert!(off_m < 0.01 && off_rad.to_degrees() < 0.11, "{off_m} m, {off_rad} rad");
            }
            frame += 1;
        }
    }
    assert_eq!(frame, 200);
}

#[test]
fn a_frame_without_actors_has_a_hash_too() {
    assert_eq!(crate::recorded_frame::sum_of(&[]), crate::recorded_frame::sum_of(&Vec::new()));
    assert_ne!(
        crate::recorded_frame::sum_of(&[]),
        crate::recorded_frame::sum_of(&[ActorState::default()])
    );
}

#[test]
fn only_an_empty_file_or_a_recording_is_replaced() {
    let scratch = Scratch::new("replaced");
    let config = scratch.config(Profile::State);
    let log = [&[1, 0][..], crate::CARLA_LOG_MAGIC, b" and more"].concat();
    for content in [&b""[..], &log] {
        fs::write(&config.path, content).unwrap();
        Writer::create(&config).unwrap().finish().unwrap();
        // The recording of the first round is replaced, too.
        Writer::create(&config).unwrap().finish().unwrap();
        assert!(Recording::open(&config.path).unwrap().info().is_complete);
    }
    for content in [&b"# a file of the user\n"[..], b"\x89", &log[2..]] {
        fs::write(&config.path, content).unwrap();
        let Err(why) = Writer::create(&config).map(drop) else { panic!("{content:?}") };
        assert!(matches!(why, RecordError::NotReplaced { .. }), "{why}");
        assert_eq!(fs::read(&config.path).unwrap(), content);
    }
}
