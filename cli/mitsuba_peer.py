"""One picture of a scene by Mitsuba 3, timed: the peer in charts of speed.

    python -m cli.mitsuba_peer SCENE.xml --passes N --seed K -o OUT.npz [--variant V] [--report FILE]

Needs the extra ``peers``; DRJIT_LIBLLVM_PATH should name a recent LLVM library, else the scalar variant is used.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from .clock import process_start

LANES = 2**20
"""Samples of one call: enough to keep wide kernels busy, not more than fit in memory."""
ROULETTE_DEPTH = 10_000
"""From where on paths end by chance: hardly ever. Mitsuba's default, 5, and 64 still, let weights grow in dense bright
media until one sample in very many carries much of the light: pictures look noiseless and too dark before it comes, and
are worse than they were when it does. Of the eight scenes of ``benchmarks/against_mitsuba.py`` five are quickest like
this; where light is scattered few times an earlier end is quicker, by half on the ball among them."""


def main(argv: Sequence[str] | None = None) -> int:
    """The command."""
    started = process_start()
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--passes", type=int, default=64)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--variant", default="llvm_ad_rgb" if has_llvm() else "scalar_rgb")
    parser.add_argument("--report", type=Path)
    options = parser.parse_args(argv)

    import mitsuba as mi
    import numpy as np

    mi.set_variant(options.variant)
    built = time.monotonic()
    scene = mi.load_file(str(options.scene), rr_depth=ROULETTE_DEPTH)
    begun = time.monotonic()
    total, left, call = 0.0, options.passes, 0
    width, height = scene.sensors()[0].film().size()
    most = max(LANES // (width * height), 1)
    while left:
        samples = min(left, most)
        total = total + samples * np.array(mi.render(scene, spp=samples, seed=1_000_003 * options.seed + call), float)
        left, call = left - samples, call + 1
    image = np.asarray(total) / options.passes
    ended = time.monotonic()
    np.savez(options.output, image=image.astype(np.float32))
    seconds = {
        "seconds": time.monotonic() - started,
        "setup": begun - started,
        "build": begun - built,
        "render": ended - begun,
        "variant": options.variant,
    }
    if options.report is not None:
        options.report.write_text(json.dumps(seconds))
    return 0


def has_llvm() -> bool:
    """Whether the variant for processors has what it needs."""
    from ctypes.util import find_library

    return "DRJIT_LIBLLVM_PATH" in os.environ or find_library("LLVM") is not None


if __name__ == "__main__":
    sys.exit(main())
