//! What a call returns, and the text of what went wrong.
#![expect(unsafe_code, reason = "names of C functions")]

use std::{
    cell::RefCell,
    ffi::{CString, c_char},
    panic::{AssertUnwindSafe, catch_unwind},
};

use client_lib::{BusError, ClientError, RefusalCode};

/// What a call returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum OmnibusStatus {
    /// It did what it says.
    Ok = 0,
    /// An argument is NULL, not UTF-8, not finite, or out of its range.
    Argument = 1,
    /// No such simulator runs, or shared memory cannot be used.
    Connection = 2,
    /// Header, library and simulator are not of one build.
    Build = 3,
    /// The simulator refused a command; omnibus_last_refusal() says why. The world is as it was.
    Refused = 4,
    /// The state of client or world does not allow it: another client holds the tick, this one
    /// holds it, the world runs on its own clock, or another thread is inside a call.
    NotAllowed = 5,
    /// A frame ended without a stage, which was late or died. The frame was taken in nevertheless.
    Incomplete = 6,
    /// The simulator has ended.
    Ended = 7,
    /// Something did not come in time.
    Timeout = 8,
    /// As many measurements are held as the bundle allows.
    Held = 9,
    /// The bundle was destroyed with its world; create it again.
    WorldGone = 10,
    /// The map cannot be read.
    Map = 11,
    /// Any other cause; the text names it.
    Other = 12,
    /// A defect of the library; please report the text.
    Defect = 13,
}

/// Why a call failed.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) status: OmnibusStatus,
    pub(crate) text: String,
    refusal: u32,
}

impl Fault {
    pub(crate) fn new(status: OmnibusStatus, text: impl Into<String>) -> Fault {
        Fault { status, text: text.into(), refusal: 0 }
    }

    pub(crate) fn argument(text: impl Into<String>) -> Fault {
        Fault::new(OmnibusStatus::Argument, text)
    }

    pub(crate) fn null(what: &str) -> Fault {
        Fault::argument(format!("{what} is NULL"))
    }
}

impl From<ClientError> for Fault {
    fn from(error: ClientError) -> Fault {
        let status = match &error {
            ClientError::Bus(bus) if bus.is_other_build() => OmnibusStatus::Build,
            ClientError::Bus(BusError::TooManyBorrowed) => OmnibusStatus::Held,
            ClientError::Bus(BusError::HostEnds) | ClientError::HostEnded { .. } => {
                OmnibusStatus::Ended
            }
            ClientError::Bus(_) => OmnibusStatus::Connection,
            ClientError::Refused { .. } => OmnibusStatus::Refused,
            ClientError::BadArgument { .. } | ClientError::NoSuchActor { .. } => {
                OmnibusStatus::Argument
            }
            ClientError::TickTaken { .. }
            | ClientError::HoldsTick
            | ClientError::NoSuchClient { .. }
            | ClientError::Asynchronous => OmnibusStatus::NotAllowed,
            ClientError::Incomplete { .. } => OmnibusStatus::Incomplete,
            ClientError::Timeout { .. } => OmnibusStatus::Timeout,
            ClientError::WorldGone { .. } => OmnibusStatus::WorldGone,
            ClientError::Map(_) => OmnibusStatus::Map,
            _ => OmnibusStatus::Other,
        };
        let refusal = error.refusal().map_or(0, |code| code as u32);
        Fault { status, text: error.to_string(), refusal }
    }
}

/// A cause without a code of its own; the text names it.
pub const OMNIBUS_REFUSAL_OTHER: u32 = 1;
/// The actor would be spawned inside the ground, a building or another actor.
pub const OMNIBUS_REFUSAL_SPAWN_COLLISION: u32 = 2;
/// The actor was never spawned, or was destroyed.
pub const OMNIBUS_REFUSAL_UNKNOWN_ACTOR: u32 = 3;
/// No blueprint has this id.
pub const OMNIBUS_REFUSAL_UNKNOWN_BLUEPRINT: u32 = 4;
/// The actor, blueprint or sensor is of a kind that the command does not apply to.
pub const OMNIBUS_REFUSAL_WRONG_KIND: u32 = 5;
/// A number, a count, a pose or a set of bits is outside its range.
pub const OMNIBUS_REFUSAL_OUT_OF_RANGE: u32 = 6;
/// No bundle or sensor has this number.
pub const OMNIBUS_REFUSAL_NOT_FOUND: u32 = 7;
/// A capacity is used up: actors or shared memory.
pub const OMNIBUS_REFUSAL_FULL: u32 = 8;
/// The actor cannot do this in its present state.
pub const OMNIBUS_REFUSAL_WRONG_STATE: u32 = 9;
/// Another world or a saved state replaced the world before the command was carried out.
pub const OMNIBUS_REFUSAL_WORLD_REPLACED: u32 = 13;

/// The numbers are those of the client library.
const _: () = {
    assert!(OMNIBUS_REFUSAL_OTHER == RefusalCode::Other as u32);
    assert!(OMNIBUS_REFUSAL_SPAWN_COLLISION == RefusalCode::SpawnCollision as u32);
    assert!(OMNIBUS_REFUSAL_UNKNOWN_ACTOR == RefusalCode::UnknownActor as u32);
    assert!(OMNIBUS_REFUSAL_UNKNOWN_BLUEPRINT == RefusalCode::UnknownBlueprint as u32);
    assert!(OMNIBUS_REFUSAL_WRONG_KIND == RefusalCode::WrongKind as u32);
    assert!(OMNIBUS_REFUSAL_OUT_OF_RANGE == RefusalCode::OutOfRange as u32);
    assert!(OMNIBUS_REFUSAL_NOT_FOUND == RefusalCode::NotFound as u32);
    assert!(OMNIBUS_REFUSAL_FULL == RefusalCode::Full as u32);
    assert!(OMNIBUS_REFUSAL_WRONG_STATE == RefusalCode::WrongState as u32);
    assert!(OMNIBUS_REFUSAL_WORLD_REPLACED == RefusalCode::WorldReplaced as u32);
};

thread_local! {
    /// Text and refusal of the last call that failed on this thread.
    static LAST: RefCell<(CString, u32)> = RefCell::new((CString::default(), 0));
}

/// Calls `work`, keeps the text of a failure, and catches a panic: none reaches C.
pub(crate) fn call(name: &str, work: impl FnOnce() -> Result<(), Fault>) -> OmnibusStatus {
    // What is behind the references has locks that a panic does not leave half done.
    let worked = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let said = panic.downcast_ref::<String>().map(String::as_str);
        let said = said.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic");
        Err(Fault::new(OmnibusStatus::Defect, format!("defect of the library: {said}")))
    });
    let Err(fault) = worked else { return OmnibusStatus::Ok };
    let text: Vec<u8> =
        format!("{name}: {}", fault.text).into_bytes().into_iter().filter(|b| *b != 0).collect();
    let text = CString::new(text).unwrap_or_default();
    // While a thread ends there is no place for the text any more.
    let _ = LAST.try_with(|last| *last.borrow_mut() = (text, fault.refusal));
    fault.status
}

/// Returns the text of the last call that failed on this thread; an empty text if none failed. It
/// is valid until the next call that fails on this thread.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_last_error() -> *const c_char {
    LAST.try_with(|last| last.borrow().0.as_ptr()).unwrap_or(c"".as_ptr())
}

/// Returns why the simulator refused the last call that failed on this thread: an
/// OMNIBUS_REFUSAL_… number, or 0 if it was no refusal.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_last_refusal() -> u32 {
    LAST.try_with(|last| last.borrow().1).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use std::{ffi::CStr, thread};

    use super::*;

    fn last() -> String {
        // SAFETY: the text is valid until the next call that fails on this thread.
        unsafe { CStr::from_ptr(omnibus_last_error()) }.to_str().unwrap().to_owned()
    }

    #[test]
    fn a_panic_becomes_a_status_with_its_text() {
        assert_eq!(call("omnibus_x", || panic!("a\0b {}", 1)), OmnibusStatus::Defect);
        assert_eq!(last(), "omnibus_x: defect of the library: ab 1");
    }

    #[test]
    fn each_thread_has_the_text_of_its_own_last_failure() {
        assert_eq!(call("omnibus_x", || Err(Fault::null("pose"))), OmnibusStatus::Argument);
        let other = thread::Builder::new().spawn(|| (last(), omnibus_last_refusal())).unwrap();
        assert_eq!(other.join().unwrap(), (String::new(), 0));
        assert_eq!(call("omnibus_y", || Ok(())), OmnibusStatus::Ok);
        assert_eq!(last(), "omnibus_x: pose is NULL");
    }
}
