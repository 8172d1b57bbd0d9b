"""Sensors that are listened to, and let go of so that Python can end.

The package drops a callback in a thread of its own, some time after `stop()`. Where the
interpreter has ended by then, the process aborts; so `end_all` waits until they are gone.
"""

import threading
import weakref

# Seconds to wait for a callback that is in use for ever.
PATIENCE_SECONDS = 2.0


class _Callback:
    """Held by the package alone."""

    def __init__(self, take):
        self._take = take

    def __call__(self, data):
        self._take(data)


class Listener:
    """A sensor, and who takes what it measures."""

    def __init__(self, actor, take):
        self._actor = actor
        self._gone = threading.Event()
        callback = _Callback(take)
        weakref.finalize(callback, self._gone.set).atexit = False
        actor.listen(callback)

    def stop(self):
        """Measures no more."""
        self._actor.stop()
        self._actor.destroy()

    def wait(self):
        """Until nobody calls back any more."""
        return self._gone.wait(PATIENCE_SECONDS)


def end_all(listeners):
    """Stops all, then waits for all."""
    for listener in listeners:
        listener.stop()
    for listener in listeners:
        listener.wait()
