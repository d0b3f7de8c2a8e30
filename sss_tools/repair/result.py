"""What a repair reports, as plain data without numpy."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Literal

Status = Literal["unchanged", "fixed", "partial", "refused"]
RungStatus = Literal["applied", "skipped", "undone"]


@dataclass(frozen=True)
class Rung:
    """How one rung of the ladder ended.

    status  applied; skipped (there was nothing to do, or it could not be tried); undone (it made things worse)
    reason  one line; for an applied rung what it did
    """

    name: str
    status: RungStatus
    reason: str | None = None


@dataclass
class Repair:
    """What became of a mesh; the fields of the JSON object ``repair``.

    status  unchanged (nothing to do, or nothing that was allowed); fixed (no fault is left that the ladder
            mends); partial (better, faults are left); refused (no solid to be had, ``reason`` says why)
    output  where the result was written, None where nothing was
    before, after  counts of faults and measures, ``Condition.to_json``; ``after`` is empty where nothing changed
    lost    what of the file's attributes the result does not carry, or not everywhere
    """

    status: Status
    reason: str | None = None
    output: str | None = None
    rungs: list[Rung] = field(default_factory=list)
    before: dict[str, Any] = field(default_factory=dict)
    after: dict[str, Any] = field(default_factory=dict)
    lost: list[str] = field(default_factory=list)

    @property
    def changed(self) -> bool:
        """Whether there is a result that differs from the input."""
        return self.status in ("fixed", "partial")

    def to_json(self) -> dict[str, Any]:
        """As CONTRACTS section 1 has it."""
        return asdict(self)
