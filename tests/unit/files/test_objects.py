"""Objects and parameters: what lifted entries mean, their order, and a published model of 846 operations."""

from __future__ import annotations

import re
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from published.plants import factory

from scbm.files import digest_of, load_model, read_located, read_model, write_model
from scbm.files.expansion import static_facts
from scbm.files.expansion.lifted_names import IndexedName, LiftedNames, LiftedScope
from scbm.files.expansion.lifted_reader import LiftedReader
from scbm.files.expansion.static_facts import ObjectTable, StaticFacts
from scbm.files.expansion.thresholds import Joint, at_least, copies
from scbm.model import Assign, DrawnVariable, InputError, Severity, Slug
from support.step_limits import step_limit
from support.wording import Wording

if TYPE_CHECKING:
    from scbm.files.expansion.thresholds import Threshold
    from scbm.model import BehaviorModel, Operation

ROOT = Path(__file__).parents[3]
FACTORY = ROOT / "benchmarks" / "published" / "factory.yaml"

HEAD = """behavior_model: cell
types:
  zone: [a, b, dock]
  robot: [r1, r2]
  cold: {objects: [c], of: zone}
  empty: []
tables: {way: {of: [zone, zone], rows: [[a, b], [b, dock]]}}
variables:
  at[robot]: {domain: zone, initial: dock}
  full[zone]: {domain: bool, initial: false}
  gone[empty]: {domain: bool, initial: false}
  on: {domain: bool, initial: false}
operations: {}
"""


def cell(rest: str) -> BehaviorModel:
    return read_model(HEAD.replace("operations: {}\n", "" if "operations:" in rest else "operations: {}\n") + rest)


def goal(predicate: str) -> str:
    return str(cell(f"goals:\n  g: '{predicate}'\n").goal("g"))


# the published factory


def with_names_of_the_benchmark(name: str) -> str:
    base, *objects = name.split(".")
    match base:
        case "robot_at" | "piece_at":
            return f"{objects[0]}_at"
        case "charged" | "assembled":
            return f"{objects[0]}_{base}"
        case _:
            return "_".join((base, *objects))


def meaning(operation: Operation) -> tuple[str, frozenset[str], frozenset[str]]:
    conjuncts = str(operation.pre.g).replace("(", "").replace(")", "").split(" && ")
    guard = [(with_names_of_the_benchmark(c.split(" == ")[0]), c.split(" == ")[1]) for c in conjuncts]
    effects = [a for a in operation.post.a if isinstance(a, Assign)]
    actions = [f"{with_names_of_the_benchmark(a.target)} <- {a.source}" for a in effects]
    return with_names_of_the_benchmark(operation.name), frozenset(map(str, guard)), frozenset(actions)


@pytest.mark.longer
def test_the_factory_in_forty_lines_has_the_846_operations_of_the_published_one() -> None:
    lifted, published = load_model(FACTORY), factory(3, 3)
    assert len(FACTORY.read_text(encoding="utf-8").splitlines()) <= 60
    assert {meaning(each) for each in lifted.operations} == {
        (each.name, *meaning(each)[1:]) for each in published.operations
    }
    assert len(lifted.operations) == len(published.operations) == 846
    assert {origin.lifted for origin in lifted.origins} == {"move", "transport", "recharge", "assemble"}


@pytest.mark.slow
def test_a_file_that_is_too_large_when_it_is_written_out_is_refused_at_once() -> None:
    objects = ", ".join(f"o{number}" for number in range(100))
    text = (
        f"behavior_model: m\ntypes: {{t: [{objects}]}}\n"
        "variables:\n  on[t]: {domain: bool, initial: false}\n"
        "operations:\n  go[p in t, q in t]:\n    pre:\n"
        "      g: forall x in t. (x == p || on[x] == on[q])\n    post: {g: true}\n"
    )
    with pytest.raises(InputError) as raised:
        read_model(text)
    (diagnostic,) = raised.value.diagnostics
    assert (diagnostic.slug, diagnostic.place.line, diagnostic.place.column) == (Slug.TOO_MANY_INSTANCES, 8, 10)


# order, names, choices


def test_ground_entries_stand_in_the_order_of_objects_the_last_parameter_fastest() -> None:
    model = cell("operations:\n  go[r in robot, z in zone]: {pre: {g: at.r == z}, post: {g: true}}\n")
    expected = [f"go.{robot}.{zone}" for robot in ("r1", "r2") for zone in ("a", "b", "dock", "c")]
    assert [operation.name for operation in model.operations] == expected


def test_where_and_guards_without_variables_leave_choices_out() -> None:
    model = cell(
        "operations:\n"
        "  go[x in zone, y in zone]: {where: 'way(x, y)', pre: {g: full.x == true}, post: {g: true}}\n"
        "  cool[z in zone]: {pre: {g: z in cold && full.z == true}, post: {g: true}}\n"
    )
    assert [str(o.name) for o in model.operations] == ["go.a.b", "go.b.dock", "cool.c"]
    assert str(model.operations[2].pre.g) == "full.c == true"


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        ("r == s && s == t", ["o0.o0.o0", "o1.o1.o1", "o2.o2.o2"]),
        ("t == r && s == o1", ["o0.o1.o0", "o1.o1.o1", "o2.o1.o2"]),
        ("next(t, r) && s == t", ["o1.o0.o0", "o2.o1.o1"]),
        ("next(r, r) || next(r, s) && t == o2", ["o0.o1.o2", "o1.o2.o2"]),
        ("next(r, s) && t in {o0, o1} && t != r", ["o0.o1.o1", "o1.o2.o0"]),
        ("(r == s || s == t) && next(r, t)", ["o0.o0.o1", "o0.o1.o1", "o1.o1.o2", "o1.o2.o2"]),
    ],
)
def test_conditions_join_parameters(where: str, expected: list[str]) -> None:
    model = read_model(joining(3, where))
    assert [operation.name for operation in model.operations] == [f"go.{choice}" for choice in expected]


def joining(objects: int, where: str) -> str:
    listed = [f"o{number}" for number in range(objects)]
    rows = ", ".join(f"[{first}, {second}]" for first, second in pairwise(listed))
    return (
        f"behavior_model: m\ntypes: {{robot: [{', '.join(listed)}]}}\n"
        f"tables: {{next: {{of: [robot, robot], rows: [{rows}]}}}}\n"
        "variables: {on: {domain: bool, initial: false}}\noperations:\n  go[r in robot, s in robot, t in robot]: "
        f"{{where: '{where}', pre: {{g: on == false}}, post: {{g: true}}}}\n"
    )


def test_parameters_that_conditions_join_are_not_enumerated_apart() -> None:
    """With 300 objects, the 27 million choices of three parameters would be too many to try."""
    assert len(read_model(joining(300, "r == s && next(s, t)")).operations) == 299


@pytest.mark.parametrize(
    ("types", "line"),
    [
        ("  a: [a1, a2]\n  b: {objects: [b1]}\n  c: {of: b, objects: [c1, wrong name]}\n", 4),
        ("  a: [a1, a2, a3, wrong name]\n  b: [also wrong]\n", 2),
        ("  a: []\n  b: {of: c}\n  c: {}\n  d: [wrong name]\n", 5),
    ],
)
def test_too_many_objects_are_one_error_before_they_are_read(
    types: str, line: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(static_facts, "MAX_OBJECTS", 3)
    monkeypatch.setattr(static_facts, "MAX_TYPES", 3)
    text = f"types:\n{types}behavior_model: cell\nvariables: {{at: {{domain: d, initial: d1}}}}\n"
    text += "operations:\n  go[x in c, y in d]: {pre: {g: at == d1}, post: {g: true, a: [at <- y]}}\n"
    with pytest.raises(InputError) as raised:
        read_model(text)
    assert [(each.slug, each.place.line) for each in raised.value.diagnostics] == [(Slug.TOO_MANY_INSTANCES, line)]


def test_a_refusal_names_the_number_of_instances() -> None:
    with pytest.raises(InputError, match=r"has 90,000 instances; at most 10,000 are built"):
        read_model(joining(300, "r == t"))


def test_an_entry_without_instances_is_a_warning(wording: Wording) -> None:
    rest = "operations:\n  go[x in zone]: {where: x == a && x == b, pre: {g: on == true}, post: {g: true}}\n"
    _, places = read_located(HEAD.replace("operations: {}\n", rest))
    assert [(warning.slug, warning.severity, warning.place.line) for warning in places.warnings] == [
        (Slug.NO_INSTANCE, Severity.WARNING, 11),
        (Slug.NO_INSTANCE, Severity.WARNING, 14),
    ]
    wording(warning.message for warning in places.warnings)


@pytest.mark.parametrize("comparison", [">= 0", "<= 2", "< 3", "!= 3"])
def test_a_comparison_of_a_count_that_always_holds_is_a_warning(comparison: str) -> None:
    goals = f"goals: {{g: 'count r in robot. (at[r] == a) {comparison}'}}\n"
    _, places = read_located(HEAD + goals)
    assert [warning.slug for warning in places.warnings] == [Slug.NO_INSTANCE, Slug.COUNT_ALWAYS_HOLDS]


def test_what_is_lifted_has_the_digest_of_the_same_model_written_out() -> None:
    lifted = cell("goals:\n  all: forall z in zone. (full[z] == true)\n")
    assert digest_of(lifted) == digest_of(read_model(write_model(lifted)))
    assert lifted == read_model(write_model(lifted))


# predicates


@pytest.mark.parametrize(
    ("lifted", "ground"),
    [
        ("forall r in robot. (at[r] == a)", "at.r1 == a && at.r2 == a"),
        ("exists r in robot. (at[r] == a)", "at.r1 == a || at.r2 == a"),
        ("forall r in robot, o in robot. (r == o || at[r] != at[o])", "at.r1 != at.r2 && at.r2 != at.r1"),
        ("on == true && forall e in empty. (gone[e] == true)", "on == true"),
        ("on == true || exists e in empty. (gone[e] == true)", "on == true"),
        ("exists e in empty. (gone[e] == true)", "false"),
        ("at.r1 in cold", "at.r1 in {c}"),
        ("on == true -> forall z in cold. (full[z] == true)", "on == true -> full.c == true"),
        ("(exists e in empty. (gone[e] == true)) -> on == true", "true"),
        ("count r in robot. (at[r] == a) >= 1", "at.r1 == a || at.r2 == a"),
        ("count r in robot. (at[r] == a) >= 2", "at.r1 == a && at.r2 == a"),
        ("count r in robot. (at[r] == a) <= 0", "!(at.r1 == a || at.r2 == a)"),
        ("count r in robot. (at[r] == a) < 2", "!(at.r1 == a && at.r2 == a)"),
        ("count z in zone. (way(a, z)) == 1", "true"),
        (
            "count z in zone. (z == a || full[z] == true) == 1",
            "!(full.b == true || full.dock == true || full.c == true)",
        ),
    ],
)
def test_a_predicate_over_objects_means_this(lifted: str, ground: str) -> None:
    assert goal(lifted) == ground


def holds(formula: Threshold, bits: int) -> bool:
    if isinstance(formula, Joint):
        operands = (holds(operand, bits) for operand in formula.operands)
        return all(operands) if formula.connective == "&&" else any(operands)
    return formula if isinstance(formula, bool) else bool(bits >> formula & 1)


def size(formula: Threshold) -> int:
    return sum(map(size, formula.operands)) if isinstance(formula, Joint) else not isinstance(formula, bool)


@pytest.mark.parametrize("predicates", range(7))
def test_a_threshold_holds_where_that_many_predicates_hold(predicates: int) -> None:
    for number in range(-1, predicates + 2):
        formula = at_least(number, predicates)
        assert size(formula) == copies(number, predicates)
        for bits in range(1 << predicates):
            assert holds(formula, bits) == (bits.bit_count() >= number)


def test_at_least_two_of_many_takes_few_copies() -> None:
    assert copies(2, 64) == copies(63, 64) == 64 * 6
    assert copies(1, 64) == copies(64, 64) == 64


# other texts


def test_actions_names_and_texts_have_parameters() -> None:
    model = cell(
        "resources:\n  arm[r in robot]: {request: [at.r]}\n"
        "operations:\n"
        "  go[r in robot]:\n"
        "    pre: {name: 'begin_{r}', g: 'arm_req_state[r] == initial', a: [arm_req_trigger.r <- true]}\n"
        "    post: {g: true, a: [forall z in cold. (full.z <- true)]}\n"
        "automatic_transitions:\n"
        "  stop[r in robot]: {g: 'go[r].state == failed && current.name == go.r', a: [on <- true]}\n"
        "waivers:\n"
        "  - {obligation: go/failed, reason: never, author: Ada, date: 2026-11-23}\n"
        "  - {obligation: 'automatic/stop[r in robot]', where: r == r2, reason: '{r}', author: A, date: 2026-11-23}\n"
    )
    first = model.operations[0]
    assert model.resources[1].request == ("at.r2",)
    assert (first.pre.name, str(first.pre.g)) == ("begin_r1", "arm.r1_req_state == initial")
    assert [str(action) for action in (*first.pre.a, *first.post.a)] == ["arm.r1_req_trigger <- true", "full.c <- true"]
    assert str(model.automatic_transitions[1].g) == "go.r2.state == failed && current.name == go.r2"
    assert [(waiver.obligation, waiver.reason) for waiver in model.waivers] == [
        ("go.r1/failed", "never"),
        ("go.r2/failed", "never"),
        ("automatic/stop.r2", "r2"),
    ]


def test_requirements_keep_their_words_and_their_durations() -> None:
    model = cell("requirements:\n  r[s in robot]: at[s] == a leads to at[s] == dock within 10 s\n")
    assert str(model.requirements[1]) == "r.r2: at.r2 == a leads to at.r2 == dock within 10 s"


def test_handshakes_can_have_parameters() -> None:
    model = cell(
        "resources:\n  arm[robot]: {}\n"
        "operations:\n"
        "  go[r in robot]: {request: arm.r, guard: 'at[r] == a', effects: [at.r <- dock], deadline: 10 s}\n"
    )
    assert str(model.operations[1].pre.a[0]) == "arm.r2_req_trigger <- true"
    assert [each.name for each in model.automatic_transitions] == ["arm_failed.r1", "arm_failed.r2"]


@pytest.mark.parametrize(
    ("written", "meant"),
    [("cnc.m_req_state == initial", "cnc_req_state.m"), ("cnc.n_req_trigger == true", "cnc_req_trigger.n")],
)
def test_the_index_of_a_state_of_a_resource_stands_last(written: str, meant: str) -> None:
    text = (
        "behavior_model: cell\ntypes: {machine: [m, n]}\nvariables: {a: {domain: bool, initial: false}}\n"
        "resources: {'cnc[machine]': {}}\n"
        f"operations: {{o: {{pre: {{g: '{written}', a: [a <- true]}}, post: {{g: true}}}}}}\n"
    )
    with pytest.raises(InputError) as raised:
        read_model(text)
    assert [each.remedy for each in raised.value.diagnostics] == [f"did you mean `{meant}`?"]
    ground = text.replace("types: {machine: [m, n]}\n", "").replace("'cnc[machine]': {}", "cnc.m: {}, cnc.n: {}")
    assert read_model(ground.replace(written, "cnc.m_req_state == initial")).operations


def test_the_words_of_a_name_of_a_part_can_be_in_the_wrong_order() -> None:
    text = (
        "behavior_model: cell\nvariables: {a: {domain: bool, initial: false}}\nresources: {cell1.cnc: {}}\n"
        "operations: {o: {pre: {g: cnc_req_state.cell1 == initial, a: [a <- true]}, post: {g: true}}}\n"
    )
    with pytest.raises(InputError) as raised:
        read_model(text)
    assert [each.remedy for each in raised.value.diagnostics] == ["did you mean `cell1.cnc_req_state`?"]


def test_errors_name_entries_as_they_are_written_or_an_instance_that_alone_has_them(wording: Wording) -> None:
    with pytest.raises(InputError) as raised:
        cell("""operations:
  stop[r in robot]: {}
  move[r in robot, s in robot]:
    pre: {g: at.r == e && stop.s.state == done}
    post: {g: true, a: [at.r <- a, at.s <- b]}
""")
    assert [each.place.line for each in raised.value.diagnostics] == [14, 14, 16, 16, 17]
    wording(each.message for each in raised.value.diagnostics)


def test_a_resource_with_parameters_needs_a_topic_for_each_object(wording: Wording) -> None:
    text = """resources:
  arm[r in robot]: {ros: {topics: {request: '/{r}/request', reply: /reply}}}
"""
    with pytest.raises(InputError) as raised:
        cell(text)
    (found,) = raised.value.diagnostics
    assert (found.place.line, found.place.column) == (15, 68)
    assert "`/reply`" in found.message
    wording(found.message)


def test_a_name_with_an_index_is_declared_once() -> None:
    text = HEAD.replace(
        "variables:", "resources: {'arm[robot]': {}}\nvariables:\n  arm_req_state[robot]: {domain: bool, initial: true}"
    )
    with pytest.raises(InputError) as raised:
        read_model(text)
    assert [(each.slug, each.place.line) for each in raised.value.diagnostics] == [(Slug.DUPLICATE_NAME, 8)]


LARGE = "behavior_model: large\ntypes: {place: [" + ", ".join(f"o{number}" for number in range(90)) + "]}\n"
LARGE += "variables:\n  open[place]: {domain: bool, initial: false}\n"


@pytest.mark.parametrize(
    "entry",
    [
        "go[a in place, b in place]: {pre: {g: forall c in place. (open.c == open.a)}, post: {g: true}}",
        "go[a in place]: {pre: {g: true}, post: {g: true, a: ['forall c in place, d in place. open.c <- true']}}",
        "go[a in place, b in place, c in place]: {pre: {g: open.a == true}, post: {g: true}}",
        "go: {pre: {g: 'forall a in place, b in place, c in place. (open.a == open.b)'}, post: {g: true}}",
        "go: {pre: {g: 'count a in place. (open.a == true) >= 40'}, post: {g: true}}",
    ],
)
def test_what_would_be_too_large_is_refused_before_it_is_built(entry: str) -> None:
    with pytest.raises(InputError) as raised, step_limit(200_000):
        read_model(f"{LARGE}operations:\n  {entry}\n")
    assert [each.slug for each in raised.value.diagnostics] == [Slug.TOO_MANY_INSTANCES]


ZONES = ("a", "b", "c")
NAMES = LiftedNames(
    StaticFacts({"zone": ZONES}, {"way": ObjectTable("way", ("zone", "zone"), {("a", "b"): None})}, {}),
    {
        "full": IndexedName(
            "variables", "full", "full", "", ("zone",), (dict.fromkeys(ZONES),), {(z,): None for z in ZONES}
        )
    },
    frozenset({"on"}),
)


@pytest.mark.parametrize(
    ("text", "least"),
    [
        ("on == true && full.z == true", 26),
        ("on == true || z == y", 0),
        ("on == true && forall x in zone. (full.x == true && (on == x))", 70),
        ("forall x in zone. (way(x, z) -> full.x == true)", 0),
        ("exists x in zone. (!(full.x == true && on == true))", 60),
        ("count x in zone. (full.x == true) >= 2", 0),
    ],
)
def test_no_instance_is_smaller_than_the_least_size_of_a_text(text: str, least: int) -> None:
    scope = LiftedScope(NAMES).with_parameters({"z": "zone", "y": "zone"})
    reader = LiftedReader(text, scope, lambda *_: pytest.fail("the text is right"))
    tree = reader.tree("predicate")
    assert tree is not None
    formula = reader.predicate(tree)
    grounds = [formula.ground({"z": z, "y": y}) for z in ZONES for y in ZONES]
    sizes = [0 if isinstance(each, bool) else each.characters for each in grounds]
    assert least * 0.6 <= formula.least <= min(sizes)


@pytest.mark.longer
def test_an_error_of_many_instances_costs_little_more_than_reading_them() -> None:
    text = f"{LARGE}  at: {{domain: place, initial: o0}}\noperations:\n"
    text += "  go[a in place]: {pre: {g: at == aisle}, post: {g: true, a: [open.a <- yes, at <- a]}}\n"
    read_model(text.replace("aisle", "o1").replace("yes", "true"))  # the grammar is made once
    with pytest.raises(InputError) as raised, step_limit(200_000):
        read_model(text)
    found = [(each.slug, each.place.line) for each in raised.value.diagnostics]
    assert found == [(Slug.VALUE_OUTSIDE_DOMAIN, 7), (Slug.UNKNOWN_NAME, 7)]


LIFTED_BINDING = """resources:
  arm[r in robot]:
    request: [at.r]
    measures: ["seen[r]"]
    publishes: [near.r]
    ros:
      service:
        name: /{r}/scan
        type: p/srv/S
        request: {at: "at[r]", arm: "{r}", turns: [{variable: "at[r]", values: {a: 0, b: 1, g: 2}}, {text: "{r}"}]}
        measured: {seen.r: seen}
      measured: {"near[r]": {topic: "/{r}/near", type: std_msgs/msg/Bool}}
"""


def test_a_binding_of_a_resource_with_parameters_names_variables_with_an_index(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("scbm.nodes.bindings.binding_keys.has_library", lambda: False)  # so that no file is needed
    text = HEAD.replace("  on:", "  seen[robot]: {domain: bool, initial: false}\n  near[robot]: SAME\n  on:")
    text = text.replace("SAME", "{domain: bool, initial: false}") + LIFTED_BINDING
    for resource, robot in zip(read_model(text).resources, ("r1", "r2"), strict=True):
        assert resource.binding is not None
        binding = resource.binding.written
        assert binding["service"]["name"] == f"/{robot}/scan"
        mapped = {"variable": f"at.{robot}", "values": {"a": 0, "b": 1, "g": 2}}
        request = binding["service"]["request"]
        assert request == {"at": f"at.{robot}", "arm": robot, "turns": [mapped, {"text": robot}]}
        assert binding["service"]["measured"] == {f"seen.{robot}": "seen"}
        assert [(name, each["topic"]) for name, each in binding["measured"].items()] == [
            (f"near.{robot}", f"/{robot}/near")
        ]


def test_replies_of_a_resource_with_parameters_draw_variables_with_an_index_by_weights() -> None:
    text = HEAD.replace("  on:", "  seen[robot]: {domain: [a, g], initial: a}\n  on:")
    drawn = "{measured: {seen.r: {a: 1, g: 3}}, failed: {'seen[r]': [g]}}"
    text += f"resources:\n  arm[r in robot]: {{measures: [seen.r], simulation: {drawn}}}\n"
    for resource, robot in zip(read_model(text).resources, ("r1", "r2"), strict=True):
        weights = (Fraction(1), Fraction(3))
        assert resource.simulation.measured == (DrawnVariable(f"seen.{robot}", ("a", "g"), weights),)
        assert resource.simulation.failed == (DrawnVariable(f"seen.{robot}", ("g",)),)


def test_a_binding_that_names_a_variable_without_its_index_is_wrong_there() -> None:
    text = LIFTED_BINDING.replace('"near[r]": {', "near: {").replace("seen.r: seen", "seen: seen")
    with pytest.raises(InputError) as raised:
        read_model(HEAD.replace("  on:", "  seen[robot]: {domain: bool, initial: false}\n  on:") + text)
    wrong = [each.place.line for each in raised.value.diagnostics if each.slug is Slug.WRONG_INDEX]
    assert wrong == [25]


# hints


HINTED = """behavior_model: hinted
types: {robot: [r1, r2], section: [s1, s2]}
variables:
  cmd[robot]: {domain: bool, initial: false}
  direction[section]: {domain: bool, initial: false}
resources:
  arm[r in robot]: {request: [cmd.r]}
  signal: {request: [direction.s1]}
operations:
  go[r in robot]: {request: arm.r, with: {cmd.r: true}, guard: cmd.r == false}
  show: {request: signal, with: {direction.s1: true}}
  cross[s in section]: {pre: {g: direction.s == true}, post: {g: true}}
"""


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (", with: {cmd.r: true}", ""),
        (", with: {direction.s1: true}", ""),
        ("[direction.s1]", "[direction[section]]"),
        ("[cmd.r]", "[cmd[r]]"),
        ("cmd.r == false", "cmd == false"),
        ("cmd.r == false", "cmd.r"),
        ("cmd.r == false", "cmmd.r == false"),
        ("direction.s == true", "direction[section] == true"),
        ("direction.s == true", "s"),
    ],
)
def test_a_hint_can_be_written_where_it_is_given(right: str, wrong: str) -> None:
    """The first quoted text of the remedy is put in place of the underlined text, or beside the key."""
    read_model(HINTED)
    text = HINTED.replace(right, wrong, 1)
    with pytest.raises(InputError) as raised:
        read_model(text)
    (found,) = raised.value.diagnostics
    hint = (found.remedy or "").split("`")[1]
    lines = text.splitlines()
    line = lines[found.place.line - 1]
    begin = found.place.column - 1
    end = begin + found.place.length
    if found.slug is Slug.MISSING_KEY:
        lines[found.place.line - 1] = f"{line[:begin]}{hint}, {line[begin:]}"
    elif found.slug is Slug.YAML_SYNTAX:
        lines[found.place.line - 1] = re.sub(r"\w+\[\w+\]", hint, line)
    else:
        lines[found.place.line - 1] = f"{line[:begin]}{hint}{line[end:]}"
    read_model("\n".join(lines))


SUMS = """behavior_model: sums
types: {cell: [c1, c2]}
variables: {a: {domain: 0..2, initial: 0}, "b[cell]": {domain: 0..2, initial: 0}}
operations: {"go[x in cell]": {pre: {g: GUARD}, post: {g: true, a: [a <- 0]}}}
"""


@pytest.mark.parametrize(
    ("guard", "begin"),
    [
        ("a - a < 3", "a"),
        ("a == 1 && 5 > a + b.x", "5"),
        ("a - b.x != 8", "a"),
        ("a - b.x > -3", "a"),
        ("max(a, b.x) <= 9", "max"),
    ],
)
def test_a_sum_whose_comparison_always_holds_is_one_warning(guard: str, begin: str) -> None:
    model, places = read_located(SUMS.replace("GUARD", f"'{guard}'"), "model")
    assert len(model.operations) == 2
    (warning,) = places.warnings
    assert (warning.slug, warning.severity) == (Slug.SUM_ALWAYS_HOLDS, Severity.WARNING)
    assert (warning.source_line or "")[warning.place.column - 1 :].startswith(begin)
    assert "c1" not in warning.message


@pytest.mark.parametrize("guard", ["a - a >= 3", "5 < a + b.x", "a - b.x == 8", "a - b.x < -3", "max(a, b.x) > 9"])
def test_a_sum_whose_comparison_can_never_hold_is_an_error(guard: str) -> None:
    with pytest.raises(InputError) as raised:
        read_model(SUMS.replace("GUARD", f"'{guard}'"))
    assert [each.slug for each in raised.value.diagnostics] == [Slug.VALUE_OUTSIDE_DOMAIN]


@pytest.mark.parametrize("guard", ["a - a <= 2", "a + b.x < 4", "a - b.x != 1"])
def test_a_sum_compared_with_one_of_its_values_is_good(guard: str) -> None:
    assert read_located(SUMS.replace("GUARD", f"'{guard}'"), "model")[1].warnings == ()
