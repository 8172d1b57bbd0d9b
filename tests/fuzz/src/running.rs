//! The execution in progress, and what is kept of one that fails.

use std::{
    fs,
    path::PathBuf,
    process,
    sync::{Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

/// An execution that lasts longer ends a soak.
const LONGEST: Duration = Duration::from_secs(60);

/// The execution in progress.
pub(crate) struct Running {
    pub(crate) target: &'static str,
    pub(crate) bytes: Vec<u8>,
    pub(crate) begun: Instant,
}

static RUNNING: Mutex<Option<Running>> = Mutex::new(None);

/// Keeps an input and returns where, and the command that repeats it.
pub(crate) fn keep(target: &str, bytes: &[u8]) -> String {
    let mut hash = mesh::WordHash::new();
    hash.bytes(bytes);
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../target/fuzz");
    let path = folder.join(format!("{target}-{:016x}", hash.value()));
    match fs::create_dir_all(&folder).and_then(|()| fs::write(&path, bytes)) {
        Ok(()) => format!(
            "repeat it: cargo run --release -p omnibus-fuzz --bin fuzz -- {target} {}",
            path.display()
        ),
        Err(e) => format!("its input is not kept: {}: {e}", path.display()),
    }
}

pub(crate) fn set_running(running: Option<Running>) {
    *RUNNING.lock().unwrap_or_else(PoisonError::into_inner) = running;
}

/// Ends the process, and keeps the input of the execution in progress.
pub(crate) fn abandon(why: &str) -> ! {
    let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(Running { target, bytes, .. }) = running {
        eprintln!("{target}: {why}; {}", keep(target, &bytes));
    }
    process::exit(1)
}

/// Ends the process when an execution lasts too long.
pub(crate) fn watch() {
    loop {
        thread::sleep(Duration::from_secs(1));
        let running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        let is_long = running.as_ref().is_some_and(|running| running.begun.elapsed() > LONGEST);
        drop(running);
        if is_long {
            abandon(&format!("it has run for {} s", LONGEST.as_secs()));
        }
    }
}
