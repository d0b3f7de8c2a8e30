"""sss-render: a picture of the light in a scene, or in a bare mesh."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sss_tools.errors import InputError
from sss_tools.memory import limited_memory, share_of_memory

from .clock import process_start
from .command import ArgumentParser, complain, progress, run, version
from .explanation import plan_at_length, plan_in_a_line

if TYPE_CHECKING:
    from distributed import Client

    from renderer.job import Budget
    from renderer.render import Renderer, Settings
    from renderer.scene.description import Scene
    from renderer.shaders.selection import Measured, Plan
    from renderer.stages import Stages

PROGRAM = "sss-render"
_SHARE = 0.9
"""Of the machine's memory to use at most: beyond that systems end processes without a word."""

# before NumPy is imported: all systems of equations here are small, and on a busy machine OpenBLAS's own threads wait
# for each other ten times as long as they work
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main(argv: Sequence[str] | None = None) -> int:
    """The command. Returns the exit status: 0 written, 2 refused, 130 interrupted with what was done written."""
    return run(PROGRAM, _render, argv)


def _render(argv: Sequence[str] | None) -> int:
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments[:1] == ["merge"]:
        return _merge(arguments[1:])
    started = process_start()
    parser = _parser()
    options = parser.parse_args(arguments)
    _refuse(options)
    if options.output is None and not options.explain_only:
        parser.error("the following arguments are required: -o/--output (or --explain-only)")
    with limited_memory(options.max_memory or share_of_memory(_SHARE)):
        if options.explain_only:
            return _explain_only(options)
        return _picture(options, started) if options.export is None else _export(options, parser)


def _picture(options: Any, started: float) -> int:
    """Render and write."""
    from renderer.output.image import check_writable
    from renderer.tracing.memory import give_back_memory

    check_writable(options.output)
    if options.preview is not None:
        check_writable(options.preview)
    if options.report is not None:
        _check_report(options.report)
    try:
        if options.scheduler is None:
            return _rendered(options, started)
        from sss_tools.scheduler import connected

        with connected(options.scheduler) as client:
            return _rendered(options, started, client)
    finally:
        give_back_memory()  # the renderer is gone; the process may go on


def _rendered(options: Any, started: float, client: Client | None = None) -> int:
    """Render, here or on a cluster, and write."""
    from renderer.guides import guide_arrays
    from renderer.job import execute
    from renderer.report import rare_event_warnings, report
    from renderer.stages import Stages

    stages = Stages()
    with stages.stage("load"):
        scene = _scene(options)
    settings, passes = _settings(options), _passes(options)
    scene, measured = _piloted(options, scene, settings, stages)
    renderer = _renderer(client, scene, settings, passes, stages, measured)
    budget = _budget(options, started, renderer.plans)
    if not options.quiet:
        for thing, plan, hole in zip(renderer.scene.objects, renderer.plans, renderer.holes, strict=True):
            print(plan_in_a_line(thing, plan, hole, renderer.sources.get(plan.name, "")))
    for plan in renderer.plans:
        if plan.warning:
            complain(PROGRAM, plan.warning, "warning")
    aovs = guide_arrays(renderer, options.aov)
    with progress(1.0, "rendering", options.quiet) as advance:
        shown = 0.0

        def show(done: float, total: float, text: str) -> None:
            nonlocal shown
            share = min(done / total, 1.0)
            advance(share - shown, text)
            shown = share

        picture = execute(renderer, options.output, budget, options.resume, aovs, show, options.preview)
    total = time.monotonic() - started
    for text in rare_event_warnings(renderer):
        complain(PROGRAM, text, "warning")
    if options.report is not None:
        text = json.dumps(report(renderer, picture, version(), total, budget), indent=1)
        _write_report(options.report, text)
    if not options.quiet:
        print(f"{options.output}: {picture.film.passes} passes in {total:.1f} s")
    return 0


def _renderer(client: Client | None, *arguments: Any) -> Renderer:
    """One that renders by threads of this process, or by a cluster."""
    if client is None:
        from renderer.render import Renderer

        return Renderer(*arguments)
    from renderer.cluster.renderer import ClusterRenderer

    return ClusterRenderer(client, *arguments)


def _parser() -> ArgumentParser:
    parser = ArgumentParser(
        PROGRAM,
        description="Render a scene (TOML) or a bare mesh: check the meshes, choose a shader for each object, "
        "follow the light.",
        epilog="sss-render merge PART... -o OUT puts parts of one render (npz) together.",
    )
    parser.add_argument("scene", type=Path, metavar="SCENE.toml|MESH", help="what to render")
    parser.add_argument("-o", "--output", type=Path, metavar="OUT", help="picture: .png, .exr or .npz")
    parser.add_argument("--explain-only", action="store_true",
                        help="say what would be done with each object, and why; render nothing")  # fmt: skip
    parser.add_argument("--shader", choices=("auto", "path", "plumb", "scalar"), default="auto",
                        help="one shader for all objects (default: by predicted error)")  # fmt: skip
    parser.add_argument("--quality", type=_share, metavar="Q",
                        help="0 cheapest to 1 reference: decides the shaders (default: 0.5) and, if given without "
                        "--passes or the like, the passes")  # fmt: skip
    parser.add_argument("--pilot", action="store_true",
                        help="measure the errors of shaders in small pictures first, and choose by them")  # fmt: skip
    amount = parser.add_mutually_exclusive_group()
    amount.add_argument("--passes", type=_positive_int, metavar="N", help="camera samples a pixel (default: 64)")
    amount.add_argument("--time", type=_positive, metavar="S", help="seconds from start to written file")
    amount.add_argument("--target-error", type=_positive, metavar="E",
                        help="relative error: only shaders predicted within it, and passes until the mean relative "
                        "standard error is (with --quality: only the latter)")  # fmt: skip
    amount.add_argument("--pass-range", type=_pass_range, metavar="A:B", help="passes A up to, not including, B")
    parser.add_argument("--adaptive", action="store_true",
                        help="more passes where there is more noise, without bias")  # fmt: skip
    parser.add_argument("--preview", type=Path, metavar="FILE",
                        help="picture to watch, kept up to date: .png, .exr or .npz")  # fmt: skip
    parser.add_argument("--seed", type=_whole, default=0, metavar="K", help="of the random numbers (default: 0)")
    parser.add_argument("--threads", type=_positive_int, metavar="N", help="default: one a core")
    parser.add_argument("--scheduler", metavar="ADDRESS",
                        help="render on the Dask cluster with this scheduler")  # fmt: skip
    parser.add_argument("--max-memory", type=_memory, metavar="SIZE",
                        help="bytes to use at most: 500M, 2G (default: nine tenths of the machine's)")  # fmt: skip
    parser.add_argument("--size", type=_size, metavar="WxH", help="of the picture (default: the scene's, or 500x500)")
    parser.add_argument("--material", metavar="NAME|FILE", help="preset or TOML file for a bare mesh (default: "
                        "marble's albedo at a mean free path of 2 %% of the size)")  # fmt: skip
    parser.add_argument("--unit", choices=("mm", "cm", "m", "inch"), default="mm",
                        help="what a unit of a bare mesh is, for --material (default: mm)")  # fmt: skip
    parser.add_argument("--hole-handling", choices=("auto", "strict", "cap", "terminate", "surface"), default="auto",
                        help="what happens where surface is missing (default: as the check says)")  # fmt: skip
    parser.add_argument("--resume", action="store_true", help="go on with an unfinished render")
    parser.add_argument("--aov", type=lambda text: text.split(","), default=[], metavar="LIST",
                        help="further arrays for exr and npz: depth, normal, predicted_error, shader_id")  # fmt: skip
    parser.add_argument("--export", choices=("mitsuba",), metavar="mitsuba",
                        help="only write the scene for Mitsuba 3: -o FILE.xml, and a folder beside it")  # fmt: skip
    parser.add_argument("--report", type=Path, metavar="FILE.json", help="what was done, and how long it took")
    return parser


def _refuse(options: Any) -> None:
    """Say no to options that would be ignored."""
    if options.scheduler is not None and options.threads is not None:
        raise InputError("--threads", "is for rendering here; those of a cluster belong to its workers",
                         "leave it out, and start dask worker with --nthreads")  # fmt: skip
    if options.adaptive and options.pass_range is not None:
        raise InputError("--adaptive", "decides later passes by earlier ones, so it has no part of a render to itself",
                         "leave out --pass-range, or --adaptive")  # fmt: skip
    if options.material is not None and _is_scene(options.scene):
        raise InputError("--material", "is for bare meshes", "set the material in the scene file")


_FOR_EXPORT = {
    "max_memory",
    "scene",
    "output",
    "export",
    "passes",
    "seed",
    "size",
    "material",
    "unit",
    "quiet",
    "verbose",
}


def _export(options: Any, parser: ArgumentParser) -> int:
    """Write the scene for another renderer."""
    for name, value in vars(options).items():
        if name not in _FOR_EXPORT and value != parser.get_default(name):
            raise InputError(
                f"--{name.replace('_', '-')}", f"says nothing to --export {options.export}", "leave it out"
            )

    from renderer.export import files
    from renderer.export.mitsuba import to_mitsuba
    from renderer.job import DEFAULT_PASSES
    from renderer.scene.admission import admit

    files.check_target(options.output)
    scene, _ = admit(_scene(options))
    export = to_mitsuba(scene, files.folder_name(options.output), options.passes or DEFAULT_PASSES, options.seed)
    for warning in export.warnings:
        complain(PROGRAM, warning, "warning")
    files.write(export, options.output)
    if not options.quiet:
        print(f"{options.output}: written for Mitsuba 3, with {len(export.files)} file(s) beside it")
    return 0


def _is_scene(path: Path) -> bool:
    return path.suffix.lower() == ".toml"


def _scene(options: Any) -> Scene:
    """The scene asked for, or one around the bare mesh."""
    if _is_scene(options.scene):
        from renderer.scene.scene_file import load_scene

        scene = load_scene(options.scene)
        if options.size is not None:
            from renderer.scene.fingerprint import with_hash

            scene = with_hash(replace(scene, camera=replace(scene.camera, resolution=options.size)))
        return scene
    from renderer.scene.staging import stage_mesh
    from sss_tools.loading import load_mesh

    from .materials import medium_of

    medium = None if options.material is None else medium_of(options.material, options.unit)
    mesh = load_mesh(options.scene)
    return stage_mesh(mesh, medium, options.size or (500, 500), options.unit)


def _settings(options: Any) -> Settings:
    from renderer.render import Settings
    from renderer.shaders.selection import DEFAULT_QUALITY

    quality = DEFAULT_QUALITY if options.quality is None else options.quality
    target = options.target_error if options.quality is None else None
    return Settings(options.shader, options.hole_handling, quality, options.seed, options.threads, target)


def _passes(options: Any) -> int | None:
    """As many as are asked for; None where seconds, an error or the quality decide."""
    from renderer.job import DEFAULT_PASSES

    if options.pass_range is not None:
        first, last = options.pass_range
        return last - first
    if options.passes is not None:
        return options.passes
    decided = options.time, options.target_error, options.quality
    return DEFAULT_PASSES if all(one is None for one in decided) else None


def _budget(options: Any, started: float, plans: Sequence[Plan]) -> Budget:
    from renderer.job import Budget
    from renderer.shaders.selection import picture_passes

    if options.pass_range is not None:
        first, last = options.pass_range
        return Budget(first, last, started=started)
    if options.time is not None or options.target_error is not None:
        return Budget(0, None, options.time, options.target_error, options.adaptive, started)
    passes = _passes(options)
    by_noise = passes is None and not options.adaptive
    return Budget(0, passes or picture_passes(plans), adaptive=options.adaptive, by_noise=by_noise, started=started)


def _piloted(
    options: Any, scene: Scene, settings: Settings, stages: Stages
) -> tuple[Scene, dict[str, Measured] | None]:
    """The scene, checked where pilots were asked for, and what they measured."""
    if not options.pilot:
        return scene, None
    from renderer.pilot import measure
    from renderer.scene.admission import admit

    with stages.stage("check"):
        scene, _ = admit(scene)
    with stages.stage("pilot"), progress(1.0, "measuring", options.quiet) as advance:
        return scene, measure(scene, settings, lambda share: advance(share, "pilots"))


def _explain_only(options: Any) -> int:
    """Print, and report where asked for, what would be done with each object."""
    from renderer.render import closed_for_light, planned
    from renderer.report import plan_report
    from renderer.shaders.selection import picture_passes
    from renderer.stages import Stages

    if options.report is not None:
        _check_report(options.report)
    stages = Stages()
    with stages.stage("load"):
        scene = _scene(options)
    settings, passes = _settings(options), _passes(options)
    scene, measured = _piloted(options, scene, settings, stages)
    scene, sources, plans = planned(scene, settings, passes, stages, measured)
    _, holes, plans = closed_for_light(scene, plans, stages)
    passes = passes or picture_passes(plans)
    if not options.quiet:
        for thing, plan, hole in zip(scene.objects, plans, holes, strict=True):
            print(plan_at_length(thing, plan, hole, sources.get(plan.name, "")))
        print(f"{passes} passes" + (", or as many as the first ones tell" if _passes(options) is None else ""))
    if options.report is not None:
        _write_report(options.report, json.dumps(plan_report(scene, plans, holes, passes, version(), stages), indent=1))
    return 0


def _check_report(path: Path) -> None:
    """Refuse a report that cannot be written, before the hour of rendering."""
    if path.is_dir() or not path.parent.is_dir():
        raise InputError(path, "cannot be written: no such folder, or a folder itself", "name a file in a folder")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(path, "cannot be written: write-protected", "choose another name")


def _write_report(path: Path, text: str) -> None:
    from sss_tools.files import write_atomically

    try:
        write_atomically(path, (text + "\n").encode())
    except OSError as error:
        raise InputError(path, f"cannot be written ({error.strerror})", "choose another name") from None


def _merge(arguments: list[str]) -> int:
    parser = ArgumentParser(f"{PROGRAM} merge", description="Put parts of one render together.")
    parser.add_argument("parts", nargs="+", type=Path, metavar="PART", help="npz files of sss-render --pass-range")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT", help="picture: .png, .exr or .npz")
    options = parser.parse_args(arguments)

    from renderer.job import merged
    from renderer.output import image

    image.check_writable(options.output)
    with limited_memory(share_of_memory(_SHARE)):
        picture = merged(options.parts)
        image.write(options.output, picture)
    if not options.quiet:
        print(f"{options.output}: {picture.film.passes} passes")
    return 0


# ---- option types: argparse turns a ValueError into "invalid VALUE" with the function's name ----


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise ValueError
    return value


def _positive_int(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


def _whole(text: str) -> int:
    value = int(text)
    if value < 0:
        raise ValueError
    return value


def _share(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 1:
        raise ValueError
    return value


def _size(text: str) -> tuple[int, int]:
    width, height = (int(part) for part in text.lower().split("x"))
    if not (0 < width <= 65536 and 0 < height <= 65536):
        raise ValueError
    return width, height


def _memory(text: str) -> int:
    from sss_tools.configuration import size_of

    return size_of(text)


def _pass_range(text: str) -> tuple[int, int]:
    first, last = (int(part) for part in text.split(":"))
    if not 0 <= first < last:
        raise ValueError
    return first, last


for _type, _name in (
    (_positive, "positive number"),
    (_positive_int, "whole number above 0"),
    (_whole, "whole number"),
    (_share, "number from 0 to 1"),
    (_size, "size WIDTHxHEIGHT"),
    (_memory, "size like 500M or 2G"),
    (_pass_range, "range A:B"),
):
    _type.__name__ = _name  # what argparse calls the kind of value in its message

if __name__ == "__main__":
    raise SystemExit(main())
