//! One data set to be written: its scene, and its folder.

use road::Network;

use crate::collect::{
    CollectError, Options,
    departures::Departures,
    folder::{Folder, FolderLock},
    format::{FORMAT, FrameLine, Metadata},
    frame_list::FrameList,
    plan::{Plan, Scene},
    sensors::PlannedSensor,
};

/// A data set to be written, with its locked folder.
pub(crate) struct Job {
    pub(crate) plan: Plan,
    pub(crate) scene: Scene,
    pub(crate) sensors: Vec<PlannedSensor>,
    /// Vehicles that depart at their times.
    pub(crate) departures: Option<Departures>,
    /// How many frames rendering may lag behind.
    pub(crate) pipeline: u32,
    /// Threads that encode and write.
    pub(crate) threads: usize,
    /// Whether progress and result are lines of JSON.
    pub(crate) json: bool,
    pub(crate) folder: Folder,
    pub(crate) frame_list: FrameList,
    /// Frames that are complete already.
    pub(crate) lines: Vec<FrameLine>,
    /// The metadata of the data set that is resumed.
    pub(crate) before: Option<Metadata>,
    pub(crate) lock: FolderLock,
}

impl Job {
    /// Locks the folder, which must be empty or hold a data set to resume. `network` is that of the
    /// scene's map.
    pub(crate) fn prepare(options: &Options, plan: Plan, network: Network) -> anyhow::Result<Job> {
        let scene = plan.scene(options.scene.unwrap_or(0))?;
        let departures = plan.demand.departures(network, scene.seed)?;
        let sensors = plan.planned_sensors()?;
        let folder = Folder::new(options.out()?);
        // First of all: another run may be about to write what is read here.
        let lock = folder.lock()?;
        let (frame_list, lines, before) = open(&folder, options.resume, plan.frames)?;
        Ok(Job {
            plan,
            scene,
            sensors,
            departures,
            pipeline: options.pipeline,
            threads: options.threads(),
            json: options.json,
            folder,
            frame_list,
            lines,
            before,
            lock,
        })
    }
}

/// Opens the list of complete frames of a folder that is empty, or holds a data set to resume.
fn open(
    folder: &Folder,
    resume: bool,
    frames: u64,
) -> Result<(FrameList, Vec<FrameLine>, Option<Metadata>), CollectError> {
    let content = folder.count()?;
    let dir = folder.root().to_owned();
    let before = match folder.read_metadata() {
        Err(CollectError::OtherFormat { format, .. }) => {
            let what = format!("a data set of format {format:?}, this build writes {FORMAT:?}");
            return Err(CollectError::Occupied { dir, what, advice: ELSEWHERE });
        }
        read => read?,
    };
    if content > 0 && !(resume && before.is_some()) {
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
    if lines.len() as u64 > frames {
        let (dir, have) = (dir.display(), lines.len());
        let wrong = format!("{dir} holds {have} frames already, --frames is {frames}");
        return Err(CollectError::Argument(wrong));
    }
    Ok((frame_list, lines, before))
}

const ELSEWHERE: &str = "choose another --out";
const ON_OR_ELSEWHERE: &str = "continue it with --resume, or choose another --out";
