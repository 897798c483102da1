"""Handshakes: a request that is said once means exactly the transitions that people wrote for it before."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Obligations
from scbm.cases.trace import End, write_trace
from scbm.files import digest_of, load_model, read_located, read_model, write_model
from scbm.model import BehaviorModel, InputError
from scbm.testing import Campaign, RandomCases, Tester

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"

HEAD = """behavior_model: cell
variables: {lamp: {domain: bool, initial: false}, n: {domain: 0..3, initial: 0}}
resources:
  lamps:
    simulation: {latency: 1 s}
"""
"""Operations begin in line 6."""


@pytest.fixture(scope="module")
def long() -> BehaviorModel:
    return load_model(EXAMPLE / "after.yaml")


@pytest.fixture(scope="module")
def short() -> BehaviorModel:
    return load_model(EXAMPLE / "handshakes.yaml")


def with_order_of(model: BehaviorModel, other: BehaviorModel) -> BehaviorModel:
    """The model with its automatic transitions in the order of another one."""
    by_name = {transition.name: transition for transition in model.automatic_transitions}
    return replace(model, automatic_transitions=tuple(by_name[each.name] for each in other.automatic_transitions))


def test_the_example_of_the_paper_fits_180_lines_and_is_the_same_model(
    short: BehaviorModel, long: BehaviorModel
) -> None:
    assert len((EXAMPLE / "handshakes.yaml").read_text().splitlines()) <= 180
    generated = [f"{resource.name}_failed" for resource in long.resources]
    written = ["abort_if_scanning_timedout_5_times", "clear_scan_timeouts"]
    assert [transition.name for transition in short.automatic_transitions] == [*written, *generated]
    assert with_order_of(short, long) == long
    assert digest_of(with_order_of(short, long)) == digest_of(long)


@pytest.mark.parametrize("written", ["n + 1", "(n + 1)", "(n) + 1", "((n)) + (1)"])
def test_a_command_can_be_a_sum(written: str) -> None:
    operation = f"operations: {{o: {{request: lamps, guard: (n) + 1 < 3, with: {{n: {written}}}}}}}\n"
    head = HEAD.replace("simulation", "request: [n]\n    simulation")
    before = read_model(head + operation).operation("o").pre
    assert [str(action) for action in before.a] == ["lamps_req_trigger <- true", "n <- n + 1"]


def test_the_example_of_the_paper_keeps_obligations_plans_traces_and_figures(
    short: BehaviorModel, long: BehaviorModel
) -> None:
    names = [sorted(str(each) for each in Obligations.of(model) if each.counts) for model in (short, long)]
    assert len(names[0]) == 86
    assert names[0] == names[1]
    cases = list(RandomCases(long).first(12, seed=3))
    assert cases == list(RandomCases(short).first(12, seed=3))
    runs = [[*map(Tester(model).execute, cases)] for model in (short, long)]
    assert [write_trace(run.trace) for run in runs[0]] == [write_trace(run.trace) for run in runs[1]]
    figures = [
        Campaign.of(model, [run.result for run in of_model]).coverage.figure
        for model, of_model in zip((short, long), runs, strict=True)
    ]
    assert figures[0] == figures[1]


def test_a_written_out_model_means_the_same(short: BehaviorModel) -> None:
    assert read_model(write_model(short)) == short
    assert digest_of(read_model(write_model(short))) == digest_of(short)


LAMP = """operations:
  light:
    request: lamps
    # said once
    guard: lamp == false
      && n < 3
    effects:
      - lamp <- true
      - n <- 0
    deadline: 1 s
    on_timeout: [n += 1]
automatic_transitions:
  dim: {g: n == 3, a: [n <- 0]}
"""


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("operations light", (7, 8, 10, 11, 12, 13, 14, 15, 16)),
        ("operations light pre g", (8, 10, 11)),
        ("operations light pre a", (8,)),
        ("operations light post gr", (8,)),
        ("operations light post a", (8, 12, 13, 14)),
        ("operations light deadline", (15,)),
        ("operations light timedout", (8, 16)),
        ("automatic_transitions lamps_failed", (4,)),
        ("automatic_transitions dim", (18,)),
    ],
)
def test_the_lines_of_a_transition_are_those_of_the_keys_that_stand_for_it(
    path: str, expected: tuple[int, ...]
) -> None:
    _, places = read_located(HEAD + LAMP)
    assert places.lines(tuple(path.split(" "))) == expected
    assert places.find(tuple(path.split(" ")))[0].line in expected


def test_an_order_of_a_resource_decides_the_order_of_its_transition() -> None:
    text = HEAD + "  door: {}\noperations:\n  open: {request: door}\n  light: {request: lamps}\n"
    assert [each.name for each in read_model(text).automatic_transitions] == ["lamps_failed", "door_failed"]


@pytest.mark.parametrize("section", ["[]", "", "dim"])
def test_automatic_transitions_of_a_wrong_shape_have_one_error(section: str) -> None:
    with pytest.raises(InputError) as raised:
        read_model(HEAD + "operations:\n  light: {request: lamps}\nautomatic_transitions: " + section)
    (found,) = raised.value.diagnostics
    assert found.place.line == 8


def test_operations_of_a_wrong_shape_have_their_errors() -> None:
    for operations in ("[]", "{light: [request]}", "{light: {request: }}", "{light: {request: {lamps: lamps}}}"):
        with pytest.raises(InputError) as raised:
            read_model(f"{HEAD}operations: {operations}")
        assert [found.place.line for found in raised.value.diagnostics] == [6]


OBJECTS = """behavior_model: cell
types: {robot: [r1, r2]}
variables: {"held[robot]": {domain: bool, initial: false}}
resources: {"arm[r in robot]": {}}
operations:
  hold[r in robot]: {request: "arm[r]", guard: "held[r] == false", effects: ["held[r] <- true"]}
"""


def test_handshakes_of_objects_have_one_failure_for_each_object() -> None:
    model = read_model(OBJECTS)
    assert [each.name for each in model.automatic_transitions] == ["arm_failed.r1", "arm_failed.r2"]
    assert model.lifted_name("automatic_transitions", "arm_failed.r2") == "arm_failed"
    assert str(model.operations[1].pre.g).startswith("arm.r2_req_state == initial && arm.r2_req_trigger == false && ")


COUNTING = """behavior_model: counting_camera
variables: {n: {domain: 0..3, initial: 0}, sharp: {domain: bool, initial: true}, done: {domain: bool, initial: false}}
resources: {camera: {measures: {n: [3, 0, 1, 2], sharp: [true, false]}, simulation: {latency: 1 s}}}
operations:
  count: {request: camera, deadline: 5 s, guard: done == false, %s, effects: [done <- true]}
automatic_transitions: {%s}
goals: {three: done == true}
"""
OTHERWISE = (
    "count_otherwise: {g: count.state == executing && camera_req_state == succeeded && %s, "
    "a: [count.state <- failed, camera_req_state <- initial, camera_req_trigger <- false]}"
)


@pytest.mark.parametrize(
    ("assumes", "condition", "effects", "otherwise"),
    [
        ("{n: 3}", "n == 3", "n <- 3", "n != 3"),
        ("{n: 3, sharp: true}", "n == 3 && sharp == true", "n <- 3, sharp <- true", "(n != 3 || sharp != true)"),
        ("{sharp: done}", "sharp == done", "sharp <- done", "sharp != done"),
    ],
)
def test_an_assumption_is_a_condition_an_effect_and_a_transition_that_fails_the_operation(
    assumes: str, condition: str, effects: str, otherwise: str
) -> None:
    short = read_model(COUNTING % (f"assumes: {assumes}", ""))
    pattern = f"post: {{gr: {condition}, a: [{effects}]}}"
    long = read_model(COUNTING % (pattern, OTHERWISE % otherwise))
    order = [action.target for action in long.operations[0].post.a]
    by_target = {action.target: action for action in short.operations[0].post.a}
    post = replace(short.operations[0].post, a=tuple(by_target[name] for name in order))
    same = replace(short, operations=(replace(short.operations[0], post=post),))
    assert with_order_of(same, long) == long


def test_replies_that_differ_from_the_assumption_fail_the_operation_and_a_new_plan_follows() -> None:
    model = read_model(COUNTING % ("assumes: {n: 3}", ""))
    campaign = Campaign.of(model, Tester(model).results(RandomCases(model).first(20, 1)))
    assert [result.verdict.end for result in campaign.results] == [End.REACHED] * 20
    missed = [str(each) for aspect in Aspect for each in campaign.coverage.missed(aspect)]
    assert not {"count/failed", "automatic/count_otherwise"}.intersection(missed)


def test_a_transition_by_hand_replaces_the_one_for_an_assumption() -> None:
    by_hand = "count_otherwise: {g: count.state == executing && n != 3, a: [count.state <- failed, done <- true]}"
    model = read_model(COUNTING % ("assumes: {n: 3}", by_hand))
    assert [str(each.a[-1]) for each in model.automatic_transitions if each.name == "count_otherwise"] == [
        "done <- true"
    ]


def test_assumptions_of_objects_have_one_transition_for_each_object() -> None:
    text = OBJECTS.replace('"arm[r in robot]": {}', '"arm[r in robot]": {measures: {"held[r]": any}}')
    text = text.replace('effects: ["held[r] <- true"]', 'assumes: {"held[r]": true}')
    model = read_model(text)
    assert [each.name for each in model.automatic_transitions][2:] == ["hold_otherwise.r1", "hold_otherwise.r2"]
    assert model.lifted_name("automatic_transitions", "hold_otherwise.r2") == "hold_otherwise"
    assert str(model.automatic_transitions[2].g) == (
        "hold.r1.state == executing && arm.r1_req_state == succeeded && held.r1 != true"
    )


def test_an_assumption_of_a_part_has_the_prefix_and_the_arguments_of_its_use(tmp_path: Path) -> None:
    (tmp_path / "eye.yaml").write_text(
        "part: eye\nparameters: {expected: {}}\nvariables: {seen: {domain: 0..3, initial: 0}}\n"
        "resources: {camera: {measures: [seen]}}\n"
        "operations: {look: {request: camera, assumes: {seen: expected}}}\n"
    )
    cell = tmp_path / "cell.yaml"
    cell.write_text(
        "behavior_model: cell\nparts: {left: {use: eye.yaml, with: {expected: 2}}}\nvariables: {}\noperations: {}\n"
    )
    model = load_model(cell)
    assert [each.name for each in model.automatic_transitions] == ["left.camera_failed", "left.look_otherwise"]
    assert str(model.operations[0].post.gr) == "left.camera_req_state == succeeded && left.seen == 2"


def test_a_lifted_failure_by_hand_replaces_those_of_all_objects() -> None:
    actions = "['current.state <- failed', 'arm[r]_req_state <- initial']"
    by_hand = f"  arm_failed[r in robot]: {{g: 'arm[r]_req_state == failed', a: {actions}}}\n"
    model = read_model(f"{OBJECTS}automatic_transitions:\n{by_hand}")
    assert [each.name for each in model.automatic_transitions] == ["arm_failed.r1", "arm_failed.r2"]
    assert all(len(each.a) == 2 for each in model.automatic_transitions)
