"""Sensors with callbacks, stopped so that Python can exit.

The package drops a callback in a thread of its own, some time after `stop()`. If the
interpreter has exited by then, the process aborts; `end_all` therefore waits for them.
"""

import threading
import weakref

# Longest time to wait for a running callback. Seconds.
PATIENCE_SECONDS = 2.0


class _Callback:
    """An object that only the package keeps alive."""

    def __init__(self, take):
        self._take = take

    def __call__(self, data):
        self._take(data)


class Listener:
    """A sensor and the function that receives its data."""

    def __init__(self, actor, take):
        self._actor = actor
        self._gone = threading.Event()
        callback = _Callback(take)
        weakref.finalize(callback, self._gone.set).atexit = False
        actor.listen(callback)

    def stop(self):
        """Stops the sensor."""
        self._actor.stop()
        self._actor.destroy()

    def wait(self):
        """Waits until no callback is running."""
        return self._gone.wait(PATIENCE_SECONDS)


def end_all(listeners):
    """Stops all sensors, then waits for their callbacks."""
    for listener in listeners:
        listener.stop()
    for listener in listeners:
        listener.wait()
