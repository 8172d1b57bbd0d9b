//! Windows of vehicles are clear, at every quality but the lowest.

use glam::Vec3;
use mesh::{Face, Material, Mesh, Tag};
use protocol::{Pose, SensorSpec, output, quality};

use super::lens::tracers;
use super::{MeasuredBundle, actor, block, camera, world_with};
use crate::{BlueprintMesh, Scene, Tracer};

/// Returns a bright wall, and a vehicle of one pane in front of it, or of two, with or without an
/// opaque block between them.
fn scene(panes: usize, has_block: bool, tag: Tag) -> Scene {
    let mut mesh = Mesh::default();
    let floor = Face::new(Tag::Roads, Material::Asphalt, 0);
    mesh.quad([[-50., -50., 0.], [50., -50., 0.], [50., 50., 0.], [-50., 50., 0.]], floor);
    let wall =
        Face { tint: Face::tint([230, 40, 40]), ..Face::new(Tag::Wall, Material::Concrete, 3) };
    block(&mut mesh, [20., -30., 0.], [21., 30., 30.], wall);
    let mut vehicle = Mesh::default();
    let pane = Face::new(tag, Material::Glass, 0);
    for x in [0.0, 1.0].into_iter().take(panes) {
        vehicle.quad([[x, 2., 0.], [x, -2., 0.], [x, -2., 3.], [x, 2., 3.]], pane);
    }
    if has_block {
        let seat = Face { tint: Face::tint([40, 40, 230]), ..Face::new(tag, Material::Cloth, 0) };
        block(&mut vehicle, [0.3, -1.5, 0.2], [0.7, 1.5, 2.5], seat);
    }
    Scene::new(&mesh, &[BlueprintMesh { mesh: &vehicle }]).unwrap()
}

/// Returns the colour in the middle of the image, and the id there.
fn middle(tracer: &mut Tracer, scene: &Scene, level: u32) -> ([u8; 4], u32) {
    let mut world = world_with(scene, &[actor(9, Pose::level(Vec3::new(6., 0., 0.), 0.))]);
    // The wall faces the sun.
    world.weather.sun_azimuth_rad = std::f32::consts::PI;
    let outputs = output::COLOR | output::INSTANCE;
    let spec = SensorSpec { quality: level, outputs, ..camera(64, 64) };
    let bundle = MeasuredBundle::measure(tracer, scene, &world, &[spec]);
    let at = 30 * 64 + 32;
    let color = bundle.plane::<[u8; 4]>(0, output::COLOR)[at];
    (color, bundle.plane::<u32>(0, output::INSTANCE)[at])
}

#[test]
fn what_is_behind_the_windows_of_a_vehicle_is_seen() {
    for mut tracer in tracers() {
        let mut shown = |panes: usize, has_block: bool, tag: Tag, level: u32| {
            middle(&mut tracer, &scene(panes, has_block, tag), level)
        };
        let (open, none) = shown(0, false, Tag::Car, quality::STANDARD);
        let (through_one, id) = shown(1, false, Tag::Car, quality::STANDARD);
        let (through_two, _) = shown(2, false, Tag::Car, quality::STANDARD);
        assert_eq!((none, id), (0x8000_0003, 9), "geometry is that of the pane");
        // Each pane takes away a part of the light, and not the colour.
        assert!(open[0] > through_one[0] && through_one[0] > through_two[0] + 8);
        assert!(through_two[0] > through_two[2] + 40, "{through_two:?}");
        let (seat, _) = shown(2, true, Tag::Car, quality::STANDARD);
        assert!(seat[2] > seat[0], "{seat:?}");
        // The roof keeps the sun from what is inside.
        assert!(u32::from(seat[2]) * 5 < u32::from(open[0]) * 3, "{seat:?} {open:?}");
        // Windows of buildings, and those of the lowest quality, hide what is behind them.
        for (tag, level) in [(Tag::Building, quality::STANDARD), (Tag::Car, quality::LOW)] {
            let (empty, _) = shown(1, false, tag, level);
            assert!(i32::from(empty[0]) < i32::from(empty[2]) + 20, "{empty:?}");
            assert_eq!(shown(1, true, tag, level).0, empty);
        }
    }
}
