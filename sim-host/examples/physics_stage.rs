//! Physics alone at full speed: `physics_stage [cars] [frames]` prints microseconds per car and
//! substep, with frames of 50 ms in 5 substeps.

use omnibus_sim_host::physics::SyntheticLoad;

fn main() {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u32>());
    let mut next = |default: u32| arguments.next().and_then(Result::ok).unwrap_or(default);
    let (cars, frames) = (next(100), next(400));
    let mut stage = SyntheticLoad::new(cars);
    for _ in 0..100 {
        stage.frame(50_000_000, 10_000_000);
    }
    let mut micros: Vec<f64> = (0..frames)
        .map(|_| {
            let begin = bus::clock::now_nanos();
            stage.frame(50_000_000, 10_000_000);
            (bus::clock::now_nanos() - begin) as f64 / 1e3 / f64::from(cars) / 5.0
        })
        .collect();
    micros.sort_by(f64::total_cmp);
    let at = |share: f64| micros[((micros.len() - 1) as f64 * share) as usize];
    let hash = stage.physics().hash();
    println!(
        "{cars} cars: {:.3} us per car and substep (p10 {:.3}, p90 {:.3}, p99 {:.3}), hash {hash:016x}",
        at(0.5),
        at(0.1),
        at(0.9),
        at(0.99)
    );
}
