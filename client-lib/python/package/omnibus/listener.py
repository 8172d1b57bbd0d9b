"""Callbacks: a thread that waits and calls."""

from __future__ import annotations

import threading
from collections.abc import Callable
from types import TracebackType
from typing import Any, overload

from ._omnibus import Bundle, Cancel, Measurement, World
from .client import Client
from .errors import CancelledError


class Listener:
    """A thread that calls a function with each new world or measurement, until ``close()``.

    An exception of the function ends the listener: it is reported as that of any thread
    (``threading.excepthook``) and raised again by ``close()``.
    """

    def __init__(self, wait: Callable[[Cancel], Any], callback: Callable[[Any], object]) -> None:
        self._cancel = Cancel()
        self._error: BaseException | None = None
        self._is_reported = False
        self._thread = threading.Thread(
            target=self._run, args=(wait, callback), name="omnibus-listener", daemon=True
        )
        self._thread.start()

    def _run(self, wait: Callable[[Cancel], Any], callback: Callable[[Any], object]) -> None:
        try:
            while True:
                callback(wait(self._cancel))
        except CancelledError:
            return
        except BaseException as error:
            self._error = error
            raise

    @property
    def is_running(self) -> bool:
        """Whether it still waits and calls."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Ends the listener and waits for its thread; raises what the function has raised, once."""
        self._cancel.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()
        if self._error is not None and not self._is_reported:
            self._is_reported = True
            raise self._error

    def __enter__(self) -> Listener:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


@overload
def listen(source: Client, callback: Callable[[World], object]) -> Listener: ...
@overload
def listen(source: Bundle, callback: Callable[[Measurement], object]) -> Listener: ...
def listen(source: Client | Bundle, callback: Callable[[Any], object]) -> Listener:
    """Calls ``callback`` in a thread of its own: with each measurement of a bundle, or with the
    newest world whenever a client can see a newer one.

    A bundle whose client ticks gives its measurements to ``tick()``: listen to bundles of a client
    that does not tick.
    """
    if isinstance(source, Bundle):
        return Listener(lambda cancel: source.wait(cancel=cancel), callback)
    return Listener(lambda cancel: source.await_frame(cancel=cancel), callback)
