//! Errors of the client library as Python's exceptions, with advice in Python's terms.

use client_lib::ClientError;
use pyo3::{PyErr, exceptions::PyValueError, import_exception};

// Documented in package/omnibus/errors.py.
import_exception!(omnibus.errors, OmnibusError);
import_exception!(omnibus.errors, BuildError);
import_exception!(omnibus.errors, CancelledError);
import_exception!(omnibus.errors, FrameIncompleteError);
import_exception!(omnibus.errors, NotAllowedError);
import_exception!(omnibus.errors, RefusedError);
import_exception!(omnibus.errors, SimulatorEndedError);
import_exception!(omnibus.errors, SimulatorTimeoutError);
import_exception!(omnibus.errors, ViewLimitError);
import_exception!(omnibus.errors, WorldGoneError);

/// Returns the exception for an error of the client library.
pub(crate) fn error(error: ClientError) -> PyErr {
    let text = error.to_string();
    match error {
        ClientError::Bus(why) if why.is_other_build() => BuildError::new_err(format!(
            "{text}: this package is omnibus-sim {}; start its own simulator with \
             omnibus.launch(), or install the wheel that belongs to the running one",
            client_lib::VERSION
        )),
        ClientError::Refused { code, .. } => RefusedError::new_err((text, code.name())),
        ClientError::BadArgument { .. } => PyValueError::new_err(text),
        ClientError::TickTaken { holder } => NotAllowedError::new_err(format!(
            "client {holder:?} holds the tick; wait for its frames with await_frame(), or let it \
             call hand_tick_to(), leave_tick() or close()"
        )),
        ClientError::HoldsTick => NotAllowedError::new_err(
            "join_barrier: this client holds the tick, so no tick waits for it; call leave_tick() \
             first",
        ),
        ClientError::Asynchronous => NotAllowedError::new_err(
            "the world runs on its own clock; call synchronise() to tick it, or wait for its \
             frames with await_frame()",
        ),
        ClientError::Incomplete { frame, .. } => FrameIncompleteError::new_err((
            format!("{text}; the simulator's standard error says why, and the next tick goes on"),
            frame.0,
        )),
        ClientError::HostEnded { .. } => SimulatorEndedError::new_err(format!(
            "{text}; its standard error says why: start another with omnibus.launch() and connect \
             again"
        )),
        ClientError::Timeout { .. } => SimulatorTimeoutError::new_err(text),
        ClientError::WorldGone { .. } => WorldGoneError::new_err(text),
        _ => OmnibusError::new_err(text),
    }
}
