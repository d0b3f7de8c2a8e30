"""Where the time of a render goes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field


@dataclass
class Stages:
    """Wall seconds by stage.

    parts  of the stage ``build``: what was built for which object, or for the whole scene ("")
    """

    seconds: dict[str, float] = field(default_factory=dict)
    parts: dict[str, dict[str, float]] = field(default_factory=dict)

    @contextmanager
    def part(self, thing: str, what: str) -> Iterator[None]:
        """Count the block's time as that of building ``what`` for the object ``thing``."""
        start = time.perf_counter()
        yield
        mine = self.parts.setdefault(thing, {})
        mine[what] = mine.get(what, 0.0) + time.perf_counter() - start

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the block's time under ``name``."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
