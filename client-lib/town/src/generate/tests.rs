use road::{LaneIndex, LaneTypes, Network};

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

fn plans() -> impl Iterator<Item = Plan> {
    let sizes = [250.0, 400.0, 640.0];
    (0..12).map(move |seed| Plan { seed, size_m: sizes[seed as usize % 3], ..plan(&NAMED[0]) })
}

#[test]
fn generated_towns_parse_without_a_finding() {
    let named = NAMED.iter().map(plan);
    for plan in plans().chain(named) {
        let network = Network::parse(&generate(&plan)).unwrap();
        assert_eq!(network.findings(), [], "{plan:?}");
        assert!(network.signals().iter().any(|signal| signal.dynamic));
        for signal in network.signals().iter().filter(|signal| signal.dynamic) {
            assert!(!signal.lanes.is_empty(), "{plan:?}: signal {} rules no lane", signal.id);
            assert!(signal.controller.is_some(), "{plan:?}: signal {}", signal.id);
        }
    }
}

/// Which lanes can be reached from the first one, changing lanes where that is allowed.
fn reached(network: &Network, start: LaneIndex, back: bool) -> Vec<bool> {
    let mut seen = vec![false; network.lanes().len()];
    let mut open = vec![start];
    seen[start.0 as usize] = true;
    while let Some(index) = open.pop() {
        let lane = network.lane(index);
        let next = if back { &lane.predecessors } else { &lane.successors };
        let sides =
            [lane.left.filter(|_| lane.left_change), lane.right.filter(|_| lane.right_change)];
        for other in next.iter().copied().chain(sides.into_iter().flatten()) {
            if !std::mem::replace(&mut seen[other.0 as usize], true) {
                open.push(other);
            }
        }
    }
    seen
}

#[test]
fn every_driving_lane_reaches_every_other() {
    for plan in plans() {
        let network = Network::parse(&generate(&plan)).unwrap();
        let driving: Vec<_> =
            network.lanes().iter().filter(|lane| LaneTypes::DRIVING.contains(lane.kind)).collect();
        let (ahead, back) =
            (reached(&network, driving[0].index, false), reached(&network, driving[0].index, true));
        for lane in driving {
            assert!(!lane.successors.is_empty() && !lane.predecessors.is_empty(), "{lane:?}");
            let index = lane.index.0 as usize;
            assert!(ahead[index] && back[index], "{plan:?}: {lane:?}");
        }
    }
}

/// A lane begins where the lanes before it end: within a centimetre and half a degree.
#[test]
fn lanes_meet_without_a_step() {
    for plan in plans() {
        let network = Network::parse(&generate(&plan)).unwrap();
        for lane in network.lanes() {
            let end = network.place_at(lane.index, lane.length_m, 0.0);
            for next in &lane.successors {
                let start = network.place_at(*next, 0.0, 0.0);
                let gap = end.position.distance(start.position);
                assert!(gap < 0.01, "{plan:?}: {gap} m after {lane:?}");
                let turn = curve::wrapped(end.heading_rad - start.heading_rad).abs();
                assert!(turn < 0.01 || !LaneTypes::DRIVING.contains(lane.kind), "{turn} {lane:?}");
            }
        }
    }
}
