"""How many facts about real meshes sss-check gets right, and who is right where others say otherwise.

    python benchmarks/manifest_facts.py [SHARED] [--page docs/validation.md] [--json FACTS.json]

SHARED holds meshes/MANIFEST.csv (by default ../shared beside the checkout), whose facts come from several independent
tools. Every mesh is checked as the command does it, in a process of its own, and what is reported is held against the
manifest. Exit status 1 for a disagreement nobody has looked at, an explanation that nothing needs any more, fewer
than 98 % of the facts right, or a corrupt file that does not end in SSS602, SSS701 or SSS702.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from sss_tools.batch import check_files  # noqa: E402
from sss_tools.loading import load_mesh  # noqa: E402
from sss_tools.validation.outcome import UNUSABLE, MeshReport, Outcome  # noqa: E402
from sss_tools.validation.settings import Settings  # noqa: E402

TARGET = 0.98
"""Least share of the facts that must be right."""

Row = dict[str, str]


@dataclass(frozen=True)
class Fact:
    """Something the manifest says of a mesh, and where the report says it.

    name      what it is called in the page
    expected  from the manifest's row; None where it says nothing
    answer    from the report
    source    what of the report answers
    """

    name: str
    expected: Callable[[Row], object]
    answer: Callable[[MeshReport], object]
    source: str


@dataclass(frozen=True)
class Comparison:
    """One fact of one mesh."""

    mesh: str
    fact: str
    expected: str
    answer: str
    explanation: str | None = None

    @property
    def right(self) -> bool:
        """Whether both say the same."""
        return self.expected == self.answer


def expected_state(row: Row) -> str:
    """The words of CONTRACTS section 2 on the manifest's numbers, which are those of the whole file."""
    if int(row["boundary_edges"]) == 0:
        return "closed"
    return "holes" if float(row["max_winding"]) >= 0.75 else "open"


def expected_loops(row: Row) -> int | None:
    """Loops, where they can be counted in one way only."""
    return int(row["n_boundary_loops"]) if row["simple_boundary"] else None


def expected_sign(row: Row) -> str | None:
    """The sign of a volume that the manifest calls a true one."""
    return row["volume_sign"] if row["volume_sign"] in "+-" else None


def found(code: str) -> Callable[[MeshReport], bool]:
    """Whether a rule found something."""
    return lambda report: any(rule.code == code for rule in report.findings)


def count(code: str) -> Callable[[MeshReport], int]:
    """How much a rule found."""
    return lambda report: sum(rule.count for rule in report.findings if rule.code == code)


def crossing_faces(report: MeshReport) -> int:
    """The faces that SSS302 speaks of; its lists may be cut, its message is not."""
    messages = [rule.message for rule in report.findings if rule.code == "SSS302"]
    return sum(int(re.search(r"(\d+) faces? in all", message)[1]) for message in messages)  # type: ignore[index]


def verdict(name: str) -> Callable[[MeshReport], object]:
    """A field of the closedness verdict; every usable mesh has one."""
    return lambda report: (report.closedness or {}).get(name)


def sign(report: MeshReport) -> str:
    """The sign of the volume."""
    return "none" if report.volume is None else "+" if report.volume > 0 else "-"


def number(column: str) -> Callable[[Row], int]:
    """A count in the manifest."""
    return lambda row: int(row[column])


def yes_or_no(row: Row) -> bool | None:
    """Internal geometry; the manifest calls deep bores ``possible`` and leaves it at that."""
    return {"yes": True, "no": False}.get(row["internal_geometry"])


FACTS = (
    Fact("closed", lambda row: row["watertight_welded"] == "True", verdict("watertight"), "`watertight`"),
    Fact("state", expected_state, verdict("state"), "`state`, CONTRACTS section 2"),
    Fact("boundary loops", expected_loops, verdict("boundary_loops"), "`boundary_loops`"),
    Fact("non-manifold edges", number("nonmanifold_edges"), count("SSS201"), "count of SSS201"),
    Fact("non-manifold vertices", number("nonmanifold_vertices"), count("SSS202"), "count of SSS202"),
    Fact("components", number("n_components"), lambda report: len(report.components), "`components`"),
    Fact("disagreeing neighbours", number("misoriented_edges"), count("SSS203"), "count of SSS203"),
    Fact("sign of the volume", expected_sign, sign, "`volume`"),
    Fact("intersects itself", lambda row: int(row["self_int_faces_cgal"]) > 0, found("SSS302"), "SSS302"),
    Fact("intersecting faces", number("self_int_faces_cgal"), crossing_faces, "faces of SSS302 (CGAL's count)"),
    Fact("duplicate faces", number("duplicate_faces"), count("SSS303"), "count of SSS303"),
    Fact("internal geometry", yes_or_no, found("SSS301"), "SSS301"),
    Fact("faces without area", number("degenerate_faces"), count("SSS401"), "count of SSS401"),
)

FOLDS = (
    "ours: {} faces that lie folded back on a coplanar neighbour over a common side; rational arithmetic "
    "(`tests/sss_tools/exact_triangles.py`) confirms every one of these pairs, CGAL leaves them out"
)
SMALL = (
    "ours: {}; the manifest says yes only from 2 % of the area on. Winding numbers (libigl) on both sides of 30 points "
    "of every face find {} of the area with matter on both sides"
)
EXPLANATIONS = {
    ("chair_model.obj", "state"): "ours: three components without boundary but without volume (1e-17 of a unit box), "
    "every sheet written twice: none could bound a volume, so there is nothing to be closed",
    ("chair_model.obj", "sign of the volume"): "ours: its volume is zero but for rounding (-2.6e-18)",
    ("soup.stl", "state"): "ours: 100 single triangles. One alone never winds by more than 1/2; 3.4 is the sum over "
    "all, and a state is that of components",
    ("soup.stl", "internal geometry"): "ours: among loose triangles there is no shell to be inside of; 3.4 is the sum "
    "of their solid angles",
    ("greatWhite.stl", "internal geometry"): SMALL.format("teeth and eyes set into the body", "0.4 %"),
    ("office_chair.obj", "internal geometry"): SMALL.format("arms and bars that run into each other", "0.1 %"),
    ("suzanne.obj", "internal geometry"): SMALL.format("eyes set into the head", "3.5 %"),
    ("not_convex.obj", "intersecting faces"): FOLDS.format(4),
    ("office_chair.obj", "intersecting faces"): FOLDS.format(59),
    ("cycloidal.ply", "intersecting faces"): FOLDS.format(2),
    ("trumpet.obj", "faces without area"): "both: one face is 7e-10 of the diagonal high; SSS401 begins at 1e-9 and "
    "says so, the manifest at nothing",
}


def main() -> int:
    """Score, write, and say what nobody has looked at yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shared", type=Path, nargs="?", default=ROOT.parent / "shared", metavar="SHARED")
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "validation.md", metavar="FILE")
    parser.add_argument("--json", type=Path, metavar="FILE", help="every fact, as data")
    parser.add_argument("--jobs", type=int, metavar="N")
    options = parser.parse_args()
    folder = options.shared / "meshes"
    if not (folder / "MANIFEST.csv").is_file():
        parser.error(f"{folder}/MANIFEST.csv: not there; name the folder that holds meshes/")
    with (folder / "MANIFEST.csv").open() as file:
        rows = list(csv.DictReader(file))
    reports = check_files([str(folder / row["file"]) for row in rows], Settings(), options.jobs)

    readable = [(row, report) for row, report in zip(rows, reports, strict=True) if row["class"] != "corrupt"]
    corrupt = [(row, report) for row, report in zip(rows, reports, strict=True) if row["class"] == "corrupt"]
    # readers differ on these: refusing them is right, too
    refused = [row["file"] for row, report in readable if row["class"] == "either" and report.closedness is None]
    facts = [
        comparison
        for row, report in readable
        if row["file"] not in refused
        for comparison in compare(row | {"simple_boundary": simple_boundary(folder / row["file"])}, report)
    ]
    endings = [(row, report, ending(report)) for row, report in corrupt]
    options.page.write_text(page(facts, endings, refused, len(readable) - len(refused)))
    if options.json:
        options.json.write_text(json.dumps([asdict(comparison) for comparison in facts], indent=1) + "\n")

    objections = complaints(facts, {row["file"]: end for row, _, end in endings})
    right = sum(comparison.right for comparison in facts)
    print(f"{right} of {len(facts)} facts right ({right / len(facts):.2%})")
    print(f"{sum(end in UNUSABLE for *_, end in endings)} of {len(endings)} corrupt files refused")
    print(*objections, sep="\n", end="\n" if objections else "")
    return int(bool(objections))


def complaints(facts: list[Comparison], endings: dict[str, str]) -> list[str]:
    """What keeps the page from standing as it is, a line each.

    endings  how each corrupt file ended
    """
    wrong = [comparison for comparison in facts if not comparison.right]
    found = [
        f"UNEXPLAINED: {one.mesh}: {one.fact}: {one.expected} expected, {one.answer} answered"
        for one in wrong
        if one.explanation is None
    ]
    stale = EXPLANATIONS.keys() - {(one.mesh, one.fact) for one in wrong}
    found += [f"STALE: {mesh}: {fact}: explained, but there is no disagreement" for mesh, fact in sorted(stale)]
    found += [f"NOT REFUSED: {mesh}: {end}" for mesh, end in endings.items() if end not in UNUSABLE]
    share = 1 - len(wrong) / len(facts)
    if share < TARGET:
        found.append(f"MISSED: {share:.2%} of the facts are right, less than {TARGET:.0%}")
    return found


def simple_boundary(path: Path) -> str:
    """``yes`` where every boundary point has two boundary edges, as the manifest's counting takes for granted."""
    topology = load_mesh(path).topology
    ends = Counter(topology.edges[topology.boundary_edges].ravel().tolist())
    return "yes" if all(degree == 2 for degree in ends.values()) else ""


def compare(row: Row, report: MeshReport) -> list[Comparison]:
    """Every fact the manifest states of a mesh, beside what was reported."""
    compared = []
    for fact in FACTS:
        if (expected := fact.expected(row)) is None:
            continue
        # a readable mesh without a verdict has none of its facts right
        answer = "no answer" if report.closedness is None else _word(fact.answer(report))
        explanation = EXPLANATIONS.get((row["file"], fact.name))
        compared.append(Comparison(row["file"], fact.name, _word(expected), answer, explanation))
    return compared


def _word(value: object) -> str:
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)


def ending(report: MeshReport) -> str:
    """The code that a file was refused with, or how else it ended."""
    codes = [rule.code for rule in report.findings if rule.code in UNUSABLE]
    if any(rule.raised for rule in report.rules):
        return "a rule raised"
    if codes:
        return codes[0]
    reasons = {rule.reason for rule in report.rules if rule.outcome == Outcome.NOT_RUN}
    return "accepted" if report.closedness else f"not-run: {', '.join(sorted(filter(None, reasons)))}"


def page(facts: list[Comparison], endings: list, refused: list[str], meshes: int) -> str:
    """The results in Markdown."""
    wrong = [comparison for comparison in facts if not comparison.right]
    lines = [
        "# Facts about real meshes",
        "",
        f"{len(facts) - len(wrong)} of {len(facts)} facts about {meshes} readable meshes right "
        f"({1 - len(wrong) / len(facts):.1%}), {sum(end in UNUSABLE for *_, end in endings)} of {len(endings)} corrupt "
        "files refused. Written by `benchmarks/manifest_facts.py`, which holds what `sss-check` reports against the "
        "manifest of the meshes: facts found by several independent tools.",
        "",
        "| fact | answered by | right | of |",
        "|---|---|---:|---:|",
    ]
    for fact in FACTS:
        of = [comparison for comparison in facts if comparison.fact == fact.name]
        lines.append(f"| {fact.name} | {fact.source} | {sum(one.right for one in of)} | {len(of)} |")
    lines += [
        "",
        "Boundary loops are compared where every boundary vertex has two boundary edges (elsewhere one may count "
        "otherwise), the volume's sign where the manifest calls it a true volume, internal geometry where it says yes "
        "or no. `state` is not in the manifest: it is what the contract's words make of its boundary edges and its "
        "greatest winding number.",
        *([f"Readers differ on {', '.join(f'`{name}`' for name in refused)}; it is refused here."] if refused else []),
        "",
        "## Disagreements",
        "",
        "| mesh | fact | manifest | sss-check | who is right, and why |",
        "|---|---|---|---|---|",
        *(
            f"| {one.mesh} | {one.fact} | {one.expected} | {one.answer} | {one.explanation or '**not looked at**'} |"
            for one in sorted(wrong, key=lambda one: (one.fact, one.mesh))
        ),
        "",
        "## Corrupt files",
        "",
        "| file | ends in | because |",
        "|---|---|---|",
    ]
    for row, report, end in endings:
        because = next((rule.message for rule in report.findings if rule.code == end), "")
        lines.append(f"| {row['file']} | {end} | {because.replace('|', ' ')} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    raise SystemExit(main())
