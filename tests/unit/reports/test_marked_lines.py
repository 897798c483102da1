"""Lines of the model file: every obligation is a branch of exactly one of them (decision 21)."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.cases.coverage import Aspect, Coverage, Obligation, Obligations
from scbm.files import load_model, read_model
from scbm.reports.ci.marked_lines import MarkedFile, MarkedLine, as_code, mark_file, mark_lines
from scbm.store import ModelSource
from support.histories import EXAMPLE, history_of
from support.profiles import examples, longer_but_one_in

MODELS = (*sorted((Path(__file__).parents[2] / "models/valid").glob("*.yaml")), *sorted(EXAMPLE.glob("*.yaml")))
CELL = """\
behavior_model: cell
variables: {a: {domain: bool, initial: false}, n: {domain: 0..3, initial: 0}}
operations:
  go:
    deadline: 10 s
    pre:
      name: start
      g: a == false
        && n < 3
      ar: [n += 1]
    post:
      g: true

      # the end
      a: [a <- true]
    failed:
      g: n == 3
    timedout: [n <- 0]
  stop:
    pre: {g: a == true}
    post: {g: true, a: [a <- false]}
    timedout: []
automatic_transitions:
  wrap:
    # at the end of the range
    g: n == 3
    a: [n <- 0]
goals: {done: a == true}
"""
GO = Obligation("go", Aspect.FAILED)


def source_of(path: Path) -> ModelSource:
    return ModelSource(path.name, path.read_bytes().decode())


def marked(text: str, *cases: tuple[str, ...]) -> MarkedFile:
    """The lines of a text after cases that visited the obligations of these names."""
    model = read_model(text)
    obligations = Obligations.of(model)
    bits = {str(obligation): obligations.bit(obligation) for obligation in obligations}
    visited = tuple((f"case-{number}", sum(bits[name] for name in case)) for number, case in enumerate(cases))
    return mark_file(model, ModelSource("cell.yaml", text), Coverage(obligations, visited))


def shown_line(line: MarkedLine) -> tuple[str, list[str], int | None, str]:
    return line.role, [f"{obligation} {count}" for obligation, count in line.obligations], line.hits, line.state


@pytest.mark.parametrize("path", longer_but_one_in(3, MODELS), ids=lambda path: path.stem)
@given(data=st.data())
@examples(10)
def test_each_counted_obligation_is_a_branch_of_one_line(path: Path, data: st.DataObject) -> None:
    model = load_model(path)
    obligations = Obligations.of(model)
    every = (1 << len(obligations.all)) - 1
    visits = data.draw(st.lists(st.integers(0, every), max_size=4))
    coverage = Coverage(obligations, tuple((f"case-{number}", bits) for number, bits in enumerate(visits)))
    lines = mark_lines(model, source_of(path), coverage)
    branches = [branch for line in lines for branch in line.obligations]
    assert Counter(o for o, _ in branches) == Counter(o for o in obligations if o.counts)
    assert all(count == len(list(coverage.visitors(o))) for o, count in branches)
    assert sum(count > 0 for _, count in branches) == coverage.figure.visited
    assert len(branches) == coverage.figure.of


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_the_lines_are_those_of_the_text(path: Path) -> None:
    model = load_model(path)
    source = source_of(path)
    lines = mark_lines(model, source, Coverage(Obligations.of(model)))
    assert [line.number for line in lines] == list(range(1, len(lines) + 1))
    assert "\n".join(line.text for line in lines) == source.text.replace("\r\n", "\n").removesuffix("\n")


def test_each_line_says_what_it_is_and_how_many_cases_executed_it() -> None:
    lines = marked(
        CELL,
        ("go/executing", "go/completed", "stop/disabled"),
        ("go/executing", "go/timedout", "automatic/wrap"),
        ("go/executing", "go/disabled"),
        (),
    ).lines
    assert [shown_line(line) for line in lines[3:19]] == [
        ("operation", ["go/failed 0"], 3, "partly"),
        ("deadline", ["go/timedout 1"], 1, "visited"),
        ("", [], None, ""),
        ("", [], None, ""),
        ("precondition", ["go/disabled 1", "go/executing 3"], 3, "visited"),
        ("precondition", [], 3, "visited"),
        ("precondition", [], 3, "visited"),
        ("", [], None, ""),
        ("postcondition", ["go/completed 1"], 1, "visited"),
        ("", [], None, ""),
        ("", [], None, ""),
        ("postcondition", [], 1, "visited"),
        ("failed", [], 0, "missed"),
        ("failed", [], 0, "missed"),
        ("timedout", [], 1, "visited"),
        ("operation", ["stop/failed 0"], 1, "partly"),
    ]
    assert [shown_line(line) for line in lines[19:27]] == [
        ("precondition", ["stop/disabled 1", "stop/executing 0"], 0, "partly"),
        ("postcondition", ["stop/completed 0"], 0, "missed"),
        ("timedout", ["stop/timedout 0"], 0, "missed"),
        ("", [], None, ""),
        ("automatic transition", ["automatic/wrap 1"], 1, "visited"),
        ("", [], None, ""),
        ("automatic transition", [], 1, "visited"),
        ("automatic transition", [], 1, "visited"),
    ]


def test_a_branch_without_a_line_of_its_own_is_one_of_the_operation() -> None:
    text = CELL.replace("    timedout: []\n", "")
    line = marked(text).lines[18]
    assert shown_line(line) == ("operation", ["stop/failed 0", "stop/timedout 0"], 0, "missed")


def test_a_line_that_says_all_of_an_operation_has_all_its_branches() -> None:
    text = (
        "behavior_model: m\nvariables: {}\n"
        "operations: {go: {deadline: 1 s, pre: {g: true}, post: {g: true}}, no: {pre: {g: true}, post: {g: true}}}\n"
    )
    line = marked(text, ("go/timedout",), ("no/failed",), ("no/completed", "go/completed"), ()).lines[2]
    assert line.role == "operation"
    assert len(line.obligations) == 10
    assert line.hits == 3
    assert line.state == "partly"


def test_a_line_that_operations_share_has_the_branches_of_all() -> None:
    text = CELL.replace("pre: {g: a == true}", "pre: &start {g: a == true}").replace(
        "automatic_transitions:", "  again:\n    pre: *start\n    post: {g: true}\nautomatic_transitions:"
    )
    file = marked(text, ("stop/executing",), ("again/executing",), ("again/executing", "stop/executing"))
    assert shown_line(file.lines[19]) == (
        "precondition",
        ["stop/disabled 0", "stop/executing 2", "again/disabled 0", "again/executing 2"],
        3,
        "partly",
    )
    assert [line.hits for line in file.lines[22:25]] == [2, None, 0]


def test_an_operation_that_only_queued_was_not_executed() -> None:
    assert marked(CELL, ("go/queued",)).lines[3].state == "missed"


def test_parts_are_operations_and_automatic_transitions_with_their_lines() -> None:
    parts = marked(CELL, ("go/failed",), ("automatic/wrap",), ("automatic/wrap",)).parts
    assert [(part.name, part.number, part.hits) for part in parts] == [
        ("go", 4, 1),
        ("stop", 19, 0),
        ("automatic/wrap", 24, 2),
    ]
    assert [part.lines for part in parts] == [
        (4, 5, 8, 9, 10, 12, 15, 16, 17, 18),
        (19, 20, 21, 22),
        (24, 26, 27),
    ]
    assert [part.owns(GO) for part in parts] == [True, False, False]


def test_as_code_a_line_was_executed_if_and_only_if_one_of_its_branches_was() -> None:
    file = marked(CELL, ("go/executing",), ("stop/disabled", "stop/queued"), ("stop/disabled",))
    code = as_code(file)
    assert [shown_line(line)[1:] for line in code.lines[3:8:4]] == [
        ([], 1, "visited"),
        (["go/failed 0", "go/disabled 0", "go/executing 1"], 1, "partly"),
    ]
    assert [shown_line(line)[1:] for line in code.lines[18:20]] == [
        ([], 2, "visited"),
        (["stop/failed 0", "stop/disabled 2", "stop/executing 0"], 2, "partly"),
    ]
    assert shown_line(code.lines[23]) == shown_line(file.lines[23])
    assert all(
        any(count for _, count in line.obligations) == bool(line.hits) for line in code.measured if line.obligations
    )
    assert code.parts == file.parts


def test_a_model_without_obligations_has_lines_that_say_nothing() -> None:
    file = marked("behavior_model: m\nvariables: {}\noperations: {}\n", ())
    assert file.measured == ()
    assert file.parts == ()
    assert [line.state for line in file.lines] == ["", "", ""]


def test_the_example_has_its_figure() -> None:
    history = history_of(EXAMPLE / "before.yaml", 20)
    lines = mark_lines(history.model, history.source, history.coverage)
    counts = [count for line in lines for _, count in line.obligations]
    assert (sum(count > 0 for count in counts), len(counts)) == (40, 86)


def test_the_lines_of_a_part_rise_in_whatever_order_it_is_written() -> None:
    first = "behavior_model: m\nvariables: {}\noperations:\n  go:\n    timedout: []\n    post: {g: true}\n"
    text = first + "    #\n" * 30 + "    pre:\n      g: true\n    deadline: 1 s\n"
    (part,) = marked(text, ("go/executing",), ("go/failed",), ("go/queued",)).parts
    assert (part.number, part.lines, part.hits) == (4, (4, 5, 6, 38, 39), 2)
