"""Whatever happens to files of PDDL on their way, the import answers with a model or with located errors."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

import pytest

from scbm.files import read_model
from scbm.model import InputError
from scbm.pddl import PddlImportOptions, PddlText, imported_model, read_pddl
from support.profiles import share
from support.published_pddl import PUBLISHED

# the reader of `unified-planning` 1.3 calls old names of a library of its own
pytestmark = pytest.mark.filterwarnings("ignore:.* deprecated - use:DeprecationWarning")

ROOT = Path(__file__).parent.parent.parent
EXAMPLE, RIGHT = ROOT / "examples" / "delivery", ROOT / "tests" / "models" / "rejected_pddl"
SOURCES = {
    "delivery": [(EXAMPLE / f"{kind}.pddl").read_text("utf-8") for kind in ("domain", "problem")],
    "depot": [(RIGHT / f"right.{kind}.pddl").read_text("utf-8") for kind in ("domain", "problem")],
    **{name: [PUBLISHED[name].domain, PUBLISHED[name].problem] for name in ("rovers-1", "plansys2-factory")},
}
TOKEN = re.compile(r"[()]|[^\s();]+")
WORDS = [
    *("(", ")", "()", "-", "?", "?x", "and", "or", "not", "when", "forall", "exists", "imply", "=", "<", "+", "*", "/"),
    *("either", "object", "number", "1", "0.5", "-3", "9" * 30, "#t", "?duration", "at", "start", "over", "all", "end"),
    *("increase", "assign", "scale-up", ":action", ":durative-action", ":parameters", ":effect", ":init", ":goal"),
    *(":derived", ":types", ":requirements", "define", "domain", "problem", "é", "\0", "\x1b[2J", "x" * 300, "(" * 60),
    *("preference", "always", "unknown", "oneof", "total-cost", "(and)", "(or)", "(not (and))", "(- 1)", "@", '"'),
]


def mutated(random: Random, text: str) -> str:
    """Return a text with one token deleted, doubled, moved, or replaced by another one."""
    spans = [match.span() for match in TOKEN.finditer(text)]
    if not spans:
        return text
    (begin, end), (other, last) = random.choice(spans), random.choice(spans)
    token = text[begin:end]
    new = random.choice(["", "", f"{token} {token}", random.choice(WORDS), text[other:last], text[other:last]])
    return f"{text[:begin]} {new} {text[end:]}"


@pytest.mark.parametrize("name", SOURCES)
@pytest.mark.parametrize("seed", range(share(100, usual=3)))
def test_a_few_changed_tokens_end_in_a_model_or_in_located_errors(name: str, seed: int) -> None:
    random = Random(seed)
    texts = list(SOURCES[name])
    for _ in range(random.choice([1, 1, 1, 2, 4])):
        index = random.choice([0, 0, 1])
        texts[index] = mutated(random, texts[index])
    domain, problem = PddlText("domain.pddl", texts[0]), PddlText("problem.pddl", texts[1])
    options = PddlImportOptions(ranges=("battery=0..9",) if name == "depot" else ())
    try:
        made = imported_model(read_pddl(domain, problem), domain, problem, options)
    except InputError as error:
        check(error, {"domain.pddl": texts[0], "problem.pddl": texts[1]})
        return
    try:
        read_model(made.text, "model.yaml")
    except InputError as error:
        check(InputError([made.at_origin(each) for each in error.diagnostics]), {"domain.pddl": texts[0]})


def check(error: InputError, texts: dict[str, str]) -> None:
    """There are errors; each has a place in its text, and words of this project."""
    assert error.diagnostics
    for each in error.diagnostics:
        if each.place.file == "--range":
            continue
        lines = texts[each.place.file].split("\n")
        assert 1 <= each.place.line <= len(lines)
        assert each.source_line == lines[each.place.line - 1]
        assert 1 <= each.place.column <= len(each.source_line) + 1
        words = f"{each.message} {each.remedy or ''}"
        assert words.isprintable()
        assert len(words) < 800
        assert "unified-planning" not in words
        assert not re.search(r"Error\b|FNode|\b[otfa]-[a-z]", words.replace(each.source_line, ""))
