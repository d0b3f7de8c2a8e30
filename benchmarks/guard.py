"""Measure what later versions are held against by ``tests/renderer/study/test_guard.py``.

    python benchmarks/guard.py [-o tests/renderer/study]

Writes guard.npz, exact pictures of the guarded scenes, and guard.json, squared biases of the faster shaders and CPU
seconds of everything over those of the fixed kernel. To be run again when a change of accuracy or speed is meant, and
to be looked at before it is committed.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from renderer.study import guard
from renderer.study.methods import FAST

ROOT = Path(__file__).resolve().parents[1]
SEED = 50
LONGER = 4
"""Times the passes of the test: the kept pictures should have less noise than those that are held against them."""


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "tests" / "renderer" / "study")
    folder = parser.parse_args().output
    arrays, biases = {}, {}
    scenes = guard.scenes()
    for name, scene in scenes.items():
        exact = guard.pictures(scene, "path", SEED, LONGER)
        for k in (0, 1):
            arrays[f"{name}_mean{k}"] = exact.means[k].astype(np.float32)
            arrays[f"{name}_stderr{k}"] = exact.stderrs[k].astype(np.float32)
        arrays[f"{name}_where"], arrays[f"{name}_passes"] = exact.where, np.array(exact.passes)
        for method in FAST:
            shown = guard.pictures(scene, method, SEED + 1)
            biases[f"{name} {method}"] = asdict(guard.truth(exact).bias(shown.means))
    np.savez_compressed(folder / "guard.npz", **arrays)
    kept = {"squared_bias": biases, "times_the_kernel": guard.speed_ratios(scenes["ball"])}
    (folder / "guard.json").write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main()
