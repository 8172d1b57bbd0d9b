//! `omnibus export`: turns data sets of `omnibus collect` into one data set of another format.
//!
//! ```text
//! DIR... ──▶ Set ──▶ frames, on all threads ──▶ OUT.partial ──▶ OUT
//! ```
//!
//! Recordings become MCAP files, one each (`recording.rs`).
//!
//! A frame is read when it is converted; only the positions of the frames are in memory. The result
//! has its name when it is complete.

mod class;
mod coco;
mod geometry;
mod images;
mod kitti;
mod lerobot;
pub(crate) mod map_scene;
mod mcap;
mod mcap_file;
mod nuscenes;
mod nuscenes_map;
mod nuscenes_radar;
mod nuscenes_words;
mod output;
mod parallel;
mod parquet;
mod ply;
mod recording;
pub(crate) mod set;
mod split;
mod statistics;
mod table;
mod webdataset;
mod writing;
mod yolo;

use std::path::{Path, PathBuf};

use anyhow::{bail, ensure};
use clap::ValueEnum;

pub(crate) use class::is_static;
use images::Images;
use output::Output;
use parallel::Threads;
use set::Set;
use split::Split;

/// Fraction of the scenes for validation, if none is given.
const VALIDATION: f64 = 0.2;

/// Samples in a shard of WebDataset, if no number is given.
const SHARD_SAMPLES: usize = 1000;

/// Arguments of `omnibus export`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ExportArgs {
    /// Data sets of `omnibus collect`, or folders with data sets in scene-*; each is a scene of the
    /// result. mcap: also recordings
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// The format to write
    #[arg(long, value_enum)]
    format: Format,
    /// The folder to write, which must not exist
    #[arg(long, value_name = "OUT")]
    out: PathBuf,
    /// Encode colour images as JPEG with this quality, 1 to 100; else they stay PNG
    #[arg(long, value_name = "QUALITY", value_parser = clap::value_parser!(u8).range(1..=100))]
    jpeg: Option<u8>,
    /// coco, kitti, yolo: the fraction of the scenes for validation; of a single scene, of its frames
    #[arg(long, value_name = "FRACTION", default_value_t = VALIDATION)]
    validation: f64,
    /// webdataset: samples in a shard
    #[arg(long, value_name = "SAMPLES", default_value_t = SHARD_SAMPLES)]
    shard_samples: usize,
    /// Threads that convert; 0: one per core
    #[arg(long, value_name = "THREADS", default_value_t = 0)]
    threads: usize,
}

/// A format that `omnibus export` writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Format {
    /// Images with instance masks
    Coco,
    /// Object detection with one camera and one lidar
    Kitti,
    /// Episodes of images, states and controls in Parquet
    Lerobot,
    /// Foxglove's messages of all sensors in their order of time
    Mcap,
    /// Every camera and lidar in related tables
    Nuscenes,
    /// A point cloud for each measurement of a lidar
    Ply,
    /// Images with 2-D boxes
    Yolo,
    /// Tar shards of all files of a frame
    Webdataset,
}

impl ExportArgs {
    /// Returns the arguments that write `dir` in a format into a folder of the format's name within it.
    pub(crate) fn within(dir: &Path, format: Format) -> ExportArgs {
        let name = format.to_possible_value().expect("every format has a name");
        ExportArgs {
            dirs: vec![dir.to_owned()],
            format,
            out: dir.join(name.get_name()),
            jpeg: None,
            validation: VALIDATION,
            shard_samples: SHARD_SAMPLES,
            threads: 0,
        }
    }

    /// Returns the folder to write.
    pub(crate) fn out(&self) -> &Path {
        &self.out
    }
}

/// Writes the data set that the arguments describe, and returns what was written, as a sentence.
pub(crate) fn export(args: &ExportArgs) -> anyhow::Result<String> {
    let fraction = args.validation;
    ensure!(
        (0.0..1.0).contains(&fraction),
        "--validation is {fraction}; use 0 (no validation) to less than 1"
    );
    ensure!(args.shard_samples > 0, "--shard-samples is 0, must be at least 1");
    // The name of a recording need not be a path.
    let is_recording =
        |dir: &PathBuf| dir.is_file() || args.format == Format::Mcap && !dir.is_dir();
    if args.dirs.iter().any(is_recording) {
        return export_recordings(args);
    }
    let set = Set::open(&args.dirs)?;
    let output = Output::create(&args.out)?;
    let root = output.root();
    let images = Images::new(args.jpeg, &set)?;
    let split = Split::of(&set, fraction);
    let threads = Threads::new(args.threads);
    match args.format {
        Format::Coco => coco::write(&set, root, &images, &split, threads)?,
        Format::Kitti => kitti::write(&set, root, &images, &split, threads)?,
        Format::Lerobot => lerobot::write(&set, root, &images, threads)?,
        Format::Mcap => mcap::write(&set, root, &images, threads)?,
        Format::Nuscenes => nuscenes::write(&set, root, &images, threads)?,
        Format::Ply => ply::write(&set, root, threads)?,
        Format::Yolo => yolo::write(&set, root, &images, &split, threads)?,
        Format::Webdataset => webdataset::write(&set, root, &images, args.shard_samples, threads)?,
    }
    output.finish()?;
    writing::log_time();
    let (frames, scenes) = (set.frames(), set.scenes().len());
    let out = args.out.display();
    Ok(format!("{frames} frames of {scenes} scene{} in {out}", if scenes == 1 { "" } else { "s" }))
}

/// Writes the recordings that the arguments name, and returns what was written, as a sentence.
fn export_recordings(args: &ExportArgs) -> anyhow::Result<String> {
    let folder = args.dirs.iter().find(|dir| dir.is_dir());
    if let Some(folder) = folder {
        bail!("{} is a folder, others are none; export them apart", folder.display());
    }
    ensure!(
        args.format == Format::Mcap,
        "{} is no folder; a recording has no images, and is exported with --format mcap",
        args.dirs[0].display()
    );
    let output = Output::create(&args.out)?;
    let frames = recording::write(&args.dirs, output.root())?;
    output.finish()?;
    let count = args.dirs.len();
    let plural = if count == 1 { "" } else { "s" };
    Ok(format!("{frames} frames of {count} recording{plural} in {}", args.out.display()))
}
