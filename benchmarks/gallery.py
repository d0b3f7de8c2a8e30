"""Makes docs/gallery.md: every example's picture, under the question that it answers.

    python benchmarks/gallery.py [--bunny FILE] [--only EXAMPLE ...] [-o FOLDER]

Runs the scripts of examples/ one after the other as a reader would, and keeps their pictures as JPEG below
FOLDER/images/gallery; the words are those of the scripts. An example that cannot be made (the bunny, without a network)
is left out and named.
"""

from __future__ import annotations

import argparse
import ast
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES: dict[str, tuple[str, ...]] = {
    "three_shaders": ("80",),
    "three_distances": (),
    "backlit": (),
    "holes": (),
    "internal_geometry": (),
    "bunny": ("128",),
}
"""Scripts in the order of the page, and what follows the folder on their command lines."""
TIMED = ("three_shaders",)
"""Examples that tell seconds: their pictures are made by hand, on a quiet machine, and stand in FOLDER/images."""
WIDEST = 1200
"""Pixels."""
JPEG_QUALITY = 88


def main() -> int:
    """The command; 1 where an example was left out."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bunny", type=Path, help="the Stanford bunny, where it is here already")
    made = [example for example in EXAMPLES if example not in TIMED]
    parser.add_argument(
        "--only", nargs="*", choices=made, default=made, metavar="EXAMPLE", help="make these, or none, and the page"
    )
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs")
    options = parser.parse_args()
    pictures = options.output / "images" / "gallery"
    pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.bunny is not None:
            shutil.copy(options.bunny, folder / "stanford-bunny.obj")
        for example in options.only:
            if run(example, folder, EXAMPLES[example]):
                save(folder / f"{example}.png", pictures / f"{example}.jpg")
                print(example, flush=True)
    places = {example: f"images/gallery/{example}.jpg" for example in EXAMPLES}
    places.update({example: f"images/{example}.png" for example in TIMED})
    missing = [example for example, place in places.items() if not (options.output / place).is_file()]
    text = "# Gallery\n\nOne picture a question, by the scripts of `examples/`: `python benchmarks/gallery.py`."
    parts = [section(example, more, places[example]) for example, more in EXAMPLES.items() if example not in missing]
    (options.output / "gallery.md").write_text("\n".join([text, "", *parts]))
    if missing:
        print(f"left out: {', '.join(missing)}", file=sys.stderr)
    return int(bool(missing))


def run(example: str, folder: Path, more: tuple[str, ...]) -> bool:
    """Make an example's picture in ``folder``; whether that worked."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, str(ROOT / "examples" / f"{example}.py"), str(folder), *more]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        print(done.stderr.strip(), file=sys.stderr)
    return done.returncode == 0


def save(made: Path, target: Path) -> None:
    """The picture as JPEG, no wider than ``WIDEST``."""
    picture = Image.open(made).convert("RGB")
    if picture.width > WIDEST:
        size = (WIDEST, round(picture.height * WIDEST / picture.width))
        picture = picture.resize(size, Image.Resampling.LANCZOS)
    picture.save(target, quality=JPEG_QUALITY, optimize=True)


def section(example: str, more: tuple[str, ...], picture: str) -> str:
    """The question, the picture at ``picture``, the command, and what the script says of it."""
    words = ast.get_docstring(ast.parse((ROOT / "examples" / f"{example}.py").read_text()))
    assert words is not None
    question, _, rest = words.partition("\n\n")
    about = "\n\n".join(part for part in rest.split("\n\n") if not part.startswith("    "))
    command = " ".join(["python", f"examples/{example}.py", *(("out", *more) if more else ())])
    return f"## {question}\n\n![{question}]({picture})\n\n`{command}`\n\n{about}\n"


if __name__ == "__main__":
    sys.exit(main())
