"""The check of sets of situations: it refuses what a finder has forgotten, and sets that are none."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.closing.proofs.proofs import planner_of_proofs, scope_of_proofs
from scbm.closing.runs.all_runs import AllRuns, CloseLimits
from scbm.closing.symbolic.run_moves import RunMove, RunMoves
from scbm.closing.symbolic.set_proofs import SetProofs
from scbm.files import digest_of, read_model
from scbm.model import BehaviorModel, PlanSet
from scbm.proofcheck import Certificate, SetsArgument, check_certificate
from scbm.proofcheck.sets import distances_check
from scbm.proofcheck.sets.clauses import Clauses
from scbm.proofcheck.sets.set_views import SituationView, new_values
from support.wording import Wording

CELL = """
behavior_model: cell
variables:
  at: {domain: [home, work], initial: home}
  seen: {domain: [none, good, bad], initial: none, random: [none, bad]}
  stop: {domain: bool, initial: false, source: input}
  door: {domain: [open, closed], initial: closed}
  count: {domain: 0..2, initial: 0, source: state}
resources:
  arm: {measures: [seen], shared: true}
  belt: {}
operations:
  go:
    deadline: 5 s
    disabled_deadline: 2 s
    pre:
      g: at == home && arm_req_trigger == false && arm_req_state == initial
      gr: stop == false
      a: [arm_req_trigger <- true]
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [at <- work, arm_req_trigger <- false, arm_req_state <- initial]
    failed: {g: true, gr: seen == bad && arm_req_state == failed}
    timedout: [arm_req_trigger <- false]
  back:
    pre: {g: at == work && belt_req_trigger == false, gr: door == closed, a: [belt_req_trigger <- true]}
    post:
      g: true
      gr: belt_req_state == succeeded
      a: [at <- home, belt_req_trigger <- false, belt_req_state <- initial]
automatic_transitions:
  belt_failed:
    g: belt_req_state == failed && current.state == executing
    a: [current.state <- failed, belt_req_state <- initial, belt_req_trigger <- false]
  counted: {g: count == 0 && plan.state == completed, a: [count += 1]}
  aborted: {g: stop == true && count == 1 && plan.state == executing, a: [plan.state <- aborted, count <- 2]}
  over: {g: plan.state == aborted && count == 2, a: [seen <- good, count <- 0]}
  tidy: {g: arm_req_state == failed && current.name == none, a: [arm_req_state <- initial]}
environment:
  open: {guard: door == closed, actions: [door <- open]}
  close: {guard: door == open, actions: [door <- closed]}
goals:
  worked: at == work
  home: at == home && seen != none
"""

PLAIN = """
behavior_model: plain
variables:
  at: {domain: 0..3, initial: 0}
  load: {domain: [none, box], initial: none}
operations:
  move:
    pre: {g: at < 3}
    post: {g: at + 1 < 4, a: [at += 1]}
  take:
    pre: {g: load == none && at == 2}
    post: {g: true, a: [load <- box]}
  drop:
    pre: {g: load == box}
    post: {g: true, a: [load <- none]}
  late:
    pre: {g: load == box, gr: at == 0}
    post: {g: true, a: [load <- none]}
goals:
  taken: load == box && at == 2
runs: {goals: single}
"""

EVERYTHING = (1 << 1_000) - 1


def sets_of(model: BehaviorModel) -> SetProofs:
    return SetProofs.of(model, EVERYTHING, lambda _: None)


def certificate(model: BehaviorModel, argument: SetsArgument, *claims: str) -> Certificate:
    planner = None if argument.plans is PlanSet.ANY else planner_of_proofs(model)
    return Certificate(model.name, digest_of(model), claims, argument, planner)


def visited_in(model: BehaviorModel, plans: PlanSet = PlanSet.ANY) -> list[str]:
    runs = AllRuns(model, CloseLimits(), lambda _: None, scope_of_proofs(model, plans))
    assert runs.stopped is None
    return list(runs.visits.obligations.names(runs.visited | runs.cut_off))


@pytest.mark.parametrize("text", [PLAIN, pytest.param(CELL, marks=pytest.mark.longer)])
def test_all_that_is_proved_is_accepted_and_nothing_else(text: str) -> None:
    model = read_model(text)
    sets, visited = sets_of(model), visited_in(model)
    proved = [str(each) for each in Obligations.of(model) if sets.proves(each)]
    assert proved
    assert check_certificate(certificate(model, sets.argument, *proved), model) == ()
    for name in visited:
        assert name not in proved
        assert check_certificate(certificate(model, sets.argument, name), model), name


@pytest.mark.longer
@pytest.mark.parametrize(("text", "least"), [(CELL, 25), (PLAIN, 10)])
def test_a_finder_that_forgets_a_step_is_noticed(text: str, least: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the set without a step proves what a run visits, the check finds that a step leads out of the set."""
    model, every = read_model(text), RunMoves.moves
    visited, known, refused, forgotten = visited_in(model), [len(model.operations)], 0, 0
    while forgotten < known[-1]:

        def moves(self: RunMoves, without: int = forgotten) -> Iterator[RunMove]:
            steps = list(every(self))
            known.append(len(steps))
            return (step for number, step in enumerate(steps) if number != without)

        monkeypatch.setattr(RunMoves, "moves", moves)
        sets = sets_of(model)
        false = [str(each) for each in Obligations.of(model) if sets.proves(each) and str(each) in visited]
        if false:
            refused += 1
            assert check_certificate(certificate(model, sets.argument, *false), model), (forgotten, false)
        forgotten += 1
    assert refused >= least


def flaws(argument: SetsArgument) -> list[str]:
    model = read_model(PLAIN)
    return [flaw.where for flaw in check_certificate(certificate(model, argument, "late/executing"), model)]


def test_numbers_that_are_no_set_are_refused() -> None:
    argument = sets_of(read_model(PLAIN)).argument
    (level, *following), *others = argument.nodes
    assert flaws(argument) == []
    assert flaws(replace(argument, reached=len(argument.nodes) + 2)) == ["the sets"]
    assert flaws(replace(argument, nodes=((99, *following), *others))) == ["node 0"]
    assert flaws(replace(argument, nodes=((level, *following, 0), *others))) == ["node 0"]
    assert flaws(replace(argument, nodes=((level, *[2 for _ in following]), *others))) == ["node 0"]
    assert flaws(replace(argument, nodes=((), *others))) == ["node 0"]
    assert flaws(replace(argument, variables=argument.variables[1:])) == ["the variables"]
    assert flaws(replace(argument, variables=argument.variables[::-1]))[0].startswith("node")


def test_a_set_of_another_kind_of_runs_is_refused() -> None:
    model = read_model(CELL)
    argument = replace(sets_of(read_model(CELL)).argument, goals=read_model(PLAIN).runs.goals)
    assert [f.where for f in check_certificate(certificate(model, argument, "go/queued"), model)] == ["the goals"]


def test_dead_states_are_checked() -> None:
    model = read_model(PLAIN)
    argument = sets_of(model).argument
    everything = certificate(model, replace(argument, dead=1), "move/queued")
    assert "the dead states" in [flaw.where for flaw in check_certificate(everything, model)]
    of_the_world = certificate(model, replace(argument, dead=argument.reached), "move/queued")
    assert [flaw.where for flaw in check_certificate(of_the_world, model)] == ["the predicted states"]


def test_without_a_solver_nothing_is_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pysat.solvers", None)
    assert flaws(sets_of(read_model(PLAIN)).argument) == ["the set"]


ROADS = """
behavior_model: roads
variables:
  at: {domain: [home, hall, yard, work, lost], initial: home}
  rain: {domain: bool, initial: false, source: input}
operations:
  leave: {pre: {g: at == home}, post: {g: true, a: [at <- lost]}}
  walk: {pre: {g: at == home}, post: {g: true, a: [at <- hall]}}
  ride: {pre: {g: at == home}, post: {g: true, a: [at <- yard]}}
  detour: {pre: {g: at == hall, gr: rain == false}, post: {g: true, a: [at <- yard]}}
  enter: {pre: {g: at == hall}, post: {g: true, a: [at <- work]}}
  arrive: {pre: {g: at == yard}, post: {g: true, a: [at <- work]}}
goals:
  worked: at == work
"""
"""Two roads are as long. The canonical plan takes the first one in the order of the operations."""


def canonical_argument(text: str) -> SetsArgument:
    return sets_of(read_model(text)).canonical(EVERYTHING).argument


def flaws_of_roads(argument: SetsArgument, claim: str = "ride/queued", text: str = ROADS) -> list[str]:
    model = read_model(text)
    return [str(flaw) for flaw in check_certificate(certificate(model, argument, claim), model)]


@pytest.mark.parametrize("text", [PLAIN, ROADS, pytest.param(CELL, marks=pytest.mark.longer)])
def test_all_that_is_proved_about_canonical_plans_is_accepted_and_nothing_else(text: str) -> None:
    model = read_model(text)
    sets, visited = sets_of(model).canonical(EVERYTHING), visited_in(model, PlanSet.CANONICAL)
    proved = [str(each) for each in Obligations.of(model) if sets.proves(each)]
    assert text is not ROADS or {"ride/queued", "arrive/executing", "detour/disabled"} < set(proved)
    assert check_certificate(certificate(model, sets.argument, *proved), model) == ()
    for name in visited:
        assert name not in proved
        assert check_certificate(certificate(model, sets.argument, name), model), name


def test_the_last_of_the_shortest_plans_is_not_canonical(wording: Wording) -> None:
    """The choices are those of the model with its operations in another order."""
    head, operations, *rest = re.split(r"(?<=operations:\n)((?:  .*\n)+)", ROADS)
    other = "".join((head, *reversed(operations.splitlines(keepends=True)), *rest))
    argument = canonical_argument(other)
    wording(flaws_of_roads(replace(argument, choices=argument.choices[::-1]), "walk/queued")[0])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("enter: {pre: {g: at == hall}", "enter: {pre: {g: at == lost}"),
        ("walk: {pre: {g: at == home}", "walk: {pre: {g: at == lost}"),
        ("worked: at == work", "worked: at in {work, yard}"),
    ],
)
def test_plans_of_another_model_are_refused(old: str, new: str, wording: Wording) -> None:
    found = flaws_of_roads(canonical_argument(ROADS.replace(old, new)), "walk/queued")
    wording(found[0])


def test_a_shorter_plan_is_noticed(wording: Wording) -> None:
    shorter = ROADS.replace("at <- lost", "at <- work")
    wording(flaws_of_roads(canonical_argument(ROADS), "leave/queued", shorter)[0])


def test_layers_and_choices_that_are_none_are_refused(wording: Wording) -> None:
    argument = canonical_argument(ROADS)
    layers, choices = argument.layers, argument.choices
    assert flaws_of_roads(argument) == []
    for wrong in (
        replace(argument, choices=choices[1:]),
        replace(argument, choices=(0,) * len(choices)),
        replace(argument, choices=choices[::-1]),
        replace(argument, choices=(choices[1], *choices[1:])),
        replace(argument, plans=PlanSet.ANY),
        replace(argument, layers=(argument.reached,)),
        replace(argument, layers=(10**6,)),
        replace(argument, layers=layers[:-1]),
        replace(argument, layers=layers[::-1]),
        replace(argument, layers=(*layers, layers[0])),
    ):
        found = [flaw for flaw in flaws_of_roads(wrong) if not re.search(": it leads from |: .* leads out of ", flaw)]
        wording("\n".join(found))


def test_operations_that_read_too_much_are_not_checked(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    argument = canonical_argument(ROADS)
    monkeypatch.setattr(distances_check, "MAX_CHANGES", 4)
    wording(flaws_of_roads(argument)[0])


SMALL = """
behavior_model: small
variables:
  at: {domain: [home, work], initial: home}
  door: {domain: [open, closed], initial: closed, source: input}
  lamp: {domain: bool, initial: false, source: state}
resources:
  arm: {}
operations:
  go:
    pre: {g: at == home && arm_req_trigger == false, gr: door == open, a: [arm_req_trigger <- true]}
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [at <- work, arm_req_trigger <- false, arm_req_state <- initial]
  back: {pre: {g: at == work}, post: {g: true, a: [at <- home]}}
automatic_transitions:
  lit: {g: go.state == initial && at == work && lamp == false, a: [lamp <- true]}
environment:
  open: {guard: door == closed, actions: [door <- open]}
goals:
  worked: at == work
  home: at == home
"""


@pytest.mark.parametrize(
    ("steps", "claim"),
    [
        ("_beginnings", "go/queued"),
        ("_plans", "go/queued"),
        ("_operation_moves", "go/executing"),
        ("_sendings", "go/completed"),
        ("_replies", "go/completed"),
        ("_automatic_moves", "automatic/lit"),
        ("_outside", "go/executing"),
        ("_ends", "back/executing"),
    ],
)
def test_a_finder_that_forgets_one_kind_of_steps_is_noticed(
    steps: str, claim: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RunMoves, steps, lambda *_: iter(()))
    assert_is_false(claim)


def test_a_finder_that_forgets_where_runs_begin_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    start = RunMoves.start
    monkeypatch.setattr(RunMoves, "start", lambda moves: start(moves) & ~start(moves))
    assert_is_false("go/executing")


def assert_is_false(claim: str) -> None:
    model = read_model(SMALL)
    sets = sets_of(model)
    assert claim in [str(each) for each in Obligations.of(model) if sets.proves(each)]
    assert check_certificate(certificate(model, sets.argument, claim), model)


def test_operations_that_are_not_current_are_initial() -> None:
    """The set is that of a model in which nothing takes the transition, so no other step leads out of it."""
    argument = sets_of(read_model(SMALL.replace("go.state == initial", "go.state == timedout"))).argument
    assert check_certificate(certificate(read_model(SMALL), argument, "automatic/lit"), read_model(SMALL))


def test_actions_that_leave_their_domain_do_not_apply() -> None:
    model, clauses = read_model(PLAIN), Clauses()
    literals = {v.name: new_values(v.domain.values, clauses) for v in model.running_space if not v.role.is_runner}
    view = SituationView.of_plan(literals, model, clauses)
    inside, _ = view.after(model.operation("move").post.a)
    assert clauses.can_hold([inside, view.has("at", 2)])
    assert not clauses.can_hold([inside, view.has("at", 3)])
