"""`scbm mutate` as a user meets it: the report, JSON and SARIF, thresholds, operators, revisions and wrong options."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from conftest import Ran
from scbm.mutation import MUTATIONS
from support.wording import Wording, diagnostic_heads

GATE = """behavior_model: gate
variables:
  door: {domain: [open, closed], initial: closed, source: state}
  count: {domain: 0..3, initial: 0, source: state}
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
  counts: {g: open_door.state == timedout && count == 0, a: [count <- 1]}
goals: {opened: door == open}
"""
HALTED = """behavior_model: halted
variables:
  item: {domain: [shelf, placed], initial: shelf}
  stop: {domain: [up, pressed], initial: up}
  latch: {domain: [none, stopped], initial: none, source: state}
  lamp: {domain: [off, on], initial: off, source: state}
operations:
  place: {pre: {g: item == shelf && latch == none}, post: {g: true, a: [item <- placed]}}
automatic_transitions:
  trip: {g: stop == pressed && latch == none, a: [latch <- stopped]}
  reset: {g: stop == up && latch == stopped, a: [latch <- none]}
  lights: {g: item == placed && lamp == off, a: [lamp <- on]}
environment:
  press: {guard: stop == up, actions: [stop <- pressed], every: {exponential: 10 s}}
  pull: {guard: stop == pressed, actions: [stop <- up], after: 1 s}
goals: {placed: {goal: item == placed, may_end: [unsolvable]}}
requirements:
  tripped: stop == pressed leads to latch == stopped
"""
LATE = "case: late\nmodel: gate.yaml\ngoal: opened\noutcomes: {motor: [timeout]}\n"
SCHEMA = Path(__file__).parents[2] / "foreign" / "sarif-schema-2.1.0.json"

Scbm = Callable[..., Ran]


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    """The model in a directory with its case."""
    (tmp_path / "late.yaml").write_text(LATE, encoding="utf-8")
    path = tmp_path / "gate.yaml"
    path.write_text(GATE, encoding="utf-8")
    return path


def result(ran: Ran) -> Any:  # noqa: ANN401 - parsed JSON
    return json.loads(ran.out)


@pytest.mark.slow
@pytest.mark.parametrize("columns", ["80", "60"])
def test_the_report_fits_the_width(scbm: Scbm, gate: Path, monkeypatch: pytest.MonkeyPatch, columns: str) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    ran = scbm("mutate", gate, gate.with_name("late.yaml"), "-j", 1)
    assert (ran.code, ran.err) == (0, "")
    assert max(map(len, ran.out.splitlines())) <= int(columns)
    assert ran.out.startswith("Mutation report: gate\n\n  Suite:   1 written case\n  Mutants: 46: ")


@pytest.mark.slow
def test_json_counts_each_mutant_once(scbm: Scbm, gate: Path) -> None:
    data = result(scbm("mutate", gate, gate.with_name("late.yaml"), "--json"))
    statuses = [mutant["status"] for mutant in data["mutants"]]
    assert data["all"] == len(statuses) == sum(counts["all"] for counts in data["operators"].values())
    assert data["all"] == sum(counts["all"] for counts in data["entries"].values())
    assert data["killed"] == statuses.count("killed")
    assert data["score"] == pytest.approx(100 * data["killed"] / (data["all"] - data["equivalent"]), abs=0.01)
    assert all(mutant["case"] == "late" for mutant in data["mutants"] if mutant["status"] == "killed")
    assert (data["cases"], data["failing"]) == (1, [])


@pytest.mark.slow
def test_each_mutant_has_its_place(scbm: Scbm, gate: Path) -> None:
    lines = GATE.splitlines()
    for mutant in result(scbm("mutate", gate, "--cases", 1, "--json"))["mutants"]:
        written = lines[mutant["line"] - 1]
        key = mutant["parts"][0].rpartition(".")[2]
        assert mutant["subject"] in written or written[mutant["column"] - 1 :].startswith(key), mutant["name"]


@pytest.mark.longer
def test_worker_processes_change_nothing(scbm: Scbm, gate: Path) -> None:
    arguments = ("mutate", gate, "--cases", 5, "--operators", "transitions", "--json")
    assert scbm(*arguments, "-j", 2).out == scbm(*arguments, "-j", 1).out


def test_operators_are_chosen_by_names_and_groups(scbm: Scbm, gate: Path) -> None:
    data = result(scbm("mutate", gate, "--operators", "deadlines, guard-drop", "--json"))
    assert list(data["operators"]) == ["guard-drop", "deadline-none", "deadline-shorter", "deadline-longer"]


def test_the_threshold_decides_the_exit_code(scbm: Scbm, gate: Path, wording: Wording) -> None:
    arguments = ("mutate", gate, gate.with_name("late.yaml"), "--operators", "deadlines")
    assert scbm(*arguments, "--fail-under", "mutants=30").code == 0
    ran = scbm(*arguments, "--fail-under", "mutants=90")
    assert ran.code == 1
    wording(ran.err)


def test_the_run_that_shows_a_survivor_is_judged_by_all_requirements(scbm: Scbm, tmp_path: Path) -> None:
    (tmp_path / "plain.yaml").write_text("case: plain\nmodel: halted.yaml\ngoal: placed\n", encoding="utf-8")
    path = tmp_path / "halted.yaml"
    path.write_text(HALTED, encoding="utf-8")
    asked = ("mutate", path, path.with_name("plain.yaml"), "--operators", "guard-drop, transition-drop")

    def benign(*require: str) -> dict[str, bool]:
        """Whether each mutant that survived breaks no requirement in the run that shows it."""
        found = result(scbm(*asked, *require, "--json", "--store", tmp_path / "m.db"))["mutants"]
        return {each["name"]: each["benign"] for each in found if each["status"] == "survived"}

    built_in, own, added = "automatic/reset/drop", "automatic/trip/drop", "place/pre.g/drop:latch == none"
    plain = benign()
    assert (plain[built_in], plain[own], plain[added]) == (False, False, True)
    assert not benign("--require", "never place.state == executing && latch == stopped")[added]
    assert benign() == plain


def test_a_threshold_without_mutants_cannot_be_met(scbm: Scbm, gate: Path, wording: Wording) -> None:
    ran = scbm("mutate", gate, "--operators", "environment", "--fail-under", "mutants=1")
    assert ran.code == 1
    wording(ran.err)


def test_recorded_results_notice_more(scbm: Scbm, gate: Path, wording: Wording) -> None:
    arguments = ("mutate", gate, gate.with_name("late.yaml"), "--operators", "transitions", "--json")
    assert result(scbm(*arguments))["killed"] == 0
    found = {each["name"]: each for each in result(scbm(*arguments, "--oracle", "recorded"))["mutants"]}
    wording(found["automatic/counts/drop"]["reason"])


@pytest.mark.slow
def test_cases_that_fail_on_the_model_are_named(scbm: Scbm, gate: Path, wording: Wording) -> None:
    wrong = gate.with_name("wrong.yaml")
    wrong.write_text(LATE.replace("late", "wrong") + "expect: {verdict: aborted}\n", encoding="utf-8")
    ran = scbm("mutate", gate, gate.parent)
    wording(line for line in ran.out.splitlines() if "left out that fail" in line)
    alone = scbm("mutate", gate, wrong)
    assert (alone.code, diagnostic_heads(alone.err)) == (2, ["CASES: error[no-cases]"])


@pytest.mark.slow
def test_sarif_has_each_mutant_that_no_case_killed(scbm: Scbm, gate: Path, tmp_path: Path) -> None:
    log = tmp_path / "mutants.sarif"
    data = result(scbm("mutate", gate, gate.with_name("late.yaml"), "--sarif", log, "--json"))
    sarif = json.loads(log.read_text(encoding="utf-8"))
    jsonschema.validate(sarif, json.loads(SCHEMA.read_text(encoding="utf-8")))
    (run,) = sarif["runs"]
    missed = {mutant["name"] for mutant in data["mutants"] if mutant["status"] in ("survived", "undecided")}
    assert {found["properties"]["mutant"] for found in run["results"]} == missed
    assert [rule["id"] for rule in run["tool"]["driver"]["rules"]] == list(MUTATIONS)


class _Page(HTMLParser):
    """The mutants of a page by the line that they stand at, and what would load something from elsewhere."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.statuses: list[tuple[int, str]] = []
        self.addresses: list[str] = []
        self._line = 0
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        del tag
        values = {key: value or "" for key, value in attrs}
        self._line = int(values["id"].removeprefix("line-")) if values.get("id", "").startswith("line-") else self._line
        if values.get("class") == "mutant":
            self.statuses.append((self._line, values["data-status"]))
        self.addresses += [values[key] for key in ("src", "href") if not values.get(key, "#").startswith("#")]


@pytest.mark.slow
def test_the_page_has_each_mutant_at_its_line_and_loads_nothing(scbm: Scbm, gate: Path, tmp_path: Path) -> None:
    file = tmp_path / "mutants.html"
    data = result(scbm("mutate", gate, gate.with_name("late.yaml"), "--html", file, "--json"))
    page = _Page(file.read_text(encoding="utf-8"))
    assert sorted(page.statuses) == sorted((mutant["line"], mutant["status"]) for mutant in data["mutants"])
    assert all(address.startswith("#line-") for address in page.addresses)
    text = file.read_text(encoding="utf-8")
    assert text.index("data-survivors") < text.index("<h2>By "), "what survived stands before the operators"


def test_the_page_shows_text_of_the_model_as_text(scbm: Scbm, gate: Path, tmp_path: Path) -> None:
    gate.write_text(GATE.replace("resources:", "# <script>alert(1)</script>\nresources:"), encoding="utf-8")
    file = tmp_path / "mutants.html"
    scbm("mutate", gate, "--cases", 1, "--operators", "deadlines", "--html", file)
    text = file.read_text(encoding="utf-8")
    assert "<script" not in text
    assert "&lt;script&gt;alert(1)" in text


def test_the_model_is_never_overwritten(scbm: Scbm, gate: Path) -> None:
    ran = scbm("mutate", gate, "--cases", 1, "--sarif", gate)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--sarif: error[bad-option]"])
    assert gate.read_text(encoding="utf-8") == GATE


@pytest.mark.parametrize(
    "options",
    [
        ("--operators", "guard-dorp"),
        ("--operators", ","),
        ("--oracle", "all"),
        ("--fail-under", "covered=3"),
        ("--fail-under", "mutants=many"),
        ("--fail-under", "101"),
    ],
)
def test_wrong_options_are_located(scbm: Scbm, gate: Path, options: tuple[str, str]) -> None:
    ran = scbm("mutate", gate, *options)
    assert ran.code == 2
    assert diagnostic_heads(ran.err)[0].startswith(options[0])


# equivalence


def test_outputs_that_cannot_be_written_are_refused_before_any_mutant_runs(
    scbm: Scbm, gate: Path, tmp_path: Path
) -> None:
    outputs = ("--html", tmp_path / "missing" / "page.html", "--sarif", tmp_path, "--witnesses", gate)
    ran = scbm("mutate", gate, gate.parent / "late.yaml", *outputs)
    assert (ran.code, ran.out) == (2, "")
    assert diagnostic_heads(ran.err) == [
        "--html: error[bad-option]",
        "--sarif: error[bad-option]",
        "--witnesses: error[bad-option]",
    ]


def test_without_goals_of_the_model_no_mutant_is_proved_equivalent(scbm: Scbm, gate: Path, wording: Wording) -> None:
    gate.write_text(GATE.replace("goals: {opened: door == open}\n", ""), encoding="utf-8")
    case = gate.parent / "late.yaml"
    case.write_text(LATE.replace("goal: opened", "goal: door == open"), encoding="utf-8")
    ran = scbm("mutate", gate, case, "--json")
    assert ran.code == 0
    mutants = result(ran)["mutants"]
    assert {mutant["status"] for mutant in mutants} == {"killed", "undecided"}
    reasons = [mutant.get("reason") for mutant in mutants if mutant["status"] == "undecided"]
    wording(dict.fromkeys(reasons))
    wording(ran.err)


@pytest.mark.slow
def test_without_a_decision_no_mutant_is_equivalent(scbm: Scbm, gate: Path) -> None:
    arguments = ("mutate", gate, gate.with_name("late.yaml"), "--json")
    decided, left = result(scbm(*arguments)), result(scbm(*arguments, "--no-equivalence"))
    assert decided["equivalent"]
    assert decided["undecided"] == 0
    assert (left["equivalent"], left["survived"]) == (0, 0)
    assert left["killed"] == decided["killed"]


@pytest.mark.slow
def test_a_limit_leaves_mutants_undecided_with_the_reason(scbm: Scbm, gate: Path) -> None:
    data = result(scbm("mutate", gate, gate.with_name("late.yaml"), "--max-states", 2, "--json"))
    reasons = [mutant["reason"] for mutant in data["mutants"] if mutant["status"] == "undecided"]
    assert reasons
    assert all("--max-states" in reason for reason in reasons)


@pytest.mark.slow
def test_saved_witnesses_kill_what_they_say(scbm: Scbm, gate: Path) -> None:
    late, saved = gate.with_name("late.yaml"), gate.with_name("witnesses")
    data = result(scbm("mutate", gate, late, "--witnesses", saved, "--json"))
    killable = {mutant["name"] for mutant in data["mutants"] if mutant.get("killable")}
    assert killable
    again = result(scbm("mutate", gate, late, saved, "--json"))
    killed = {mutant["name"] for mutant in again["mutants"] if mutant["status"] == "killed"}
    assert again["failing"] == []
    assert killable <= killed
    assert again["score"] > data["score"]


@pytest.mark.slow
def test_witnesses_that_are_there_are_not_written_again(scbm: Scbm, gate: Path) -> None:
    arguments = ("mutate", gate, gate.with_name("late.yaml"), "--witnesses", gate.with_name("witnesses"))
    assert (scbm(*arguments).code, scbm(*arguments).code) == (0, 0)


@pytest.mark.slow
def test_witnesses_that_were_edited_stay_as_they_are(scbm: Scbm, gate: Path, wording: Wording) -> None:
    saved = gate.with_name("witnesses")
    arguments = ("mutate", gate, gate.with_name("late.yaml"), "--witnesses", saved)
    assert scbm(*arguments).code == 0
    first = min(saved.iterdir())
    first.write_text(f"{first.read_text()}# seen\n", encoding="utf-8")
    ran = scbm(*arguments)
    assert ran.code == 0
    assert f": {first.name}\n" in ran.err
    wording(ran.err.replace(first.name, "WITNESS"))
    assert first.read_text().endswith("# seen\n")


def test_no_output_replaces_a_store(scbm: Scbm, gate: Path) -> None:
    late, store = gate.with_name("late.yaml"), gate.with_name("cov.db")
    assert scbm("test", gate, late, "--store", store).code == 0
    before = store.read_bytes()
    for option in ("--html", "--sarif"):
        ran = scbm("mutate", gate, late, option, store)
        assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{option}: error[bad-option]"])
    assert store.read_bytes() == before


# --since


def _git(directory: Path, *arguments: str) -> None:
    identity = ("-c", "user.name=test", "-c", "user.email=test@example.org", "-c", "commit.gpgsign=false")
    command = ["git", *identity, *arguments]
    subprocess.run(command, cwd=directory, check=True, capture_output=True)


@pytest.fixture
def tracked(gate: Path) -> Path:
    """The model, committed as it is."""
    _git(gate.parent, "init", "--quiet", "--initial-branch", "main")
    _git(gate.parent, "add", ".")
    _git(gate.parent, "commit", "--quiet", "--message", "Add the gate")
    return gate


def test_without_a_change_there_are_no_mutants(scbm: Scbm, tracked: Path) -> None:
    assert result(scbm("mutate", tracked, "--cases", 1, "--since", "HEAD", "--json"))["mutants"] == []


def test_only_what_changed_since_a_revision_has_mutants(scbm: Scbm, tracked: Path) -> None:
    tracked.write_text(GATE.replace("count <- 1", "count <- 2").replace("# ", "#  "), encoding="utf-8")
    data = result(scbm("mutate", tracked, "--cases", 1, "--since", "main", "--json"))
    assert list(data["entries"]) == ["automatic/counts"]


@pytest.mark.longer
def test_a_case_file_in_a_subdirectory_of_the_work_tree_is_found(scbm: Scbm, tracked: Path) -> None:
    cell = tracked.parent / "cells" / "cell.yaml"
    cell.parent.mkdir()
    cell.write_text(GATE, encoding="utf-8")
    _git(tracked.parent, "add", ".")
    _git(tracked.parent, "commit", "--quiet", "--message", "Add a cell")
    cell.write_text(GATE.replace("deadline: 10 s", "deadline: 20 s"), encoding="utf-8")
    data = result(scbm("mutate", cell, "--cases", 1, "--since", "HEAD", "--json"))
    assert list(data["entries"]) == ["open_door"]


PARTED = """\
behavior_model: cell
include: parts/lights.yaml
variables: {door: {domain: [open, closed], initial: closed}}
resources: {motor: {simulation: {latency: 1 s}}}
operations:
  open_door: {request: motor, deadline: 10 s, guard: door == closed, effects: [door <- open]}
goals: {opened: door == open}
"""
LIGHTS = """\
part: lights
variables: {lamp: {domain: [lit, dark], initial: dark}}
automatic_transitions:
  lights: {g: door == open && lamp == dark, a: [lamp <- lit]}
"""


@pytest.fixture
def parted(tracked: Path) -> Path:
    """A model with a part in a file, both committed."""
    cell = tracked.parent / "cells" / "cell.yaml"
    (cell.parent / "parts").mkdir(parents=True)
    cell.write_text(PARTED, encoding="utf-8")
    (cell.parent / "parts" / "lights.yaml").write_text(LIGHTS, encoding="utf-8")
    _git(tracked.parent, "add", ".")
    _git(tracked.parent, "commit", "--quiet", "--message", "Add a cell with a part")
    return cell


@pytest.mark.longer
def test_a_change_of_a_part_is_a_change_of_the_model(scbm: Scbm, parted: Path) -> None:
    changed = LIGHTS.replace("lamp <- lit]", "lamp <- lit, door <- closed]")
    (parted.parent / "parts" / "lights.yaml").write_text(changed, encoding="utf-8")
    data = result(scbm("mutate", parted, "--cases", 1, "--since", "HEAD", "--json"))
    assert list(data["entries"]) == ["automatic/lights"]


def test_an_error_of_an_earlier_part_names_the_revision(scbm: Scbm, parted: Path) -> None:
    (parted.parent / "parts" / "lights.yaml").write_text("part: [", encoding="utf-8")
    _git(parted.parent, "commit", "--all", "--quiet", "--message", "Break the part")
    (parted.parent / "parts" / "lights.yaml").write_text(LIGHTS, encoding="utf-8")
    ran = scbm("mutate", parted, "--since", "HEAD")
    assert ran.code == 2
    assert diagnostic_heads(ran.err)[0].startswith("HEAD:parts/lights.yaml:")
    assert "(used in HEAD:cell.yaml:2)" in ran.err


@pytest.mark.longer
def test_operations_in_another_order_have_mutants(scbm: Scbm, parted: Path) -> None:
    added = "goals:", "  shut: {pre: {g: door == open}, post: {g: true, a: [door <- closed]}}\ngoals:"
    parted.write_text(PARTED.replace(*added), encoding="utf-8")
    _git(parted.parent, "commit", "--all", "--quiet", "--message", "Shut the door")
    lines = PARTED.replace(*added).splitlines(keepends=True)
    lines[5], lines[6] = lines[6], lines[5]
    parted.write_text("".join(lines), encoding="utf-8")
    data = result(scbm("mutate", parted, "--cases", 1, "--since", "HEAD", "--json"))
    assert list(data["entries"]) == ["shut", "open_door"]


def test_what_did_not_change_meets_each_threshold(scbm: Scbm, tracked: Path, wording: Wording) -> None:
    ran = scbm("mutate", tracked, "--cases", 1, "--since", "HEAD", "--fail-under", "mutants=100")
    assert ran.code == 0
    wording(ran.err)


@pytest.mark.parametrize("revision", ["nowhere", "--output=stolen", "HEAD;ls", ""])
def test_an_unknown_revision_is_an_error(scbm: Scbm, tracked: Path, revision: str) -> None:
    ran = scbm("mutate", tracked, f"--since={revision}")
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--since:1:1: error[bad-option]"])
    assert sorted(path.name for path in tracked.parent.iterdir()) == [".git", "gate.yaml", "late.yaml"]


def test_a_file_that_the_revision_does_not_have_is_an_error(scbm: Scbm, tracked: Path) -> None:
    new = tracked.with_name("new.yaml")
    new.write_text(GATE, encoding="utf-8")
    ran = scbm("mutate", new, "--since", "HEAD")
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--since: error[bad-option]"])


def test_an_earlier_text_that_is_no_model_is_an_error_that_names_the_revision(scbm: Scbm, tracked: Path) -> None:
    tracked.write_text("behavior_model: [", encoding="utf-8")
    _git(tracked.parent, "commit", "--all", "--quiet", "--message", "Break the gate")
    tracked.write_text(GATE, encoding="utf-8")
    ran = scbm("mutate", tracked, "--since", "HEAD")
    assert ran.code == 2
    assert diagnostic_heads(ran.err)[0].startswith("HEAD:gate.yaml:")
