from dataclasses import replace
from pathlib import Path

from sss_tools.report.rules_page import render
from sss_tools.validation.rule import all_rules

PAGE = Path(__file__).parents[3] / "docs" / "rules.md"


def test_the_page_in_the_documentation_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == render(), "run: python -m sss_tools.report.rules_page > docs/rules.md"


def test_the_page_changes_with_the_rules():
    for change in ({"why": "No."}, {"name": "x"}, {"fix": "No."}, {"finds": "No."}):
        assert render([replace(all_rules()[0], **change), *all_rules()[1:]]) != render()


def test_every_link_of_the_table_leads_to_a_section():
    text = render()
    headings = {line[3:].lower().replace(" ", "-") for line in text.splitlines() if line.startswith("## ")}
    links = {line.split("(#")[1].split(")")[0] for line in text.splitlines() if line.startswith("| [")}
    assert links == headings and len(links) == len(all_rules())
