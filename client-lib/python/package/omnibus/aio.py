"""The same waits for asyncio: other tasks run meanwhile, and a cancelled task ends its wait."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import TYPE_CHECKING, TypeVar

from ._omnibus import Bundle, Cancel, Measurement, World

if TYPE_CHECKING:
    from .client import Client, Frame

T = TypeVar("T")


async def _in_thread(wait: Callable[[Cancel], T]) -> T:
    cancel = Cancel()
    try:
        return await asyncio.to_thread(wait, cancel)
    finally:
        cancel.set()


async def tick(client: Client, timeout_secs: float | None = None) -> Frame:
    """As ``Client.tick``. A tick that is cancelled was requested nevertheless: the world advances."""
    return await _in_thread(lambda cancel: client.tick(timeout_secs, cancel=cancel))


async def frames(client: Client) -> AsyncIterator[World]:
    """As ``Client.frames``."""
    while True:
        yield await _in_thread(lambda cancel: client.await_frame(cancel=cancel))


async def measurements(bundle: Bundle) -> AsyncIterator[Measurement]:
    """Yields each measurement of a bundle."""
    while True:
        yield await _in_thread(lambda cancel: bundle.wait(cancel=cancel))
