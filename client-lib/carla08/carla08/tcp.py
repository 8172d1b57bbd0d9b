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


def told_as_connection_error(method):
    """The package says RuntimeError when a call is not answered in time."""

    @functools.wraps(method)
    def wrapped(*args, **kwargs):
        try:
            return method(*args, **kwargs)
        except RuntimeError as error:
            text = str(error)
            if "time-out" in text or "rpc::timeout" in text or "connection" in text.lower():
                raise TCPConnectionError(text) from error
            raise

    return wrapped
