//! Instances: each running host has a name and a folder, and shares nothing with another.

use std::{
    fs::{self, DirBuilder, File, Metadata, OpenOptions, Permissions},
    io::Write,
    os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt},
    path::{Path, PathBuf},
    time::Duration,
};

use iceoryx2::prelude::{Config, FileName, FilePath, Path as BusPath, SemanticString};
use iceoryx2_bb_posix::unique_system_id::UniqueSystemId;
use rustix::{
    fs::{FallocateFlags, FlockOperation, fallocate, flock},
    io::retry_on_intr,
};

use crate::{BusError, BusNode, CONTROL_LEN, ControlPageMapping, process, shared_memory::SHM};

/// Returns the processes whose ids of iceoryx2 are in the name of a file: of a node or port the one
/// that made it, of a connection those of both ends.
fn creators(name: &str) -> impl Iterator<Item = u32> {
    // Hashes of names are in hexadecimal, with 40 digits.
    let ids = name.split(['_', '.']).filter(|part| (20..40).contains(&part.len()));
    let ids = ids.filter_map(|part| part.parse::<u128>().ok());
    ids.map(|id| UniqueSystemId::from(id).pid().value() as u32)
}

/// How often, and after which time, a host looks whether the files of a dead one of its name are gone.
const REMOVALS_AWAITED: u32 = 20;
const REMOVAL_PAUSE: Duration = Duration::from_millis(50);

/// A folder without a control page that changed so recently may belong to a host that is starting.
const STARTING: Duration = Duration::from_secs(5);

/// How the folder of an instance begins.
const FOLDER: &str = "omnibus-";

/// The folder of one host: `/dev/shm/omnibus-<id>/`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instance {
    id: String,
}

/// The instance that this process hosts. Dropping it removes every file of the instance.
pub struct OwnedInstance {
    instance: Instance,
    _lock: File,
}

/// Whether a folder changed a short time ago.
fn is_young(folder: &Metadata) -> bool {
    folder.modified().is_ok_and(|time| time.elapsed().map_or(true, |age| age < STARTING))
}

fn error(what: impl Into<String>) -> BusError {
    BusError::Instance(what.into())
}

impl Instance {
    /// The instance of this name, running or not.
    pub fn named(id: &str) -> Result<Instance, BusError> {
        let fits = (1..=16).contains(&id.len())
            && id.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-');
        if !fits {
            return Err(error(format!(
                "instance name {id:?} has {} bytes; use 1 to 16 of a-z, 0-9 and -",
                id.len()
            )));
        }
        Ok(Instance { id: id.to_owned() })
    }

    /// The running instances, sorted by name.
    pub fn running() -> Vec<Instance> {
        Instance::all().into_iter().filter(Instance::is_running).collect()
    }

    /// The running instance of this name; without a name, the only one that runs.
    pub fn find(id: Option<&str>) -> Result<Instance, BusError> {
        if let Some(id) = id {
            let instance = Instance::named(id)?;
            if !instance.is_running() {
                return Err(error(format!(
                    "no simulator named {id:?} runs; start one: omnibus run --name {id}"
                )));
            }
            return Ok(instance);
        }
        let running = Instance::running();
        match &running[..] {
            [one] => Ok(one.clone()),
            [] => Err(error("no simulator runs; start one: omnibus run")),
            many => {
                let names: Vec<_> = many.iter().map(|i| i.id.as_str()).collect();
                Err(error(format!(
                    "{} simulators run ({}); say which by name",
                    many.len(),
                    names.join(", ")
                )))
            }
        }
    }

    /// The name of the instance.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// The folder of the instance.
    pub fn root(&self) -> PathBuf {
        Path::new(SHM).join(format!("{FOLDER}{}", self.id))
    }

    /// The prefix of its shared-memory files.
    fn prefix(&self) -> String {
        format!("omnibus.{}.", self.id)
    }

    fn all() -> Vec<Instance> {
        let Ok(entries) = fs::read_dir(SHM) else { return Vec::new() };
        let mut found: Vec<_> = entries
            .flatten()
            .filter_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                Some(Instance { id: name.strip_prefix(FOLDER)?.to_owned() })
            })
            .collect();
        found.sort_by(|a, b| a.id.cmp(&b.id));
        found
    }

    /// Whether the host is alive: a live host holds the lock file.
    fn is_running(&self) -> bool {
        let Ok(file) = File::open(self.root().join("lock")) else { return false };
        flock(&file, FlockOperation::NonBlockingLockExclusive).is_err()
    }

    /// Takes the lock that a dead host has left; `None` while a process holds it, and for a folder
    /// without one that may belong to a host that is starting.
    fn lock_of_dead_host(&self) -> Option<File> {
        let path = self.root().join("lock");
        let is_new = !path.exists();
        if is_new && fs::metadata(self.root()).map_or(true, |folder| is_young(&folder)) {
            return None;
        }
        let open = OpenOptions::new().read(true).write(true).create(is_new).open(&path);
        let file = open.ok()?;
        flock(&file, FlockOperation::NonBlockingLockExclusive).ok()?;
        // Another process may have removed the file, and a new host created its own.
        let (own, current) = (file.metadata().ok()?, fs::metadata(&path).ok()?);
        (own.ino() == current.ino()).then_some(file)
    }

    /// Whether the process that the control page names as the host is alive.
    fn has_host(&self) -> bool {
        self.control().is_ok_and(|control| {
            let (pid, started) = control.host_process();
            process::start_time(pid) == Some(started)
        })
    }

    /// Removes the files of dead hosts; returns their names.
    pub fn sweep() -> Vec<String> {
        let mut swept = Vec::new();
        for instance in Instance::all() {
            // Before the lock is taken, because creating its file changes the folder.
            let Ok(folder) = fs::metadata(instance.root()) else { continue };
            // Held until everything is removed: a new host of this name waits for it.
            let Some(_lock) = instance.lock_of_dead_host() else { continue };
            let is_same = fs::metadata(instance.root()).is_ok_and(|now| now.ino() == folder.ino());
            // A host creates the control page under the lock. Until then its folder is only young.
            if instance.control().is_ok() || is_same && !is_young(&folder) {
                instance.remove();
                swept.push(instance.id);
            }
        }
        swept
    }

    fn remove(&self) {
        // First, so that what a process creates from now on is removed by that process: see `node`.
        let _ = fs::remove_file(self.control_path());
        for file in self.segments() {
            let _ = fs::remove_file(file);
        }
        let _ = fs::remove_dir_all(self.root());
    }

    /// Stores the reason why the process in `slot` is about to end, for the host.
    pub fn write_exit_message(&self, slot: usize, words: &str) {
        let _ = fs::write(self.exit_message_path(slot), words);
    }

    /// Returns and removes the reason that the process in `slot` stored.
    pub fn take_exit_message(&self, slot: usize) -> Option<String> {
        let path = self.exit_message_path(slot);
        let words = fs::read_to_string(&path).ok()?;
        let _ = fs::remove_file(&path);
        Some(words)
    }

    fn exit_message_path(&self, slot: usize) -> PathBuf {
        self.root().join(format!("exit-message.{slot}"))
    }

    /// The shared-memory files of the instance.
    pub fn segments(&self) -> Vec<PathBuf> {
        let prefix = self.prefix();
        let Ok(entries) = fs::read_dir(SHM) else { return Vec::new() };
        let mut files: Vec<_> = entries
            .flatten()
            .filter(|e| e.file_name().to_string_lossy().starts_with(&prefix))
            .map(|e| e.path())
            .collect();
        files.sort();
        files
    }

    /// For the host, before it cleans up after dead processes: a segment whose creator was killed before
    /// it had a size blocks every process that opens it. Removes empty segments of dead processes.
    pub fn sweep_unfinished_segments(&self) -> usize {
        let is_unfinished = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            fs::metadata(path).is_ok_and(|m| m.size() == 0)
                && creators(&name).any(|pid| !process::is_alive(pid))
        };
        let unfinished = self.segments().into_iter().filter(is_unfinished);
        unfinished.filter(|path| fs::remove_file(path).is_ok()).count()
    }

    /// For the host, when the transport could not remove the node of a dead process because of its
    /// incomplete tag files: removes them, except those of the processes in `spared`.
    pub fn sweep_stuck_nodes(&self, spared: &[u32]) -> usize {
        let Ok(nodes) = fs::read_dir(self.root().join("nodes")) else { return 0 };
        let is_stuck = |node: &fs::DirEntry| {
            let name = node.file_name().to_string_lossy().into_owned();
            let is_needed = |pid: u32| spared.contains(&pid) || process::is_alive(pid);
            node.path().is_dir() && creators(&name).any(|pid| !is_needed(pid))
        };
        let stuck = nodes.flatten().filter(is_stuck);
        stuck.filter(|node| fs::remove_dir_all(node.path()).is_ok()).count()
    }

    /// The transport's configuration for this instance. Clean-up as a side effect is off: only the host
    /// cleans up, explicitly.
    fn config(&self) -> Config {
        let mut config = Config::default();
        let root = format!("{}/", self.root().display());
        let prefix =
            FileName::new(self.prefix().as_bytes()).expect("a checked name is a file name");
        config.global.prefix = prefix;
        config
            .global
            .set_root_path(&BusPath::new(root.as_bytes()).expect("a checked name is a path"));
        config.global.service.cleanup_dead_nodes_on_open = false;
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.creation_timeout = Duration::from_secs(2);
        config
    }

    /// Opens a node; `in_process`: on the heap of this process instead of shared memory.
    /// Fails with [`BusError::HostEnds`] when the host has removed the instance, and leaves no file then.
    pub fn node(&self, name: &str, in_process: bool) -> Result<BusNode, BusError> {
        let node = BusNode::new(name, &self.config(), in_process);
        if self.control_path().exists() {
            return node;
        }
        drop(node);
        // The transport creates its counter of nodes and its folders where they are missing, and never
        // removes them. A host that starts under this name meanwhile can do without the counter.
        let is_counter = |path: &PathBuf| path.extension().is_some_and(|e| e == "global_mgmt");
        for counter in self.segments().into_iter().filter(is_counter) {
            let _ = fs::remove_file(counter);
        }
        let _ = fs::remove_dir(self.root().join("nodes"));
        let _ = fs::remove_dir(self.root());
        Err(BusError::HostEnds)
    }

    fn control_path(&self) -> PathBuf {
        self.root().join("control")
    }

    /// Maps the control page and checks it.
    pub fn control(&self) -> Result<ControlPageMapping, BusError> {
        let path = self.control_path();
        let map =
            || ControlPageMapping::map(&OpenOptions::new().read(true).write(true).open(&path)?);
        let control = map().map_err(|e| error(format!("{}: {e}", path.display())))?;
        control.check()?;
        Ok(control)
    }

    /// Creates an instance: removes the files of dead hosts, creates folder, lock and a blank control
    /// page. Without a name, the name is made from the process id.
    pub fn create(id: Option<&str>) -> Result<OwnedInstance, BusError> {
        Instance::sweep();
        let own = format!("p{}", std::process::id());
        let instance = Instance::named(id.unwrap_or(&own))?;
        let root = instance.root();
        // Other users cannot enter it: they may not even watch.
        let create = || DirBuilder::new().mode(0o700).create(&root);
        let mut created = create();
        for _ in 0..REMOVALS_AWAITED {
            // Another process may be about to remove what a dead host of this name has left.
            if !matches!(&created, Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists)
                || instance.has_host()
            {
                break;
            }
            std::thread::sleep(REMOVAL_PAUSE);
            Instance::sweep();
            created = create();
        }
        created.map_err(|e| match e.kind() {
            std::io::ErrorKind::AlreadyExists => error(format!(
                "a simulator named {:?} already runs; stop it or choose another name",
                instance.id
            )),
            _ => error(format!("{}: {e}", root.display())),
        })?;
        let lock = File::create(root.join("lock"))
            .map_err(|e| error(format!("{}/lock: {e}", root.display())))?;
        let owned_instance = OwnedInstance { instance, _lock: lock };
        owned_instance.furnish().map_err(|e| error(format!("{}: {e}", root.display())))?;
        Ok(owned_instance)
    }
}

impl OwnedInstance {
    fn furnish(&self) -> std::io::Result<()> {
        // A process that looks whether this host lives, or sweeps, holds it for a moment.
        retry_on_intr(|| flock(&self._lock, FlockOperation::LockExclusive))?;
        let root = self.instance.root();
        let control = OpenOptions::new()
            .create_new(true)
            .read(true)
            .write(true)
            .open(root.join("control"))?;
        // With memory behind every page: none is missing when it is first written.
        retry_on_intr(|| fallocate(&control, FallocateFlags::empty(), 0, CONTROL_LEN as u64))?;
        let mut config = File::create(root.join("bus.toml"))?;
        writeln!(config, "[global]\nroot-path = \"{}/\"", root.display())?;
        writeln!(config, "prefix = \"{}\"", self.instance.prefix())?;
        writeln!(config, "[global.service]\ncleanup-dead-nodes-on-open = false")?;
        writeln!(config, "[global.node]\ncleanup-dead-nodes-on-creation = false")?;
        writeln!(config, "cleanup-dead-nodes-on-destruction = false")
    }

    /// The instance.
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// The blank control page, for the host to initialise.
    pub fn control(&self) -> Result<ControlPageMapping, BusError> {
        let path = self.instance.control_path();
        let map =
            || ControlPageMapping::map(&OpenOptions::new().read(true).write(true).open(&path)?);
        map().map_err(|e| error(format!("{}: {e}", path.display())))
    }

    /// Opens the host's node. A host that cleans up needs the instance's configuration as the
    /// process-wide one, which can be set once; a second instance in one process is refused.
    pub fn node(&self, in_process: bool) -> Result<BusNode, BusError> {
        if !in_process {
            let file = format!("{}/bus.toml", self.instance.root().display());
            let path =
                FilePath::new(file.as_bytes()).map_err(|e| error(format!("{file}: {e:?}")))?;
            let global = Config::setup_global_config_from_file(&path)
                .map_err(|e| error(format!("{file}: {e:?}")))?;
            if global.global.prefix != self.instance.config().global.prefix {
                return Err(error(
                    "this process already hosted another instance; start each in a process of its own",
                ));
            }
        }
        let node = self.instance.node("sim-host", in_process)?;
        // One file of the transport is made for every user.
        for path in self.instance.segments() {
            let _ = fs::set_permissions(path, Permissions::from_mode(0o600));
        }
        Ok(node)
    }
}

impl Drop for OwnedInstance {
    fn drop(&mut self) {
        self.instance.remove();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::Strategy;

    /// Leaves the files of a host that was killed.
    fn kill(host: OwnedInstance) {
        host.control().unwrap().initialise(0, 1, Strategy::BATCH);
        flock(&host._lock, FlockOperation::Unlock).unwrap();
        std::mem::forget(host);
    }

    /// An id of iceoryx2 that this process could make, and one of a process that has ended.
    fn ids() -> [u128; 2] {
        let mut ended = std::process::Command::new("true").spawn().unwrap();
        ended.wait().unwrap();
        let own = UniqueSystemId::new().unwrap().value();
        let is_own_pid = |shift: &u32| (own >> shift) as u32 == std::process::id();
        let shift = [0, 32, 64, 96].into_iter().find(is_own_pid).unwrap();
        let rest = own & !(u128::from(u32::MAX) << shift);
        [own, rest | u128::from(ended.id()) << shift]
    }

    #[test]
    fn what_a_live_process_has_begun_stays_and_what_an_ended_one_left_is_removed() {
        let host = Instance::create(None).unwrap();
        let instance = &host.instance;
        let [own, ended] = ids();
        let segment = |name: &str| PathBuf::from(format!("{SHM}/{}{name}", instance.prefix()));
        let hash = "0123456789012345678901234567890123456789";
        let names = [
            format!("{hash}_{own}__0.data"),
            format!("{hash}_{ended}__0.data"),
            format!("{hash}_{own}_{own}.connection"),
            format!("{hash}_{own}_{ended}.connection"),
            format!("{hash}.unknown"),
        ];
        for name in &names {
            File::create_new(segment(name)).unwrap();
        }
        assert_eq!(instance.sweep_unfinished_segments(), 2);
        let stays = names.each_ref().map(|name| segment(name).exists());
        assert_eq!(stays, [true, false, true, false, true]);
        let node = |id: u128| instance.root().join("nodes").join(id.to_string());
        for id in [own, ended] {
            fs::create_dir_all(node(id)).unwrap();
        }
        let pid = UniqueSystemId::from(ended).pid().value() as u32;
        assert_eq!(instance.sweep_stuck_nodes(&[pid]), 0);
        assert_eq!(instance.sweep_stuck_nodes(&[]), 1);
        assert!(node(own).exists() && !node(ended).exists());
    }

    #[test]
    fn a_node_that_is_opened_after_the_end_of_the_host_leaves_no_file() {
        let host = Instance::create(Some(&format!("e{}", std::process::id()))).unwrap();
        let instance = host.instance.clone();
        drop(host);
        assert!(matches!(instance.node("late", false), Err(BusError::HostEnds)));
        assert_eq!((instance.segments(), instance.root().exists()), (vec![], false));
    }

    #[test]
    fn an_old_folder_without_a_host_is_removed_at_once_and_a_young_one_stays() {
        let instance = Instance::named(&format!("o{}", std::process::id())).unwrap();
        fs::create_dir(instance.root()).unwrap();
        assert!(!Instance::sweep().contains(&instance.id));
        let old = std::time::SystemTime::now() - 2 * STARTING;
        File::open(instance.root()).unwrap().set_modified(old).unwrap();
        assert!(Instance::sweep().contains(&instance.id));
        assert!(!instance.root().exists());
    }

    #[test]
    fn what_removes_the_files_of_a_dead_host_never_removes_those_of_its_successor() {
        const HOSTS: usize = 100;
        let name = format!("s{}", std::process::id());
        let (hosts, swept) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let succeed = || {
            while hosts.load(Ordering::Relaxed) < HOSTS {
                // Without success, another thread has been the host for a second.
                let Ok(host) = Instance::create(Some(&name)) else { continue };
                let lock = host.instance.root().join("lock");
                for _ in 0..20 {
                    let own = host._lock.metadata().unwrap().ino();
                    let current = fs::metadata(&lock).map(|file| file.ino());
                    assert_eq!(current.ok(), Some(own), "the files of a live host are removed");
                    std::thread::sleep(Duration::from_micros(100));
                }
                hosts.fetch_add(1, Ordering::Relaxed);
                kill(host);
            }
        };
        let sweep = || {
            while hosts.load(Ordering::Relaxed) < HOSTS {
                swept.fetch_add(usize::from(Instance::sweep().contains(&name)), Ordering::Relaxed);
            }
        };
        std::thread::scope(|scope| {
            let threads = [scope.spawn(succeed), scope.spawn(succeed), scope.spawn(succeed)];
            scope.spawn(sweep);
            scope.spawn(sweep);
            let results = threads.map(|thread| thread.join());
            // The other threads end with the first that fails.
            hosts.store(HOSTS, Ordering::Relaxed);
            results.into_iter().for_each(|result| result.unwrap());
        });
        // Either a thread has removed the files of the last host, or they are removed now.
        let last = usize::from(Instance::sweep().contains(&name));
        assert!(swept.into_inner() + last > 0);
    }
}
