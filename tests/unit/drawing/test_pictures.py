"""Pictures of models: golden files, names that mean something elsewhere, equal objects, statuses."""

from __future__ import annotations

import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Decision, Obligation, Statuses, StatusProof
from scbm.drawing import layered_layout
from scbm.drawing.automata import ModelAutomata
from scbm.drawing.automaton_svg import arrow_line
from scbm.drawing.drawn_automata import ArrowStyle, drawn_automata
from scbm.drawing.edge_statuses import PAINTS, EdgeStatuses
from scbm.drawing.label_widths import label_of, label_width
from scbm.drawing.layered_layout import LayoutEdge, LayoutNode, lay_out
from scbm.drawing.model_picture import Picture, automata_picture, plan_picture
from scbm.drawing.named_parts import automata_of_operation, named_automata
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel
from scbm.planning import Planner, Solved
from support.histories import EXAMPLE, history_of
from support.hostile_names import HOSTILE, hostile_model

if TYPE_CHECKING:
    from collections.abc import Callable

    Golden = Callable[[str, str], None]

pytest.importorskip("quickjs", reason="the extra `draw` is not installed")

ROOT = Path(__file__).parents[3]
SVG = "{http://www.w3.org/2000/svg}"
DUAL = ROOT / "examples/dual_cnc/cell.yaml"
LIFTED = ROOT / "examples/dual_cnc/lifted.yaml"


def picture(model: BehaviorModel, statuses: EdgeStatuses | None = None, *names: str) -> Picture:
    automata = ModelAutomata.of(model)
    return automata_picture(automata, named_automata(automata, names), statuses or EdgeStatuses())


def parsed(svg: str) -> ET.Element:
    return ET.fromstring(svg)  # noqa: S314 - our own


def plan_of(model: BehaviorModel, goal: str) -> Picture:
    predicate = model.goal(goal)
    assert predicate is not None
    answer = Planner.of(model).plan(model.nominal_state, predicate)
    assert isinstance(answer, Solved)
    return plan_picture(ModelAutomata.of(model), goal, answer.plan, EdgeStatuses())


def stored() -> EdgeStatuses:
    """The statuses of five cases of the paper's example, with a proof, and a forced visit."""
    history = history_of(EXAMPLE / "before.yaml", 5)
    proof = StatusProof(Decision.UNCOVERABLE, "nothing takes it", "p.json")
    forced = history.obligations.bit(Obligation("pick_item_a", Aspect.COMPLETED))
    found = Statuses.of(history.coverage, {"automatic/clear_scan_timeouts": proof}, forced=forced)
    return EdgeStatuses.of_store(replace(history, decided=found))


@pytest.mark.parametrize(("name", "path"), [("robot_in_the_air", EXAMPLE / "before.yaml"), ("dual_cnc", DUAL)])
def test_the_picture_of_a_model_is_always_the_same(golden: Golden, name: str, path: Path) -> None:
    golden(f"draw-{name}.svg", f"{picture(load_model(path)).svg()}\n")


def test_a_picture_with_statuses_is_always_the_same(golden: Golden) -> None:
    shown = picture(load_model(EXAMPLE / "before.yaml"), stored())
    golden("draw-statuses.svg", f"{shown.svg()}\n")
    golden("draw-statuses.md", shown.mermaid)


def test_the_picture_of_a_plan_is_always_the_same(golden: Golden) -> None:
    shown = plan_of(load_model(EXAMPLE / "before.yaml"), "item_a_scanned")
    golden("draw-plan.svg", f"{shown.svg()}\n")
    golden("draw-plan.md", shown.mermaid)


@pytest.mark.slow
def test_another_process_draws_the_same_bytes() -> None:
    command = [sys.executable, "-m", "scbm", "draw", str(DUAL)]
    runs = [subprocess.run(command, capture_output=True, check=True, env={"PYTHONHASHSEED": n}).stdout for n in "12"]
    assert runs[0] == runs[1]
    assert runs[0].decode() == f"{picture(load_model(DUAL)).svg()}\n"


def test_each_thread_lays_out_the_same() -> None:
    nodes, edges = [LayoutNode(40, 20)] * 4, [LayoutEdge(n, (n + 1) % 4, 50, 14) for n in range(4)]
    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda _: lay_out(nodes, edges), range(6)))
    assert all(each == found[0] for each in found)


def test_a_long_chain_of_values_has_a_layout() -> None:
    """A sequence of steps is one: the layout calls itself for each of them."""
    nodes, edges = [LayoutNode(40, 20)] * 400, [LayoutEdge(n, n + 1, 50, 14) for n in range(399)]
    found = lay_out(nodes, edges)
    assert [middle.x for middle in found.nodes] == sorted(middle.x for middle in found.nodes)


def test_the_vendored_file_is_the_one_of_its_digest() -> None:
    data = files("scbm.drawing").joinpath("vendored/dagre.min.js").read_bytes()
    assert sha256(data).hexdigest() in (layered_layout.__doc__ or "")


def test_hostile_names_are_texts_in_svg_and_html() -> None:
    shown = picture(hostile_model())
    for text in (shown.svg(), shown.html().partition("</style>")[2]):
        assert "<script" not in text
        assert not any(character in text for character in "\x00\x1b\u202e")
    root = parsed(shown.svg())
    titles = [title.text or "" for title in root.iter(f"{SVG}title")]
    assert all(any(line in title for title in titles) for line in HOSTILE[:-1])
    assert {element.tag.removeprefix(SVG) for element in root.iter()} <= {
        "svg", "title", "desc", "style", "rect", "g", "text", "tspan", "path", "polygon",
    }  # fmt: skip


def test_hostile_names_in_mermaid_have_no_syntax() -> None:
    lines = picture(hostile_model()).mermaid.splitlines()
    labels = [line.partition('"')[2].rpartition('"')[0] for line in lines if line.lstrip().startswith("state ")]
    assert labels
    assert not any(character in label for label in labels for character in '":<>[]{}|`%\x1b')


def test_labels_are_cut_and_tooltips_are_whole() -> None:
    name = "a_very_long_name_of_an_operation_that_has_to_be_cut"
    model = hostile_model()
    renamed = replace(model, operations=(replace(model.operations[0], name=name),))
    svg = parsed(picture(renamed).svg())
    shown = [element for element in svg.iter(f"{SVG}text") if "".join(element.itertext()).startswith(name)]
    assert [element[0].tail for element in shown] == [f"{name[:39]}…"]


def test_a_wide_automaton_has_a_row_of_its_own() -> None:
    """Else its width would be that of all rows, and a page would show only the left part of each."""
    svg = parsed(picture(load_model(EXAMPLE / "before.yaml")).svg())
    frames = [each for each in svg.iter(f"{SVG}g") if each.get("class") == "automaton"]
    places = [tuple(map(float, re.findall(r"[\d.]+", each.get("transform") or ""))) for each in frames]
    boxes = [(x, y, float(frame[0].get("width") or "")) for frame, (x, y) in zip(frames, places, strict=True)]
    assert any(width > 1_200 for _, _, width in boxes)
    for row in dict.fromkeys(y for _, y, _ in boxes):
        inside = [x + width for x, y, width in boxes if y == row]
        assert len(inside) == 1 or max(inside) <= 1_216


def test_wide_characters_are_as_wide_as_two() -> None:
    assert label_width("中", 10) == 2 * label_width("é", 10)
    assert label_of("中" * 41) == f"{'中' * 39}…"


def test_equal_objects_are_drawn_once() -> None:
    automata = ModelAutomata.of(load_model(LIFTED))
    drawn = drawn_automata(automata, automata.drawn, EdgeStatuses())
    assert {each.title: each.variables for each in drawn if len(each.variables) > 1} == {
        "door[machine]": ("door.m1", "door.m2"),
        "chuck[machine]": ("chuck.m1", "chuck.m2"),
        "part[machine]": ("part.m1", "part.m2"),
        "alarm[machine]": ("alarm.m1", "alarm.m2"),
    }


def test_numbers_are_no_objects_in_the_values_of_equal_automata() -> None:
    text = """\
behavior_model: rack
types: {slot: 1..3}
variables:
  parts[s in slot]: {domain: 0..2, initial: 0}
operations:
  fill[s in slot]: {pre: {g: "parts[s] < 2"}, post: {g: true, a: ["parts[s] += 1"]}}
goals: {full: "parts[1] == 2"}
"""
    automata = ModelAutomata.of(read_model(text))
    (drawn,) = drawn_automata(automata, automata.drawn, EdgeStatuses())
    assert [node.label for node in drawn.nodes] == ["0", "1", "2"]
    assert [line.text for arrow in drawn.arrows for line in arrow.lines] == ["fill (3)", "fill (3)"]


def test_equal_objects_have_the_worst_status_and_the_number_of_covered_ones() -> None:
    model = load_model(LIFTED)
    history = history_of(LIFTED, 0)
    bit = history.obligations.bit(Obligation("clamp.m1", Aspect.COMPLETED))
    coverage = replace(history.coverage, cases=(("one", bit),))
    known = Statuses.of(coverage).by_obligation
    automata = ModelAutomata.of(model)
    drawn = drawn_automata(automata, named_automata(automata, ["chuck"]), EdgeStatuses(known))
    lines = [(line.text, line.paint) for arrow in drawn[0].arrows for line in arrow.lines]
    assert lines == [("clamp (2) 1 of 2", "missed"), ("unclamp (2)", "missed")]


def test_statuses_are_those_of_obligations() -> None:
    statuses = stored()
    paints = {
        name: statuses.paint([obligation])
        for name, obligation in (
            ("covered", Obligation("scanner_scan_item_a", Aspect.COMPLETED)),
            ("missing", Obligation("robot_move_to_home", Aspect.COMPLETED)),
            ("forced", Obligation("pick_item_a", Aspect.COMPLETED)),
            ("proved", Obligation("clear_scan_timeouts", Aspect.TAKEN)),
        )
    }
    assert paints == {"covered": "visited", "missing": "missed", "forced": "forced", "proved": "uncoverable"}


def test_names_select_variables_operations_and_resources() -> None:
    automata = ModelAutomata.of(load_model(EXAMPLE / "before.yaml"))

    def chosen(*names: str) -> dict[str, int]:
        return {each.variable.name: len(each.edges) for each in named_automata(automata, names)}

    assert chosen("robot_at") == {"robot_at": 5}
    assert chosen("robot_command", "pick_item_a") == {"gripper_act": 1, "item_a_at": 1, "robot_command": 11}
    assert chosen("scanner") == {"scanned_a": 1, "scan_timeouts": 5}
    assert chosen("clear_scan_timeouts") == {"scan_timeouts": 1}
    assert {each.variable.name for each in automata_of_operation(automata, "place_item_a")} == {
        "gripper_act",
        "item_a_at",
    }


def test_a_click_leads_to_the_row_of_its_obligation() -> None:
    page = picture(load_model(EXAMPLE / "before.yaml"), stored()).html()
    svg = parsed(page[page.index("<svg") : page.index("</svg>") + len("</svg>")])
    targets = {link.get("href") for link in svg.iter(f"{SVG}a")}
    assert len(targets) == 19
    assert all(f'<tr id="{str(target)[1:]}">' in page for target in targets)


def test_each_kind_of_line_has_a_pattern_of_its_own_without_colours() -> None:
    """The three ways to be proved share one; their marks and colours differ."""
    styles = (ArrowStyle.OPERATION, ArrowStyle.AUTOMATIC)
    paints = ("visited", "missed", "forced", "uncoverable")
    patterns = [arrow_line(style, paint)[2] for style in styles for paint in paints]
    patterns.append(arrow_line(ArrowStyle.OUTSIDE, "")[2])
    assert len(dict.fromkeys(patterns)) == len(patterns)
    assert len(dict.fromkeys(paint.mark for paint in PAINTS.values())) == len(PAINTS)
