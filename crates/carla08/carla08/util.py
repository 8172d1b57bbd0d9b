"""Small things that 0.8's programs import."""

import contextlib
import sys
import time

from .tcp import TCPConnectionError


@contextlib.contextmanager
def make_connection(client_type, *args, **kwargs):
    """A client that is connected inside the `with` block."""
    client = client_type(*args, **kwargs)
    try:
        client.connect()
        yield client
    finally:
        client.disconnect()


def print_over_same_line(text):
    """Prints over what was printed last."""
    width = max(len(text), getattr(print_over_same_line, "width", 0))
    sys.stdout.write("\r" + text.ljust(width))
    sys.stdout.flush()
    print_over_same_line.width = len(text)


def retry_until_served(work, log, seconds=1.0):
    """Runs `work` again, once a second, for as long as the server is not there."""
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
        """Starts anew."""
        self.start, self.end = time.time(), None

    def stop(self):
        """Holds the time."""
        self.end = time.time()

    def seconds(self):
        """Seconds between start and stop."""
        return (self.end or time.time()) - self.start

    def milliseconds(self):
        """Milliseconds between start and stop."""
        return 1000.0 * self.seconds()
