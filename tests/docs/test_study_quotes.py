"""The figures of the study that texts quote: all are those of its report, in the order in which each text has them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
REPORT = (ROOT / "study" / "results" / "report.md").read_text(encoding="utf-8")

QUOTES = {
    "README.md": (
        r"\*\*Is the criterion worth it\?\*\*.*?\n\n",
        "models, tau, tau of requirements, requirements, built-ins, recorded, tau of pairs",
    ),
    "study/README.md": (
        r"## What came out.*?\n## ",
        """models, written, generated, control, mutants, tau, tau by requests,
        tau of requirements, written tau of requirements, generated tau of requirements,
        tau of built-ins, tau of recorded, less pairs, less pairs by requests,
        chosen 4, random 16, completed 4, matching 4, requirements, built-ins, recorded,
        written requirements, written built-ins, written recorded, clean-up by built-ins""",
    ),
    "docs/explanation/scbm-ias.md": (
        r"## Does it predict which faults tests find\?.*?\n## ",
        "models, tau, requirements, built-ins, recorded, tau of requirements, tau of pairs",
    ),
}
"""By text: a pattern of the part that quotes the study, and the names of the figures in it, in their order."""

FIGURE = re.compile(
    r"(?<![\d.])-?0\.\d\d(?!\d)|\d+(?= %)|\d+,\d{3}|\d+(?= (?:models|written|generated|planning problems))"
)


def rows(section: str, name: str) -> list[list[str]]:
    """Return the cells after the first one of the rows with a name in the report, each without its interval."""
    part = re.search(rf"^## {section}\n.*?(?=^## )", REPORT, re.DOTALL | re.MULTILINE)
    assert part
    found = re.findall(rf"^\| {re.escape(name)} \|(.*)\|$", part[0], re.MULTILINE)
    return [[cell.split()[0] for cell in cells.split("|")] for cells in found]


def row(section: str, name: str) -> list[str]:
    """Return the cells of the first of these rows."""
    return rows(section, name)[0]


def percent(share: str) -> str:
    """Return a share with two decimals in percent."""
    return str(round(float(share) * 100))


def figures() -> dict[str, str]:
    """Return the figures of the report by the names that `QUOTES` has."""
    groups = [len(re.findall(rf"^\| \S+ \| {name} \| \d", REPORT, re.MULTILINE)) for name in ("written", "generated")]
    stay = re.search(r"(\d+) models stay in the study", REPORT)
    control = re.search(r"(\d+) planning problems without", REPORT)
    drawn = re.search(r"([\d,]+) mutants were drawn, and\s+([\d,]+)\s+of\s+them\s+are\s+proved", REPORT)
    assert stay
    assert control
    assert drawn
    mutants, equivalent = (int(count.replace(",", "")) for count in drawn.groups())
    tau, by_requests = row("Predictors", "SCBM-IAS")
    (pairs, _), less = rows("Predictors", "edges of runs, by events")
    names = ("requirements", "built-ins", "recorded")
    oracles = {name: row("Oracles", name) for name in names}
    by_group = {name: row("Written and generated models", name) for name in names}
    _, chosen, completed, matching = map(percent, row("What suites find", "4"))
    return {
        **{name: percent(cells[0]) for name, cells in oracles.items()},
        "all models": stay[1],
        "models": str(sum(groups)),
        "written": str(groups[0]),
        "generated": str(groups[1]),
        "control": control[1],
        "mutants": f"{mutants - equivalent:,}",
        "tau": tau,
        "tau by requests": by_requests,
        "tau of pairs": pairs,
        **{f"written {name}": percent(cells[0]) for name, cells in by_group.items()},
        "written tau of requirements": by_group["requirements"][2],
        "generated tau of requirements": by_group["requirements"][3],
        **{f"tau of {name}": cells[2] for name, cells in oracles.items()},
        "less pairs": less[0],
        "less pairs by requests": less[2],
        "clean-up by built-ins": percent(oracles["built-ins"][1]),
        "chosen 4": chosen,
        "random 16": percent(row("What suites find", "16")[0]),
        "completed 4": completed,
        "matching 4": matching,
    }


@pytest.mark.parametrize("text", QUOTES)
def test_a_text_quotes_the_report(text: str) -> None:
    pattern, names = QUOTES[text]
    part = re.search(pattern, (ROOT / text).read_text(encoding="utf-8"), re.DOTALL)
    assert part
    known = figures()
    assert FIGURE.findall(part[0]) == [known[name] for name in re.split(r",\s+", names)]


def test_the_report_ends_with_the_deviations_as_they_are() -> None:
    assert REPORT.endswith((ROOT / "study" / "deviations.md").read_text(encoding="utf-8"))


def test_the_report_and_the_text_confirm_the_same_hypotheses() -> None:
    decided = dict(re.findall(r"^\| (H\d) \|.*\| (confirmed|not confirmed) \|$", REPORT, re.MULTILINE))
    assert [name for name, decision in decided.items() if decision == "not confirmed"] == ["H3"]
    assert len(decided) == 7
    assert "Six of the seven hypotheses are confirmed" in (ROOT / "study/README.md").read_text(encoding="utf-8")
