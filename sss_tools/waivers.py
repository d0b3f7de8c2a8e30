"""Findings that a user accepts, with a reason, in one geometry and no other."""

from __future__ import annotations

from pathlib import Path

from .record import read_waivers, record_path
from .validation.outcome import UNUSABLE, MeshReport, Outcome
from .validation.settings import Settings


def waive(report: MeshReport, path: str | Path, settings: Settings) -> dict[str, str]:
    """Turn the accepted findings of a report into ``waived`` ones.

    Accepted is what the record beside the mesh waives for this geometry, unless ``settings.isolated``, and what
    ``settings.waive`` waives in this run. Returns what a record of this geometry is to hold, code -> reason: the
    waivers it had, and those of this run that met a finding. What could not be applied is a warning of the report.
    """
    sidecar = record_path(path)
    recorded: dict[str, str] = {}
    try:
        recorded, foreign = read_waivers(path, report.hash or "")
    except ValueError as error:
        # a record that is about to be replaced need not be complained about
        if not settings.record:
            report.warnings.append(f"{sidecar}: the record {error}; it is ignored")
    else:
        if foreign:
            lost = "dropped" if settings.record else "not applied"
            report.warnings.append(
                f"{sidecar}: the waivers of {', '.join(foreign)} belong to other geometry and are {lost}: "
                "look at the mesh and waive them again"
            )
    if recorded and settings.isolated:
        report.warnings.append(f"{sidecar}: its waivers of {', '.join(sorted(recorded))} are not applied (--isolated)")
    accepted = {**({} if settings.isolated else recorded), **settings.waive}
    for rule in report.findings:
        if rule.code in accepted and rule.code not in UNUSABLE:
            rule.outcome, rule.reason = Outcome.WAIVED, accepted[rule.code]
    met = {rule.code for rule in report.waived}
    for code in settings.waive:
        if code not in met:
            report.warnings.append(f"{report.path}: there is nothing to waive: {code} found nothing")
    kept = {**recorded, **settings.waive}
    return {code: reason for code, reason in kept.items() if code in recorded or code in met}
