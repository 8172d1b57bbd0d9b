//! `omnibus view`: a running simulator in a browser.

use std::{
    net::{IpAddr, Ipv4Addr, SocketAddr},
    process::{Command, Stdio},
};

use view::{Ended, ViewOptions, Viewer};

use crate::run::stop_on_signals;

/// Arguments of `omnibus view`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ViewArgs {
    /// The name of the simulator; default: the only one that runs
    #[arg(long)]
    name: Option<String>,
    /// The port of the page; 0: any that is free
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

/// Serves the page until Ctrl-C, SIGTERM, or the end of the simulator.
pub(crate) fn view(args: &ViewArgs) -> anyhow::Result<()> {
    let stop = stop_on_signals()?;
    let options = ViewOptions { instance: args.name.clone(), listen: args.listen, port: args.port };
    let viewer = Viewer::start(&options)?;
    let (address, instance) = (viewer.address(), viewer.instance().to_owned());
    let url = url(address);
    print_line!("simulator {instance:?} is shown at {url}; Ctrl-C ends");
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
    if viewer.run(&stop)? == Ended::SimulatorEnded {
        print_line!("simulator {instance:?} has ended");
    }
    Ok(())
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
