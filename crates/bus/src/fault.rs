//! Deliberate process death, for the tests of the crash rules.
//!
//! Nothing here acts until the process calls [`arm_from_environment`], and only the program that
//! the tests start does so. In every other process, a user's program that links `client-lib`
//! included, each fault point costs one load and the environment is never read.
//!
//! In an armed process `OMNIBUS_FAULT=<role>:<point>:<every>` kills a process of that role with
//! SIGKILL when it passes the point at a frame that `every` divides, but never at the first frame
//! of its life, so that its successor makes progress. The point `joining` has no frame: every
//! second life dies there. `OMNIBUS_DELAY=<role>:<max_micros>` delays a role by up to that time at
//! each frame, by a pattern of the frame number.

use std::{sync::OnceLock, time::Duration};

use rustix::process::{Signal, getpid, kill_process};

use crate::Role;
use protocol::Frame;

/// What the tests ask of this process; not set in a process that is not under test.
static PLAN: OnceLock<Plan> = OnceLock::new();

#[derive(Default)]
struct Plan {
    death: Option<Death>,
    delay: Option<Delay>,
}

struct Death {
    role: String,
    point: String,
    every: u64,
}

struct Delay {
    role: String,
    micros_max: u64,
}

/// Lets `OMNIBUS_FAULT` and `OMNIBUS_DELAY` act on this process. Only the program that the tests
/// start calls it.
pub fn arm_from_environment() {
    let death = || {
        let text = std::env::var("OMNIBUS_FAULT").ok()?;
        let mut parts = text.split(':');
        let role = parts.next()?.to_owned();
        let point = parts.next()?.to_owned();
        Some(Death { role, point, every: parts.next()?.parse().ok()? })
    };
    let delay = || {
        let text = std::env::var("OMNIBUS_DELAY").ok()?;
        let (role, micros) = text.split_once(':')?;
        Some(Delay { role: role.to_owned(), micros_max: micros.parse().ok()? })
    };
    let _ = PLAN.set(Plan { death: death(), delay: delay() });
}

fn death_at(role: Role, point: &str) -> Option<&'static Death> {
    let death = PLAN.get()?.death.as_ref()?;
    (death.role == role.name() && death.point == point).then_some(death)
}

fn die() -> ! {
    let _ = kill_process(getpid(), Signal::KILL);
    unreachable!("the kernel does not return from SIGKILL");
}

/// A point where an armed process of `role` may die, at `frame` of a life that began with `first`.
pub fn point(role: Role, name: &str, frame: Frame, first: Frame) {
    if let Some(death) = death_at(role, name)
        && frame > first
        && frame.0.is_multiple_of(death.every)
    {
        die();
    }
}

/// The point at which a process of `role` has joined but is not ready.
pub fn joining(role: Role) {
    let life = || std::env::var("OMNIBUS_LIFE").ok()?.parse::<u64>().ok();
    if death_at(role, "joining").is_some()
        && life().is_some_and(|life| life > 0 && !life.is_multiple_of(2))
    {
        die();
    }
}

/// A point where an armed process of `role` may be delayed.
pub fn delay(role: Role, frame: Frame) {
    if let Some(delay) = PLAN.get().and_then(|plan| plan.delay.as_ref())
        && delay.role == role.name()
    {
        let mixed = frame.0.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        std::thread::sleep(Duration::from_micros(mixed % (delay.micros_max + 1)));
    }
}

#[cfg(test)]
mod tests {
    use std::{os::unix::process::ExitStatusExt, process::Command};

    use super::*;

    /// Runs `passes_a_fault_point` in a process of its own and returns the signal that ended it.
    fn signal_of(is_armed: bool) -> Option<i32> {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "fault::tests::passes_a_fault_point"]);
        command.env("OMNIBUS_FAULT", "client:leaving:1");
        if is_armed {
            command.env("OMNIBUS_TEST_ARMED", "1");
        }
        let status = command.output().unwrap().status;
        assert!(status.success() || status.signal().is_some(), "{status}");
        status.signal()
    }

    #[test]
    fn passes_a_fault_point() {
        if std::env::var_os("OMNIBUS_TEST_ARMED").is_some() {
            arm_from_environment();
        }
        point(Role::Client, "leaving", Frame(2), Frame(1));
    }

    #[test]
    fn the_environment_kills_only_a_process_that_was_armed() {
        assert_eq!(signal_of(false), None);
        assert_eq!(signal_of(true), Some(9));
    }
}
