"""What all charts share: matplotlib where it is installed, colours that most eyes can tell apart, files."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from sss_tools.errors import InputError
from sss_tools.files import write_atomically

COLOURS = {
    "path": "#0072B2",
    "plumb": "#E69F00",
    "scalar": "#009E73",
    "diffuse": "#CC79A7",
    "auto": "#000000",
    "mitsuba": "#D55E00",
    "opaque": "#BBBBBB",
}
"""Okabe & Ito 2008, "Color Universal Design"."""
MARKERS = {"path": "o", "plumb": "s", "scalar": "^", "diffuse": "v", "auto": "D", "mitsuba": "X"}
LABELS = {"mitsuba": "Mitsuba 3"}


def require() -> None:
    """Raise InputError where there is nothing to draw with."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise InputError("charts", "matplotlib is not installed", "pip install 'sss-tools[charts]'") from None


def pyplot() -> Any:
    """matplotlib.pyplot, drawing to files only. Raises InputError where it is missing."""
    require()
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    pyplot.rcParams.update({
        "font.size": 9, "axes.titlesize": 10, "axes.spines.top": False, "axes.spines.right": False,
        "axes.grid": True, "grid.color": "#DDDDDD", "grid.linewidth": 0.5, "legend.frameon": False,
        "svg.hashsalt": "sss-chart", "figure.constrained_layout.use": True,
    })  # fmt: skip
    return pyplot


def save(figure: Any, folder: Path, name: str) -> None:
    """PNG and SVG, and close the figure. The same figure gives the same bytes."""
    for kind, options in (("png", {"dpi": 130}), ("svg", {"metadata": {"Date": None}})):
        buffer = io.BytesIO()
        figure.savefig(buffer, format=kind, facecolor="white", **options)
        write(folder / f"{name}.{kind}", buffer.getvalue())
    pyplot().close(figure)


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[dict[str, object]]) -> None:
    """Numbers with six figures; what is not known is left empty."""
    text = io.StringIO()
    table = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow({name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()})
    write(path, text.getvalue().encode())


def write(path: Path, data: bytes) -> None:
    """Whole or not at all; InputError where that cannot be done."""
    try:
        write_atomically(path, data)
    except OSError as error:
        raise InputError(path, f"cannot be written ({error.strerror})", "choose another folder") from None


def log_ticks(axis: Any) -> None:
    """Plain numbers at 1, 2 and 5 of every power of ten, fewer where there are many powers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    wide = high / max(low, 1e-300) > 2e3
    axis.set_major_locator(LogLocator(10, subs=(1.0,) if wide else (1.0, 2.0, 5.0), numticks=20))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
