"""The page about all rules, ``docs/rules.md``: ``python -m sss_tools.report.rules_page > docs/rules.md``."""

from __future__ import annotations

import sys
from collections.abc import Iterable

from ..validation.outcome import FixSafety
from ..validation.rule import Rule, all_rules

_HEAD = """# Rules

What `sss-check` looks for, and what each fault does to light inside a solid. `sss-check --explain CODE` says the same.
This page is written by `python -m sss_tools.report.rules_page` from the rules themselves.

- **error**: light cannot be right in such a solid. **warning**: it may well be wrong. **info**: good to know.
- A **safe** fix keeps the shape, an **unsafe** one may invent or remove surface and is done on request only.
- A rule ends as `pass`, `fail`, `waived` or `not-run`, with the reason. SSS602, SSS701 and SSS702 say that a file
  cannot be used at all; they always run and cannot be waived.
"""
_FIXES = {FixSafety.SAFE: "safe", FixSafety.UNSAFE: "unsafe", FixSafety.NONE: "by hand"}


def render(rules: Iterable[Rule] | None = None) -> str:
    """The page in Markdown: a table, then a section a rule."""
    rules = tuple(all_rules() if rules is None else rules)
    table = ["| code | name | severity | fix | finds |", "|---|---|---|---|---|"]
    table += [
        f"| [{rule.code}](#{_anchor(rule)}) | {rule.name} | {rule.severity} | {_FIXES[rule.fix_safety]} | "
        f"{_cell(rule.finds)} |"
        for rule in rules
    ]
    return "\n".join([_HEAD, *table, "", *(_section(rule) for rule in rules)])


def _section(rule: Rule) -> str:
    return (
        f"## {rule.code} {rule.name}\n\n"
        f"{_sentence(rule.finds)}\n\n"
        f"**Why.** {rule.why}\n\n"
        f"**What helps.** {_sentence(rule.fix)} Automatic fix: {rule.fix_safety}. Severity: {rule.severity}.\n"
    )


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _anchor(rule: Rule) -> str:
    return f"{rule.code} {rule.name}".lower().replace(" ", "-")


if __name__ == "__main__":
    sys.stdout.write(render())
