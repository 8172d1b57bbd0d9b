//! Whether the frames of a data set are those in which its sensors measure.

use crate::collect::format::{FrameLine, Metadata};

/// Returns where frames or times do not follow from the time step and the periods of the sensors: the
/// frame, and what is wrong.
///
/// A sensor measures in each frame within which its period has elapsed once more, so that its measurements
/// are a period apart, give or take less than a frame, however many there are.
pub(crate) fn faults(metadata: &Metadata, lines: &[FrameLine]) -> Vec<(u64, String)> {
    let mut faults = Vec::new();
    let settings = &metadata.settings;
    let delta_nanos = i128::from(settings.fixed_delta_nanos);
    for pair in lines.windows(2) {
        let [before, after] = [&pair[0], &pair[1]];
        let frames = i128::from(after.frame) - i128::from(before.frame);
        if frames < 1 || nanos(after) - nanos(before) != frames * delta_nanos {
            let [before_nanos, after_nanos] = [before, after].map(|line| line.sim_time_nanos);
            let why = format!(
                "frame {} at {after_nanos} ns follows frame {} at {before_nanos} ns in frames.jsonl",
                after.frame, before.frame
            );
            faults.push((after.frame, why));
        }
    }
    let (Some(first), Some(last)) = (lines.first(), lines.last()) else { return faults };
    if let Some(idle) = lines.iter().find(|line| line.sensors.is_empty()) {
        faults.push((idle.frame, format!("frame {} in frames.jsonl has no sensor", idle.frame)));
    }
    let written = settings.sensors.iter().filter(|sensor| {
        metadata.outputs.iter().any(|output| output.folder.split('/').next() == Some(&sensor.name))
    });
    for sensor in written {
        // Data sets of older builds have one period for all sensors.
        let every_nanos = settings.every_frames * settings.fixed_delta_nanos;
        let period_nanos = i128::from(sensor.period_nanos.unwrap_or(every_nanos));
        let name = &sensor.name;
        // The measurement from which periods are counted, and how many have elapsed since.
        let mut start: Option<(&FrameLine, i128)> = None;
        let mut before = first;
        for line in lines.iter().filter(|line| line.measures(name)) {
            let elapsed = start.map_or(period_nanos, |(start, _)| nanos(line) - nanos(start));
            let expected = start.map_or(period_nanos, |(_, count)| (count + 1) * period_nanos);
            let is_late =
                start.is_none() && nanos(line) - nanos(first) >= period_nanos + delta_nanos;
            if is_late || (elapsed - expected).abs() >= delta_nanos {
                let why = format!(
                    "{name} measures in frame {} after frame {} in frames.jsonl, its period is \
                     {period_nanos} ns",
                    line.frame, before.frame
                );
                faults.push((line.frame, why));
                start = None;
            }
            start = Some(start.map_or((line, 0), |(start, count)| (start, count + 1)));
            before = line;
        }
        if nanos(last) - nanos(before) >= period_nanos + delta_nanos {
            let why =
                format!("{name} does not measure after frame {} in frames.jsonl", before.frame);
            faults.push((last.frame, why));
        }
    }
    faults
}

fn nanos(line: &FrameLine) -> i128 {
    line.sim_time_nanos.into()
}

#[cfg(test)]
mod tests {
    use protocol::{BundleReceipt, SnapshotHeader, Stamp};

    use super::*;
    use crate::collect::{
        format::{SensorPose, SpawnedActors},
        metadata,
        sensors::default_sensors,
        testing::{line, settings},
    };

    const DELTA_NANOS: u64 = 50_000_000;

    /// A data set of a camera and a lidar with these rates, as the renderer measures them.
    fn data_set(rates_hz: [f64; 2]) -> (Metadata, Vec<FrameLine>) {
        let mut sensors = default_sensors(800, 600);
        let mut settings = settings();
        for (index, rate_hz) in rates_hz.into_iter().enumerate() {
            sensors[index].period_nanos = (1e9 / rate_hz).round() as u64;
            settings.sensors[index].period_nanos = Some(sensors[index].period_nanos);
        }
        let planned: Vec<_> = sensors.iter().map(|spec| (*spec).into()).collect();
        let metadata = metadata::of(settings, SpawnedActors::default(), &planned, 200);
        let receipt = BundleReceipt::new(3 * DELTA_NANOS, DELTA_NANOS);
        let lines = (44..244).filter_map(|frame| {
            let mut line = line(frame);
            let stamp = Stamp { sim_time_nanos: line.sim_time_nanos, ..Stamp::default() };
            let header = SnapshotHeader { stamp, delta_nanos: DELTA_NANOS, ..Default::default() };
            let due = sensors.iter().filter(|spec| receipt.is_due(spec, &header));
            line.sensors = due
                .map(|spec| SensorPose {
                    name: spec.name.to_string(),
                    world_from_sensor: (&spec.parent_from_sensor).into(),
                })
                .collect();
            (!line.sensors.is_empty()).then_some(line)
        });
        (metadata, lines.collect())
    }

    #[test]
    fn frames_that_the_renderer_measures_at_any_rate_are_without_fault() {
        for rates in [[20.0, 20.0], [12.0, 20.0], [13.0, 2.0], [10.0, 7.0], [0.3, 19.9]] {
            let (metadata, lines) = data_set(rates);
            assert_eq!(faults(&metadata, &lines), [], "{rates:?}");
        }
    }

    #[test]
    fn a_measurement_that_is_missing_additional_or_late_is_found() {
        let (metadata, sound) = data_set([12.0, 20.0]);
        let found = |change: &dyn Fn(&mut Vec<FrameLine>)| {
            let mut lines = sound.clone();
            change(&mut lines);
            faults(&metadata, &lines)
        };
        let of_camera = |lines: &[FrameLine]| -> Vec<usize> {
            (0..lines.len()).filter(|at| lines[*at].measures("front")).collect()
        };
        let measured = of_camera(&sound);
        let told = found(&|lines| drop(lines[measured[9]].sensors.remove(0)));
        let frame = sound[measured[10]].frame;
        assert!(
            matches!(&told[..], [(at, why)] if *at == frame && why.contains("front")),
            "{told:?}"
        );
        let told = found(&|lines| {
            let pose = lines[measured[0]].sensors[0].clone();
            let mut later = lines.iter_mut().skip(measured[3]);
            let idle = later.find(|line| !line.measures("front")).unwrap();
            idle.sensors.insert(0, pose);
        });
        assert!(!told.is_empty());
        let told = found(&|lines| {
            lines.iter_mut().for_each(|line| line.sensors.retain(|pose| pose.name != "front"));
        });
        assert!(
            matches!(&told[..], [(_, why)] if why.contains("does not measure after")),
            "{told:?}"
        );
        let told = found(&|lines| drop(lines.remove(measured[5])));
        assert!(told.iter().any(|(_, why)| why.contains("lidar measures in frame")), "{told:?}");
        let told = found(&|lines| lines[7].sim_time_nanos += 1);
        assert!(told.iter().any(|(_, why)| why.contains("follows frame")), "{told:?}");
    }
}
