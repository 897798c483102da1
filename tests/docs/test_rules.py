"""Pages name rules of the semantics by numbers; on the site these are links."""

from __future__ import annotations

import re
from pathlib import Path

from page_parts import link_rules

DOCS = Path(__file__).parents[2] / "docs"


def test_numbers_after_a_link_to_the_semantics_lead_to_the_rules() -> None:
    linked = link_rules("**4.2** The plan.\nSee [semantics](../reference/semantics.md#4-plans) 4.2, 7.13, and 5.")
    assert linked == ("(rule-4-2)=\n**4.2** The plan.\nSee [semantics 4.2](#rule-4-2), [7.13](#rule-7-13), and 5.")


def test_each_number_is_that_of_a_rule() -> None:
    texts = {page: link_rules(page.read_text(encoding="utf-8")) for page in sorted(DOCS.rglob("*.md"))}
    rules = set(re.findall(r"^\((rule-[\d-]+)\)=$", texts[DOCS / "reference" / "semantics.md"], re.MULTILINE))
    named = {rule: page for page, text in texts.items() for rule in re.findall(r"\(#(rule-[\d-]+)\)", text)}
    assert {rule: page for rule, page in named.items() if rule not in rules} == {}
    assert len(named) >= 30
