use super::*;

#[test]
fn the_same_plan_gives_the_same_text_and_another_seed_another() {
    let one = plan(&NAMED[0]);
    assert_eq!(generate(&one), generate(&one));
    assert_ne!(generate(&one), generate(&Plan { seed: one.seed + 1, ..one.clone() }));
}

#[test]
fn reference_lines_are_continuous() {
    for seed in 0..20 {
        let plan = Plan { seed, ..plan(&NAMED[0]) };
        let layout = layout::grid(&plan);
        for junction in junction::junctions(&layout) {
            for turn in &junction.turns {
                assert!(!turn.pieces.is_empty());
                for pair in turn.pieces.windows(2) {
                    let (end, start) = (pair[0].end(), pair[1].start);
                    assert!(end.position.distance(start.position) < 2e-3);
                    assert!(curve::wrapped(end.heading - start.heading).abs() < 1e-3);
                }
                let arm = &junction.arms[turn.to];
                let end = turn.pieces.last().unwrap().end();
                assert!(curve::wrapped(end.heading - arm.bearing).abs() < 1e-6);
                let kerb = turn.pieces.iter().map(|piece| piece.curvature.min(0.0)).sum::<f64>();
                assert!(kerb > -1.0 / 7.0, "seed {seed}: a right turn of {kerb} per metre");
            }
        }
    }
}
