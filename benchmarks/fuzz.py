"""Does any damaged file make the check or the renderer crash, hang, raise, or print?

    python benchmarks/fuzz.py --count 20000 --render-count 20000 -o build/fuzz

Meshes (``fuzz_inputs``) are checked with all rules; scenes, environment images and parts of renders
(``fuzz_scenes``) are read, and made ready to be rendered.

Runs in rounds; each round's outcome is in OUT/state.json before the next begins, so that a run that was stopped goes
on where it was. Inputs that crashed, hung or raised are kept in OUT. With --page the table goes to that file.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from fuzz_inputs import damaged

from sss_tools.batch import Task, check_tasks
from sss_tools.files import write_atomically
from sss_tools.validation.outcome import UNUSABLE, MeshReport
from sss_tools.validation.settings import Settings

ROUND = 500
TIMEOUT = 20.0
MEMORY = 2 * 2**30
COLUMNS = ("inputs", "usable", "refused", "out of memory", "crash", "hang", "raised")
FAULTS = ("crash", "hang", "raised")


def outcome(report: MeshReport) -> str:
    """How the check of an input ended, one of ``COLUMNS``."""
    error = report.error or ""
    if any(rule.raised for rule in report.rules):
        return "raised"
    if "out of memory" in error or "memory was limited" in error:
        return "out of memory"
    if "took longer than" in error:
        return "hang"
    if "check was ended by" in error or "check ended with" in error:
        return "crash"
    if any(finding.code in UNUSABLE for finding in report.findings):
        return "refused"
    return "usable" if report.status == "ok" and report.closedness is not None else "raised"


def check_inputs(
    folder: Path, seed: int, numbers: range, jobs: int | None = None
) -> list[tuple[str, Path, MeshReport]]:
    """Kind, file and report of damaged inputs, written to ``folder``."""
    kinds, paths = [], []
    for number in numbers:
        kind, suffix, data = damaged(seed, number)
        path = folder / f"{number}-{kind}{suffix}"
        path.write_bytes(data)
        kinds.append(kind)
        paths.append(path)
    tasks = [Task(str(path), Settings(), TIMEOUT, MEMORY) for path in paths]
    return list(zip(kinds, paths, check_tasks(tasks, jobs), strict=True))


@contextlib.contextmanager
def diverted_stderr() -> Iterator[IO[bytes]]:
    """What this process and its children print, as a file: a traceback there is a fault, too."""
    original, file = os.dup(2), tempfile.TemporaryFile()  # noqa: SIM115 - it is read after the diversion
    os.dup2(file.fileno(), 2)
    try:
        yield file
    finally:
        os.dup2(original, 2)
        os.close(original)


def most_memory() -> int:
    """Bytes that the largest process held that this one has waited for."""
    return 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss


def page(state: dict) -> str:
    """The table in Markdown."""
    total: Counter[str] = Counter()
    lines = [
        "# Fuzzing",
        "",
        f"{state['next']} damaged meshes of seed {state['seed']}, each checked with all rules, and "
        f"{state['render_next']} damaged scenes, skies and parts of renders, each made ready to be rendered "
        f"(at most {TIMEOUT:g} s and {MEMORY >> 30} GiB): `python benchmarks/fuzz.py`.",
        "",
        "| format | " + " | ".join(COLUMNS) + " |",
        "|---|" + "---:|" * len(COLUMNS),
    ]
    for kind, counts in sorted(state["kinds"].items()):
        total.update(counts)
        lines.append(f"| {kind} | " + " | ".join(str(counts.get(column, 0)) for column in COLUMNS) + " |")
    lines.append("| all | " + " | ".join(str(total[column]) for column in COLUMNS) + " |")
    lines += ["", f"Rounds of {ROUND} in which anything was printed to stderr: {state['printed']}. Most memory of any "
              f"process, libraries included: {state['memory'] >> 20} MiB."]  # fmt: skip
    lines += ["", "*usable*: checked, or made ready, to the end. *refused*: SSS602, SSS701 or SSS702 and status 2; of "
              "scenes, skies and parts: one line, and status 2.", ""]  # fmt: skip
    return "\n".join(lines)


def main() -> int:
    """Run on to ``--count`` inputs; status 1 where any crashed, hung or raised."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--render-count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int)
    parser.add_argument("-o", "--out", type=Path, default=Path("build/fuzz"))
    parser.add_argument("--page", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / "state.json"
    state = {"seed": options.seed, "next": 0, "render_next": 0, "kinds": {}, "printed": 0, "memory": 0}
    state |= json.loads(file.read_text()) if file.exists() else {}
    if state["seed"] != options.seed:
        sys.exit(f"{file} belongs to seed {state['seed']}")
    start, begun = time.monotonic(), state["next"]
    while state["next"] < options.count:
        numbers = range(state["next"], min(state["next"] + ROUND, options.count))
        with tempfile.TemporaryDirectory() as folder:
            with diverted_stderr() as printed:
                results = check_inputs(Path(folder), options.seed, numbers, options.jobs)
            printed.seek(0)
            if noise := printed.read().decode(errors="replace"):
                state["printed"] += 1
                print(f"printed between {numbers.start} and {numbers.stop}: {noise[-2000:]}")
            for kind, path, report in results:
                counts = state["kinds"].setdefault(kind, {})
                result = outcome(report)
                for column in ("inputs", result):
                    counts[column] = counts.get(column, 0) + 1
                if result in FAULTS:
                    path.rename(options.out / path.name)
                    reasons = {rule.reason for rule in report.rules if rule.raised} or {report.error}
                    print(f"{result}: {options.out / path.name}: {sorted(map(str, reasons))}")
        state["next"], state["memory"] = numbers.stop, max(state["memory"], most_memory())
        write_atomically(file, json.dumps(state, indent=1).encode())
        rate = (state["next"] - begun) / (time.monotonic() - start)
        print(f"{state['next']} of {options.count}, {rate:.0f} a second", file=sys.stderr)
    while state["render_next"] < options.render_count:
        import fuzz_scenes

        numbers = range(state["render_next"], min(state["render_next"] + ROUND, options.render_count))
        with diverted_stderr() as printed:
            found, memory = fuzz_scenes.outcomes(options.seed, numbers)
        printed.seek(0)
        state["printed"] += bool(printed.read())
        for number, (kind, result) in zip(numbers, found, strict=True):
            counts = state["kinds"].setdefault(kind, {})
            for column in ("inputs", result):
                counts[column] = counts.get(column, 0) + 1
            if result in FAULTS:
                print(f"{result}: {kind}, number {number}")
        state["render_next"], state["memory"] = numbers.stop, max(state["memory"], memory)
        write_atomically(file, json.dumps(state, indent=1).encode())
    print(page(state))
    if options.page is not None:
        options.page.write_text(page(state))
    return int(state["printed"] > 0 or any(counts.get(fault) for counts in state["kinds"].values() for fault in FAULTS))


if __name__ == "__main__":
    sys.exit(main())
