"""sss-inspect: look at a mesh, a scene or a record, with what is wrong drawn where it is."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sss_tools.errors import InputError
from sss_tools.reading import read_file

from .command import ArgumentParser, complain, progress, run

if TYPE_CHECKING:
    from renderer.inspection.exhibit import Exhibit
    from renderer.inspection.layer import Artist

PROGRAM = "sss-inspect"

LIVE = (640, 480)
"""Greatest size of the window of ``--live``, pixels."""
COLOURS = ("finding", "thickness", "shader", "component")

# before NumPy is imported: on a busy machine OpenBLAS's own threads wait for each other longer than they work
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main(argv: Sequence[str] | None = None) -> int:
    """The command. Returns the exit status: 0 looked, 2 refused, 130 interrupted."""
    return run(PROGRAM, _inspect, argv)


def _inspect(argv: Sequence[str] | None) -> int:
    options = _parser().parse_args(argv)
    for output, suffix in ((options.screenshot, ".png"), (options.html, ".html")):
        if output is not None:
            _check_output(output, suffix, options.subject)
    if options.picture is not None and options.html is None:
        raise InputError("--picture", "goes on a page", "add --html FILE.html, or leave it out")

    if options.live:
        return _live(options)
    picture = None if options.picture is None else _read_picture(options.picture)
    interactive = options.screenshot is None and options.html is None
    if interactive:
        _refuse_without_screen()

    from renderer.inspection.exhibit import put_together

    from .inspect_subject import inspection_of

    with progress(3, "checking", options.quiet) as advance:
        inspection = inspection_of(options, lambda text: None if options.quiet else complain(PROGRAM, text, "warning"))
        advance(1, "looking for the best view")
        exhibit = put_together(inspection, options.color)
        advance(1, "drawing")
        if options.screenshot is not None:
            _write_still(exhibit, options)
        if options.html is not None:
            from renderer.inspection.page import render_page

            _write(options.html, render_page(exhibit, picture, options.clip).encode(errors="backslashreplace"))
    if interactive:
        from renderer.inspection.window import Window

        Window(exhibit, options.clip).run()
    elif not options.quiet:
        _say(exhibit, options)
    return 0


def _live(options: Any) -> int:
    """A window with our own picture in it."""
    for name in ("screenshot", "html", "rule", "clip", "picture"):
        if getattr(options, name) is not None:
            raise InputError("--live", f"goes without --{name}", "leave one of them out")
    _refuse_without_screen()
    from renderer.inspection.live import Live
    from renderer.inspection.live_window import LiveWindow

    from .inspect_subject import scene_of

    with progress(1, "building", options.quiet):
        scene = scene_of(options)
        width, height = scene.camera.resolution
        share = min(LIVE[0] / width, LIVE[1] / height)
        live = Live(scene, (max(round(share * width), 1), max(round(share * height), 1)), options.preview)
    LiveWindow(live, Path(options.subject).name).run()
    return 0


def _refuse_without_screen() -> None:
    from renderer.inspection import gl

    drawable = gl.preflight()
    if drawable.window is None:
        raise InputError("no window can be opened", drawable.problem, "or use --screenshot FILE.png, --html FILE.html")
    if not drawable.on_screen:
        raise InputError("no window can be opened", "there is no display",
                         "set DISPLAY, or use --screenshot FILE.png or --html FILE.html")  # fmt: skip


def _write_still(exhibit: Exhibit, options: Any) -> None:
    from renderer.inspection.still import compose, png

    artist = _artist(exhibit, options)
    _write(options.screenshot, png(compose(exhibit, artist, options.size, options.clip)))


def _artist(exhibit: Exhibit, options: Any) -> Artist:
    """VTK where it can draw, else our own rays."""
    from renderer.inspection import gl
    from renderer.inspection.ray_artist import RayArtist

    drawable = gl.preflight()
    if drawable.window is None:
        if not options.quiet:
            complain(PROGRAM, f"{drawable.problem}; the still is made by our own tracer", "warning")
        return RayArtist(exhibit, options.clip)
    from renderer.inspection.vtk_artist import VtkArtist

    return VtkArtist(exhibit, options.clip)


def _say(exhibit: Exhibit, options: Any) -> None:
    places = sum(spot.places for spot in exhibit.spots)
    found = sum(len(specimen.findings) for specimen in exhibit.inspection.specimens)
    for output in (options.screenshot, options.html):
        if output is not None:
            print(f"{output}: {found} finding{'' if found == 1 else 's'} in {places} place{'' if places == 1 else 's'}")


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        PROGRAM,
        description="Look at a mesh, a scene (TOML) or a record (MESH.sss.json): what is wrong is drawn where it is.",
        epilog="Without an output option a window opens. Without any OpenGL, stills are made by our own tracer.",
    )
    add = parser.add_argument
    add("subject", metavar="MESH|SCENE|RECORD", help="what to look at")
    add("--rule", metavar="CODE", help="show the findings of this rule only: a code or a name")
    add("--color", choices=COLOURS, default="finding",
        help="what colours stand for (default: finding)")  # fmt: skip
    add("--clip", type=_clip, metavar="AXIS[:FROM]:TO", help="keep this part of the box around everything: x is "
        "its first half across x, z:0.3:1 all but the first 30 %% along z")  # fmt: skip
    add("--screenshot", type=Path, metavar="FILE.png", help="write a still instead of opening a window")
    add("--html", type=Path, metavar="FILE.html", help="write one page with everything in it, to look at or to send")
    add("--picture", type=Path, metavar="FILE.png", help="a render to put on the page")
    add("--live", action="store_true", help="turn the rendered picture itself: a quick shader while it moves, passes "
        "of the path shader while it rests")  # fmt: skip
    add("--preview", choices=("scalar", "plumb"), default="scalar", help="what draws while --live moves "
        "(default: scalar)")  # fmt: skip
    add("--size", type=_size, default=(1400, 1000), metavar="WxH", help="of the still (default: 1400x1000)")
    add("--material", metavar="NAME|FILE", help="what a mesh is made of: a preset, or a TOML file")
    add("--unit", choices=("mm", "cm", "m", "inch"), help="what one mesh unit is, for --material")
    return parser


def _read_picture(path: Path) -> bytes:
    """The bytes of a PNG file. Raises InputError for what is none."""
    try:
        data = read_file(path)
    except OSError as error:
        raise InputError(path, f"cannot be read ({error.strerror})", "name a PNG of sss-render") from None
    if not data.startswith(b"\x89PNG\r\n\x1a\n"):
        raise InputError(path, "is no PNG picture", "name a PNG of sss-render")
    return data


def _check_output(path: Path, suffix: str, subject: str) -> None:
    """Raise InputError where an output cannot be written, before any work is done."""
    if path.suffix.lower() != suffix:
        raise InputError(path, f"does not end in {suffix}", f"name it {path.with_suffix(suffix).name}")
    if path.resolve() == Path(subject).resolve():
        raise InputError(path, "is what is to be looked at", "write to another file")
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise InputError(path, "is a folder", "name a file in it")
    if not target.parent.is_dir():
        raise InputError(path, f"there is no folder {path.parent}", "create it")
    if not os.access(target if target.exists() else target.parent, os.W_OK):
        raise InputError(path, "cannot be written", "choose another place")


def _write(path: Path, data: bytes) -> None:
    from sss_tools.files import write_atomically

    try:
        write_atomically(path, data)
    except OSError as error:
        raise InputError(path, f"cannot be written ({error.strerror or error})", "choose another place") from None


def _clip(text: str) -> Any:
    axis, *shares = text.lower().split(":")
    numbers = [float(share) for share in shares]
    if axis not in ("x", "y", "z") or len(numbers) > 2:
        raise ValueError
    lower, upper = {0: (0.0, 0.5), 1: (0.0, *numbers), 2: tuple(numbers)}[len(numbers)]
    if not 0 <= lower < upper <= 1:
        raise ValueError
    from renderer.inspection.layer import Clip

    return Clip("xyz".index(axis), lower, upper)


def _size(text: str) -> tuple[int, int]:
    width, height = (int(part) for part in text.lower().split("x"))
    if not (500 <= width <= 8192 and 400 <= height <= 8192):
        raise ValueError
    return width, height


_clip.__name__ = "part AXIS, AXIS:TO or AXIS:FROM:TO, shares from 0 to 1"  # what argparse calls it in its message
_size.__name__ = "size WIDTHxHEIGHT, from 500x400 to 8192x8192"

if __name__ == "__main__":
    sys.exit(main())
