"""The automata of models: from which values each change starts, and what makes it."""

from pathlib import Path

from msgspec.structs import replace

from scbm.drawing.automata import ANY_OTHER, Automaton, ModelAutomata
from scbm.files import load_model, read_model
from scbm.model import And, BehaviorModel, Constant, Domain, Equal, NotEqual, Or, Reference, Variable

ROOT = Path(__file__).parents[3]
AIR = ROOT / "examples/robot_in_the_air/before.yaml"

HEAD = """\
behavior_model: cell
resources: {arm: {}}
goals: {done: at == shelf}
variables:
  at: {domain: [home, shelf, table], initial: home}
  lit: {domain: bool, initial: false}
"""


def automaton(text: str, name: str) -> Automaton:
    return of_model(read_model(text), name)


def of_model(model: BehaviorModel, name: str) -> Automaton:
    return next(each for each in ModelAutomata.of(model).automata if each.variable.name == name)


def edges(found: Automaton) -> list[str]:
    """Return the edges as texts, thin ones with `~`, bounds with `≤`."""
    return [
        f"{'any' if e.source == ANY_OTHER else found.groups[e.source]} {'~' if e.is_meanwhile else '-'}> "
        f"{'≤ ' if e.is_bound else ''}{found.groups[e.target]}: {e.maker}"
        for e in found.edges
    ]


def test_the_same_change_from_all_other_values_is_one_edge() -> None:
    found = of_model(load_model(AIR), "robot_at")
    assert len(found.edges) == 5
    assert {edge.source for edge in found.edges} == {ANY_OTHER}


def test_an_edge_starts_from_the_values_that_the_guards_of_planner_and_runner_allow() -> None:
    text = (
        f"{HEAD}operations:\n  go: {{pre: {{g: at != table, gr: at != shelf}}, post: {{g: true, a: [at <- table]}}}}\n"
    )
    assert edges(automaton(text, "at")) == ["home -> table: go"]


def test_a_guard_is_projected_on_the_values_that_others_allow() -> None:
    text = HEAD + "operations:\n  go: {pre: {g: at != table && (at == home -> lit == true) && lit == false}, "
    assert edges(automaton(text + "post: {g: true, a: [at <- table]}}\n", "at")) == ["shelf -> table: go"]


def test_an_effect_at_the_end_also_starts_from_what_others_make_of_the_value_meanwhile() -> None:
    text = f"""{HEAD}operations:
  go: {{pre: {{g: at == home}}, post: {{g: true, a: [at <- table]}}}}
environment:
  push: {{guard: at == home, actions: [at <- shelf]}}
"""
    assert edges(automaton(text, "at")) == ["home -> table: go", "shelf ~> table: go", "home -> shelf: push"]


def test_the_guard_at_the_end_excludes_values_too() -> None:
    text = f"""{HEAD}operations:
  go: {{pre: {{g: at != table}}, post: {{g: true, gr: at == shelf, a: [at <- table]}}}}
"""
    assert edges(automaton(text, "at")) == ["shelf -> table: go"]


def test_an_effect_at_the_end_starts_from_what_the_start_sets() -> None:
    text = f"""{HEAD}operations:
  go: {{pre: {{g: at == home, a: [at <- shelf]}}, post: {{g: true, a: [at <- table]}}}}
"""
    assert edges(automaton(text, "at")) == ["home -> shelf: go (start)", "shelf -> table: go"]


def test_failures_and_timeouts_are_marked() -> None:
    text = f"""{HEAD}operations:
  go:
    deadline: 1 s
    pre: {{g: at == home}}
    post: {{g: lit == true, a: [at <- table]}}
    failed: {{g: lit == true, a: [at <- shelf]}}
    timedout: [at <- shelf]
"""
    assert edges(automaton(text, "at"))[1:] == ["home -> shelf: go (failed)", "home -> shelf: go (timedout)"]


def test_assigned_variables_and_sums_give_each_possible_value() -> None:
    text = """\
behavior_model: cell
variables:
  x: {domain: 0..3, initial: 0}
  y: {domain: 1..2, initial: 1}
operations:
  copy: {pre: {g: x == 0}, post: {g: true, a: [x <- y]}}
  add: {pre: {g: y == 1}, post: {g: true, a: [x <- x + y]}}
  less: {pre: {g: true}, post: {g: true, a: [x -= 2]}}
goals: {done: x == 3}
"""
    assert edges(automaton(text, "x")) == [
        "0 -> 1: copy", "0 -> 2: copy", "0 -> 1: add", "0 -> 2: add", "1 -> 2: add", "1 -> 3: add", "2 -> 3: add",
        "2 -> 0: less", "3 -> 1: less",
    ]  # fmt: skip


def test_large_domains_are_grouped_by_the_constants_that_the_model_uses() -> None:
    text = """\
behavior_model: cart
variables: {battery: {domain: 0..100, initial: 100}}
operations:
  drive: {pre: {g: battery > 20}, post: {g: true, a: [battery -= 15]}}
  charge: {pre: {g: battery <= 20}, post: {g: true, a: [battery <- 100]}}
goals: {empty: battery == 0}
"""
    found = automaton(text, "battery")
    assert list(map(str, found.groups)) == ["0", "1..20", "21..99", "100"]
    assert edges(found) == [
        "21..99 -> 1..20: drive", "21..99 -> 21..99: drive", "100 -> 21..99: drive",
        "0 -> 100: charge", "1..20 -> 100: charge",
    ]  # fmt: skip


def test_symbols_that_nothing_distinguishes_are_one_group() -> None:
    names = [f"place_{number}" for number in range(14)]
    text = f"""\
behavior_model: cart
variables: {{at: {{domain: [{", ".join(names)}], initial: place_0}}}}
operations:
  go: {{pre: {{g: at != place_3}}, post: {{g: true, a: [at <- place_3]}}}}
goals: {{there: at == place_3}}
"""
    assert list(map(str, automaton(text, "at").groups)) == ["place_0, place_1, place_2, … (13 values)", "place_3"]


def test_replies_published_values_and_inputs_are_named() -> None:
    text = """\
behavior_model: cell
variables:
  seen: {domain: [unknown, good, bad], initial: unknown}
  shown: {domain: [red, green], initial: red}
  button: {domain: [up, down], initial: up}
  done: {domain: bool, initial: false}
resources:
  camera: {measures: {seen: [good, bad]}}
  lamp: {publishes: [shown]}
operations:
  look:
    pre: {g: camera_req_state == initial && button == down && shown == red, a: [camera_req_trigger <- true]}
    post: {g: true, gr: camera_req_state == succeeded && seen == good,
           a: [done <- true, camera_req_trigger <- false, camera_req_state <- initial]}
goals: {done: done == true}
"""
    assert edges(automaton(text, "seen")) == ["any -> good: camera", "any -> bad: camera"]
    assert edges(automaton(text, "shown")) == ["red -> green: lamp", "green -> red: lamp"]
    assert [edge.maker.kind.name for edge in automaton(text, "button").edges] == ["INPUT", "INPUT"]


def test_variables_that_only_requests_need_are_left_out() -> None:
    found = ModelAutomata.of(load_model(AIR))
    assert found.carried == ("robot_command", "gantry_command", "scanner_command", "gripper_command")
    assert sum(len(each.edges) for each in found.drawn) == 25


def test_a_search_that_meets_its_limit_gives_a_bound() -> None:
    model = read_model(f"{HEAD}operations:\n  go: {{pre: {{g: at == home}}, post: {{g: true, a: [at <- table]}}}}\n")
    pigeons = [Variable(f"p{n}", Domain.integers(1, 10), 1, (1,)) for n in range(11)]
    apart = [NotEqual(Reference(a.name), Reference(b.name)) for a in pigeons for b in pigeons if a.name < b.name]
    free = Or((And(tuple(apart)), Equal(Reference("at"), Constant("home"))))
    operation = model.operations[0]
    hard = replace(operation, pre=replace(operation.pre, g=free))
    found = of_model(replace(model, variables=(*model.variables, *pigeons), operations=(hard,)), "at")
    assert edges(found) == ["home -> table: go", "shelf -> ≤ table: go"]


def test_runs_may_begin_with_values_that_the_initial_states_allow() -> None:
    text = """\
behavior_model: cell
variables:
  at: {domain: [home, shelf, table], initial: home, random: any}
  lit: {domain: bool, initial: false, random: any}
  button: {domain: [up, down], initial: up}
initial_states: "at != shelf && (at == table -> lit == true)"
operations:
  go: {pre: {g: at == home && button == down}, post: {g: true, a: [at <- table, lit <- true]}}
goals: {there: at == table && lit == true}
"""
    model = read_model(text)
    assert [group.is_allowed for group in of_model(model, "at").groups] == [True, False, True]
    assert [group.is_allowed for group in of_model(model, "button").groups] == [True, True]
