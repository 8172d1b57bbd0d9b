//! Draws meshes of this room into a PNG, to be looked at while they are being shaped.
//!
//! `look fleet OUT.png` draws the catalogue as a contact sheet, `look blueprint ID OUT.png` one of
//! it from four sides, `look roads MAP OUT.png` the roads of a named town or of a file.

use std::fs::File;
use std::io::BufWriter;

use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Vec3, Vec4Swizzles, vec3};
use road::{Material, Mesh};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["fleet", out] => fleet(out),
        ["blueprint", id, out] => one(id, out),
        ["roads", map, out] => roads(map, out),
        _ => eprintln!("look fleet OUT.png | look blueprint ID OUT.png | look roads MAP OUT.png"),
    }
}

fn fleet(out: &str) {
    let all = town::catalogue();
    let (columns, cell) = (8, 240);
    let mut picture = Picture::new(columns * cell, all.len().div_ceil(columns) * cell);
    for (index, one) in all.iter().enumerate() {
        let corner = [(index % columns) * cell, (index / columns) * cell];
        let reach = one.half_extents_m.length() * 1.05;
        picture.draw(
            &one.mesh,
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
            &one.mesh,
            corner,
            [cell; 2],
            around(one.center_m, reach, *yaw, *pitch),
            one.default_color,
        );
    }
    picture.save(out);
}

fn network(map: &str) -> road::Network {
    let text = match map {
        "default" => town::default_map().1,
        _ => town::named(map).unwrap_or_else(|| std::fs::read_to_string(map).expect("a map")),
    };
    road::Network::parse(&text).expect("a valid map")
}

fn roads(map: &str, out: &str) {
    let mesh = road::surface_mesh(&network(map), 2.0);
    let (low, high) = mesh
        .positions
        .iter()
        .map(|p| Vec3::from_array(*p))
        .fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let side = 1800;
    let mut picture = Picture::new(side, side);
    let reach = (high - low).truncate().max_element() * 0.51;
    let camera = around((low + high) * 0.5, reach, 0.0, 90.0);
    picture.draw(&mesh, [0, 0], [side; 2], camera, [0; 3]);
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
            let clip = world.map(|p| clip_from_world * p.extend(1.0));
            if clip.iter().any(|p| p.w <= 0.05) {
                continue;
            }
            let pixel = clip.map(|p| {
                let p = p.xyz() / p.w;
                vec3((p.x + 1.0) * 0.5 * size[0] as f32, (1.0 - p.y) * 0.5 * size[1] as f32, p.z)
            });
            let normal = (world[1] - world[0]).cross(world[2] - world[0]).normalize_or_zero();
            let [a, b, c] = pixel;
            let area = (b - a).truncate().perp_dot((c - a).truncate());
            // A face seen from behind is drawn in magenta: it should not exist.
            let shade = 0.42 + 0.58 * normal.dot(sun).max(0.0);
            let base = if area > 0.0 {
                [255, 0, 255]
            } else {
                look(Material::from_code(face.material).unwrap(), paint)
            };
            let rgb = base.map(|channel| (f32::from(channel) * shade) as u8);
            self.fill(pixel, area, corner, size, rgb);
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
    }
}
