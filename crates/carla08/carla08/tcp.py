"""Why a client cannot go on: what 0.8's programs catch before they try again."""

import functools
import socket


class TCPConnectionError(Exception):
    """The server is not there, or no longer."""


def wait_for_server(host, port, timeout):
    """Raises at once when nobody listens, without the long time-out of a call."""
    try:
        socket.create_connection((host, port), timeout).close()
    except OSError as error:
        raise TCPConnectionError(f"no server at {host}:{port}: {error}") from error


# How the package, and the door of a simulator that ends, say that nobody is there.
LOST = ("time-out", "timeout", "connection", "host has ended")


def told_as_connection_error(method):
    """The package says RuntimeError when a call is not answered."""

    @functools.wraps(method)
    def wrapped(*args, **kwargs):
        try:
            return method(*args, **kwargs)
        except RuntimeError as error:
            if any(words in str(error).lower() for words in LOST):
                raise TCPConnectionError(str(error)) from error
            raise

    return wrapped
