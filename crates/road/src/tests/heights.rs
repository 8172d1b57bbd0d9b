//! Lane centres against the surface that vehicles drive on.

use glam::DVec3;

use super::{made, shared_maps, small, surface::Caster};
use crate::{LanePoint, LaneTypes, Network, surface_mesh};

/// How far apart lane centres are compared with the surface, metres.
const EVERY_M: f64 = 0.25;
/// Where a junction's roads contradict each other, cells of 0.9 m follow the common height no more
/// closely than this, metres.
const NEAR_M: f64 = 0.05;

/// Two roads that cross in the plan view; the second one's elevation rises by 0.4 m at the
/// crossing.
fn contradiction() -> String {
    let road = |id: u32, geometry: &str, elevation: &str| {
        let lane = |id: i32| {
            format!(
                r#"<lane id="{id}" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>"#
            )
        };
        format!(
            r#"<road id="{id}" name="" length="24" junction="9"><planView><geometry s="0" length="24" {geometry}><line/></geometry></planView><elevationProfile>{elevation}</elevationProfile><lanes><laneSection s="0"><left>{}</left><center><lane id="0" type="none"/></center><right>{}</right></laneSection></lanes></road>"#,
            lane(1),
            lane(-1),
        )
    };
    format!(
        r#"<OpenDRIVE><header revMajor="1" revMinor="4"/>{}{}<junction id="9" name=""/></OpenDRIVE>"#,
        road(1, r#"x="-12" y="0" hdg="0""#, r#"<elevation s="0" a="0" b="0" c="0" d="0"/>"#),
        road(
            2,
            r#"x="0" y="-12" hdg="1.5707963267948966""#,
            r#"<elevation s="0" a="0" b="0" c="0.008333333" d="-0.000462963"/><elevation s="12" a="0.4" b="0" c="-0.008333333" d="0.000462963"/>"#,
        ),
    )
}

#[test]
fn every_driving_lane_s_centre_lies_on_the_drive_surface() {
    let mut maps = made::maps();
    maps.push(("small".to_string(), small::text(small::JOINED)));
    maps.push(("contradiction".to_string(), contradiction()));
    maps.extend(shared_maps());
    let mut failed = Vec::new();
    for (name, text) in maps {
        let network = Network::parse(&text).expect("a valid map");
        let mesh = surface_mesh(&network, 5.0);
        let caster = Caster::new(&mesh);
        let (mut points, mut off, mut worst) = (0, 0, (0.0, String::new()));
        for lane in network.lanes().iter().filter(|lane| LaneTypes::DRIVABLE.contains(lane.kind)) {
            let steps = (lane.length_m / EVERY_M).ceil().max(1.0) as usize;
            for step in 0..=steps {
                let at = LanePoint {
                    lane: lane.index,
                    along_m: lane.length_m * step as f64 / steps as f64,
                };
                if network.width(at) < 0.3 {
                    continue;
                }
                let centre = network.place(at).position;
                // At seams a vertical ray may pass between two triangles.
                let Some((z, _)) = caster.below(centre + DVec3::Z, 3.0) else { continue };
                points += 1;
                let apart_m = z - centre.z;
                off += usize::from(apart_m.abs() > NEAR_M);
                if apart_m.abs() > worst.0 {
                    let (road, _, id, s) = network.road_space(at);
                    let id = format!("{apart_m:+.3} m at road {} lane {id} s {s:.2}", road.id);
                    worst = (apart_m.abs(), id);
                }
            }
        }
        println!("{name}: {points} points, {off} off the surface; worst {}", worst.1);
        assert!(points > 0, "{name} has no driving lane with a surface");
        if off > 0 {
            failed.push(format!("{name}: {off} points, worst {}", worst.1));
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn a_contradicted_centre_line_keeps_its_ends_and_its_plan_view() {
    let network = Network::parse(&contradiction()).expect("a valid map");
    let lane = network.find_lane("2", 0, -1).expect("lane -1 of road 2");
    let centre = |along_m: f64| network.place_at(lane, along_m, 0.0).position;
    for (along_m, y) in [(0.0, -12.0), (6.0, -6.0), (12.0, 0.0), (24.0, 12.0)] {
        assert!(centre(along_m).truncate().distance(glam::DVec2::new(1.75, y)) < 1e-9);
    }
    assert!(centre(0.0).z.abs() < 1e-6 && centre(24.0).z.abs() < 1e-6);
    // Between the two roads' heights where they cross.
    assert!((0.05..0.35).contains(&centre(12.0).z), "{}", centre(12.0).z);
    let copy = network.clone();
    assert_eq!(copy, Network::parse(&contradiction()).expect("a valid map"));
}
