"""Cobertura XML: read by a library that is not ours; its branch rate is the figure."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import NoReturn

import pytest
from lxml import etree
from msgspec.structs import replace

from scbm.files import read_model
from scbm.reports.ci.cobertura import cobertura_xml
from scbm.reports.ci.marked_lines import as_code, mark_file
from scbm.store import History, ModelSource, StoredCase, StoredRun
from support.histories import EXAMPLE, history_of

MODELS = Path(__file__).parents[2] / "models/valid"
RUN = StoredRun("0" * 32, "2026-11-21T12:00:00.123456Z", "scbm test", ModelSource("m.yaml", ""))


def stored(text: str, path: str = "m.yaml", cases: tuple[StoredCase, ...] = ()) -> History:
    return History(read_model(text), (replace(RUN, source=ModelSource(path, text)),), cases)


def written(history: History) -> etree._Element:
    return etree.fromstring(cobertura_xml(history).encode())


def unavailable(reason: str) -> NoReturn:
    if os.environ.get("SCBM_ALL_TOOLS") == "1":
        pytest.fail(f"{reason}, and SCBM_ALL_TOOLS=1 says that it is there")
    pytest.skip(reason)


@pytest.fixture
def example() -> History:
    return history_of(EXAMPLE / "before.yaml", 20)


def test_the_branch_rate_is_the_figure(example: History) -> None:
    root = written(example)
    figure = example.coverage.figure
    assert (root.get("branches-covered"), root.get("branches-valid")) == (str(figure.visited), str(figure.of))
    assert root.get("branch-rate") == "0.4651"
    (lines,) = root.iterfind("packages/package/classes/class/lines")
    conditions = [condition.get("coverage") for condition in lines.iter("condition")]
    assert conditions.count("100%") == figure.visited
    assert len(conditions) == figure.of


def test_a_reader_that_is_not_ours_finds_the_lines_and_their_file(example: History, tmp_path: Path) -> None:
    try:
        pycobertura, filesystem = import_module("pycobertura"), import_module("pycobertura.filesystem")
    except ImportError:
        unavailable("there is no pycobertura")
    report = tmp_path / "coverage.xml"
    report.write_text(cobertura_xml(example), encoding="utf-8")
    read = pycobertura.Cobertura(str(report), filesystem=filesystem.filesystem_factory(str(EXAMPLE.parents[1])))
    name = "examples/robot_in_the_air/before.yaml"
    lines = as_code(mark_file(example.model, example.source, example.coverage)).measured
    assert read.files() == [name]
    assert read.total_statements(name) == len(lines)
    words = {"visited": "hit", "partly": "partial", "missed": "miss"}
    assert read.line_statuses(name) == [(line.number, words[line.state]) for line in lines]
    assert read.branch_rate() == pytest.approx(0.4651)
    assert [line.source.rstrip("\n") for line in read.file_source(name)] == example.source.text.splitlines()


@pytest.mark.peer
def test_it_is_what_the_dtd_of_cobertura_says(example: History) -> None:
    path = os.environ.get("SCBM_COBERTURA_DTD")
    if path is None:
        pytest.skip("SCBM_COBERTURA_DTD does not say where the DTD is, which is under the GPL and so not here")
    with Path(path).open("rb") as stream:
        dtd = etree.DTD(stream)
    for history in (example, stored("behavior_model: m\nvariables: {}\noperations: {}\n")):
        assert dtd.validate(written(history)), dtd.error_log


def test_conditions_say_how_many_of_them_were_visited(example: History) -> None:
    line = next(
        each for each in written(example).iterfind("packages/*/*/class/lines/line") if each.get("number") == "70"
    )
    assert {str(key): str(value) for key, value in line.items()} == {
        "number": "70",
        "hits": "12",
        "branch": "true",
        "condition-coverage": "66% (2/3)",
    }
    conditions = [tuple(map(str, condition.values())) for condition in line.iter("condition")]
    assert conditions == [("0", "failed", "100%"), ("1", "disabled", "0%"), ("2", "executing", "100%")]


def test_operations_and_automatic_transitions_are_methods(example: History) -> None:
    methods = {method.get("name"): method for method in written(example).iter("method")}
    assert len(methods) == 22
    assert methods["robot_move_to_home"].get("line-rate") == "0.0000"
    assert methods["robot_move_to_toolbox_gripper"].get("branch-rate") == "0.6000"
    assert methods["automatic/robot_failed"].get("branch-rate") == "1.0000"
    assert [line.get("number") for line in methods["automatic/robot_failed"].iter("line")] == ["323", "324", "325"]


def test_a_method_has_its_own_branches_of_a_line_that_it_shares() -> None:
    history = history_of(MODELS / "anchors.yaml", 20)
    methods = {method.get("name"): method for method in written(history).iter("method")}
    assert [len(list(method.iter("condition"))) for method in methods.values()] == [5, 5, 5]
    assert methods["take_left"].get("branch-rate") == "0.4000"
    assert methods["take_again"].get("branch-rate") == "0.0000"


@pytest.mark.parametrize(
    ("path", "source", "package", "filename"),
    [
        ("cell.yaml", ".", ".", "cell.yaml"),
        ("./models/../models/cell.yaml", ".", "models", "models/cell.yaml"),
        ("models\\cell.yaml", ".", "models", "models/cell.yaml"),
        ("/builds/group/project/models/cell.yaml", "/builds/group/project/models", ".", "cell.yaml"),
        ("C:\\project\\cell.yaml", "C:/project", ".", "cell.yaml"),
        ("<zelle & co>.yaml", ".", ".", "<zelle & co>.yaml"),
    ],
)
def test_a_relative_file_is_in_the_repository_and_an_absolute_one_in_its_directory(
    path: str, source: str, package: str, filename: str
) -> None:
    root = written(stored("behavior_model: m\nvariables: {}\noperations: {}\n", path))
    assert root.findtext("sources/source") == source
    assert [each.get("name") for each in root.iter("package")] == [package]
    assert [each.get("filename") for each in root.iter("class")] == [filename]


def test_the_moment_is_that_of_the_last_run(example: History) -> None:
    assert written(replace(example, runs=(RUN, *example.runs))).get("timestamp") == "1795262400000"


@pytest.mark.slow
def test_a_rate_is_never_all_before_all_is_visited() -> None:
    operations = "".join(f"  o{n}: {{pre: {{g: true}}, post: {{g: true}}}}\n" for n in range(5000))
    history = stored(f"behavior_model: m\nvariables: {{}}\noperations:\n{operations}")
    almost = (1 << 24_999) - 1
    example = history_of(EXAMPLE / "before.yaml", 1)
    root = written(replace(history, cases=(replace(example.cases[0], visited=almost),)))
    assert (root.get("branches-covered"), root.get("branches-valid")) == ("24999", "25000")
    assert root.get("branch-rate") == "0.9999"


def test_where_nothing_can_be_measured_nothing_is_missing() -> None:
    root = written(stored("behavior_model: m\nvariables: {}\noperations: {}\n"))
    assert (root.get("line-rate"), root.get("branch-rate"), root.get("branches-valid")) == ("1", "1", "0")
