"""Pictures of meshes that are no sound solids: sheets, strips, shells in shells, hundreds of open parts.

    PYTHONPATH=. python benchmarks/odd_meshes.py [--passes N] [--meshes FOLDER] [-o FOLDER]

Each stands in the standard stage, with the path shader asked for and ``auto`` hole handling. Writes odd_meshes.md and
images/odd_meshes.png into FOLDER, docs/ by default: what was done with each and why, how many paths were lost, and the
share of its pixels that are black (below a fiftieth of its mean).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from renderer.output.image import linear_to_srgb
from renderer.render import Renderer, Settings
from renderer.scene.staging import stage_mesh
from sss_tools import shapes
from sss_tools.loading import load_mesh
from sss_tools.mesh import Mesh

SIZE, COLUMNS, CAPTION = 120, 5, 30
BLACK = 0.02
FROM_CORPUS = {
    "Beetle, 33 loops": "beetle_vw.obj",
    "teapot, 6 loops": "teapot.obj",
    "bunny, open scan": "bunny_stanford.obj",
    "guitar of 94 solids": "stratocaster.ply",
}


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--passes", type=int, default=6)
    parser.add_argument("--meshes", type=Path, default=Path("../shared/meshes"))
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"))
    options = parser.parse_args()
    lines = ["# Odd meshes", "", "![](images/odd_meshes.png)", "",
             "| mesh | state | handling | shader | why | leaked | ended at holes | black pixels |",
             "|---|---|---|---|---|---:|---:|---:|"]  # fmt: skip
    tiles = []
    for name, mesh in odd_meshes(options.meshes).items():
        renderer = Renderer(stage_mesh(mesh, size=(SIZE, SIZE)), Settings(shader="path"), options.passes)
        renderer.run(range(options.passes))
        (plan,), (hole,) = renderer.plans, renderer.holes
        picture = renderer.film.mean()
        shown = picture[renderer.object_id == 0].mean(axis=1)
        tally = renderer.tally
        lines.append(
            f"| {name} | {plan.state} | {plan.hole_handling} | {plan.shader} | {hole.reason} | "
            f"{tally.leaked / tally.samples:.1e} | {tally.terminated / tally.samples:.1e} | "
            f"{100 * (shown < BLACK * shown.mean()).mean():.1f} % |"
        )
        print(lines[-1], flush=True)
        tiles.append((f"{name}\n{plan.hole_handling}, {plan.shader}", picture))
    lines += ["", f"{options.passes} passes. Made by `benchmarks/odd_meshes.py`.", ""]
    (options.output / "images").mkdir(parents=True, exist_ok=True)
    sheet(tiles).save(options.output / "images" / "odd_meshes.png")
    (options.output / "odd_meshes.md").write_text("\n".join(lines))


def odd_meshes(folder: Path) -> dict[str, Mesh]:
    """By name; those of the corpus where it is there."""
    ball = shapes.icosphere(1.0, 4)
    cut = shapes.punctured(ball, [[0.3, 0.5, 0.8]], 0.5)
    square = Mesh(
        np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0.5], [-1, 1, 0.5]], float), np.array([[0, 1, 2], [0, 2, 3]])
    )
    beside = shapes.moved(ball, (1.2, 0, 0))
    made = {
        "sheet": square,
        "Moebius strip": moebius_strip(),
        "bowl": shapes.punctured(ball, [[0, 1, 0]], 1.85),
        "ball with a hole": cut,
        "the same, inside out": shapes.inverted(cut),
        "the same round another": shapes.joined(cut, shapes.icosphere(0.5, 3)),
        "hollow ball": shapes.hollow_ball(1.0, 0.7, 4),
        "overlapping, one cut": shapes.joined(cut, beside),
        "ball and sheet": shapes.joined(ball, shapes.moved(square, (1.9, 0, 0))),
        "spike through its hole": spiked(cut_on_top=shapes.punctured(ball, [[0, 1, 0]], 0.6)),
        "every third face turned": Mesh(
            ball.vertices, np.where(np.arange(len(ball.faces))[:, None] % 3 == 0, ball.faces[:, ::-1], ball.faces)
        ),
    }
    for name, file in FROM_CORPUS.items():
        if (folder / file).exists():
            made[name] = load_mesh(folder / file)
    return made


def moebius_strip(around: int = 96, across: int = 8) -> Mesh:
    """A strip with half a turn: it has one side."""
    u = np.repeat(np.arange(around) / around * 2 * np.pi, across)
    v = np.tile(np.linspace(-0.35, 0.35, across), around)
    reach = 1 + v * np.cos(u / 2)
    points = np.stack([reach * np.cos(u), v * np.sin(u / 2), reach * np.sin(u)], axis=1)
    i, j = (index.ravel() for index in np.indices((around, across - 1)))
    here, last = i * across + j, i == around - 1
    # the last quadrilaterals join the first column upside down
    ahead = np.where(last, across - 1 - j, here + across)
    beside = np.where(last, across - 2 - j, here + across + 1)
    return Mesh(points, np.concatenate([np.stack([here, ahead, beside], 1), np.stack([here, beside, here + 1], 1)]))


def spiked(cut_on_top: Mesh) -> Mesh:
    """The far side of a ball dented so deep that it comes out through the hole on top."""
    points = cut_on_top.vertices.copy()
    off_axis = np.linalg.norm(points[:, [0, 2]], axis=1)
    dented = (points[:, 1] < 0) & (off_axis < 0.35)
    points[dented, 1] += 2.4 * (1 - (off_axis[dented] / 0.35) ** 2)
    return Mesh(points, cut_on_top.faces)


def sheet(tiles: list[tuple[str, np.ndarray]]) -> Image.Image:
    """Pictures with captions, ``COLUMNS`` in a row."""
    rows = -(-len(tiles) // COLUMNS)
    image = Image.new("RGB", (COLUMNS * SIZE, rows * (SIZE + CAPTION)), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(9)
    for k, (caption, picture) in enumerate(tiles):
        x, y = k % COLUMNS * SIZE, k // COLUMNS * (SIZE + CAPTION)
        pixels = np.round(255 * np.clip(linear_to_srgb(picture), 0, 1)).astype(np.uint8)
        image.paste(Image.fromarray(pixels), (x, y))
        draw.text((x + 3, y + SIZE + 1), caption, fill="black", font=font, spacing=1)
    return image


if __name__ == "__main__":
    main()
