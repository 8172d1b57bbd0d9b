"""Helpers that the programs of 0.8 import."""

import contextlib
import sys
import time

from .tcp import TCPConnectionError


@contextlib.contextmanager
def make_connection(client_type, *args, **kwargs):
    """Yields a connected client."""
    client = client_type(*args, **kwargs)
    try:
        client.connect()
        yield client
    finally:
        client.disconnect()


def print_over_same_line(text):
    """Prints over the previous line."""
    width = max(len(text), getattr(print_over_same_line, "width", 0))
    sys.stdout.write("\r" + text.ljust(width))
    sys.stdout.flush()
    print_over_same_line.width = len(text)


def retry_until_served(work, log, seconds=1.0):
    """Runs `work`; retries once a second while the server cannot be reached."""
    while True:
        try:
            return work()
        except TCPConnectionError as error:
            log.error("%s", error)
            time.sleep(seconds)


class StopWatch:
    """Measures wall-clock time."""

    def __init__(self):
        self.restart()

    def restart(self):
        """Restarts the watch."""
        self.start, self.end = time.time(), None

    def stop(self):
        """Stops the watch."""
        self.end = time.time()

    def seconds(self):
        """Returns the seconds between start and stop."""
        return (self.end or time.time()) - self.start

    def milliseconds(self):
        """Returns the milliseconds between start and stop."""
        return 1000.0 * self.seconds()
