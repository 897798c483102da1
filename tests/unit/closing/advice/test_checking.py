"""Doubts about models that load: each kind is raised where it is due, and not where it is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.cases.trace import OperationStepped
from scbm.closing.advice import CheckLimits, Doubt, check_model
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Severity, Slug
from scbm.testing import RandomCases, Tester
from support.models import scan_cell
from support.profiles import longer_but_one_in
from support.wording import Wording

ROOT = Path(__file__).parents[4]
SOUND = sorted((*(ROOT / "examples").glob("*/*.yaml"), *(ROOT / "study" / "models").glob("*.yaml")))


def _doubts(*replacements: tuple[str, str], more: str = "") -> list[Doubt]:
    """What is doubtful about the scanning cell with some texts replaced, but for the variables that it only has
    for other tests, and for those that only `scan_cell` declares as states."""
    doubts = check_model(scan_cell(*replacements, more=more)).doubts
    unused = (("variables", "count"), ("variables", "temperature"))
    return [doubt for doubt in doubts if doubt.path not in unused and doubt.slug is not Slug.NEVER_ASSIGNED]


@pytest.mark.parametrize("name", ["before", "after"])
def test_the_example_raises_no_doubt(name: str) -> None:
    checked = check_model(load_model(ROOT / f"examples/robot_in_the_air/{name}.yaml"))
    assert checked.doubts == ()
    assert (checked.initial_states, checked.complete) == (12, True)
    assert checked.reachable == {"before": 190, "after": 152}[name]


@pytest.mark.parametrize("path", longer_but_one_in(10, SOUND), ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_no_example_and_no_model_of_the_study_raises_a_doubt(path: Path) -> None:
    assert check_model(load_model(path)).doubts == ()


def test_a_good_model_raises_no_doubt() -> None:
    assert _doubts() == []


@pytest.mark.parametrize(
    ("replacement", "slug", "path"),
    [
        (
            ("gr: light != red", "gr: light == green && light == blue"),
            Slug.GUARD_NEVER_HOLDS,
            ("operations", "scan_box", "pre", "gr"),
        ),
        (
            ("g: true\n      gr: scan_req_state == succeeded", "g: light == green\n      gr: light == red"),
            Slug.GUARD_NEVER_HOLDS,
            ("operations", "scan_box", "post", "gr"),
        ),
        (
            ("scanned: box_is_scanned == true", "scanned: count == 1 && count == 2"),
            Slug.GUARD_NEVER_HOLDS,
            ("goals", "scanned"),
        ),
        (
            ("g: scan_req_state == failed &&", "g: scan_req_state == failed && scan_req_state == succeeded &&"),
            Slug.GUARD_NEVER_HOLDS,
            ("automatic_transitions", "scan_failed", "g"),
        ),
        (
            ("&& box_is_scanned == false", "&& box_is_scanned == true"),
            Slug.OPERATION_NEVER_ENABLED,
            ("operations", "scan_box", "pre", "g"),
        ),
        (("scanned: box_is_scanned == true", "scanned: light == red"), Slug.GOAL_UNREACHABLE, ("goals", "scanned")),
        (
            ("initial: green}", "initial: green, random: any}"),
            None,
            (),
        ),
        (
            ("box_is_scanned <- true]", "box_is_scanned <- true, count += 2]"),
            None,
            (),
        ),
        (
            ("box_is_scanned == false\n", "count != 2\n"),
            None,
            (),
        ),
        (
            ("&& box_is_scanned == false", "&& scan_box.state == initial && box_is_scanned == false"),
            Slug.PLANNER_READS_RUNNER,
            ("operations", "scan_box", "pre", "g"),
        ),
        (
            ("box_is_scanned <- true]", "box_is_scanned <- true, count <- 2]"),
            None,
            (),
        ),
    ],
)
def test_each_doubt_where_it_is_due(replacement: tuple[str, str], slug: Slug | None, path: tuple[str, ...]) -> None:
    found = [(doubt.slug, doubt.path) for doubt in _doubts(replacement)]
    if slug is None:
        assert found == []
    else:
        assert (slug, path) in found


def test_a_goal_that_only_some_initial_states_reach_names_one_that_does_not() -> None:
    doubts = _doubts(
        (
            "box_is_scanned: {domain: bool, initial: false}",
            "box_is_scanned: {domain: bool, initial: false, random: any}",
        ),
        ("scanned: box_is_scanned == true", "scanned: box_is_scanned == false"),
    )
    (doubt,) = doubts
    assert doubt.slug is Slug.GOAL_NOT_ALWAYS_REACHABLE
    assert (doubt.remedy or "").endswith(": box_is_scanned == true")


def test_a_step_that_leaves_a_domain_is_reported_with_the_state_in_which_it_does() -> None:
    doubts = _doubts(
        ("&& box_is_scanned == false", ""),
        ("box_is_scanned <- true]", "box_is_scanned <- true, count += 1]"),
    )
    assert [(d.slug, d.path) for d in doubts] == [(Slug.DOMAIN_LEFT, ("operations", "scan_box", "post", "a"))]
    assert "count == 2" in doubts[0].message


def test_automatic_transitions_that_go_round_are_named_once() -> None:
    ring = (
        "automatic_transitions:\n"
        "  up: {g: light == green && current.state == executing, a: [light <- blue]}\n"
        "  down: {g: light == blue, a: [light <- green]}"
    )
    doubts = _doubts(("automatic_transitions:", ring))
    assert [doubt.slug for doubt in doubts] == [Slug.AUTOMATIC_LIVELOCK]
    assert "up -> down -> up" in doubts[0].message


def test_no_initial_state_and_a_nominal_one_that_is_not_allowed() -> None:
    nominal = _doubts(
        ("count: {domain: 0..2, initial: 0}", "count: {domain: 0..2, initial: 0, random: any}"),
        more="initial_states: count == 2\n",
    )
    assert [doubt.slug for doubt in nominal] == [Slug.INITIAL_STATE_NOMINAL]
    none = _doubts(more="initial_states: count == 2\n")
    assert [doubt.slug for doubt in none] == [Slug.INITIAL_STATE_NOMINAL, Slug.NO_INITIAL_STATE]


def _answering_after(latency: str) -> tuple[str, str]:
    return ("    measures: [temperature]\n", f"    measures: [temperature]\n    simulation: {{latency: {latency}}}\n")


@pytest.mark.parametrize("latency", ["11 s", "{uniform: [11 s, 12 s]}"])
def test_a_deadline_before_each_reply_is_doubtful(latency: str, wording: Wording) -> None:
    (doubt,) = _doubts(_answering_after(latency))
    assert (doubt.slug, doubt.path) == (Slug.DEADLINE_TOO_SHORT, ("operations", "scan_box", "deadline"))
    wording(f"{doubt.message}; {doubt.remedy}")


@pytest.mark.parametrize("latency", ["10 s", "{uniform: [10 s, 12 s]}", "{exponential: 99 s}"])
def test_a_deadline_in_the_moment_of_a_reply_is_long_enough(latency: str) -> None:
    assert not _doubts(_answering_after(latency))


@pytest.mark.parametrize(
    "kept",
    [
        ("      gr: scan_req_state == succeeded\n", ""),
        ("    timedout: [scan_req_trigger <- false]\n", ""),
    ],
)
def test_a_request_that_may_outlive_its_deadline_gets_its_reply(kept: tuple[str, str]) -> None:
    found = _doubts(_answering_after("11 s"), kept)
    assert Slug.DEADLINE_TOO_SHORT not in [each.slug for each in found]


def test_failures_that_nothing_notices_and_replies_that_are_awaited_without_end_are_reported() -> None:
    unsure = ("    measures: [temperature]\n", "    measures: [temperature]\n    simulation: {outcomes: OUTCOMES}\n")
    fails = (unsure[0], unsure[1].replace("OUTCOMES", "{succeed: 0.5, fail: 0.5}"))
    silent = (unsure[0], unsure[1].replace("OUTCOMES", "{succeed: 0.5, timeout: 0.5}"))
    no_deadline = (("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    unwatched = ("g: scan_req_state == failed && current.state == executing", "g: light == blue")
    assert _doubts(fails) == _doubts(silent) == []
    unnoticed = [Slug.FAILURE_UNNOTICED, Slug.HANDSHAKE_INCOMPLETE]  # the transition has the name of a generated one
    assert [doubt.slug for doubt in _doubts(fails, unwatched)] == unnoticed
    assert [doubt.slug for doubt in _doubts(silent, *no_deadline)] == [Slug.NO_DEADLINE]


def test_a_variable_that_nothing_reads_is_reported() -> None:
    doubts = check_model(scan_cell(is_open=True)).doubts
    assert [(d.slug, d.path[-1]) for d in doubts] == [
        (Slug.UNUSED_VARIABLE, "count"),
        (Slug.UNUSED_VARIABLE, "temperature"),
    ]


def _counters(*numbers: int) -> BehaviorModel:
    """Return the scanning cell with counters that operations count up to 9."""
    many = "".join(f"  n{index}: {{domain: 0..9, initial: 0}}\n" for index in numbers)
    steps = "".join(f"  up{i}: {{pre: {{g: n{i} != 9}}, post: {{g: true, a: [n{i} += 1]}}}}\n" for i in numbers)
    return scan_cell(("variables:\n", "variables:\n" + many), ("operations:\n", "operations:\n" + steps))


@pytest.mark.longer
def test_an_exploration_that_meets_its_limit_is_unfinished_and_no_doubt() -> None:
    model = _counters(1, 2, 3)
    checked = check_model(model, CheckLimits(states=100, chains=50))
    assert not checked.complete
    assert len(checked.unfinished) == 2
    assert checked.doubts == check_model(model).doubts
    assert check_model(model).unfinished == ()


def test_doubts_about_the_text_come_before_the_exploration() -> None:
    order: list[str] = []
    check_model(
        scan_cell(is_open=True),
        found=lambda doubt: order.append(doubt.slug),
        progress=lambda _: order.append("explores"),
    )
    assert order[:3] == [Slug.UNUSED_VARIABLE, Slug.UNUSED_VARIABLE, "explores"]


_RECOVERY = """
behavior_model: recovery
variables:
  failures: {domain: 0..3, initial: 0}
  mode: {domain: [normal, timed_out, cleared], initial: normal}
  seen: {domain: [near, far], initial: near}
  done: {domain: bool, initial: false}
  unused: {domain: bool, initial: false}
resources:
  arm: {measures: [seen], simulation: {outcomes: {succeed: 0.8, fail: 0.1, timeout: 0.1}}}
operations:
  work:
    pre: {g: done == false, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [done <- true, arm_req_trigger <- false]}
    deadline: 5 s
    timedout: [mode <- timed_out, arm_req_trigger <- false]
    failed: {g: arm_req_state == failed, a: [failures += 1, arm_req_trigger <- false]}
  after_failure: {pre: {g: failures == 1}, post: {g: true, a: [failures <- 0]}}
  after_timeout: {pre: {g: mode == timed_out}, post: {g: true, a: [mode <- normal]}}
  after_automatic: {pre: {g: mode == cleared}, post: {g: true, a: [mode <- normal]}}
  after_measuring: {pre: {g: seen == far}, post: {g: true, a: [seen <- near]}}
  impossible: {pre: {g: unused == true}, post: {g: true, a: [unused <- true]}}
automatic_transitions:
  clear: {g: "arm_req_state == failed && mode == timed_out", a: [mode <- cleared]}
goals: {done: done == true}
"""


@pytest.mark.parametrize("limits", [CheckLimits(), CheckLimits(states=3)])
def test_operations_that_only_recovery_enables_are_not_doubted(limits: CheckLimits) -> None:
    doubts = check_model(read_model(_RECOVERY), limits).doubts
    never = [doubt.path[1] for doubt in doubts if doubt.slug is Slug.OPERATION_NEVER_ENABLED]
    assert never == ["impossible"]


def test_a_limit_on_states_after_failures_names_the_variables_that_multiply(wording: Wording) -> None:
    checked = check_model(read_model(_RECOVERY), CheckLimits(states=20))
    (clause,) = checked.unfinished
    assert "failures (" in clause
    assert "whether after_failure, after_timeout, after_automatic and others" in clause
    wording(clause)


_FAILED_BY_A_TRANSITION = """
behavior_model: failed_by_a_transition
variables:
  broken: {domain: bool, initial: false}
  late: {domain: bool, initial: false}
  busy: {domain: bool, initial: false}
  lid: {domain: [open, closed], initial: open}
resources:
  arm: {simulation: {outcomes: {succeed: 0.5, fail: 0.5}}}
operations:
  work:
    pre: {g: lid == open, a: [arm_req_trigger <- true, busy <- true]}
    post: {g: lid == closed}
    deadline: 5 s
    timedout: [late <- true]
  repair: {pre: {g: broken == true && late == false}, post: {g: true, a: [lid <- closed]}}
automatic_transitions:
  arm_failed:
    g: busy == true && arm_req_state == failed && current.state == executing
    a: [current.state <- failed, broken <- true]
goals: {closed: lid == closed}
"""


def test_recovery_ends_an_operation_that_an_automatic_transition_fails() -> None:
    doubts = check_model(read_model(_FAILED_BY_A_TRANSITION)).doubts
    assert Slug.OPERATION_NEVER_ENABLED not in [doubt.slug for doubt in doubts]


_HELD_FROM_OUTSIDE = """
behavior_model: held
variables:
  button: {domain: [released, pressed], initial: released, source: input}
  lamp: {domain: [off, on], initial: off}
  state: {domain: [idle, held, done], initial: idle}
resources:
  panel: {publishes: [lamp]}
operations:
  work: {deadline: 5 s, pre: {g: state == idle}, post: {g: true, gr: button == released, a: [state <- done]}}
  go_on: {pre: {g: state == held}, post: {g: true, a: [state <- idle]}}
  check_lamp: {pre: {g: lamp == on && state == held}, post: {g: true, a: [state <- idle]}}
automatic_transitions:
  hold: {g: button == pressed && work.state == executing, a: [current.state <- failed, state <- held]}
goals: {done: state == done}
"""


@pytest.mark.parametrize(
    "more", ["", "environment: {press: {guard: button == released, actions: [button <- pressed]}}"]
)
def test_operations_that_only_a_change_from_outside_enables_are_not_doubted(more: str) -> None:
    doubts = check_model(read_model(_HELD_FROM_OUTSIDE + more)).doubts
    assert Slug.OPERATION_NEVER_ENABLED not in [doubt.slug for doubt in doubts]


@pytest.mark.slow
def test_recovery_reaches_every_state_in_which_a_run_starts_an_operation() -> None:
    model = read_model(_RECOVERY)
    tester = Tester(model)
    executed = {
        record.operation
        for case in RandomCases(model).first(200, seed=1)
        for record in tester.execute(case).trace.records
        if isinstance(record, OperationStepped)
    }
    assert executed
    doubted = [d.path[1] for d in check_model(model).doubts if d.slug is Slug.OPERATION_NEVER_ENABLED]
    assert not executed.intersection(doubted)


@pytest.mark.parametrize(
    ("guard", "waits"),
    [
        ("true", False),
        ("scan_req_trigger == true || light == blue", False),
        ("scan_command in {scan_box} && !(scan_command == none)", False),
        ("scan_req_state == succeeded || scan_command == none", True),
        ("light == green", True),
    ],
)
def test_an_operation_that_completes_at_once_needs_no_deadline(guard: str, waits: bool) -> None:  # noqa: FBT001
    silent = (
        "    measures: [temperature]\n",
        "    measures: [temperature]\n    simulation: {outcomes: {timeout: 1}}\n",
    )
    no_deadline = (("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    doubts = _doubts(silent, *no_deadline, ("gr: scan_req_state == succeeded", f"gr: {guard}"))
    assert (Slug.NO_DEADLINE in [doubt.slug for doubt in doubts]) == waits


def test_a_state_that_no_action_assigns_is_reported_at_its_source() -> None:
    light = "light: {domain: [green, red, blue], initial: green"
    scanned = (
        "box_is_scanned: {domain: bool, initial: false",
        "box_is_scanned: {source: state, domain: bool, initial: false",
    )

    def found(source: str) -> list[tuple[str | int, ...]]:
        model = scan_cell(scanned, (light, f"{light}, source: {source}"), is_open=True)
        return [doubt.path for doubt in check_model(model).doubts if doubt.slug is Slug.NEVER_ASSIGNED]

    assert found("state") == [("variables", "light", "source")]
    assert found("constant") == found("input") == []


_LATE = """\
behavior_model: late
variables:
  n: {domain: 0..2, initial: 0}
  done: {domain: bool, initial: false}
resources:
  arm: {simulation: {latency: 1 s, outcomes: {succeed: 0.9, timeout: 0.1}}}
operations:
  move: {request: arm, deadline: 5 s, guard: done == false && n == 2, effects: [done <- true], on_timeout: [n += 1]}
  step: {pre: {g: n < 2}, post: {g: true, a: [n += 1]}}
goals: {done: done == true}
"""


def test_a_timeout_that_leaves_a_domain_is_doubtful() -> None:
    (doubt,) = check_model(read_model(_LATE)).doubts
    assert (doubt.slug, doubt.path) == (Slug.DOMAIN_LEFT, ("operations", "move", "timedout"))


@pytest.mark.parametrize("change", [("n == 2", "n == 1"), ("n += 1]}\n  step", "n <- 0]}\n  step")])
def test_a_timeout_that_stays_in_its_domain_is_good(change: tuple[str, str]) -> None:
    assert check_model(read_model(_LATE.replace(*change))).doubts == ()


_ROBOTS = """\
behavior_model: robots
types: {robot: [r1, r2]}
variables:
  n[robot]: {domain: bool, initial: false}
operations:
  inc[x in robot]: {pre: {g: n.x == false}, post: {g: true, a: [n.x <- true]}}
requirements:
"""


@pytest.mark.parametrize(
    ("requirement", "doubtful"),
    [
        ("r[x in robot, y in robot]: always x != y && n[x] == false", ["r.r1.r1", "r.r2.r2"]),
        ("r[x in robot]: never x == r1 || n[x] == true", ["r.r1"]),
        ("r: always n.r1 == true && n.r1 == false", ["r"]),
        ("r: never n.r1 == true || n.r1 == false", ["r"]),
        ("r[x in robot, y in robot]: never x != y && n[x] == true && n[y] == true", []),
        ("r[x in robot, y in robot]: always x != y -> n[x] == false", []),
        ("r[x in robot, y in robot]: {requirement: always n.x == false, where: x != y}", []),
    ],
)
def test_a_requirement_that_every_run_violates_is_doubtful(requirement: str, doubtful: list[str]) -> None:
    doubts = check_model(read_model(f"{_ROBOTS}  {requirement}\n")).doubts
    expected = [(Slug.GUARD_NEVER_HOLDS, ("requirements", name)) for name in doubtful]
    assert [(doubt.slug, doubt.path) for doubt in doubts] == expected


@pytest.mark.parametrize(
    ("requirement", "doubtful"),
    [
        ("r: always n.r1 == true || n.r1 == false", ["r"]),
        ("r: never n.r1 == true && n.r1 == false", ["r"]),
        ("r: n.r1 == true && n.r1 == false leads to n.r2 == true", ["r"]),
        ("r: n.r1 == true leads to n.r1 == true || n.r2 == true within 5 s", ["r"]),
        ("r: n.r1 == true || n.r2 == true before n.r1 == true", ["r"]),
        ("r: after n.r1 == true && n.r1 == false always n.r2 == true until n.r2 == false", ["r"]),
        ("r: after n.r1 == true always n.r2 == true until n.r2 == false", ["r"]),
        ("r: after n.r1 == true always n.r2 == true until n.r1 == false", []),
        ("r: n.r1 == true leads to n.r2 == true", []),
        ("r: n.r1 == true before n.r2 == true", []),
        ("r[x in robot, y in robot]: always n.x == true || n.y == false", []),
        ("r[x in robot, y in robot]: never x != y && x == y", ["r.r1.r1", "r.r1.r2", "r.r2.r1", "r.r2.r2"]),
        ("r[x in robot]: always n.x == true || n.x == false", ["r.r1", "r.r2"]),
    ],
)
def test_a_requirement_that_no_run_can_violate_is_doubtful(requirement: str, doubtful: list[str]) -> None:
    doubts = check_model(read_model(f"{_ROBOTS}  {requirement}\n")).doubts
    expected = [(Slug.REQUIREMENT_ALWAYS_HOLDS, ("requirements", name)) for name in doubtful]
    assert [(doubt.slug, doubt.path) for doubt in doubts] == expected


EXCLUSIVE = """
behavior_model: cell
variables: {full: {domain: bool, initial: false}, spent: {domain: bool, initial: false}}
operations:
  fill: {pre: {g: full == false && spent == false}, post: {g: true, a: [full <- true]}}
  burst: {pre: {g: spent == false}, post: {g: true, a: [spent <- true]}}
  MORE
goals: {full: full == true, spent: spent == true}
"""


def notes_about_goals(more: str = "", further: str = "") -> list[tuple[Severity, tuple[int | str, ...]]]:
    model = read_model(EXCLUSIVE.replace("MORE", more) + further)
    return [(each.severity, each.path) for each in check_model(model).doubts if each.slug is Slug.GOALS_EXCLUDE]


def test_goals_that_runs_without_faults_put_out_of_reach_are_noted_once() -> None:
    renew = "renew: {pre: {g: spent == true}, post: {g: true, a: [spent <- false]}}"
    assert notes_about_goals() == [(Severity.NOTE, ("goals", "full"))]
    assert notes_about_goals(renew) == []
    assert notes_about_goals(further="reachable_again: [full]\n") == []
    assert notes_about_goals(further="runs: {goals: single}\n") == []
