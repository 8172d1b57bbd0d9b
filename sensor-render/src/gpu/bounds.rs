//! Bounds that the shaders rely on.
//!
//! The shader module is compiled without bounds checks and without limits of loops (see
//! [`super::kernels`]), so every index that a shader computes must lie within its buffer, and every
//! traversal must end. What comes from outside of this crate (maps, meshes, sensor specs, a cached
//! scene, a world that was placed in another scene) is checked here, on the way to the device.

use mesh::Material;

use crate::{
    bvh::{DEPTH_MAX, Link, Node, TOP_DEPTH_MAX},
    gpu::batch::{Batch, GpuCamera, GpuLidar, NONE},
    lidar_echo::SUB_RAYS,
    scene::Scene,
    world::World,
};

/// Links on the stack of the shaders (`stack` in reference.wgsl).
const STACK: usize = 51;

const _: () = assert!(DEPTH_MAX + TOP_DEPTH_MAX <= STACK);
// `materials` and `reflectivities` of the shaders have 40 entries, `code` is at most 39.
const _: () = assert!(Material::ALL.len() == 40);

/// Checks the scene before it is uploaded: hierarchies end, are no deeper than the shaders' stack,
/// and name triangles and walls that exist.
pub(crate) fn check_scene(scene: &Scene) -> Result<(), String> {
    let primitives = scene.triangles.len();
    let roots = scene.blases.iter().chain([&scene.town_blas]).map(|blas| blas.root);
    check_hierarchy("scene", &scene.nodes, roots, primitives, DEPTH_MAX)?;
    let normals = scene.triangles.len() - (scene.smooth_from as usize).min(scene.triangles.len());
    if scene.smooth.len() != normals {
        return Err(format!(
            "the scene has normals for {} of the {normals} triangles of blueprints",
            scene.smooth.len()
        ));
    }
    let walls = scene.walls.len() as u32;
    match scene.triangles.iter().find(|triangle| triangle.wall >= walls) {
        Some(triangle) => {
            Err(format!("a triangle names wall {}, the scene has {walls}", triangle.wall))
        }
        None => Ok(()),
    }
}

/// Checks one frame's world: its top level, and that it was placed in `scene`.
pub(crate) fn check_world(scene: &Scene, world: &World) -> Result<(), String> {
    let instances = world.instances.len();
    check_hierarchy("world", &world.nodes, world.root, instances, TOP_DEPTH_MAX)?;
    for instance in &world.instances {
        let blas = scene.blases.get(instance.blas as usize);
        if blas.is_none_or(|blas| blas.root != instance.root) {
            return Err(format!(
                "actor {} was placed in another scene; place the world in the scene to measure",
                instance.id
            ));
        }
    }
    let overlay = &world.overlay;
    check_hierarchy(
        "overlay",
        &overlay.nodes,
        [overlay.root],
        overlay.capsules.len(),
        TOP_DEPTH_MAX,
    )
}

/// Checks that every link leads to a later node or to primitives that exist, and that no node lies
/// deeper than `depth_max`.
fn check_hierarchy(
    what: &str,
    nodes: &[Node],
    roots: impl IntoIterator<Item = Link>,
    primitives: usize,
    depth_max: usize,
) -> Result<(), String> {
    let mut depths = vec![0u8; nodes.len()];
    let reach = |link: Link, from: Option<usize>, depths: &mut [u8]| {
        if link.is_leaf() {
            let (first, count) = link.primitives();
            let end = first as usize + count as usize;
            if count > 0 && end > primitives {
                return Err(format!(
                    "the hierarchy of the {what} has a leaf of {count} primitives from {first} on, \
                     of {primitives}"
                ));
            }
            return Ok(());
        }
        let at = link.0 as usize;
        if at >= depths.len() || from.is_some_and(|from| at <= from) {
            return Err(format!(
                "the hierarchy of the {what} has a link to node {at} of {}",
                depths.len()
            ));
        }
        let depth = from.map_or(1, |from| depths[from].saturating_add(1));
        depths[at] = depths[at].max(depth);
        if usize::from(depths[at]) > depth_max {
            return Err(format!("the hierarchy of the {what} is deeper than {depth_max}"));
        }
        Ok(())
    };
    for root in roots {
        reach(root, None, &mut depths)?;
    }
    for (at, node) in nodes.iter().enumerate() {
        reach(node.child0, Some(at), &mut depths)?;
        reach(node.child1, Some(at), &mut depths)?;
    }
    Ok(())
}

/// Checks that every plane of a batch lies within the buffer that it is written to, the tags and the tables,
/// and that each of the overlay's texts has its place in the image of each camera. `words_of` gives the length
/// of an imported payload.
pub(crate) fn check_batch(
    batch: &Batch,
    texts: usize,
    words_of: impl Fn(u32) -> u64,
) -> Result<(), String> {
    let (places, cameras) = (batch.text_places.len(), batch.cameras.len());
    if places != cameras * texts {
        return Err(format!("there are {places} places of {texts} texts in {cameras} images"));
    }
    let (words, tags) = (batch.byte_len / 4, u64::from(batch.tag_len));
    let circles = batch.circles.len() as u64;
    let within = |what: &str, first: u32, count: u64, of: u64| {
        if first == NONE || u64::from(first) + count <= of {
            return Ok(());
        }
        Err(format!("{what} take {count} words from {first} on, of {of}"))
    };
    for camera in &batch.cameras {
        let GpuCamera { width, height, color, depth, instance, tag, first_tag, .. } = *camera;
        let GpuCamera { film, development, .. } = *camera;
        let pixels = u64::from(width) * u64::from(height);
        let words = if camera.payload == 0 { words } else { words_of(camera.payload) };
        within("colours", color, pixels, words)?;
        within("depths", depth, pixels, words)?;
        within("instances", instance, pixels, words)?;
        within("normals", camera.normal, pixels * 3, words)?;
        within("flows", camera.flow, pixels * 2, words)?;
        within("rainfalls", camera.rainfall, 1, batch.rainfalls.len() as u64)?;
        within("views", camera.view_before, 1, batch.views_before.len() as u64)?;
        if camera.has_surfaces() && camera.view_before == NONE {
            return Err("a camera with normals or optical flow has no view before".into());
        }
        if tag != NONE {
            within("packed tags", tag, pixels.div_ceil(64) * 16, words)?;
            within("tags", first_tag, pixels, tags)?;
        }
        if development != NONE {
            let Some(how) = batch.developments.get(development as usize) else {
                let count = batch.developments.len();
                return Err(format!("a camera names development {development} of {count}"));
            };
            if film == NONE {
                continue;
            }
            let [cells, coarse] = how.cells().map(|count| count as u64);
            let gathered = how.grid.map(|cells| u64::from(cells) * u64::from(how.side));
            let is_covered = gathered[0] >= width.into() && gathered[1] >= height.into();
            if !is_covered || color == NONE {
                return Err(format!(
                    "a film of {width} x {height} pixels has cells for {gathered:?}"
                ));
            }
            within("films", film, pixels + 1 + (cells + coarse) * 2, batch.film_len)?;
        }
    }
    for lidar in &batch.lidars {
        let GpuLidar { columns, channels, azimuths, elevations, span, elevation_count, .. } =
            *lidar;
        let beams = u64::from(columns) * u64::from(channels);
        within("azimuths", azimuths, beams.div_ceil(span.max(1).into()), circles)?;
        within("elevations", elevations, elevation_count.into(), circles)?;
        within("places", lidar.places, u64::from(columns) * 6, circles)?;
        if beams > 0 && (span == 0 || elevation_count == 0 || lidar.rays > SUB_RAYS as u32) {
            return Err(format!(
                "a lidar has {elevation_count} elevations, {span} beams per azimuth and {} rays per beam",
                lidar.rays
            ));
        }
        for (points, labels) in
            [(lidar.points, lidar.labels), (lidar.last_points, lidar.last_labels)]
        {
            within("points", points, beams * 4, words)?;
            within("labels", labels, beams * 2, words)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use mesh::{Face, Material, Mesh, Tag};
    use protocol::{ActorId, ActorState, Pose, Stamp, Weather};

    use super::*;
    use crate::scene::BlueprintMesh;

    fn mesh(quads: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for quad in 0..quads {
            let x = quad as f32;
            let corners = [[x, 0., 0.], [x + 1., 0., 0.], [x + 1., 1., 0.], [x, 1., 0.]];
            mesh.quad(corners, Face::new(Tag::Car, Material::CarPaint, 0));
        }
        mesh
    }

    fn scene(quads: u32) -> Scene {
        Scene::new(&mesh(quads), &[BlueprintMesh { mesh: &mesh(20) }]).unwrap()
    }

    fn world(scene: &Scene) -> World {
        let actors = [1, 2, 3].map(|id| ActorState {
            actor_id: ActorId(id),
            pose: Pose::IDENTITY,
            ..ActorState::default()
        });
        let mut world = World::new();
        world.place(scene, Stamp::default(), 0, &Weather::default(), &actors, |_| [0; 3]);
        world
    }

    #[test]
    fn a_world_is_measured_only_in_the_scene_that_it_was_placed_in() {
        let (own, other) = (scene(50), scene(70));
        assert_eq!(check_scene(&own), Ok(()));
        assert_eq!(check_world(&own, &world(&own)), Ok(()));
        let error = check_world(&other, &world(&own)).unwrap_err();
        assert!(error.contains("was placed in another scene"), "{error}");
    }

    #[test]
    fn a_hierarchy_that_does_not_end_or_leaves_its_buffers_is_refused() {
        let damaged = |damage: fn(&mut Scene)| {
            let mut scene = scene(50);
            damage(&mut scene);
            check_scene(&scene).unwrap_err()
        };
        let ring = damaged(|scene| scene.nodes[3].child0 = Link(2));
        assert!(ring.contains("a link to node 2 of"), "{ring}");
        let outside = damaged(|scene| scene.nodes[3].child0 = Link(9999));
        assert!(outside.contains("a link to node 9999 of"), "{outside}");
        let leaf = damaged(|scene| scene.nodes[3].child1 = Link::leaf(9999, 2));
        assert!(leaf.contains("2 primitives from 9999 on"), "{leaf}");
        let wall = damaged(|scene| scene.triangles[5].wall = 77);
        assert_eq!(wall, "a triangle names wall 77, the scene has 1");
        let deep = damaged(|scene| {
            let last = scene.nodes.len();
            scene.nodes[3].child0 = Link(last as u32);
            for at in last..last + DEPTH_MAX {
                let child0 = Link(at as u32 + 1);
                scene.nodes.push(Node { child0, child1: Link::EMPTY, ..scene.nodes[3] });
            }
        });
        assert!(deep.contains("is deeper than 33"), "{deep}");
    }

    #[test]
    fn a_plane_outside_of_the_output_is_refused() {
        use bytemuck::Zeroable;
        let camera = GpuCamera {
            width: 10,
            height: 10,
            color: 0,
            depth: NONE,
            instance: NONE,
            tag: NONE,
            normal: NONE,
            flow: NONE,
            rainfall: NONE,
            view_before: NONE,
            film: NONE,
            development: NONE,
            ..GpuCamera::zeroed()
        };
        let batch = |byte_len| Batch { cameras: vec![camera], byte_len, ..Batch::default() };
        let check = |batch: &Batch| check_batch(batch, 0, |payload| u64::from(payload) * 20);
        assert_eq!(check(&batch(400)), Ok(()));
        let error = check(&batch(396)).unwrap_err();
        assert_eq!(error, "colours take 100 words from 0 on, of 99");
        let imported = |payload| {
            let cameras = vec![GpuCamera { payload, ..camera }];
            check(&Batch { cameras, ..Batch::default() })
        };
        assert_eq!(imported(5), Ok(()));
        assert_eq!(imported(4).unwrap_err(), "colours take 100 words from 0 on, of 80");
        let lidar = GpuLidar {
            columns: 65_536,
            channels: 65_536,
            labels: NONE,
            last_points: NONE,
            last_labels: NONE,
            places: NONE,
            span: 65_536,
            elevation_count: 65_536,
            ..GpuLidar::zeroed()
        };
        let circles = vec![[0.0; 2]; 131_072];
        let batch = Batch { lidars: vec![lidar], circles, byte_len: 1 << 30, ..Batch::default() };
        assert!(check(&batch).unwrap_err().starts_with("points take 17179869184 words"));
    }
}
