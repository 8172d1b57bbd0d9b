"""Why calls fail. Each message says what, which, and what to try."""

from __future__ import annotations


class OmnibusError(Exception):
    """Why a call of this package failed; every other exception of this module is one."""


class RefusedError(OmnibusError):
    """The simulator refused a command; the world is as it was.

    ``code`` is the cause to be matched, as ``"SpawnCollision"`` (docs/errors.md).
    """

    def __init__(self, message: str, code: str = "Other") -> None:
        super().__init__(message, code)
        self.message = message
        self.code = code

    def __str__(self) -> str:
        return self.message


class FrameIncompleteError(OmnibusError):
    """A frame ended without a part of the simulator, which was late or died.

    ``frame`` is its number. The world is at that frame; the next tick goes on.
    """

    def __init__(self, message: str, frame: int = 0) -> None:
        super().__init__(message, frame)
        self.message = message
        self.frame = frame

    def __str__(self) -> str:
        return self.message


class SimulatorEndedError(OmnibusError):
    """The simulator has ended, or was killed."""


class SimulatorTimeoutError(OmnibusError, TimeoutError):
    """Something did not come within its time limit."""


class BuildError(OmnibusError):
    """This package and the program or the running simulator are of different builds."""


class ViewLimitError(OmnibusError):
    """As many measurements of a bundle are held as it allows, and it does not copy."""


class WorldGoneError(OmnibusError):
    """Another world was loaded; the bundles of the old one were destroyed with it."""


class NotAllowedError(OmnibusError):
    """The call is not possible in this state: another client holds the tick, the client is closed,
    or the process is a fork of the one that connected."""


class CancelledError(OmnibusError):
    """A wait was ended by ``Cancel.set()``."""
