//! `export`: containers of `omnibus export` beside plain writing of the same bytes, and the encoders
//! of images.

use std::{
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use anyhow::{Context, ensure};
use image_file::{FULL_COLOR_QUALITY, Filter, Pixels, Samples};

use crate::{
    Effort,
    figure::{Figure, Peer, Sink, Spread, Unit, median},
    machine::Machine,
    scene::Scratch,
    sim,
};

const ROUNDS: usize = 7;
const FRAMES: usize = 200;
/// The qualities of JPEG files: with colour in half the resolution, and in that of the image.
const JPEG: [(&str, u8); 2] = [("export.jpeg", 90), ("export.jpeg.full_color", FULL_COLOR_QUALITY)];
/// Bytes of one call of `write`.
const PIECE: usize = 1 << 20;

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let home = Scratch::new()?;
    let set = home.path().join("set");
    let frames = effort.count(FRAMES);
    collect(&set, frames)?;
    for (format, name) in [
        ("webdataset", "export.webdataset"),
        ("mcap", "export.mcap"),
        ("lerobot", "export.lerobot"),
    ] {
        container(format, name, &set, frames, effort, sink)?;
    }
    encoders(&set, effort, sink)
}

fn collect(set: &Path, frames: usize) -> anyhow::Result<()> {
    let output = Command::new(sim::omnibus()?)
        .args(["collect", "--name", &sim::unique_name(), "--vehicles", "50"])
        .args(["--frames", &frames.to_string(), "--every", "5", "--out"])
        .arg(set)
        .output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "omnibus collect: {}", said.trim());
    Ok(())
}

/// Measures the time for which an export writes its containers, without the reading and conversion
/// that go on beside it, and in turn plain writing of files of the same sizes from memory.
fn container(
    format: &str,
    name: &'static str,
    set: &Path,
    frames: usize,
    effort: Effort,
    sink: &mut Sink,
) -> anyhow::Result<()> {
    let out = set.with_file_name("out");
    let peer = set.with_file_name("peer");
    let (mut rates, mut peers) = (Vec::new(), Vec::new());
    let mut megabytes = 0.0;
    for _ in 0..=effort.rounds(ROUNDS) {
        let output = Command::new(sim::omnibus()?)
            .env("OMNIBUS_LOG", "debug")
            .arg("export")
            .arg(set)
            .args(["--format", format, "--shard-samples", "50", "--out"])
            .arg(&out)
            .output()?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "omnibus export: {}", said.trim());
        let line = said.lines().rev().find_map(|line| line.split_once("written for "));
        let nanos = line.and_then(|(_, time)| time.strip_suffix(" ns")?.parse::<f64>().ok());
        let taken = nanos.context("omnibus export logs no time of writing")? / 1e9;
        let sizes = sizes(&out)?;
        megabytes = sizes.iter().sum::<u64>() as f64 / 1e6;
        rates.push(megabytes / taken);
        fs::remove_dir_all(&out)?;
        peers.push(megabytes / write_plainly(&peer, &sizes)?);
        fs::remove_dir_all(&peer)?;
    }
    // The first round fills the cache of the file system.
    let rates = &rates[1..];
    let value = median(rates);
    let slowest = rates.iter().copied().fold(f64::INFINITY, f64::min);
    let figure = Figure {
        name,
        workload: format!(
            "the containers of omnibus export --format {format}: {frames} frames of collect.default, \
             {megabytes:.0} MB, to the file system of the temporary folder"
        ),
        unit: Unit::PerSecond("MB"),
        value,
        spread: Spread { p50: value, p90: slowest, p99: slowest, n: rates.len() },
        peer: Some(Peer { name: "write of the same bytes", value: median(&peers[1..]) }),
    };
    sink.put(&figure, &Machine::look())
}

/// Returns the sizes of the files below a folder.
fn sizes(folder: &Path) -> anyhow::Result<Vec<u64>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let data = entry.metadata()?;
        if data.is_dir() { found.extend(sizes(&entry.path())?) } else { found.push(data.len()) }
    }
    Ok(found)
}

/// Writes files of these sizes with one thread, and returns the seconds.
fn write_plainly(folder: &Path, sizes: &[u64]) -> anyhow::Result<f64> {
    let piece = vec![0x5a; PIECE];
    fs::create_dir(folder)?;
    let begin = Instant::now();
    for (number, size) in sizes.iter().enumerate() {
        let mut file = File::create(folder.join(number.to_string()))?;
        let mut left = *size as usize;
        while left > 0 {
            let part = left.min(PIECE);
            file.write_all(&piece[..part])?;
            left -= part;
        }
    }
    Ok(begin.elapsed().as_secs_f64())
}

/// An image in memory: 8-bit RGB.
struct Picture {
    size: [u32; 2],
    rgb: Vec<u8>,
}

/// An encoder that replaces the content of a file.
type Encode<'a> = &'a dyn Fn(&Picture, &mut Vec<u8>) -> anyhow::Result<()>;

/// Measures the encoders of images that `omnibus collect` and `omnibus export` use, on one thread: PNG
/// beside a general encoder, and JPEG beside PNG.
fn encoders(set: &Path, effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let pictures = pictures(&set.join("front/color"), effort.count(20))?;
    let mut measure = |name, what: &str, encode: Encode, peer, other: Encode| {
        let figure = encoder(name, what, encode, (peer, other), &pictures, effort)?;
        sink.put(&figure, &Machine::look())
    };
    measure("export.png", "PNG", &as_png, "the package png, fast", &as_general_png)?;
    for (name, quality) in JPEG {
        let what = format!("quality {quality}");
        let encode = |picture: &Picture, file: &mut Vec<u8>| {
            Ok(image_file::jpeg(picture.size, Pixels::Rgb(&picture.rgb), quality, file)?)
        };
        measure(name, &what, &encode, "PNG", &as_png)?;
    }
    Ok(())
}

fn encoder(
    name: &'static str,
    what: &str,
    encode: Encode,
    peer: (&'static str, Encode),
    pictures: &[Picture],
    effort: Effort,
) -> anyhow::Result<Figure> {
    let mut file = Vec::new();
    let (mut rates, mut sizes) = ([Vec::new(), Vec::new()], [0; 2]);
    for _ in 0..effort.rounds(ROUNDS) {
        for (index, encode) in [encode, peer.1].into_iter().enumerate() {
            let begin = Instant::now();
            sizes[index] = 0;
            for picture in pictures {
                file.clear();
                encode(picture, &mut file)?;
                sizes[index] += file.len() / pictures.len();
            }
            rates[index].push(pictures.len() as f64 / begin.elapsed().as_secs_f64());
        }
    }
    let [rates, peers] = rates;
    let value = median(&rates);
    let slowest = rates.iter().copied().fold(f64::INFINITY, f64::min);
    let [width, height] = pictures[0].size;
    Ok(Figure {
        name,
        workload: format!(
            "{width}x{height}, {what}, one thread: {} KB a file; {}: {} KB",
            sizes[0] / 1000,
            peer.0,
            sizes[1] / 1000
        ),
        unit: Unit::PerSecond("frames"),
        value,
        spread: Spread { p50: value, p90: slowest, p99: slowest, n: rates.len() },
        peer: Some(Peer { name: peer.0, value: median(&peers) }),
    })
}

fn pictures(folder: &Path, count: usize) -> anyhow::Result<Vec<Picture>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let read = |path: &PathBuf| {
        let mut reader =
            png::Decoder::new(std::io::BufReader::new(File::open(path)?)).read_info()?;
        let mut rgb = vec![0; reader.output_buffer_size().unwrap_or(0)];
        let info = reader.next_frame(&mut rgb)?;
        Ok(Picture { size: [info.width, info.height], rgb })
    };
    paths.iter().take(count.max(1)).map(read).collect()
}

fn as_png(picture: &Picture, file: &mut Vec<u8>) -> anyhow::Result<()> {
    let row = |y: usize, to: &mut [u8]| {
        to.copy_from_slice(&picture.rgb[y * to.len()..][..to.len()]);
    };
    Ok(image_file::png(picture.size, Samples::Rgb8, Filter::Paeth, row, file)?)
}

fn as_general_png(picture: &Picture, file: &mut Vec<u8>) -> anyhow::Result<()> {
    let mut encoder = png::Encoder::new(file, picture.size[0], picture.size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Sub);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&picture.rgb)?;
    writer.finish()?;
    Ok(())
}
