"""A store keeps no traces, as its cases give the same runs again."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case, Network
from scbm.files import Scope, load_model, parse_requirement, read_network
from scbm.model import Requirement
from scbm.store import (
    Recipe,
    Replays,
    drawn_recipe,
    network_words,
    read_history,
    write_store,
    written_recipe,
)
from scbm.testing import RandomCases, Tester, load_suite
from support.stores import a_run
from support.wording import Wording

EXAMPLE = Path(__file__).parents[3] / "examples/robot_in_the_air"
MODEL = load_model(EXAMPLE / "after.yaml")
HOME = "always gantry_req_state == executing -> robot_at == home"


def _stored(path: Path, cases: list[tuple[Case, Recipe]]) -> Path:
    tester = Tester(MODEL)
    with write_store(path, MODEL, a_run(1, MODEL)) as writer:
        for position, (case, recipe) in enumerate(cases, start=1):
            writer.add(position, recipe, tester.execute(case).result)
    return path


def _drawn(network: Network | None, **changes: object) -> list[tuple[Case, Recipe]]:
    cases = [replace(case, **changes) for case in RandomCases(MODEL, network=network).first(4, 3)]
    return [(case, drawn_recipe(case, network_words(network))) for case in cases]


def _requirement() -> Requirement:
    return Requirement("required_1", parse_requirement(HOME, Scope.of(MODEL), file="--require"))


def _written() -> list[tuple[Case, Recipe]]:
    suite = load_suite([EXAMPLE / "cases"], MODEL)
    return [(written.case, written_recipe(written.case, MODEL, str(written.path))) for written in suite]


CASES = {
    "plain": _drawn(Network()),
    "lossy": _drawn(read_network("loss: 10 %, jitter: 20 ms", MODEL)),
    "drawn": _drawn(None),
    "judged": _drawn(Network(), requirements=(_requirement(),)),
    "written": _written(),
}


@pytest.mark.parametrize("name", CASES)
def test_a_case_of_a_store_gives_the_run_that_it_was(name: str, tmp_path: Path) -> None:
    cases = CASES[name]
    history = read_history(_stored(tmp_path / "cov.db", cases))
    replays = Replays(history)
    tester = Tester(MODEL)
    assert len(history.cases) == len(cases)
    for (case, _), stored in zip(cases, history.cases, strict=True):
        again = replays.execute(stored)
        assert again is not None
        assert again.trace == tester.execute(case).trace
        assert (again.visited, again.verdict, again.ended_ns) == (stored.visited, stored.verdict, stored.ended_ns)


def test_the_requirements_and_the_limit_of_the_command_line_are_kept(tmp_path: Path) -> None:
    ((case, _), *_) = _drawn(Network(), requirements=(_requirement(),))
    limited = replace(case, limits=replace(case.limits, time_ns=1_000))
    history = read_history(_stored(tmp_path / "cov.db", [(limited, drawn_recipe(limited, ""))]))
    assert Replays(history).case(history.cases[0]) == limited


@pytest.mark.longer
def test_a_recorded_case_leaves_nothing_to_chance(tmp_path: Path) -> None:
    history = read_history(_stored(tmp_path / "cov.db", CASES["drawn"]))
    replays = Replays(history)
    for stored in history.cases:
        recorded = replace(replays.recorded(stored), origin=None)
        execution = Tester(MODEL).execute(recorded)
        assert execution.visited == stored.visited
        assert recorded.recorded is not None
        assert execution.digest == recorded.recorded.trace


def test_a_case_of_an_earlier_model_is_not_run(tmp_path: Path) -> None:
    history = read_history(_stored(tmp_path / "cov.db", CASES["plain"]))
    assert Replays(history).execute(replace(history.cases[0], is_earlier=True)) is None


def test_only_drawn_cases_have_a_recipe_of_numbers(wording: Wording) -> None:
    (case, _), *_ = CASES["written"]
    with wording.raises(ValueError):
        drawn_recipe(case, "")


def test_a_written_case_is_recorded_as_it_is(tmp_path: Path) -> None:
    history = read_history(_stored(tmp_path / "cov.db", CASES["written"]))
    replays = Replays(history)
    assert [replays.recorded(stored) for stored in history.cases] == [case for case, _ in CASES["written"]]


def test_what_several_commands_printed_is_kept_apart(tmp_path: Path) -> None:
    """Each command line names its first requirement `required_1`, and has a network of its own."""
    other = replace(_requirement(), sentence=parse_requirement("never scanned_a == true", Scope.of(MODEL), file="-"))
    cases = [
        *CASES["plain"],
        *CASES["drawn"],
        *_drawn(read_network("loss: 10 %", MODEL), requirements=(_requirement(),)),
        *_drawn(read_network("jitter: 20 ms", MODEL), requirements=(other,)),
        *_drawn(Network(), requirements=(_requirement(), replace(other, name="required_2"))),
    ]
    history = read_history(_stored(tmp_path / "cov.db", cases))
    replays = Replays(history)
    again = [replays.case(stored) for stored in history.cases]
    assert again == [case for case, _ in cases]
    assert [replays.case(stored) for stored in reversed(history.cases)] == again[::-1]
