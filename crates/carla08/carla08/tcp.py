"""The connection error, after which the programs of 0.8 retry."""

import functools
import socket


class TCPConnectionError(Exception):
    """The server cannot be reached."""


def wait_for_server(host, port, timeout):
    """Raises at once if no server listens, without the timeout of a call."""
    try:
        socket.create_connection((host, port), timeout).close()
    except OSError as error:
        raise TCPConnectionError(f"no server at {host}:{port}: {error}") from error


# Messages of the package, and of a simulator that ends, that mean a lost connection.
LOST = ("time-out", "timeout", "connection", "host has ended")


def told_as_connection_error(method):
    """Converts the RuntimeError of an unanswered call."""

    @functools.wraps(method)
    def wrapped(*args, **kwargs):
        try:
            return method(*args, **kwargs)
        except RuntimeError as error:
            if any(words in str(error).lower() for words in LOST):
                raise TCPConnectionError(str(error)) from error
            raise

    return wrapped
