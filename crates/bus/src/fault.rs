//! Dying on purpose, for the tests of the crash rules.
//!
//! `OMNIBUS_FAULT=<role>:<point>:<every>` kills a process of that role with SIGKILL when it passes
//! the point at a frame that `every` divides, but never at the first frame of its life, so that
//! its successor gets on. At the point `joining` there is no frame: there every second life dies.
//! `OMNIBUS_DELAY=<role>:<max_micros>` makes a role dawdle up to so long at each frame, by a
//! pattern of the frame number. Both cost one comparison when they are not set.

use std::{sync::OnceLock, time::Duration};

use rustix::process::{Signal, getpid, kill_process};

use crate::Role;
use protocol::Frame;

struct Plan {
    role: String,
    point: String,
    every: u64,
}

fn plan() -> Option<&'static Plan> {
    static PLAN: OnceLock<Option<Plan>> = OnceLock::new();
    PLAN.get_or_init(|| {
        let text = std::env::var("OMNIBUS_FAULT").ok()?;
        let mut parts = text.split(':');
        let role = parts.next()?.to_owned();
        let point = parts.next()?.to_owned();
        Some(Plan { role, point, every: parts.next()?.parse().ok()? })
    })
    .as_ref()
}

fn die() -> ! {
    let _ = kill_process(getpid(), Signal::KILL);
    unreachable!("the kernel does not return from SIGKILL");
}

/// A place where a process of `role` may be told to die, at `frame` of a life that began with
/// `first`.
pub fn point(role: Role, name: &str, frame: Frame, first: Frame) {
    if let Some(plan) = plan()
        && plan.role == role.name()
        && plan.point == name
        && frame > first
        && frame.0.is_multiple_of(plan.every)
    {
        die();
    }
}

/// Where a process of `role` has joined but is not ready.
pub fn joining(role: Role) {
    let life = || std::env::var("OMNIBUS_LIFE").ok()?.parse::<u64>().ok();
    if let Some(plan) = plan()
        && plan.role == role.name()
        && plan.point == "joining"
        && life().is_some_and(|life| life > 0 && !life.is_multiple_of(2))
    {
        die();
    }
}

/// Where a process of `role` may be told to dawdle.
pub fn delay(role: Role, frame: Frame) {
    static DELAY: OnceLock<Option<(String, u64)>> = OnceLock::new();
    let delay = DELAY.get_or_init(|| {
        let text = std::env::var("OMNIBUS_DELAY").ok()?;
        let (role, micros) = text.split_once(':')?;
        Some((role.to_owned(), micros.parse().ok()?))
    });
    if let Some((slow, micros)) = delay
        && slow == role.name()
    {
        let mixed = frame.0.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        std::thread::sleep(Duration::from_micros(mixed % (micros + 1)));
    }
}
