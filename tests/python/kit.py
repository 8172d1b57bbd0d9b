"""Simulators for the tests: on a small map, with the CPU tracer."""

import faulthandler
import functools
import os
import pathlib

import omnibus

# Ends a test that hangs, with the stack of each thread.
faulthandler.dump_traceback_later(240, exit=True)

launch = functools.partial(omnibus.launch, os.environ["OMNIBUS_TEST_MAP"], device="cpu")


def shared_memory(name: str) -> int:
    """Returns the bytes of an instance in shared memory."""
    files = [*pathlib.Path("/dev/shm").glob(f"omnibus.{name}.*")]
    files += pathlib.Path(f"/dev/shm/omnibus-{name}").rglob("*")
    return sum(path.stat().st_size for path in files if path.exists())


def nothing_is_left(name: str) -> bool:
    """Returns whether no file of an instance is left."""
    return shared_memory(name) == 0 and not pathlib.Path(f"/dev/shm/omnibus-{name}").exists()
