//! The connection: connect, tick, wait, close.
#![expect(unsafe_code, reason = "names of C functions")]

use std::{
    ffi::{CStr, c_char},
    mem::MaybeUninit,
    sync::{Mutex, MutexGuard, TryLockError},
    time::Duration,
};

use client_lib::{Client, Pace};

use crate::{
    argument::{optional_text, place, text},
    status::{Fault, OmnibusStatus, call},
};

/// The version of the declarations in this header. omnibus_connect() compares it with that of the
/// library.
pub const OMNIBUS_INTERFACE: u32 = 4;

/// A connection to a running simulator. One thread at a time uses it: a call while another thread
/// is inside a call returns OMNIBUS_STATUS_NOT_ALLOWED.
pub struct OmnibusClient {
    client: Mutex<Client>,
}

/// The client, for one call.
pub(crate) fn enter(client: Option<&OmnibusClient>) -> Result<MutexGuard<'_, Client>, Fault> {
    let client = client.ok_or_else(|| Fault::null("client"))?;
    lock(&client.client, "client")
}

/// A lock that is free, or the error that another thread is inside a call.
pub(crate) fn lock<'a, T>(mutex: &'a Mutex<T>, what: &str) -> Result<MutexGuard<'a, T>, Fault> {
    match mutex.try_lock() {
        Ok(guard) => Ok(guard),
        // A panic was reported to the call in which it happened.
        Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => Err(Fault::new(
            OmnibusStatus::NotAllowed,
            format!("another thread is inside a call with this {what}; give each thread its own"),
        )),
    }
}

/// Returns a time of C, which must be from 0 on; infinity is `None`.
fn seconds(what: &str, secs: f64) -> Result<Option<Duration>, Fault> {
    if secs == f64::INFINITY {
        return Ok(None);
    }
    let time = Duration::try_from_secs_f64(secs);
    time.map(Some).map_err(|_| Fault::argument(format!("{what} is {secs}, not a time in seconds")))
}

/// Returns a time of C that must be finite.
fn finite(what: &str, secs: f64) -> Result<Duration, Fault> {
    let no_limit = || Fault::argument(format!("{what} is infinite; a finite time is needed"));
    seconds(what, secs)?.ok_or_else(no_limit)
}

/// Returns the version of the library and of what it shares with the simulator, as
/// "0.1.0 (build 0123456789abcdef)". `omnibus --version` prints that of the program, which must be
/// the same. The text is never freed.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_build() -> *const c_char {
    const BUILD: &CStr = {
        const BYTES: [u8; client_lib::VERSION.len() + 1] = {
            let mut bytes = [0; client_lib::VERSION.len() + 1];
            let mut i = 0;
            while i < client_lib::VERSION.len() {
                bytes[i] = client_lib::VERSION.as_bytes()[i];
                i += 1;
            }
            bytes
        };
        match CStr::from_bytes_with_nul(&BYTES) {
            Ok(build) => build,
            Err(_) => panic!("the version has a zero byte"),
        }
    };
    BUILD.as_ptr()
}

/// Connects to the simulator of the name `instance`, or with NULL to the only one that runs. `name`
/// is that of the client, unique in its simulator: commands of one frame are carried out in the
/// order of names. `interface` is OMNIBUS_INTERFACE.
///
/// `*client` belongs to the caller until it is given to omnibus_close().
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_connect(
    interface: u32,
    name: *const c_char,
    instance: *const c_char,
    client: Option<&mut MaybeUninit<Box<OmnibusClient>>>,
) -> OmnibusStatus {
    call("omnibus_connect", || {
        if interface != OMNIBUS_INTERFACE {
            return Err(Fault::new(
                OmnibusStatus::Build,
                format!(
                    "the program was compiled with interface {interface} of omnibus.h, and this \
                     library has interface {OMNIBUS_INTERFACE}; compile it with the header of this \
                     library"
                ),
            ));
        }
        let place = place(client, "client")?;
        let connected = Client::connect(optional_text(instance, "instance")?, text(name, "name")?)?;
        place.write(Box::new(OmnibusClient { client: Mutex::new(connected) }));
        Ok(())
    })
}

/// Ends a connection and frees it; NULL is ignored. Bundles and measurements stay valid and are
/// released on their own; the actors of omnibus_world() are not. Actors that it spawned stay in the
/// simulator.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_close(client: Option<Box<OmnibusClient>>) {
    call("omnibus_close", || {
        drop(client);
        Ok(())
    });
}

/// Sets how long calls wait: for a frame, at first without a limit (INFINITY), and for the outcome
/// of a command or a measurement, at first 30 s. Both in seconds.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_set_timeouts(
    client: Option<&OmnibusClient>,
    frame_secs: f64,
    answer_secs: f64,
) -> OmnibusStatus {
    call("omnibus_set_timeouts", || {
        let frame = seconds("frame_secs", frame_secs)?;
        let answer = finite("answer_secs", answer_secs)?;
        let mut client = enter(client)?;
        let deadlines = client.deadlines().with_frame(frame).with_answer(answer);
        client.set_deadlines(deadlines);
        Ok(())
    })
}

/// Takes the tick and makes the world wait for it: each omnibus_tick() is `delta_secs` of simulated
/// time long, 0.0001 to 10 s.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_synchronise(
    client: Option<&OmnibusClient>,
    delta_secs: f64,
) -> OmnibusStatus {
    call("omnibus_synchronise", || {
        let delta = finite("delta_secs", delta_secs)?;
        Ok(enter(client)?.synchronise(delta)?)
    })
}

/// Lets the world run on its own clock, at `factor` simulated seconds per real second; it waits for
/// no client.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_run_freely(client: Option<&OmnibusClient>, factor: f64) -> OmnibusStatus {
    call("omnibus_run_freely", || {
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(Fault::argument(format!("factor is {factor}, not a positive number")));
        }
        let mut client = enter(client)?;
        let settings = client.settings().with_pace(Pace::RealTime(factor as f32));
        Ok(client.apply_settings(settings)?)
    })
}

/// Advances the world by one tick and takes the new frame in. When it returns, every participant
/// has done its work for the frame, and its measurements are in their bundles. `frame` may be NULL.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_tick(
    client: Option<&OmnibusClient>,
    frame: Option<&mut MaybeUninit<u64>>,
) -> OmnibusStatus {
    call("omnibus_tick", || {
        let ticked = enter(client)?.tick()?;
        if let Some(frame) = frame {
            frame.write(ticked.0);
        }
        Ok(())
    })
}

/// Waits until a newer frame than the one that was taken in last is published, and takes the newest
/// in: for clients that do not tick. `frame` may be NULL.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_await_frame(
    client: Option<&OmnibusClient>,
    frame: Option<&mut MaybeUninit<u64>>,
) -> OmnibusStatus {
    call("omnibus_await_frame", || {
        let newest = enter(client)?.await_frame()?;
        if let Some(frame) = frame {
            frame.write(newest.0);
        }
        Ok(())
    })
}

/// Takes the newest frame in, without waiting; `*is_newer` says whether it is newer than the one
/// before. `is_newer` may be NULL.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_refresh(
    client: Option<&OmnibusClient>,
    is_newer: Option<&mut MaybeUninit<bool>>,
) -> OmnibusStatus {
    call("omnibus_refresh", || {
        let newer = enter(client)?.refresh()?;
        if let Some(is_newer) = is_newer {
            is_newer.write(newer);
        }
        Ok(())
    })
}

/// Makes every tick of another client wait until this one has called omnibus_arrive() for the
/// frame. Not for the client that ticks.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_join_barrier(client: Option<&OmnibusClient>) -> OmnibusStatus {
    call("omnibus_join_barrier", || Ok(enter(client)?.join_barrier()?))
}

/// Reports that this client's work for the frame that it took in last is done.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_arrive(client: Option<&OmnibusClient>) -> OmnibusStatus {
    call("omnibus_arrive", || {
        enter(client)?.arrive();
        Ok(())
    })
}

/// Lets ticks pass without waiting for this client.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_leave_barrier(client: Option<&OmnibusClient>) -> OmnibusStatus {
    call("omnibus_leave_barrier", || Ok(enter(client)?.leave_barrier()?))
}
