"""The lifecycle of an operation as a picture: its figures are those of coverage, and it says only what is so."""

from pathlib import Path

import pytest
from lxml import etree
from msgspec.structs import replace

from scbm.cases.coverage import STATE_ASPECTS, Decision, Obligation, Statuses, StatusProof
from scbm.files import load_model
from scbm.model import Action, BehaviorModel
from scbm.reports.html.diagrams import lifecycle_parts, lifecycle_svg
from scbm.store import History
from support.histories import EXAMPLE, history_of
from support.wording import Wording

LIFECYCLE = load_model(Path(__file__).parents[3] / "models/valid/lifecycle.yaml")
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def history() -> History:
    return history_of(EXAMPLE / "before.yaml", 20)


def _parsed(history: History, operation: str) -> etree._Element:
    """Return the lifecycle of an operation, with the common parts that it refers to."""
    root = etree.fromstring(lifecycle_svg(history, operation))
    found = etree.fromstring(f'<svg xmlns="{SVG[1:-1]}">{lifecycle_parts(history)}</svg>')
    parts = {part.get("id"): part for part in found.iterfind(f"{SVG}defs/{SVG}g")}
    for use in root.findall(f".//{SVG}use"):
        holder = use.getparent()
        assert holder is not None
        holder.replace(use, etree.fromstring(etree.tostring(parts[(use.get("href") or "")[1:]])))
    return root


def _states(root: etree._Element) -> dict[str, tuple[str, etree._Element]]:
    """For each state that leads somewhere, by what it says first: all that it says, and its element."""
    links = root.findall(f"{SVG}a")
    seen = {link: " ".join(str(part) for text in link.iter(f"{SVG}text") for part in text.itertext()) for link in links}
    words_by_link = {link: words.split() for link, words in seen.items()}
    return {words[1]: (" ".join(words), link) for link, words in words_by_link.items()}


def _texts(root: etree._Element) -> list[str]:
    return [str(text) for text in root.itertext()]


def _of(model: BehaviorModel, history: History) -> History:
    return History(model, history.runs, ())


def _assignment(model: BehaviorModel) -> tuple[Action, ...]:
    """`gripper_open.state <- failed`."""
    return (replace(model.automatic_transitions[0].a[0], target="gripper_open.state"),)


def test_each_state_says_how_many_cases_visited_it(history: History) -> None:
    for operation in history.model.operations:
        states = _states(_parsed(history, operation.name))
        assert list(states) == [aspect.value for aspect in STATE_ASPECTS]
        for aspect in STATE_ASPECTS:
            count = len([*history.coverage.visitors(Obligation(operation.name, aspect))])
            words = "✗ {} no case" if not count else "✓ {} 1 case" if count == 1 else f"✓ {{}} {count} cases"
            assert states[aspect][0] == words.format(aspect)


def test_what_was_missed_is_reported_without_colour_too(history: History) -> None:
    states = _states(_parsed(history, "gantry_move_to_agv"))
    dashed = {state for state, (_, link) in states.items() if link.findall(f".//{SVG}rect[@stroke-dasharray]")}
    assert dashed == {"disabled", "failed", "timedout"}


def test_each_state_leads_to_the_cases_that_visit_it(history: History) -> None:
    states = _states(_parsed(history, "gripper_open"))
    assert states["failed"][1].get("href") == "#/cases?visits=gripper_open%2Ffailed"


def test_title_and_description_name_the_operation_and_its_states(history: History, wording: Wording) -> None:
    root = _parsed(history, "gripper_open")
    named = {element.get("id"): element.text for element in root.iter(f"{SVG}title", f"{SVG}desc")}
    shown = [named[name] or "" for name in (root.get("aria-labelledby") or "").split()]
    assert "gripper_open" in shown[0]
    wording(shown)


def test_a_picture_with_links_is_no_image_to_a_screen_reader(history: History) -> None:
    assert _parsed(history, "gripper_open").get("role") == "group"


def test_deadlines_stand_at_their_arrows(wording: Wording) -> None:
    empty = _of(LIFECYCLE, history_of(EXAMPLE / "before.yaml", 0))
    texts = _texts(_parsed(empty, "full"))
    assert any("2 min" in text for text in texts)
    assert "500 ms" in texts
    wording(texts)


def test_an_operation_without_deadlines_has_none(wording: Wording) -> None:
    empty = _of(LIFECYCLE, history_of(EXAMPLE / "before.yaml", 0))
    texts = _texts(_parsed(empty, "plain"))
    assert "after" not in texts
    wording(texts)


def test_what_can_fail_an_operation_is_reported(history: History) -> None:
    empty = _of(LIFECYCLE, history)
    assert "injections" in _texts(_parsed(empty, "plain"))
    own = _texts(_parsed(empty, "full"))
    assert "failed" in own
    assert "give_up" in own
    automatic = _texts(_parsed(history, "gripper_open"))
    assert "automatic" in automatic
    assert "robot_failed, gantry_failed, scanner_failed, gripper_failed" in automatic


def test_an_automatic_transition_that_fails_another_operation_is_no_way_to_fail_this_one() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    only = replace(model.automatic_transitions[0], a=_assignment(model))
    changed = replace(model, automatic_transitions=(only,))
    empty = _of(changed, history_of(EXAMPLE / "before.yaml", 0))
    assert "automatic" in _texts(_parsed(empty, "gripper_open"))
    assert "automatic" not in _texts(_parsed(empty, "gripper_close"))


def test_names_are_escaped(history: History) -> None:
    nasty = "<b>&\"'é"
    operation = replace(history.model.operations[0], name=nasty)
    root = _parsed(_of(replace(history.model, operations=(operation,)), history), nasty)
    assert root.find(f"{SVG}title") is not None
    assert (root.findtext(f"{SVG}title") or "").endswith(f" {nasty}")
    assert _states(root)["failed"][1].get("href") == "#/cases?visits=%3Cb%3E%26%22%27%C3%A9%2Ffailed"


def test_an_operation_that_does_not_exist_is_an_error(history: History) -> None:
    with pytest.raises(KeyError):
        lifecycle_svg(history, "nothing")


def test_a_state_has_the_mark_and_the_colour_of_its_status(history: History) -> None:
    proofs = {"gripper_open/timedout": StatusProof(Decision.UNCOVERABLE, "no run", "runs")}
    root = _parsed(replace(history, decided=Statuses.of(history.coverage, proofs)), "gripper_open")
    words, link = _states(root)["timedout"]
    assert words == "\N{MULTIPLICATION SIGN} timedout no case"
    assert link.findtext("{*}title") == "timedout: no case, uncoverable"
    assert [group.get("class") for group in link.findall(f"{SVG}g")] == ["state uncoverable"]
