"""What is done with an object, and why, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from renderer.scene.description import SceneObject
    from renderer.scene.holes import HoleReport
    from renderer.shaders.selection import Plan


def plan_in_a_line(thing: SceneObject, plan: Plan, hole: HoleReport, source: str) -> str:
    """The verdict on an object, what is done at its holes, its shader and why.

    source  where the verdict comes from
    """
    if plan.state is None:
        return f"{plan.name}: {plan.shader}"
    assert thing.closedness is not None
    loops = thing.closedness.boundary_loops
    holes = f", {loops} boundary loop(s)" if loops else ""
    return (
        f"{plan.name}: {plan.state}{holes} ({source}); hole handling {plan.hole_handling}{_expected(hole)}; "
        f"shader {plan.shader} at distance {plan.distance:.4g}: {plan.reason}"
    )


def plan_at_length(thing: SceneObject, plan: Plan, hole: HoleReport, source: str) -> str:
    """The same in lines, with sizes and all shaders that the object could have had."""
    if plan.state is None:
        return f"{plan.name}: {plan.shader}, {plan.size_px:.4g} pixels across at distance {plan.distance:.4g}"
    assert thing.closedness is not None and plan.mean_free_path_px is not None
    loops = thing.closedness.boundary_loops
    lines = [
        f"{plan.name}: {plan.state}, {loops} boundary loop(s) ({source}); "
        f"hole handling {plan.hole_handling}{_expected(hole)}",
        f"  distance {plan.distance:.4g}, {plan.size_px:.4g} pixels across, mean free path "
        f"{plan.mean_free_path_px:.3g} pixels",
    ]
    if plan.candidates:
        lines.append(f"  {'shader':8}{'error':>9}{'counted':>10}{'passes':>8}{'seconds':>10}{'share':>7}")
    for one in plan.candidates:
        share = plan.shares.get(one.shader, 0.0)
        lines.append(
            f"  {one.shader:8}{_percentage(one.predicted_error):>9}{_percentage(one.error_bound):>10}{one.passes:>8}"
            f"{one.predicted_seconds:>10.2g}{100 * share:>5.3g} %"
        )
    return "\n".join([*lines, f"  {plan.shader}: {plan.reason}"])


def _percentage(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"


def _expected(hole: HoleReport) -> str:
    return "" if not hole.expected_error else f", {100 * hole.expected_error:.2g} % error expected of it"
