//! The arguments of `omnibus collect`, checked before a simulator starts.

use std::path::PathBuf;

use protocol::PIPELINE_MAX;

use crate::collect::{
    CollectError,
    folder::{Folder, FolderLock},
    format::{FORMAT, FrameLine, Metadata},
    frame_list::FrameList,
};

/// What to collect, and where to write it.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the data set; created if missing
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The number of frames to keep
    #[arg(long, default_value_t = 300)]
    pub(crate) frames: u64,
    /// Vehicles in traffic, in addition to the ego
    #[arg(long, default_value_t = 50)]
    pub(crate) vehicles: u32,
    /// Pedestrians on the sidewalks around the ego
    #[arg(long, default_value_t = 0)]
    pub(crate) walkers: u32,
    /// Altitudes of the sun above the horizon, each for an equal part of the frames; else one clear afternoon
    #[arg(long, value_name = "DEGREES,…", value_delimiter = ',', allow_hyphen_values = true)]
    pub(crate) sun_altitudes_deg: Vec<f32>,
    /// Simulated seconds per frame
    #[arg(long, value_name = "SECONDS", default_value_t = 0.05)]
    pub(crate) fixed_delta: f64,
    /// Keep one in this many frames
    #[arg(long, value_name = "FRAMES", default_value_t = 1)]
    pub(crate) every: u64,
    /// Frames to simulate before the first that is kept
    #[arg(long, value_name = "FRAMES", default_value_t = 40)]
    pub(crate) warmup: u64,
    /// Width of the camera's images
    #[arg(long, value_name = "PIXELS", default_value_t = 800)]
    pub(crate) width: u32,
    /// Height of the camera's images
    #[arg(long, value_name = "PIXELS", default_value_t = 600)]
    pub(crate) height: u32,
    /// How many frames rendering may lag behind the simulation, 0 to 3; the data are the same
    #[arg(long, value_name = "FRAMES", default_value_t = 1)]
    pub(crate) pipeline: u32,
    /// Threads that encode and write; 0: one per core
    #[arg(long, value_name = "THREADS", default_value_t = 0)]
    pub(crate) writers: usize,
    /// Continue a data set that was interrupted; all other settings must be the same
    #[arg(long)]
    pub(crate) resume: bool,
}

impl Args {
    fn check(&self) -> Result<(), CollectError> {
        let delta = self.fixed_delta;
        let wrong = if self.frames == 0 {
            "--frames is 0, must be at least 1".to_owned()
        } else if let Some(wrong) =
            self.sun_altitudes_deg.iter().find(|deg| !(-90.0..=90.0).contains(*deg))
        {
            format!("--sun-altitudes-deg has {wrong}; use -90 to 90")
        } else if self.every == 0 {
            "--every is 0; 1 keeps every frame".to_owned()
        } else if !(0.001..=1.0).contains(&delta) {
            format!("--fixed-delta is {delta} s; use 0.001 to 1")
        } else if self.pipeline > PIPELINE_MAX {
            format!("--pipeline is {}; use 0 to {PIPELINE_MAX}", self.pipeline)
        } else if !(16..=8192).contains(&self.width) || !(16..=8192).contains(&self.height) {
            format!("the camera has {}x{} pixels; use 16 to 8192", self.width, self.height)
        } else {
            return Ok(());
        };
        Err(CollectError::Argument(wrong))
    }

    /// The sun's altitude for a frame that is kept, by its ordinal among them; none where it stays.
    pub(crate) fn sun_altitude_rad(&self, kept: u64) -> Option<f32> {
        let parts = self.sun_altitudes_deg.len() as u64;
        let part = kept.min(self.frames - 1) * parts / self.frames;
        self.sun_altitudes_deg.get(part as usize).map(|deg| deg.to_radians())
    }

    /// Returns the simulated time per frame.
    pub(crate) fn delta_nanos(&self) -> u64 {
        (self.fixed_delta * 1e9).round() as u64
    }

    /// Returns the number of encoder threads.
    pub(crate) fn threads(&self) -> usize {
        match self.writers {
            0 => std::thread::available_parallelism().map_or(2, usize::from).min(16),
            some => some.min(64),
        }
    }
}

/// A data set to be written, with its locked folder.
pub(crate) struct Job {
    pub(crate) args: Args,
    pub(crate) folder: Folder,
    pub(crate) frame_list: FrameList,
    /// Frames that are complete already.
    pub(crate) lines: Vec<FrameLine>,
    /// The metadata of the data set that is resumed.
    pub(crate) before: Option<Metadata>,
    pub(crate) lock: FolderLock,
}

impl Job {
    /// Checks the arguments and locks the folder, which must be empty or hold a data set to resume.
    pub(crate) fn prepare(args: &Args) -> Result<Job, CollectError> {
        args.check()?;
        let folder = Folder::new(&args.out);
        // First of all: another run may be about to write what is read here.
        let lock = folder.lock()?;
        let content = folder.count()?;
        let dir = folder.root().to_owned();
        let before = match folder.read_metadata() {
            Err(CollectError::OtherFormat { format, .. }) => {
                let what = format!("a data set of format {format:?}, this build writes {FORMAT:?}");
                return Err(CollectError::Occupied { dir, what, advice: ELSEWHERE });
            }
            read => read?,
        };
        if content > 0 && !(args.resume && before.is_some()) {
            let (what, advice) = match &before {
                Some(m) if m.complete => {
                    (format!("a complete data set of {} frames", m.frames_complete), ELSEWHERE)
                }
                Some(m) => {
                    let (lines, _) = super::frame_list::read(&folder.frames())?;
                    let (have, wanted) = (lines.len(), m.frames_requested);
                    (format!("an unfinished data set, {have} of {wanted} frames"), ON_OR_ELSEWHERE)
                }
                None => (format!("{content} files or folders that are not a data set"), ELSEWHERE),
            };
            return Err(CollectError::Occupied { dir, what, advice });
        }
        let (frame_list, lines) = FrameList::open(&folder.frames())?;
        if lines.len() as u64 > args.frames {
            let (dir, have, wanted) = (dir.display(), lines.len(), args.frames);
            let wrong = format!("{dir} holds {have} frames already, --frames is {wanted}");
            return Err(CollectError::Argument(wrong));
        }
        Ok(Job { args: args.clone(), folder, frame_list, lines, before, lock })
    }
}

const ELSEWHERE: &str = "choose another --out";
const ON_OR_ELSEWHERE: &str = "continue it with --resume, or choose another --out";
