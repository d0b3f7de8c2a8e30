"""Ctrl-C and SIGTERM, by which batch systems end jobs, as one interrupt that no library hides."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Raise KeyboardInterrupt at either signal; yields what tells whether one came.

    A library may take an interrupt for an error of its own: NumPy, while it is being imported, says that its
    installation is broken. A signal that is ignored stays so, and outside the main thread nothing changes.
    """
    import signal
    import threading

    came = False

    def interrupt(*_: Any) -> None:
        nonlocal came
        came = True
        raise KeyboardInterrupt

    before = {}
    try:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                    before[number] = signal.signal(number, interrupt)
        yield lambda: came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
