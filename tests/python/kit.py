"""Simulators for the tests: on a small map, with the CPU tracer."""

import contextlib
import faulthandler
import functools
import os
import pathlib
import signal
import subprocess
import sys

import omnibus

# Ends a test that hangs, with the stack of each thread.
faulthandler.register(signal.SIGALRM, chain=True)
signal.alarm(240)

launch = functools.partial(omnibus.launch, os.environ["OMNIBUS_TEST_MAP"], device="cpu")


def shared_memory(name: str) -> int:
    """Returns the bytes of an instance's channels in shared memory."""
    total = 0
    for path in pathlib.Path("/dev/shm").glob(f"omnibus.{name}.*"):
        # It may be removed meanwhile.
        with contextlib.suppress(FileNotFoundError):
            total += path.stat().st_size
    return total


def nothing_is_left(name: str) -> bool:
    """Returns whether no file of an instance is left."""
    return shared_memory(name) == 0 and not pathlib.Path(f"/dev/shm/omnibus-{name}").exists()


def run_python(program: str) -> subprocess.CompletedProcess[str]:
    """Runs a program in an interpreter of its own, which finds this module."""
    command = [sys.executable, "-X", "faulthandler", "-c", program]
    environment = {**os.environ, "PYTHONPATH": str(pathlib.Path(__file__).parent)}
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
