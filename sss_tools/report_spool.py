"""Reports that wait on disk until they are written out, in order, one at a time."""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Iterator, Sequence
from typing import overload

from .validation.outcome import MeshReport


class ReportSpool(Sequence[MeshReport]):
    """``length`` reports, put in any order; each access reads one from a temporary file that nobody else sees.

    Raises IndexError for a report that was not put yet.
    """

    def __init__(self, length: int):
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as this object
        self._places: list[int | None] = [None] * length

    def put(self, number: int, report: MeshReport) -> None:
        """Keep the report with this number."""
        self._places[number] = self._file.seek(0, 2)
        pickle.dump(report, self._file, pickle.HIGHEST_PROTOCOL)

    def __len__(self) -> int:
        return len(self._places)

    @overload
    def __getitem__(self, number: int) -> MeshReport: ...

    @overload
    def __getitem__(self, number: slice) -> list[MeshReport]: ...

    def __getitem__(self, number: int | slice) -> MeshReport | list[MeshReport]:
        if isinstance(number, slice):
            return [self[place] for place in range(*number.indices(len(self)))]
        place = self._places[number]
        if place is None:
            raise IndexError(f"report {number} was not put yet")
        self._file.seek(place)
        return pickle.load(self._file)

    def __iter__(self) -> Iterator[MeshReport]:
        return (self[number] for number in range(len(self)))
