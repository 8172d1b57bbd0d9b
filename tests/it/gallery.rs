//! Pictures of `omnibus gallery`.

use std::{fs, path::Path};

use crate::kit::{Scratch, omnibus, small_map};

/// Returns size, and mean of all bytes, of a picture in RGB.
fn read(path: &Path) -> ([u32; 2], f32) {
    let file = fs::File::open(path).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let found = reader.next_frame(&mut bytes).unwrap();
    let sum: u64 = bytes.iter().map(|byte| u64::from(*byte)).sum();
    ([found.width, found.height], sum as f32 / bytes.len() as f32)
}

#[test]
fn a_gallery_has_the_same_place_in_five_lights_and_overwrites_nothing() {
    let scratch = Scratch::new();
    let out = scratch.path().join("pictures");
    let gallery = || {
        omnibus()
            .args(["gallery", "--map", small_map(), "--device", "cpu", "--warmup", "5"])
            .args(["--width", "96", "--height", "64", "--out"])
            .arg(&out)
            .output()
            .unwrap()
    };
    let ended = gallery();
    let told = String::from_utf8([ended.stdout, ended.stderr].concat()).unwrap();
    assert!(ended.status.success(), "{told}");
    let written: Vec<&str> = told.lines().filter(|line| line.ends_with(".png")).collect();
    assert_eq!(written.len(), 5, "{told}");
    let means = ["day", "dusk", "night", "rain", "fog"].map(|light| {
        let ending = format!("-{light}.png");
        let path = written.iter().find(|path| path.ends_with(&ending)).expect(light);
        let (size, mean) = read(Path::new(path));
        assert_eq!(size, [96, 64]);
        mean
    });
    let [day, dusk, night, rain, fog] = means;
    assert!(night < 0.85 * day.min(dusk).min(rain).min(fog), "{means:?}");
    assert!(out.join("gallery.jpg").metadata().unwrap().len() > 1000);

    let again = gallery();
    let told = String::from_utf8(again.stderr).unwrap();
    assert!(!again.status.success() && told.contains("exists; name another folder"), "{told}");
}
