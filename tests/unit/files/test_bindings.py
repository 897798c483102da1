"""Bindings: beside the model and in it; what they mean, and that they are no part of what a model is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from msgspec.structs import replace
from ruamel.yaml import YAML

from scbm.files import bindings_schema, digest_of, load_bindings, read_bindings, read_model, write_model
from scbm.files.codec.binding_keys import RosKeys
from scbm.model import (
    SET_BOOL,
    TRIGGER,
    BehaviorModel,
    Binding,
    Diagnostic,
    FieldType,
    InputError,
    Interval,
    MeasuredTopic,
    MessageType,
    Reading,
    Reference,
    Resource,
    Scalar,
    ServiceCall,
    ServiceChoice,
    ServiceType,
    Slug,
    TopicPair,
    Value,
    ValueKind,
    Variable,
)
from support.models import scan_cell
from support.strings import CHARACTERS, matching
from support.wording import Wording

MODEL = read_model("""
behavior_model: cell
variables:
  command: {domain: [none, scan, light], initial: none}
  shelf: {domain: -5..300, initial: 0}
  lit: {domain: bool, initial: false}
  zone: {domain: [near, far], initial: near}
resources:
  scanner:
    request: [command, shelf, lit]
    measures: [zone, shelf, lit]
    ros: {topics: {request: /scanner/request, reply: /scanner/reply}}
  arm: {request: [lit]}
operations: {}
""")

RIGHT = """
bindings_of: cell
resources:
  scanner:
    services:
      command:
        scan: {name: /scanner/scan, type: std_srvs/srv/Trigger}
        light:
          name: /scanner/light
          type: {name: my_robot/srv/Light, request: {on: bool, level: float32}, response: {code: int8, left: float64}}
          request: {on: lit, level: 0.5}
          succeeded: {code: 0}
          measured: {zone: {field: left, ranges: {far: 0.5..}}, shelf: code}
    measured:
      zone: {topic: /scanner/zone, type: std_msgs/msg/String, values: {CLOSE: near}}
"""


def resource(model: BehaviorModel, name: str) -> Resource:
    return next(resource for resource in model.resources if resource.name == name)


def diagnostics_of(text: str, model: BehaviorModel = MODEL) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        read_bindings(text, model, "drivers.yaml")
    return raised.value.diagnostics


# what they mean


def test_a_file_of_bindings_replaces_those_that_it_names_and_keeps_the_others() -> None:
    bound = read_bindings("bindings_of: cell\nresources: {arm: {topics: {request: /a, reply: /b}}}\n", MODEL)
    assert resource(bound, "arm").binding == Binding(TopicPair("/a", "/b"))
    assert resource(bound, "scanner").binding == Binding(TopicPair("/scanner/request", "/scanner/reply"))
    assert replace(bound, resources=MODEL.resources) == MODEL


def test_services_chosen_by_a_variable() -> None:
    kind = ServiceType(
        "my_robot/srv/Light",
        (("on", FieldType.BOOL), ("level", FieldType.FLOAT32)),
        (("code", FieldType.INT8), ("left", FieldType.FLOAT64)),
    )
    light = ServiceCall(
        "/scanner/light",
        kind,
        (("on", Reference("lit")), ("level", 0.5)),
        (("code", 0),),
        (("left", Reading("zone", (("far", Interval(0.5, None)),))), ("code", Reading("shelf"))),
    )
    scan = ServiceCall("/scanner/scan", TRIGGER, (), (("success", True),))
    assert resource(read_bindings(RIGHT, MODEL), "scanner").binding == Binding(
        ServiceChoice("command", (("scan", scan), ("light", light))),
        (MeasuredTopic("/scanner/zone", MessageType.STRING, Reading("zone", texts=(("CLOSE", "near"),))),),
    )


def test_fields_are_called_in_the_order_of_their_type_and_not_of_what_is_written() -> None:
    turned = RIGHT.replace("{on: lit, level: 0.5}", "{level: 0.5, on: lit}")
    assert read_bindings(turned, MODEL) == read_bindings(RIGHT, MODEL)


def test_a_text_that_is_the_name_of_a_variable_is_that_variable_and_any_other_is_itself() -> None:
    text = """
bindings_of: cell
resources:
  scanner:
    service:
      name: /say
      type: {name: p/srv/Say, request: {a: string, b: string, c: float64, d: int16}, response: {success: bool}}
      request: {a: command, b: near, c: shelf, d: shelf}
"""
    requests = getattr(resource(read_bindings(text, MODEL), "scanner").binding, "requests", None)
    assert isinstance(requests, ServiceCall)
    assert requests.request == (
        ("a", Reference("command")),
        ("b", "near"),
        ("c", Reference("shelf")),
        ("d", Reference("shelf")),
    )


@pytest.mark.parametrize(("written", "succeeded"), [("{}", ()), ("{success: false}", (("success", False),))])
def test_what_a_response_must_contain_can_be_written(written: str, succeeded: tuple[tuple[str, Scalar], ...]) -> None:
    service = f"{{name: /scan, type: std_srvs/srv/Trigger, succeeded: {written}}}"
    bound = read_bindings(f"bindings_of: cell\nresources: {{arm: {{service: {service}}}}}\n", MODEL)
    assert resource(bound, "arm").binding == Binding(ServiceCall("/scan", TRIGGER, (), succeeded))


def test_whole_numbers_keep_all_their_digits_and_numbers_of_topics_of_floats_are_floats() -> None:
    text = """
bindings_of: cell
resources:
  scanner:
    topics: {request: /a, reply: /b}
    measured:
      zone: {topic: /c, type: std_msgs/msg/Int64, ranges: {near: ..9007199254740993, far: +9007199254740993..}}
      shelf: {topic: /d, type: std_msgs/msg/Float64, ranges: {-5: "-1.5e-3 .. 1", 300: 1 ..}}
"""
    binding = resource(read_bindings(text, MODEL), "scanner").binding
    assert binding is not None
    zone, shelf = (measured.reading.ranges for measured in binding.measured)
    assert zone == (("near", Interval(None, 9007199254740993)), ("far", Interval(9007199254740993, None)))
    assert shelf == ((-5, Interval(-0.0015, 1.0)), (300, Interval(1.0, None)))
    assert type(zone[0][1].high) is int
    assert type(shelf[0][1].high) is float


@pytest.mark.parametrize(
    ("written", "is_best_effort"), [("", False), (", best_effort: false", False), (", best_effort: true", True)]
)
def test_a_measured_topic_says_whether_best_effort_is_enough(written: str, *, is_best_effort: bool) -> None:
    topic = f"{{topic: /zone, type: std_msgs/msg/String{written}}}"
    scanner = f"{{topics: {{request: /a, reply: /b}}, measured: {{zone: {topic}}}}}"
    text = f"bindings_of: cell\nresources: {{scanner: {scanner}}}\n"
    binding = resource(read_bindings(text, MODEL), "scanner").binding
    assert binding is not None
    assert [measured.is_best_effort for measured in binding.measured] == [is_best_effort]


def test_bindings_are_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "drivers.yaml"
    path.write_text(RIGHT, encoding="utf-8")
    assert load_bindings(path, MODEL) == read_bindings(RIGHT, MODEL)
    with pytest.raises(InputError) as raised:
        load_bindings(tmp_path / "driver.yaml", MODEL)
    assert [diagnostic.slug for diagnostic in raised.value.diagnostics] == [Slug.FILE_MISSING]


def test_the_bindings_of_the_documentation_are_bindings_of_its_model() -> None:
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "bind-drivers.md").read_text(encoding="utf-8")
    blocks = [block.partition("```")[0] for block in page.split("```yaml\n")[1:]]
    (model,) = (block for block in blocks if block.startswith("# model: picking\n"))
    (beside,) = (block for block in blocks if block.startswith("# file: laboratory.yaml\n"))
    bound = read_bindings(beside, read_model(model))
    ways = [type(getattr(resource.binding, "requests", None)) for resource in bound.resources]
    assert ways == [ServiceCall, TopicPair, TopicPair, type(None)]


# what is wrong with a file


def test_all_that_is_wrong_is_reported_at_once_each_at_its_place(wording: Wording) -> None:
    text = """bindings_of: cell
resources:
  scaner: {topics: {request: /a, reply: /b}}
  scanner:
    service: {name: scan, type: std_srvs/srv/Triger}
    measured: {zone: {topic: /zone, type: std_msgs/msg/Float64, ranges: {near: ..0.5, far: 0.4..}}}
  arm: {topic: {request: /a, reply: /b}}
more: 1
"""
    problems = [(d.place.line, d.place.column, d.slug, d.remedy) for d in diagnostics_of(text)]
    assert [(line, slug) for line, _, slug, _ in problems] == [
        (3, Slug.UNKNOWN_RESOURCE),
        (5, Slug.BAD_ROS_NAME),
        (5, Slug.BAD_ROS_TYPE),
        (6, Slug.BAD_RANGE),
        (7, Slug.UNKNOWN_KEY),
        (8, Slug.UNKNOWN_KEY),
    ]
    assert problems[0][1:3] == (3, Slug.UNKNOWN_RESOURCE)
    wording(problems[0][3])
    assert problems[3][1] == text.splitlines()[5].index("0.4..") + 1


@pytest.mark.parametrize(
    ("text", "slug"),
    [
        ("bindings_of: cel\nresources: {gripper: {topics: {request: a, reply: /b}}}\n", Slug.BAD_BINDING),
        (RIGHT.replace("of: cell", "of: cel"), Slug.BAD_BINDING),
        (RIGHT.replace("bindings_of: cell\n", ""), Slug.MISSING_KEY),
        ("bindings_of: cell\n", Slug.MISSING_KEY),
        ("bindings_of: [cell]\nresources: {}\n", Slug.WRONG_SHAPE),
        ("bindings_of: cell\nresources: {arm: {}}\n", Slug.BAD_BINDING),
        ("behavior_model: cell\n", Slug.WRONG_SHAPE),
        ("case: first\n", Slug.WRONG_SHAPE),
        ("- a\n", Slug.WRONG_SHAPE),
        ("", Slug.FILE_EMPTY),
        ("bindings_of: cell\nresources: {arm: {[a]: 1}}\n", Slug.WRONG_SHAPE),
        (RIGHT.replace("level: float32", "level: uint16").replace("level: 0.5", "level: shelf"), Slug.WRONG_TYPE),
        (RIGHT.replace("msg/String,", "msg/String, best_effort: 1,"), Slug.WRONG_TYPE),
        (RIGHT.replace("msg/String,", "msg/String, best_effort: [true],"), Slug.WRONG_SHAPE),
        (
            RIGHT
            + "      shelf: {topic: /scanner/zone, type: std_msgs/msg/String, best_effort: true, values: {LOW: 0}}\n",
            Slug.BAD_BINDING,
        ),
        (
            "bindings_of: cell\nresources: {arm: {measured: {lit: {topic: /x, type: std_msgs/msg/Bool}}}}\n",
            Slug.UNKNOWN_VARIABLE,
        ),
    ],
)
def test_one_mistake_is_reported_once(text: str, slug: Slug, wording: Wording) -> None:
    (diagnostic,) = diagnostics_of(text)
    assert diagnostic.slug is slug
    wording(diagnostic.message)


def test_a_wrong_name_of_the_model_does_not_hide_what_else_is_wrong() -> None:
    text = RIGHT.replace("of: cell", "of: cel").replace("name: /scanner/scan", "name: scan") + "  arn: {}\n"
    found = diagnostics_of(text)
    assert [d.slug for d in found] == [Slug.BAD_BINDING, Slug.BAD_ROS_NAME, Slug.UNKNOWN_RESOURCE]
    assert [(d.remedy or "``").split("`")[1] for d in found] == ["", "/scan", "arm"]


def test_a_variable_that_cannot_choose_does_not_hide_what_is_wrong_with_services() -> None:
    text = RIGHT.replace("      command:", "      comand:").replace("type: std_srvs/srv/Trigger", "type: Trigger")
    assert [d.slug for d in diagnostics_of(text)] == [Slug.UNKNOWN_VARIABLE, Slug.BAD_ROS_TYPE]
    text = RIGHT.replace("type: std_srvs/srv/Trigger", "type: Trigger").replace(
        "      command:", "      lit: {true: {name: on, type: std_srvs/srv/Trigger}}\n      command:"
    )
    assert [d.slug for d in diagnostics_of(text)] == [Slug.BAD_BINDING, Slug.BAD_ROS_NAME, Slug.BAD_ROS_TYPE]


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("name: /scanner/scan", "name: /scbm/cell/scanner/request"),
        ("topic: /scanner/zone", "topic: /scbm/zone"),
        ("topic: /scanner/zone", "topic: /scbm"),
    ],
)
def test_names_of_the_nodes_of_cells_are_no_drivers(right: str, wrong: str, wording: Wording) -> None:
    text, name = RIGHT.replace(right, wrong), wrong.partition(" ")[2]
    (problems,) = diagnostics_of(text)
    assert problems.slug is Slug.BAD_BINDING
    wording((problems.message, problems.remedy))
    assert text.splitlines()[problems.place.line - 1][problems.place.column - 1 :].startswith(name)


def test_names_that_only_look_like_those_of_the_nodes_of_cells_are_fine() -> None:
    names = "{topics: {request: /scbm_cell/request, reply: /cell/scbm/reply}}"
    read_bindings(f"bindings_of: cell\nresources: {{arm: {names}}}\n", MODEL)


@pytest.mark.parametrize("name", ["class", "from", "self", "serialize", "guid", "seq"])
def test_fields_may_have_all_names_that_ros_2_allows(name: str) -> None:
    type_ = f"type: {{name: some/srv/Odd, request: {{{name}: bool}}, response: {{}}}}"
    service = f"{{name: /odd, {type_}, request: {{{name}: true}}, succeeded: {{}}}}"
    bound = read_bindings(f"bindings_of: cell\nresources: {{arm: {{service: {service}}}}}\n", MODEL)
    type_of_fields = ServiceType("some/srv/Odd", ((name, FieldType.BOOL),), ())
    call = ServiceCall("/odd", type_of_fields, ((name, True),), (), ())
    assert resource(bound, "arm").binding == Binding(call, ())


def test_a_model_file_is_no_file_of_bindings_and_the_other_way_round(wording: Wording) -> None:
    with pytest.raises(InputError) as raised:
        read_model(RIGHT)
    assert [d.slug for d in raised.value.diagnostics] == [Slug.WRONG_SHAPE]
    wording(d.message for d in raised.value.diagnostics)


def test_bindings_of_a_file_do_not_contradict_those_that_the_model_keeps(wording: Wording) -> None:
    measuring = replace(MODEL, resources=(MODEL.resources[0], Resource("arm", (), ("lit",))))
    arm = "arm: {measured: {lit: {topic: /scanner/reply, type: std_msgs/msg/Bool}}}"
    (problems,) = diagnostics_of(f"bindings_of: cell\nresources: {{{arm}}}\n", measuring)
    assert problems.slug is Slug.TYPES_DIFFER
    wording(problems.message)
    scanner = "scanner: {topics: {request: /a, reply: /b}}"
    read_bindings(f"bindings_of: cell\nresources: {{{arm}, {scanner}}}\n", measuring)  # that one is replaced


def test_topics_of_requests_are_not_shared_with_a_resource_that_keeps_its_own(wording: Wording) -> None:
    arm = "arm: {topics: {request: /arm/request, reply: /scanner/reply}}"
    (problems,) = diagnostics_of(f"bindings_of: cell\nresources: {{{arm}}}\n", MODEL)
    assert problems.slug is Slug.BAD_BINDING
    wording(problems.message)
    scanner = "scanner: {topics: {request: /a, reply: /b}}"
    read_bindings(f"bindings_of: cell\nresources: {{{arm}, {scanner}}}\n", MODEL)  # that one is replaced


def test_measured_topics_and_services_may_be_shared() -> None:
    service = "service: {name: /robot, type: std_srvs/srv/Trigger}"
    measured = "measured: {lit: {topic: /lit, type: std_msgs/msg/String, values: {ON: true}}}"
    both = replace(MODEL, resources=(MODEL.resources[0], Resource("arm", ("lit",), ("lit",))))
    bound = read_bindings(
        f"bindings_of: cell\nresources: {{scanner: {{{service}, {measured}}}, arm: {{{service}, {measured}}}}}\n", both
    )
    first, second = (resource.binding for resource in bound.resources)
    assert first == second


def test_a_type_of_services_has_the_fields_that_it_has_in_the_model(wording: Wording) -> None:
    bound = read_bindings(RIGHT, MODEL)
    service = "{name: /x, type: {name: my_robot/srv/Light, response: {success: bool}}}"
    (problems,) = diagnostics_of(f"bindings_of: cell\nresources: {{arm: {{service: {service}}}}}\n", bound)
    assert problems.slug is Slug.TYPES_DIFFER
    wording(problems.message)


def test_what_actions_send_is_known_of_a_model_that_is_already_built() -> None:
    model = scan_cell()
    text = f"""bindings_of: {model.name}
resources:
  scan: {{services: {{scan_command: {{}}}}}}
"""
    (problems,) = diagnostics_of(text, model)
    assert (problems.slug, problems.place.line) == (Slug.UNBOUND_REQUEST, 3)


# a model with bindings is the same model


def test_bindings_do_not_change_what_distinguishes_models() -> None:
    without = replace(MODEL, resources=tuple(replace(r, binding=None) for r in MODEL.resources))
    assert without != MODEL
    assert write_model(MODEL) != write_model(without)
    assert digest_of(MODEL) == digest_of(without) == digest_of(read_bindings(RIGHT, MODEL))
    assert digest_of(MODEL) != digest_of(replace(MODEL, name="other"))
    assert digest_of(MODEL) != digest_of(replace(MODEL, resources=MODEL.resources[::-1]))


# round trip

VARIABLES = {variable.name: variable for variable in MODEL.variables}
SCANNER = resource(MODEL, "scanner")
names = matching(r"(/[A-Za-z]([A-Za-z0-9]|_[a-z]){0,5}){1,3}")
floats = st.floats(allow_nan=False, allow_infinity=False)
texts = st.text(CHARACTERS, max_size=6)


def literals(kind: FieldType) -> st.SearchStrategy[Scalar]:
    match kind:
        case FieldType.BOOL:
            return st.booleans()
        case FieldType.STRING:
            return texts.filter(lambda text: text not in MODEL.running_space)
        case FieldType.FLOAT32 | FieldType.FLOAT64:
            return st.floats(width=32 if kind is FieldType.FLOAT32 else 64, allow_nan=False, allow_infinity=False)
        case _:
            return st.integers(kind.integers[0], kind.integers[-1])


def arguments(kind: FieldType) -> st.SearchStrategy[Scalar | Reference]:
    carried = [VARIABLES[name] for name in SCANNER.request]
    same = [v for v in carried if v.domain.kind is kind.kind or (kind.is_float and v.domain.kind is ValueKind.INTEGER)]
    fitting = [v.name for v in same if v.domain.kind is not ValueKind.INTEGER or all(map(kind.holds, v.domain.values))]
    return st.one_of(literals(kind), *([st.sampled_from(fitting).map(Reference)] if fitting else []))


@st.composite
def intervals(draw: st.DrawFn, kind: FieldType, count: int) -> list[Interval]:
    numbers: st.SearchStrategy[Any] = floats if kind.is_float else st.integers(-(10**15), 10**15)
    ends = sorted(draw(st.lists(numbers, min_size=2 * count, max_size=2 * count, unique=True)))
    low, high = draw(st.booleans()), draw(st.booleans())
    bounds: list[Any] = [None if low else ends[0], *ends[1:-1], None if high else ends[-1]]
    return [Interval(*pair) for pair in zip(bounds[::2], bounds[1::2], strict=True)]


@st.composite
def readings(draw: st.DrawFn, variable: Variable, kind: FieldType) -> Reading:
    if kind is FieldType.BOOL or (kind.kind is variable.domain.kind and draw(st.booleans())):
        return Reading(variable.name)
    values: list[Value] = draw(st.lists(st.sampled_from(variable.domain.values), min_size=1, max_size=3, unique=True))
    if kind is FieldType.STRING:
        keys = draw(st.lists(texts, min_size=1, max_size=4, unique=True))
        return Reading(variable.name, texts=tuple((key, draw(st.sampled_from(values))) for key in keys))
    return Reading(variable.name, tuple(zip(values, draw(intervals(kind, len(values))), strict=True)))


def readable(variable: Variable, kinds: list[FieldType]) -> list[FieldType]:
    """The types whose data can be read into a variable."""
    return [kind for kind in kinds if kind is not FieldType.BOOL or variable.domain.kind is ValueKind.BOOLEAN]


@st.composite
def calls(draw: st.DrawFn) -> ServiceCall:
    name, index = draw(names), draw(st.integers(0, 10**6))
    fields = st.lists(st.tuples(matching(r"[a-z](_?[a-z0-9]){0,4}"), st.sampled_from(FieldType)))
    kinds = [tuple(draw(fields.map(dict)).items()) for _ in range(2)]
    described = ServiceType(f"p/srv/T{index}", *kinds)
    kind = draw(st.sampled_from([TRIGGER, SET_BOOL, described]))
    request = tuple((field, draw(arguments(type_))) for field, type_ in kind.request)
    comparable = [(field, type_) for field, type_ in kind.response if not type_.is_float]
    succeeded = tuple((field, draw(literals(type_))) for field, type_ in comparable if draw(st.booleans()))
    measured = []
    for measures in SCANNER.measures:
        possible = [pair for pair in kind.response if pair[1] in readable(VARIABLES[measures], list(FieldType))]
        is_read = draw(st.booleans())
        if possible and is_read:
            field, type_ = draw(st.sampled_from(possible))
            measured.append((field, draw(readings(VARIABLES[measures], type_))))
    return ServiceCall(f"{name}{index}", kind, request, succeeded, tuple(measured))


@st.composite
def bindings(draw: st.DrawFn) -> Binding:
    measured = []
    for index, name in enumerate(SCANNER.measures):
        if draw(st.booleans()):
            kinds = [kind for kind in MessageType if kind.data in readable(VARIABLES[name], [kind.data])]
            kind = draw(st.sampled_from(kinds))
            topic = f"{draw(names)}/measured{index}"
            reading = draw(readings(VARIABLES[name], kind.data))
            measured.append(MeasuredTopic(topic, kind, reading, draw(st.booleans())))
    variable = VARIABLES[draw(st.sampled_from(SCANNER.request))]
    values = st.lists(st.sampled_from(variable.domain.values), min_size=1, max_size=3, unique=True)
    choice = values.flatmap(
        lambda chosen: st.tuples(*(st.tuples(st.just(value), calls()) for value in chosen)).map(
            lambda pairs: ServiceChoice(variable.name, pairs)
        )
    )
    pair = names.map(lambda name: TopicPair(f"{name}/request", f"{name}/reply"))
    ways: list[st.SearchStrategy[Any]] = [calls(), choice, pair, *([st.none()] if measured else [])]
    return Binding(draw(st.one_of(ways)), tuple(measured))


def is_one_type_each(binding: Binding) -> bool:
    kinds: dict[str, ServiceType] = {}
    named: dict[str, ServiceType] = {}
    return all(
        kinds.setdefault(call.type.name, call.type) == call.type and named.setdefault(call.name, call.type) == call.type
        for call in binding.calls
    )


@pytest.mark.slow
@given(bindings().filter(is_one_type_each))
def test_what_is_written_is_read_as_the_same(binding: Binding) -> None:
    model = replace(MODEL, resources=(replace(SCANNER, binding=binding), MODEL.resources[1]))
    again = read_model(write_model(model))
    assert again == model
    assert write_model(again) == write_model(model)
    assert repr(again.resources) == repr(model.resources)  # `1 == 1.0 == True` to Python
    data = {"bindings_of": "cell", "resources": {"scanner": RosKeys.write(binding)}}
    assert list(Draft202012Validator(bindings_schema()).iter_errors(data)) == []


@pytest.mark.parametrize(
    "text",
    [":0", "- a", "#", "a: b", "\n", " ", "true", "null", "5", "1e3", "", "'", '"', "\\", "{", "*a", "!a", "é", "<<"],
)
def test_any_text_that_a_driver_may_say_or_want_is_written_as_it_is(text: str) -> None:
    kind = ServiceType("p/srv/Say", (("text", FieldType.STRING),), (("text", FieldType.STRING),))
    reading = Reading("zone", texts=((text, "near"),))
    call = ServiceCall("/say", kind, (("text", text),), (("text", text),), (("text", reading),))
    model = replace(MODEL, resources=(replace(SCANNER, binding=Binding(call)), MODEL.resources[1]))
    assert read_model(write_model(model)) == model


# the schema


def faults_of(text: str) -> list[str]:
    data = YAML(typ="safe", pure=True).load(text)
    return [fault.message for fault in Draft202012Validator(bindings_schema()).iter_errors(data)]


def test_the_schema_of_bindings_is_one() -> None:
    Draft202012Validator.check_schema(bindings_schema())
    assert list(bindings_schema()["properties"]) == ["bindings_of", "resources"]
    assert "null" not in str(bindings_schema()).replace("None", "null")
    for name, kind in bindings_schema()["$defs"].items():
        assert kind["additionalProperties"] is False, name
        assert kind["description"], name


def test_the_bindings_that_the_mistakes_are_made_in_satisfy_the_schema() -> None:
    assert faults_of(RIGHT) == []


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("bindings_of: cell", ""),
        ("services:", "service:"),
        ("name: /scanner/scan,", ""),
        ("name: /scanner/scan,", "name: scan,"),
        ("name: /scanner/scan,", "name: /scbm/scan,"),
        ("std_srvs/srv/Trigger", "std_srvs/srv/Triger"),
        ("level: float32", "level: float"),
        ("level: 0.5", "level: [0.5]"),
        ("0.5..", "0.5"),
        ("std_msgs/msg/String", "string"),
        ("{CLOSE: near}", "near"),
        ("field: left", "fields: left"),
    ],
)
def test_a_typical_mistake_does_not_satisfy_the_schema(right: str, wrong: str) -> None:
    assert RIGHT.count(right) == 1
    assert faults_of(RIGHT.replace(right, wrong))
