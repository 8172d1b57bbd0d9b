//! `omnibus view`: a running simulator, a recording or a data set in a browser; the first two also in
//! Foxglove.

use std::{
    net::{IpAddr, Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::Arc,
    time::Duration,
};

use ::record::Recording;
use anyhow::ensure;
use carla_gateway::carla_log;
use protocol::Settings;
use view::{Ended, Source, ViewOptions, Viewer};

use crate::{
    collect::map_lines::LaneMap,
    export::map_scene::map_scene,
    replay::{self, TemporaryFile},
    run::{BackgroundHost, stop_on_signals},
    saved::existing_recording,
    view_data_set::StoredSet,
};

/// Arguments of `omnibus view`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ViewArgs {
    /// A recording, which a simulator of its own shows, or the folder of a data set of `collect`, or one
    /// with data sets in scene-*; default: the running simulator
    path: Option<PathBuf>,
    /// The name of the simulator; default: the only one that runs
    #[arg(long)]
    name: Option<String>,
    /// Recordings: the tracer: auto, cpu, gpu:N, or null
    #[arg(long, default_value = "auto", requires = "path")]
    device: String,
    /// The port of the page and of the Foxglove WebSocket, ws://127.0.0.1:PORT/foxglove; 0: any that is
    /// free
    #[arg(long, default_value_t = 7878)]
    port: u16,
    /// The address to listen on; there is no password: whoever reaches the port sees the cameras,
    /// drives, spawns and stops time
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    listen: IpAddr,
    /// Do not open the page in a browser
    #[arg(long)]
    no_open: bool,
}

/// Shows what the argument names.
pub(crate) fn view(args: &ViewArgs) -> anyhow::Result<()> {
    let Some(path) = &args.path else {
        return serve(args, Source::Simulator(args.name.clone())).map(drop);
    };
    if path.is_dir() {
        ensure!(args.name.is_none(), "a data set has no simulator; leave --name out");
        let set = StoredSet::open(path)?;
        return serve(args, Source::DataSet(Arc::new(set))).map(drop);
    }
    let shown = RecordedWorld::open(args, &existing_recording(path)?)?;
    let served = serve(args, Source::Recording(shown.recording()));
    let ended = shown.host.end();
    // The reason why the host ended causes the viewer's end.
    if served? == Ended::SimulatorEnded {
        ended?;
    }
    Ok(())
}

/// A recording, and the simulator that shows it.
struct RecordedWorld {
    host: BackgroundHost,
    instance: String,
    file: PathBuf,
    title: [String; 2],
    length: Duration,
    _map: TemporaryFile,
    /// Of a CARLA log.
    _imported: Option<TemporaryFile>,
}

impl RecordedWorld {
    fn open(args: &ViewArgs, path: &Path) -> anyhow::Result<RecordedWorld> {
        let imported =
            carla_log::is_log(path).then(|| replay::import_log(path, None)).transpose()?;
        let file = imported.as_ref().map_or_else(|| path.to_owned(), |file| file.0.clone());
        let mut recording = Recording::open(&file)?;
        let length = Duration::from_nanos(recording.duration_nanos()?);
        ensure!(!length.is_zero(), "{} holds no frames; there is nothing to show", path.display());
        let first = recording
            .frames(0)?
            .iter()
            .find_map(|frame| (frame.delta_nanos > 0).then_some(frame.delta_nanos));
        let settings = Settings { synchronous: 1, ..Settings::default() };
        let delta_nanos = first.unwrap_or(settings.delta_nanos);
        let settings = Settings { delta_nanos, ..settings };
        let (host, map) = replay::simulator(&recording, args.name.clone(), &args.device, settings)?;
        // A map of the user is named by its path.
        let map_name = Path::new(&recording.info().episode.map).file_stem();
        let title = [path.file_name(), map_name]
            .map(|name| name.unwrap_or_default().to_string_lossy().into_owned());
        let instance = host.instance_id().to_owned();
        Ok(RecordedWorld { host, instance, file, title, length, _map: map, _imported: imported })
    }

    fn recording(&self) -> view::Recording {
        view::Recording {
            instance: self.instance.clone(),
            file: self.file.clone(),
            title: self.title.clone(),
            length: self.length,
        }
    }
}

/// Serves the page until Ctrl-C, SIGTERM, or the end of the simulator.
fn serve(args: &ViewArgs, source: Source) -> anyhow::Result<Ended> {
    let stop = stop_on_signals()?;
    let map_scene = |network: &_, nanos| map_scene(&LaneMap::new(network, &[], &[]), nanos);
    let options = ViewOptions { source, listen: args.listen, port: args.port, map_scene };
    let viewer = Viewer::start(&options)?;
    let address = viewer.address();
    let shown = match &args.path {
        Some(path) => path.display().to_string(),
        None => format!("simulator {:?}", viewer.instance().unwrap_or_default()),
    };
    let url = url(address);
    let stream = match &options.source {
        Source::DataSet(_) => String::new(),
        _ => {
            format!(", and to Foxglove and Lichtblick at {}foxglove", url.replacen("http", "ws", 1))
        }
    };
    print_line!("{shown} is shown at {url}{stream}; Ctrl-C ends");
    if !args.listen.is_loopback() {
        eprintln!(
            "omnibus: port {} is open to other machines and has no password: whoever reaches it sees \
             the cameras, drives, spawns, destroys and stops time; use a firewall, or listen on \
             127.0.0.1 and forward the port by ssh -L",
            address.port()
        );
    }
    if !args.no_open {
        open(&url);
    }
    let ended = viewer.run(&stop)?;
    if ended == Ended::SimulatorEnded {
        print_line!("{shown} has ended");
    }
    Ok(ended)
}
/// Returns the address of the page for a browser on this machine.
fn url(address: SocketAddr) -> String {
    let shown = if address.ip().is_unspecified() {
        SocketAddr::from((Ipv4Addr::LOCALHOST, address.port()))
    } else {
        address
    };
    format!("http://{shown}/")
}

/// Opens the page in the browser of the desktop, if there is a desktop.
fn open(url: &str) {
    let has_screen = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    if !has_screen("DISPLAY") && !has_screen("WAYLAND_DISPLAY") {
        return;
    }
    let mut command = Command::new("xdg-open");
    command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    if let Err(e) = command.spawn() {
        log::info!("no browser was opened: xdg-open: {e}");
    }
}
