//! Physics alone at full speed: `physics_stage [cars] [frames] [threads] [apart] [dormant]` prints
//! microseconds per car and substep, with frames of 50 ms in 5 substeps, and the processor time of
//! all threads. Cars `apart` metres apart drive in circles; `dormant` percent of them are dormant.

use omnibus_sim_host::physics::SyntheticLoad;
use rustix::time::{ClockId, clock_gettime};

fn main() {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u32>());
    let mut next = |default: u32| arguments.next().and_then(Result::ok).unwrap_or(default);
    let (cars, frames, threads) = (next(100), next(400), next(1));
    let (apart, dormant) = (next(16), next(0));
    let mut stage = SyntheticLoad::spaced(cars, apart as f32);
    stage.set_threads(threads as usize);
    for frame in 0..100 {
        stage.frame(50_000_000, 10_000_000);
        if frame == 20 {
            stage.make_dormant(cars * dormant / 100);
        }
    }
    let processor_micros = || {
        let time = clock_gettime(ClockId::ProcessCPUTime);
        time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 / 1e3
    };
    let per_substep = 1.0 / f64::from(cars) / 5.0;
    let before = processor_micros();
    let mut micros: Vec<f64> = (0..frames)
        .map(|_| {
            let begin = bus::clock::now_nanos();
            stage.frame(50_000_000, 10_000_000);
            (bus::clock::now_nanos() - begin) as f64 / 1e3 * per_substep
        })
        .collect();
    let processor = (processor_micros() - before) / f64::from(frames) * per_substep;
    micros.sort_by(f64::total_cmp);
    let at = |share: f64| micros[((micros.len() - 1) as f64 * share) as usize];
    let hash = stage.physics().hash();
    println!(
        "{cars} cars, {threads} threads: {:.3} us per car and substep (p10 {:.3}, p90 {:.3}, p99 {:.3}), processor {processor:.3} us, hash {hash:016x}",
        at(0.5),
        at(0.1),
        at(0.9),
        at(0.99)
    );
}
