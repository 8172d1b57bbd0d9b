//! A simulator in processes of its own: the `omnibus` program beside this one.

use std::{
    io::{BufRead, BufReader, Read},
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    thread::JoinHandle,
    time::Duration,
};

use anyhow::{Context, anyhow};
use client_lib::Client;
use rustix::process::{Pid, Signal, kill_process};

/// Returns the path of the program.
pub(crate) fn omnibus() -> anyhow::Result<PathBuf> {
    let own = std::env::current_exe().context("where is this program?")?;
    let path = own.with_file_name("omnibus");
    if path.is_file() {
        return Ok(path);
    }
    Err(anyhow!("{} is not there; build it: cargo build --release", path.display()))
}

/// Returns a name that no other simulator has.
pub(crate) fn unique_name() -> String {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    format!("bench-{}-{count}", std::process::id() % 1_000_000)
}

/// A running `omnibus run`. Dropping it ends it as Ctrl-C does.
pub(crate) struct Sim {
    child: Child,
    name: String,
    said: Option<JoinHandle<String>>,
}

impl Sim {
    /// Spawns the process; clients may try to connect.
    pub(crate) fn spawn(args: &[&str]) -> anyhow::Result<Sim> {
        let name = unique_name();
        let mut child = Command::new(omnibus()?)
            .args(["run", "--name", &name, "--quality", "low"])
            .args(if args.contains(&"--carla-port") { &[][..] } else { &["--no-carla"] })
            .args(args)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .context("omnibus run")?;
        let mut lines = child.stderr.take().expect("it is piped");
        let said = std::thread::Builder::new().name("stderr".into()).spawn(move || {
            let mut text = String::new();
            let _ = lines.read_to_string(&mut text);
            text
        })?;
        Ok(Sim { child, name, said: Some(said) })
    }

    /// Starts a simulator and waits until it runs.
    pub(crate) fn start(args: &[&str]) -> anyhow::Result<Sim> {
        let mut sim = Sim::spawn(args)?;
        let mut line = String::new();
        let out = sim.child.stdout.as_mut().expect("it is piped");
        BufReader::new(out).read_line(&mut line)?;
        if line.contains(&sim.name) {
            return Ok(sim);
        }
        let why = sim.said.take().and_then(|said| said.join().ok()).unwrap_or_default();
        Err(anyhow!("omnibus run {}: {}", args.join(" "), why.trim()))
    }

    /// Returns its name.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Connects a client.
    pub(crate) fn client(&self) -> anyhow::Result<Client> {
        Ok(Client::connect(Some(&self.name), "bench")?)
    }

    /// Returns the host's process.
    pub(crate) fn host_pid(&self) -> u32 {
        self.child.id()
    }

    /// Returns standard error if the process has ended.
    pub(crate) fn has_ended(&mut self) -> Option<String> {
        self.child.try_wait().ok()??;
        Some(self.said.take().and_then(|said| said.join().ok()).unwrap_or_default())
    }
}

/// Returns the process that plays a role in the client's simulator.
pub(crate) fn pid_of(client: &Client, role: &str) -> anyhow::Result<u32> {
    let control = client.instance().control()?;
    let slots = control.slots().iter();
    let mut playing = slots.filter(|s| s.role().is_some_and(|r| r.name() == role));
    playing.next().map(|slot| slot.pid()).with_context(|| format!("no process plays {role}"))
}

impl Drop for Sim {
    fn drop(&mut self) {
        let signal = |child: &Child, signal| {
            if let Some(pid) = Pid::from_raw(child.id() as i32) {
                let _ = kill_process(pid, signal);
            }
        };
        for wait in 0..1000 {
            if !matches!(self.child.try_wait(), Ok(None)) {
                break;
            }
            match wait {
                0 => signal(&self.child, Signal::INT),
                999 => {
                    eprintln!("bench: simulator {:?} did not end within 10 s; killed", self.name);
                    signal(&self.child, Signal::KILL);
                    let _ = self.child.wait();
                }
                _ => std::thread::sleep(Duration::from_millis(10)),
            }
        }
    }
}
