//! Draws the meshes of this crate into PNG files, for a look while they are developed.
//!
//! `preview fleet OUT.png` draws a contact sheet of the catalogue, `preview blueprint ID OUT.png`
//! one blueprint from four sides, `preview roads MAP OUT.png` the roads of a named town or of a
//! file, `preview plan MAP OUT.png` the furnished town from above, `preview part MAP X Y REACH
//! OUT.png` a part of it from an oblique angle, `preview street MAP FIRST OUT.png` six streets from
//! the driver's position. `preview time MAP` measures loading, best of five.

use std::fs::File;
use std::io::BufWriter;
use std::time::Instant;

use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Vec3, Vec4, Vec4Swizzles, vec3};
use mesh::{Material, Mesh};
use omnibus_town as town;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["fleet", out] => fleet(out),
        ["blueprint", id, out] => one(id, out),
        ["roads", map, out] => from_above(&road::surface_mesh(&network(map), 2.0), out),
        ["plan", map, out] => from_above(&furnished(map).assembled_mesh(), out),
        ["part", map, x, y, reach, out] => {
            part(&furnished(map).assembled_mesh(), [x, y, reach], out)
        }
        ["street", map, lane, out] => street(map, lane, out),
        ["time", map] => time(map),
        _ => eprintln!("see the head of examples/preview.rs"),
    }
}

fn fleet(out: &str) {
    let prefix = std::env::var("PREFIX").unwrap_or_default();
    let all: Vec<_> = town::catalogue().iter().filter(|one| one.id.starts_with(&prefix)).collect();
    let (columns, cell) = (8, 240);
    let mut picture = Picture::new(columns * cell, all.len().div_ceil(columns) * cell);
    for (index, one) in all.iter().enumerate() {
        let corner = [(index % columns) * cell, (index / columns) * cell];
        let reach = one.half_extents_m.length() * 1.05;
        picture.draw(
            one.mesh(),
            corner,
            [cell; 2],
            around(one.center_m, reach, 35.0, 20.0),
            one.default_color,
        );
    }
    picture.save(out);
}

fn one(id: &str, out: &str) {
    let (_, one) = town::blueprint(id).expect("an id of the catalogue");
    let cell = 640;
    let mut picture = Picture::new(2 * cell, 2 * cell);
    let reach = one.half_extents_m.length() * 1.02;
    for (index, (yaw, pitch)) in
        [(0.0, 0.0), (90.0, 0.0), (40.0, 22.0), (215.0, 25.0)].iter().enumerate()
    {
        let corner = [(index % 2) * cell, (index / 2) * cell];
        picture.draw(
            one.mesh(),
            corner,
            [cell; 2],
            around(one.center_m, reach, *yaw, *pitch),
            one.default_color,
        );
    }
    picture.save(out);
}

fn network(map: &str) -> road::Network {
    road::Network::parse(&text(map)).expect("a valid map")
}

fn text(map: &str) -> String {
    match map {
        "default" => mapgen::default_map().1,
        _ => mapgen::named(map).unwrap_or_else(|| std::fs::read_to_string(map).expect("a map")),
    }
}

fn time(map: &str) {
    let mut best = [f32::INFINITY; 4];
    for _ in 0..5 {
        let mut clock = Instant::now();
        let mut stage = |index: usize| {
            best[index] = best[index].min(clock.elapsed().as_secs_f32() * 1e3);
            clock = Instant::now();
        };
        let text = text(map);
        stage(0);
        let network = road::Network::parse(&text).expect("a valid map");
        stage(1);
        let _roads = road::surface_mesh(&network, 4.0);
        stage(2);
        let town = town::furnish(&network, 1);
        stage(3);
        drop(town);
    }
    println!(
        "text {:.1} ms, parse {:.1} ms, surface mesh {:.1} ms, furnish (with its mesh) {:.1} ms",
        best[0], best[1], best[2], best[3]
    );
}

fn furnished(map: &str) -> town::Town {
    let network = network(map);
    let start = Instant::now();
    let town = match std::env::var("DETAIL") {
        Ok(high) if high == "high" => town::furnish_with(&network, 1, town::Detail::High),
        _ => town::furnish(&network, 1),
    };
    println!(
        "{} triangles, {} objects, {} colliders in {:.3} s",
        town.mesh.triangles.len(),
        town.objects.len(),
        town.colliders.len(),
        start.elapsed().as_secs_f32()
    );
    for tag in mesh::Tag::ALL {
        let triangles = town.mesh.faces.iter().filter(|face| face.tag == *tag as u8).count();
        let objects = town.objects.iter().filter(|object| object.tag == *tag).count();
        if triangles > 0 {
            println!("  {tag:?}: {triangles} triangles, {objects} objects");
        }
    }
    town
}

fn from_above(mesh: &Mesh, out: &str) {
    let near = |p: &[f32; 3]| p[2] < 500.0;
    let road = mesh.triangles.iter().zip(&mesh.faces).filter(|(_, face)| face.tag == 1);
    let points = road.flat_map(|(triangle, _)| triangle.map(|i| mesh.positions[i as usize]));
    let (low, high) = points
        .filter(near)
        .map(Vec3::from_array)
        .fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let side = 1800;
    let mut picture = Picture::new(side, side);
    let reach = (high - low).truncate().max_element() * 0.5 + 60.0;
    let camera = around((low + high) * 0.5, reach, 0.0, 90.0);
    picture.draw(mesh, [0, 0], [side; 2], camera, [160, 40, 40]);
    picture.save(out);
}

fn part(mesh: &Mesh, numbers: [&str; 3], out: &str) {
    let [x, y, reach] = numbers.map(|text| text.parse::<f32>().expect("a number of metres"));
    let side = 1600;
    let mut picture = Picture::new(side, side);
    let camera = around(vec3(x, y, 5.0), reach, -60.0, 40.0);
    picture.draw(mesh, [0, 0], [side; 2], camera, [160, 40, 40]);
    picture.save(out);
}

/// From the driver's position at the spawn points, from number `first` on.
fn street(map: &str, first: &str, out: &str) {
    let network = network(map);
    let mesh = furnished(map).assembled_mesh();
    let spawns = network.spawn_points();
    let first: usize = first.parse().expect("a number");
    let (width, height) = (900, 520);
    let mut picture = Picture::new(2 * width, 3 * height);
    for view in 0..6 {
        let at = network.place(spawns[(first + view * 17) % spawns.len()]);
        let eye = at.position.as_vec3() + Vec3::Z * 1.8;
        let ahead = vec3(at.heading_rad.cos() as f32, at.heading_rad.sin() as f32, 0.02);
        let camera = directx::perspective(1.0, width as f32 / height as f32, 0.3, 2500.0)
            * view::look_at_mat4(eye, eye + ahead, Vec3::Z);
        let corner = [view % 2 * width, view / 2 * height];
        picture.draw(&mesh, corner, [width, height], camera, [160, 40, 40]);
    }
    picture.save(out);
}

/// Parallel rays towards `target` from a bearing and a height in degrees.
fn around(target: Vec3, reach: f32, yaw_deg: f32, pitch_deg: f32) -> Mat4 {
    let (yaw, pitch) = (yaw_deg.to_radians(), pitch_deg.to_radians());
    let from = vec3(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin()) * reach * 3.0;
    let up = if pitch_deg > 89.0 { Vec3::Y } else { Vec3::Z };
    directx::orthographic(-reach, reach, -reach, reach, 0.0, reach * 6.0)
        * view::look_at_mat4(target + from, target, up)
}

struct Picture {
    width: usize,
    height: usize,
    color: Vec<u8>,
    depth: Vec<f32>,
}

impl Picture {
    fn new(width: usize, height: usize) -> Picture {
        Picture {
            width,
            height,
            color: [186, 205, 224].repeat(width * height),
            depth: vec![f32::INFINITY; width * height],
        }
    }

    fn draw(
        &mut self,
        mesh: &Mesh,
        corner: [usize; 2],
        size: [usize; 2],
        clip_from_world: Mat4,
        paint: [u8; 3],
    ) {
        let sun = vec3(0.45, 0.30, 0.84);
        for (triangle, face) in mesh.triangles.iter().zip(&mesh.faces) {
            let world = triangle.map(|i| Vec3::from_array(mesh.positions[i as usize]));
            let clip = before_the_eye(world.map(|p| clip_from_world * p.extend(1.0)));
            let normal = (world[1] - world[0]).cross(world[2] - world[0]).normalize_or_zero();
            for index in 2..clip.len() {
                let pixel = [clip[0], clip[index - 1], clip[index]].map(|p| {
                    let p = p.xyz() / p.w;
                    let (x, y) = ((p.x + 1.0) * 0.5, (1.0 - p.y) * 0.5);
                    vec3(x * size[0] as f32, y * size[1] as f32, p.z)
                });
                let [a, b, c] = pixel;
                let area = (b - a).truncate().perp_dot((c - a).truncate());
                // A face seen from behind is drawn in magenta: closed meshes have none.
                let shade = 0.42 + 0.58 * normal.dot(sun).max(0.0);
                let base = if area > 0.0 {
                    [255, 0, 255]
                } else if face.tint != 0 {
                    let t = u32::from(face.tint);
                    [(t >> 11) * 255 / 31, (t >> 5 & 63) * 255 / 63, (t & 31) * 255 / 31]
                        .map(|c| c as u8)
                } else {
                    look(Material::from_code(face.material).unwrap(), paint)
                };
                let rgb = base.map(|channel| (f32::from(channel) * shade) as u8);
                self.fill(pixel, area, corner, size, rgb);
            }
        }
    }

    fn fill(
        &mut self,
        [a, b, c]: [Vec3; 3],
        area: f32,
        corner: [usize; 2],
        size: [usize; 2],
        rgb: [u8; 3],
    ) {
        if area == 0.0 {
            return;
        }
        let low = a.min(b).min(c).max(Vec3::ZERO);
        let high = a.max(b).max(c);
        for y in low.y as usize..(high.y.max(0.0) as usize + 1).min(size[1]) {
            for x in low.x as usize..(high.x.max(0.0) as usize + 1).min(size[0]) {
                let p = glam::vec2(x as f32 + 0.5, y as f32 + 0.5);
                let [u, v, w] = [(b, c), (c, a), (a, b)]
                    .map(|(from, to)| (to - from).truncate().perp_dot(p - from.truncate()) / area);
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                let depth = a.z * u + b.z * v + c.z * w;
                let at = (corner[1] + y) * self.width + corner[0] + x;
                if (0.0..1.0).contains(&depth) && depth < self.depth[at] {
                    self.depth[at] = depth;
                    self.color[at * 3..at * 3 + 3].copy_from_slice(&rgb);
                }
            }
        }
    }

    fn save(&self, path: &str) {
        let file = BufWriter::new(File::create(path).expect("a path that can be written"));
        let mut encoder = png::Encoder::new(file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&self.color).unwrap();
    }
}

/// The part of a triangle in front of the near plane.
fn before_the_eye(corners: [Vec4; 3]) -> Vec<Vec4> {
    let mut kept = Vec::with_capacity(4);
    for index in 0..3 {
        let (here, next) = (corners[index], corners[(index + 1) % 3]);
        if here.z > 0.0 {
            kept.push(here);
        }
        if (here.z > 0.0) != (next.z > 0.0) {
            kept.push(here + (next - here) * (here.z / (here.z - next.z)));
        }
    }
    kept
}

fn look(material: Material, paint: [u8; 3]) -> [u8; 3] {
    use Material::*;
    match material {
        Asphalt => [70, 71, 74],
        PaintWhite => [235, 235, 232],
        PaintYellow => [226, 178, 44],
        Paving => [165, 160, 152],
        Kerb => [188, 185, 178],
        Grass => [98, 132, 62],
        Soil => [122, 98, 70],
        Concrete => [160, 158, 152],
        FacadeBrick => [150, 84, 66],
        FacadePlaster => [214, 200, 172],
        FacadeGlass => [98, 130, 152],
        FacadeConcrete => [172, 168, 160],
        RoofFlat => [112, 110, 108],
        RoofTiles => [140, 66, 46],
        Bark => [84, 64, 46],
        Leaves => [66, 110, 46],
        Needles => [40, 82, 50],
        Metal => [140, 144, 148],
        Glass => [44, 56, 66],
        CarPaint => paint,
        Rubber => [30, 30, 31],
        Plastic => [48, 49, 52],
        LampWhite => [250, 248, 230],
        LampRed => [190, 20, 22],
        LampAmber => [236, 134, 20],
        SignalRed => [255, 40, 30],
        SignalYellow => [255, 200, 40],
        SignalGreen => [50, 230, 110],
        Sign => [240, 240, 240],
        Wood => [134, 98, 62],
        Skin => [206, 158, 130],
        Cloth => [56, 66, 96],
        Water => [60, 110, 140],
        IndicatorLeft | IndicatorRight => [236, 134, 20],
        LampReverse | LampFog | LampInterior | LampHigh => [240, 240, 236],
        Beacon => [40, 70, 220],
    }
}
