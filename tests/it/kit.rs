//! The fixture of every scenario: a simulator in processes of its own, on a small map.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write as _},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex, OnceLock,
        atomic::{AtomicU32, Ordering},
    },
    thread::JoinHandle,
};

use bus::Role;
use client_lib::{Client, Instance, wire::Settings};
use rustix::process::{Pid, Signal, kill_process};

/// Simulated time of a tick.
pub(crate) const DELTA_NANOS: u64 = 50_000_000;

/// Returns a command that starts the program under test.
pub(crate) fn omnibus() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_role"));
    // Its cache stays out of the user's own.
    command.env("OMNIBUS_CACHE", std::env::temp_dir().join("omnibus-it-cache"));
    // So do the recordings of CARLA's clients.
    command.env("XDG_STATE_HOME", std::env::temp_dir().join("omnibus-it-state"));
    command
}

/// Returns whether the long versions of tests were requested.
pub(crate) fn is_soak() -> bool {
    std::env::var_os("OMNIBUS_SOAK").is_some()
}

/// Notes that a test did not run, and why; `./run test` counts and lists these notes at its end.
pub(crate) fn note_skipped(test: &str, why: &str) {
    note(&format!("skipped {test}: {why}"));
}

/// Notes that a test made a second attempt, and why; `./run test` counts and lists these notes too.
pub(crate) fn note_retried(test: &str, why: &str) {
    note(&format!("retried {test}: {why}"));
}

fn note(line: &str) {
    eprintln!("{line}");
    if let Some(path) = std::env::var_os("OMNIBUS_TEST_NOTES") {
        let mut file = fs::OpenOptions::new().create(true).append(true).open(path).unwrap();
        // One write: tests of one process note at the same time.
        file.write_all(format!("{line}\n").as_bytes()).unwrap();
    }
}

/// A folder that is removed with the test.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new() -> Scratch {
        let path = std::env::temp_dir().join(unique("omnibus-it"));
        fs::create_dir_all(&path).unwrap();
        Scratch(path)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn unique(stem: &str) -> String {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    format!("{stem}-{}-{}", std::process::id() % 100_000, COUNT.fetch_add(1, Ordering::Relaxed))
}

/// Returns a small town, which the stages build quickly.
pub(crate) fn small_map() -> &'static str {
    static MAP: OnceLock<String> = OnceLock::new();
    MAP.get_or_init(|| {
        let plan = mapgen::Plan {
            name: "Hamlet".to_owned(),
            seed: 5,
            size_m: 250.0,
            character: mapgen::Character::Grid,
            relief_m: 2.0,
        };
        // Next to this test's other files: one map for all tests, kept for inspection after a
        // failure.
        let folder = std::env::temp_dir().join(format!("omnibus-it-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("hamlet.xodr");
        fs::write(&path, mapgen::generate(&plan)).unwrap();
        path.to_str().unwrap().to_owned()
    })
}

/// A running `omnibus run`.
pub(crate) struct Sim {
    child: Child,
    instance: Instance,
    log: Arc<Mutex<String>>,
    reader: Option<JoinHandle<()>>,
}

impl Sim {
    /// Starts a synchronous simulator on the small map, with the CPU tracer.
    pub(crate) fn start(args: &[&str]) -> Sim {
        Sim::start_with(args, &[])
    }

    /// Starts a simulator with the first GPU, or with Mesa's software one. Without any, notes that
    /// `test` is skipped.
    pub(crate) fn start_on_gpu(test: &str) -> Option<Sim> {
        let alone = ["stage", "render", "--device", "gpu:0", "--frames", "1", "--warmup", "0"];
        let tried = omnibus().args(alone).args(["--map", small_map()]).output().unwrap();
        let said = String::from_utf8_lossy(&tried.stderr);
        if said.contains("there is no Vulkan adapter") {
            note_skipped(test, "no Vulkan adapter, not even a software one");
            return None;
        }
        assert!(tried.status.success(), "{said}");
        Some(Sim::start(&["--device", "gpu:0"]))
    }

    /// Starts a simulator with additional environment variables.
    pub(crate) fn start_with(args: &[&str], variables: &[(&str, &str)]) -> Sim {
        Sim::start_named(&unique("t"), args, variables)
    }

    /// Starts a simulator of this name.
    pub(crate) fn start_named(name: &str, args: &[&str], variables: &[(&str, &str)]) -> Sim {
        let mut command = omnibus();
        command.args(["run", "--synchronous", "--name", name]);
        if !args.contains(&"--device") {
            command.args(["--device", "cpu"]);
        }
        if !args.contains(&"--carla-port") {
            command.arg("--no-carla");
        }
        if !args.contains(&"--map") {
            command.args(["--map", small_map()]);
        }
        command.args(args).envs(variables.iter().copied());
        Sim::of(command, name).unwrap_or_else(|log| panic!("it did not start: {log}"))
    }

    fn of(mut command: Command, name: &str) -> Result<Sim, String> {
        let spawned = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = spawned.spawn().unwrap();
        let log = Arc::new(Mutex::new(String::new()));
        let (lines, into) = (child.stderr.take().unwrap(), Arc::clone(&log));
        let reader = thread(move || {
            for line in BufReader::new(lines).lines().map_while(Result::ok) {
                let mut log = into.lock().unwrap();
                log.push_str(&line);
                log.push('\n');
            }
        });
        let mut said = String::new();
        let mut output = BufReader::new(child.stdout.as_mut().unwrap());
        output.read_line(&mut said).unwrap();
        // What came with the first line belongs to the rest.
        log.lock().unwrap().push_str(&String::from_utf8_lossy(output.buffer()));
        if !said.contains(name) {
            let _ = child.wait();
            let _ = reader.join();
            return Err(log.lock().unwrap().clone());
        }
        let instance = Instance::named(name).unwrap();
        Ok(Sim { child, instance, log, reader: Some(reader) })
    }

    /// Returns the instance.
    pub(crate) fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Connects a client.
    pub(crate) fn client(&self, name: &str) -> Client {
        Client::connect(Some(self.instance.id()), name).unwrap()
    }

    /// Connects a client that holds the tick.
    pub(crate) fn ticker(&self) -> Client {
        let mut client = self.client("ticker");
        client.synchronise(std::time::Duration::from_nanos(DELTA_NANOS)).unwrap();
        client
    }

    /// Returns standard error so far.
    pub(crate) fn log(&self) -> String {
        self.log.lock().unwrap().clone()
    }

    /// Returns the process that plays this role now, if there is one.
    pub(crate) fn pid(&self, role: Role) -> Option<u32> {
        self.live_pid(|slot| slot.role() == Some(role))
    }

    /// Returns the process of the CARLA server, once the host has admitted it.
    pub(crate) fn gateway_pid(&self) -> Option<u32> {
        // A successor that joins before the death is noticed has a number behind the name.
        self.live_pid(|slot| format!("{}", slot.name()).starts_with("gateway"))
    }

    /// Returns whether the host has admitted a process.
    pub(crate) fn has_admitted(&self, pid: u32) -> bool {
        self.live_pid(|slot| slot.pid() == pid).is_some()
    }

    /// Returns the newest frame.
    pub(crate) fn frame(&self) -> u64 {
        self.instance.control().unwrap().tick.get()
    }

    fn live_pid(&self, is_it: impl Fn(&bus::Slot) -> bool) -> Option<u32> {
        let control = self.instance.control().unwrap();
        let mut slots = (0..bus::SLOTS).map(|i| control.slot(i));
        let slot = slots.find(|slot| slot.state() == bus::SlotState::Live && is_it(slot))?;
        Some(slot.pid()).filter(|pid| *pid != 0)
    }

    /// Returns the process of the host.
    pub(crate) fn host_pid(&self) -> u32 {
        self.child.id()
    }

    /// Returns everything of the instance in shared memory, with sizes.
    pub(crate) fn shared_memory(&self) -> Vec<(String, u64)> {
        let mut files = Vec::new();
        list(&self.instance.root(), &mut files);
        for path in self.instance.segments() {
            let len = fs::metadata(&path).map_or(0, |m| m.len());
            files.push((path.display().to_string(), len));
        }
        files
    }

    /// Sends a signal to the host and waits for its end.
    pub(crate) fn signal(mut self, signal: Signal) -> (ExitStatus, String) {
        kill(self.host_pid(), signal);
        self.wait()
    }

    /// Waits for the end and returns standard error.
    pub(crate) fn wait(&mut self) -> (ExitStatus, String) {
        let mut rest = String::new();
        let _ = self.child.stdout.take().map(|mut out| out.read_to_string(&mut rest));
        let status = self.child.wait().unwrap();
        if let Some(reader) = self.reader.take() {
            reader.join().unwrap();
        }
        (status, self.log() + &rest)
    }

    /// Ends the simulator as Ctrl-C does, and asserts that nothing is left behind.
    pub(crate) fn end(mut self) -> String {
        kill(self.host_pid(), Signal::INT);
        let (status, log) = self.wait();
        assert!(status.success(), "{status}: {log}");
        assert_eq!(self.shared_memory(), []);
        log
    }
}

impl Drop for Sim {
    fn drop(&mut self) {
        // A test failed during the run.
        if matches!(self.child.try_wait(), Ok(None)) {
            kill(self.host_pid(), Signal::TERM);
            let (_, log) = self.wait();
            eprintln!("{log}");
        }
    }
}

fn list(dir: &Path, files: &mut Vec<(String, u64)>) {
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        match entry.metadata() {
            Ok(meta) if meta.is_dir() => list(&entry.path(), files),
            Ok(meta) => files.push((entry.path().display().to_string(), meta.len())),
            Err(_) => {}
        }
    }
}

/// Sends a signal.
pub(crate) fn kill(pid: u32, signal: Signal) {
    let pid = Pid::from_raw(pid as i32).unwrap();
    let _ = kill_process(pid, signal);
}

/// Returns whether a process exists and is not a zombie.
pub(crate) fn lives(pid: u32) -> bool {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit(") ").next().is_some_and(|rest| !rest.is_empty() && !rest.starts_with('Z'))
}

/// Returns the resident memory of a process, in bytes.
pub(crate) fn resident_bytes(pid: u32) -> u64 {
    let statm = fs::read_to_string(format!("/proc/{pid}/statm")).unwrap_or_default();
    statm.split(' ').nth(1).and_then(|pages| pages.parse::<u64>().ok()).unwrap_or(0) * 4096
}

/// Returns how many files a process has open.
pub(crate) fn open_files(pid: u32) -> usize {
    fs::read_dir(format!("/proc/{pid}/fd")).map_or(0, Iterator::count)
}

/// Waits until a condition holds; panics with `what` after a minute.
pub(crate) fn eventually(what: &str, mut is_so: impl FnMut() -> bool) {
    for _ in 0..6000 {
        if is_so() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    panic!("{what} did not come about within a minute");
}

/// Lets the world run on its own clock, in steps of 10 ms at the speed of real time.
pub(crate) fn run_asynchronously(client: &mut Client) {
    let settings = Settings {
        synchronous: 0,
        delta_nanos: 10_000_000,
        real_time_permille: 1000,
        ..client.wire_settings()
    };
    client.apply_wire_settings(settings).unwrap();
}

/// Starts a thread of a test.
pub(crate) fn thread<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> JoinHandle<T> {
    std::thread::Builder::new().name("scenario".into()).spawn(work).unwrap()
}
