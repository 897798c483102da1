"""`scbm mutate --store`, and what `scbm test` and `scbm report` say of visited obligations then (decision 52)."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conftest import Ran
from scbm.cases.coverage import MutantStatus
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.mutation import MUTATIONS, MutantResult, MutationRuns
from scbm.mutation.equivalence.equivalences import Survivors
from scbm.mutation.mutation_work import MutationWork
from support.wording import Wording, diagnostic_heads, paragraphs

GATE = """behavior_model: gate
variables:
  door: {domain: [open, closed], initial: closed, source: state}
  noted: {domain: bool, initial: false, source: state}
resources:
  motor: {simulation: {latency: 1 s}}
operations:
  open_door:
    deadline: 10 s
    pre: {g: door == closed && motor_req_state == initial, a: [motor_req_trigger <- true]}
    post:
      g: true
      gr: motor_req_state == succeeded
      a: [motor_req_trigger <- false, motor_req_state <- initial, door <- open]
    failed: {g: motor_req_state == failed, a: [motor_req_trigger <- false, motor_req_state <- initial]}
    timedout: [motor_req_trigger <- false]
automatic_transitions:
  notes: {g: open_door.state == timedout && noted == false, a: [noted <- true]}
goals: {opened: door == open}
"""
LATE = "case: late\nmodel: gate.yaml\ngoal: opened\noutcomes: {motor: [timeout]}\n"
WELL = "case: well\nmodel: gate.yaml\ngoal: opened\n"

Scbm = Callable[..., Ran]


@pytest.fixture
def gate(scbm: Scbm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:  # noqa: ARG001 - it sets a directory, too
    """The working directory has the model and two cases."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    for name, text in (("gate", GATE), ("late", LATE), ("well", WELL)):
        Path(f"{name}.yaml").write_text(text, encoding="utf-8")


SUITE = ("gate.yaml", "late.yaml", "well.yaml")
MUTATE = ("mutate", *SUITE, "-j", "1")
TEST = ("test", *SUITE)
STORE = ("--store", "cov.db")

pytestmark = pytest.mark.usefixtures("gate")


_FILLED: list[bytes] = []
"""The store after `scbm mutate` with the suite, once a test has made it: it is the same for all."""


def fill(scbm: Scbm) -> None:
    """Make a store with the results of all mutants, and without cases."""
    if not _FILLED:
        scbm(*MUTATE, *STORE)
        _FILLED.append(Path("cov.db").read_bytes())
    Path("cov.db").write_bytes(_FILLED[0])


def mutants(ran: Ran) -> Any:  # noqa: ANN401 - parsed JSON
    return json.loads(ran.out)["mutants"]


@pytest.mark.slow
def test_a_report_from_a_store_is_the_report_without_one(scbm: Scbm, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = scbm(*MUTATE, "--json")
    first = scbm(*MUTATE, "--json", *STORE)
    assert (first.out, first.err) == (plain.out, "cov.db: results of 45 mutants, 45 of them new\n")
    monkeypatch.setattr(MutationRuns, "result", _refuse)
    monkeypatch.setattr(Survivors, "decided", _refuse)
    again = scbm(*MUTATE, "--json", *STORE)
    assert (again.out, again.err) == (plain.out, "cov.db: results of 45 mutants, none of them new\n")


def unwrapped(text: str) -> str:
    """Return the text of a message as one line, whatever the width."""
    return " ".join(text.split())


def _refuse(*_: object) -> MutantResult:
    raise AssertionError("the store has this result")


@pytest.mark.slow
def test_witnesses_come_back_from_a_store(scbm: Scbm) -> None:
    scbm(*MUTATE, "--witnesses", "fresh")
    fill(scbm)
    scbm(*MUTATE, "--witnesses", "stored", *STORE)
    fresh, stored = (sorted(Path(name).iterdir()) for name in ("fresh", "stored"))
    assert [(file.name, file.read_text()) for file in fresh] == [(file.name, file.read_text()) for file in stored]
    assert fresh


@pytest.mark.longer
def test_parts_of_the_mutants_add_up(scbm: Scbm, wording: Wording) -> None:
    scbm(*MUTATE, "--no-equivalence", "--operators", "guards", *STORE)
    (partly,) = paragraphs(scbm(*TEST, *STORE).out, "Asserted: ")
    assert "not known" in partly
    wording(partly)
    groups = ",".join(name for name, mutation in MUTATIONS.items() if mutation.group != "guards")
    scbm(*MUTATE, "--no-equivalence", "--operators", groups, *STORE)
    assert "  Asserted: " in scbm(*TEST, *STORE).out
    assert "not known" not in scbm("report", "cov.db").out


@pytest.mark.slow
def test_decisions_outlive_a_change_of_the_cases(scbm: Scbm, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(scbm)
    more = ("mutate", "gate.yaml", "late.yaml", "-j", "1", "--json")
    plain, before = scbm(*more), scbm(*MUTATE, "--json", *STORE)
    monkeypatch.setattr(Survivors, "decided", _not_again(Survivors.decided, before))
    assert scbm(*more, *STORE).out == plain.out


def _not_again(decided: Callable[[Survivors, MutantResult], MutantResult], before: Ran) -> Callable[..., MutantResult]:
    """Decide about mutants that were killed before, and about no other."""
    killed = [mutant["name"] for mutant in mutants(before) if mutant["status"] == "killed"]

    def decide(survivors: Survivors, result: MutantResult) -> MutantResult:
        assert result.mutant.name in killed
        return decided(survivors, result)

    return decide


@pytest.mark.longer
@pytest.mark.parametrize(
    ("change", "old", "new"),
    [("gate.yaml", "latency: 1 s", "latency: 2 s"), ("late.yaml", "[timeout]", "[timeout, fail]")],
)
def test_results_of_other_inputs_do_not_count(scbm: Scbm, change: str, old: str, new: str) -> None:
    fill(scbm)
    text = Path(change).read_text()
    assert old in text
    Path(change).write_text(text.replace(old, new))
    ran = scbm(*MUTATE, *STORE)
    if change == "gate.yaml":
        assert diagnostic_heads(ran.err) == ["cov.db: error[store-other-model]"]
    else:
        assert ran.err == "cov.db: results of 45 mutants, 45 of them new\n"
        assert "not known" not in scbm(*TEST, *STORE).out


@pytest.mark.slow
@pytest.mark.parametrize("place", [MutationRuns, Survivors], ids=["while cases run", "while mutants are compared"])
def test_an_interrupted_command_keeps_what_it_did_and_goes_on(
    scbm: Scbm, monkeypatch: pytest.MonkeyPatch, place: type, wording: Wording
) -> None:
    plain = scbm(*MUTATE, "--json")
    name = "result" if place is MutationRuns else "decided"
    calls = {"before": 0, "after": 0}

    def counted(when: str, most: int) -> Callable[..., MutantResult]:
        method: Callable[..., MutantResult] = getattr(place, name)

        def call(self: object, argument: object) -> MutantResult:
            calls[when] += 1
            if calls[when] > most:
                raise KeyboardInterrupt
            return method(self, argument)

        return call

    with monkeypatch.context() as patch:
        patch.setattr(place, name, counted("before", 3))
        ran = scbm(*MUTATE, *STORE)
    assert ran.code == 130
    wording(unwrapped(ran.err))
    with monkeypatch.context() as patch:
        patch.setattr(place, name, counted("after", 1000))
        assert scbm(*MUTATE, "--json", *STORE).out == plain.out
    assert 3 + calls["after"] == (45 if place is MutationRuns else _decided(plain))


@pytest.mark.parametrize("place", [MutationWork, MutationRuns], ids=["on the model itself", "on the first mutant"])
def test_an_interruption_before_the_first_result_says_what_the_store_has(
    scbm: Scbm, monkeypatch: pytest.MonkeyPatch, place: type, wording: Wording
) -> None:
    monkeypatch.setattr(place, "runs" if place is MutationWork else "result", _interrupt)
    ran = scbm(*MUTATE, *STORE)
    assert ran.code == 130
    wording(unwrapped(ran.err))
    wording(unwrapped(scbm(*MUTATE).err))


def _interrupt(*_: object) -> MutantResult:
    raise KeyboardInterrupt


def test_an_interruption_without_a_store_says_how_far_the_command_was(
    scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(Survivors, "decided", _interrupt)
    ran = scbm(*MUTATE)
    assert ran.code == 130
    wording(unwrapped(ran.err))


@pytest.mark.parametrize("place", [MutationRuns, Survivors], ids=["while cases run", "while mutants are compared"])
def test_sigterm_ends_the_mutants_and_what_is_known_is_reported(
    scbm: Scbm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: type, wording: Wording
) -> None:
    name, calls = "result" if place is MutationRuns else "decided", list[object]()
    method: Callable[..., MutantResult] = getattr(place, name)

    def terminated(self: object, argument: object) -> MutantResult:
        calls.append(argument)
        if len(calls) == 3:
            signal.raise_signal(signal.SIGTERM)
        return method(self, argument)

    monkeypatch.setattr(place, name, terminated)
    page = tmp_path / "page.html"
    ran = scbm(*MUTATE, "--json", "--html", page, "--fail-under", "mutants=100")
    report = json.loads(ran.out)
    assert ran.code == 130
    assert len(report["mutants"]) == (2 if place is MutationRuns else 45)
    assert report["ended_early"] in page.read_text(encoding="utf-8")
    wording(report["ended_early"])
    open_ones = [each["reason"] for each in report["mutants"] if each["status"] == "undecided"]
    wording(sorted({reason for reason in open_ones if "interrupted" in reason}))
    assert "under 100" not in ran.err


def test_a_store_that_cannot_be_written_any_more_has_what_it_got(
    scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    full = InputError([Diagnostic(Slug.STORE_UNUSABLE, "database or disk is full", Place("cov.db"))])
    monkeypatch.setattr(Survivors, "decided", lambda *_: _raise(full))
    ran = scbm(*MUTATE, *STORE)
    assert ran.code == 2
    wording(unwrapped(ran.err))


def _raise(error: InputError) -> MutantResult:
    raise error


@pytest.mark.slow
def test_decisions_under_larger_limits_count(scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    plain = scbm(*MUTATE, "--json")
    fill(scbm)
    with monkeypatch.context() as patch:
        patch.setattr(Survivors, "decided", _refuse)
        assert scbm(*MUTATE, "--json", "--max-states", "200000", *STORE).out == plain.out
    more = scbm(*MUTATE, "--max-states", "400000", *STORE)
    assert int(re.findall(r"\d+", more.err)[1]) > 0
    wording(unwrapped(more.err))


def test_a_store_with_results_of_mutants_alone_says_so(scbm: Scbm, wording: Wording) -> None:
    fill(scbm)
    ran = scbm("report", "cov.db")
    assert ran.code == 2
    assert diagnostic_heads(ran.err) == ["cov.db: error[store-empty]"]
    wording(unwrapped(ran.err))
    for status in MutantStatus:
        count = sum(mutant["status"] == status for mutant in mutants(scbm(*MUTATE, "--json", *STORE)))
        assert f"{count} {status}" in ran.err


def _decided(ran: Ran) -> int:
    return sum(mutant["status"] != "killed" for mutant in mutants(ran))


def test_reports_of_a_store_without_results_of_mutants_say_so(scbm: Scbm, wording: Wording) -> None:
    assert "sserted" not in scbm(*TEST).out
    tested = scbm(*TEST, "--store", "plain.db").out
    reported = scbm("report", "plain.db").out
    for text in (tested, reported):
        assert text.splitlines()[3].startswith("  Asserted: not known")
        assert text.count("scbm mutate") == 1  # one line is enough
        wording(text.splitlines()[3])
    scbm("report", "plain.db", "--html", "page.html")
    page = Path("page.html").read_text()
    wording(re.findall(r'data-asserted="">.*?</p>', page))
    for ran in (scbm(*TEST, "--store", "plain.db", "--json"), scbm("report", "plain.db", "--json")):
        asserted = json.loads(ran.out)["asserted"]
        assert asserted["percent"] is None
        wording(asserted["why_none"])


def test_a_store_with_results_adds_the_figure_and_a_list(scbm: Scbm, wording: Wording) -> None:
    plain = scbm(*TEST, "--store", "plain.db")
    fill(scbm)
    lines = [line for line in scbm(*TEST, *STORE).out.splitlines() if line]
    added = [line for line in lines if line not in plain.out]
    assert added[0].startswith("  Asserted: 75.00 %")
    assert "  scbm mutate gate.yaml late.yaml well.yaml --store cov.db" in added
    assert added[2] == "  at: notes  taken"
    wording(added[:5])


def test_json_has_the_answer_of_each_visited_obligation(scbm: Scbm) -> None:
    fill(scbm)
    tested = json.loads(scbm(*TEST, *STORE, "--json").out)["asserted"]
    reported = json.loads(scbm("report", "cov.db", "--json").out)["asserted"]
    assert tested == reported
    assert tested["counts"] == {"asserted": 3, "nothing_asserted": 1, "unknown": 0}
    assert (tested["percent"], tested["asserted"], tested["of"], tested["why_none"]) == (75.0, 3, 4, None)
    answers = {entry["name"]: entry for entry in tested["obligations"]}
    assert "open_door/disabled" not in answers  # no case visits it
    assert answers["automatic/notes"]["answer"] == "nothing_asserted"
    for entry in tested["obligations"]:
        parts = (entry[part] for part in ("noticed", "unnoticed", "equivalent", "undecided"))
        assert entry["mutants"] == sum(parts)


def test_the_page_marks_what_nothing_asserts(scbm: Scbm, wording: Wording) -> None:
    fill(scbm)
    scbm(*TEST, *STORE)
    scbm("report", "cov.db", "--html", "after.html")
    page = Path("after.html").read_text()
    assert re.findall(r'data-asserted="(.*?)"', page) == ["75.00 %"]
    assert re.findall(r'data-unasserted="(.*?)"', page) == ["1"]
    parts = ('data-asserted=".*?</p>', 'data-unasserted=".*?</h2>', 'title="automatic/notes: .*?"')
    wording(text for part in parts for text in re.findall(part, page))
    answers = re.findall(r'data-answer="(\w+)">', page)
    assert answers == ["asserted"] * 3  # of the operation; its page has no row for the transition


@pytest.mark.parametrize("verb", [TEST + STORE, ("report", "cov.db")], ids=["test", "report"])
def test_the_threshold_decides_the_exit_code(scbm: Scbm, verb: tuple[str, ...], wording: Wording) -> None:
    scbm(*TEST, *STORE)
    ran = scbm(*verb, "--fail-under", "asserted=75")
    assert ran.code == 1
    wording(unwrapped(ran.err))
    fill(scbm)
    scbm(*TEST, *STORE)
    assert scbm(*verb, "--fail-under", "asserted=75").code == 0
    ran = scbm(*verb, "--fail-under", "asserted=76")
    assert ran.code == 1
    wording(unwrapped(ran.err))


@pytest.mark.slow
def test_test_shows_the_command_that_fills_the_store(scbm: Scbm) -> None:
    ran = scbm(*TEST, *STORE, "--fail-under", "asserted=75")
    command = ran.err.splitlines()[-1].strip()
    assert command == "scbm mutate gate.yaml late.yaml well.yaml --store cov.db"
    scbm(*command.split()[1:], "-j", "1")
    assert scbm(*TEST, *STORE, "--fail-under", "asserted=75").code == 0


@pytest.mark.slow
def test_random_cases_are_found_by_seed_and_options(scbm: Scbm) -> None:
    drawn = ("gate.yaml", "--cases", "4", "--seed", "3", "--network", "drawn", "--require", "always noted == noted")
    scbm("mutate", *drawn, "--no-equivalence", "-j", "1", *STORE)
    assert "not known" not in scbm("test", *drawn, *STORE).out
    other = [word.replace("3", "4") for word in drawn]
    assert "not known" in scbm("test", *other, *STORE).out


def test_the_threshold_needs_a_store_and_a_simulation(scbm: Scbm, wording: Wording) -> None:
    ran = scbm(*TEST, "--fail-under", "asserted=75")
    assert ran.code == 2
    wording(unwrapped(ran.err))
    over_nodes = scbm(*TEST, *STORE, "--transport", "loopback", "--fail-under", "asserted=75")
    assert diagnostic_heads(over_nodes.err) == ["--fail-under: error[bad-option]"]


@pytest.mark.longer
def test_results_for_recorded_oracles_do_not_count(scbm: Scbm, wording: Wording) -> None:
    scbm(*MUTATE, "--no-equivalence", "--oracle", "recorded", *STORE)
    (asserted,) = paragraphs(scbm(*TEST, *STORE).out, "Asserted: ")
    assert "`--oracle recorded`" in asserted
    wording(asserted)


@pytest.mark.longer
def test_cases_with_drawn_inputs_are_other_cases(scbm: Scbm) -> None:
    few = ("gate.yaml", "--cases", "2")
    scbm("mutate", *few, "--inputs", "drawn", "--no-equivalence", "-j", "1", *STORE)
    assert "not known" in scbm("test", *few, "--store", "cov.db").out
    Path("cov.db").unlink()
    scbm("mutate", *few, "--inputs", "drawn", "--no-equivalence", "-j", "1", *STORE)
    assert "not known" not in scbm("test", *few, "--inputs", "drawn", *STORE).out


def test_a_case_file_is_no_store(scbm: Scbm) -> None:
    ran = scbm(*MUTATE, "--store", "late.yaml")
    assert ran.code == 2
    assert Path("late.yaml").read_text() == LATE
