"""Bindings: beside the model and in it; what they mean, and that they are no part of what a model is."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from msgspec.structs import replace
from ruamel.yaml import YAML

from scbm.files import bindings_schema, digest_of, load_bindings, load_model, read_bindings, read_model, write_model
from scbm.model import BehaviorModel, Binding, Diagnostic, InputError, Reference, Resource, Slug
from scbm.nodes.bindings.ros_binding import (
    CallChoice,
    Interval,
    MeasuredTopic,
    RosBinding,
    ServiceCall,
    TopicPair,
    request_values,
)
from scbm.nodes.types.cdr import codec_of
from scbm.nodes.types.definitions import STRING, TRIGGER, Scalar
from scbm.nodes.types.field_paths import FieldPath
from scbm.nodes.types.interface_files import InterfaceFolder
from scbm.nodes.types.type_library import TypeLibrary
from support.models import scan_cell
from support.ros_types import SUCCESS, path_to, reading, trigger
from support.wording import Wording

MODEL_TEXT = """
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
"""
MODEL = read_model(MODEL_TEXT)

INTERFACES = Path(__file__).parents[3] / "models" / "interfaces"
"""A folder with the package `my_robot`."""

RIGHT = f"""
bindings_of: cell
interfaces: [{INTERFACES}]
resources:
  scanner:
    services:
      command:
        scan: {{name: /scanner/scan, type: std_srvs/srv/Trigger}}
        light:
          name: /scanner/light
          type: my_robot/srv/Light
          request: {{on: lit, level: 0.5}}
          succeeded: {{code: DONE}}
          measured: {{zone: {{field: left, ranges: {{far: 0.5..}}}}, shelf: code}}
    measured:
      zone: {{topic: /scanner/zone, type: std_msgs/msg/String, values: {{CLOSE: near}}}}
"""


def binding(model: BehaviorModel, name: str = "scanner") -> RosBinding:
    found = resource(model, name).binding
    assert isinstance(found, RosBinding)
    return found


def resource(model: BehaviorModel, name: str) -> Resource:
    return next(resource for resource in model.resources if resource.name == name)


def diagnostics_of(text: str, model: BehaviorModel = MODEL) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        read_bindings(text, model, "drivers.yaml")
    return raised.value.diagnostics


# what they mean


def test_a_file_of_bindings_replaces_those_that_it_names_and_keeps_the_others() -> None:
    bound = read_bindings("bindings_of: cell\nresources: {arm: {topics: {request: /a, reply: /b}}}\n", MODEL)
    assert resource(bound, "arm").binding == RosBinding({}, TopicPair("/a", "/b"))
    assert resource(bound, "scanner").binding == RosBinding({}, TopicPair("/scanner/request", "/scanner/reply"))
    assert replace(bound, resources=MODEL.resources) == MODEL


def test_services_chosen_by_a_variable() -> None:
    kind = TypeLibrary([InterfaceFolder.of(str(INTERFACES), Path())]).service("my_robot/srv/Light")
    light = ServiceCall(
        "/scanner/light",
        kind,
        ((path_to(kind.request, "on"), Reference("lit")), (path_to(kind.request, "level"), 0.5)),
        ((path_to(kind.response, "code"), 0),),
        (
            reading("zone", kind.response, "left", (("far", Interval(0.5, None)),)),
            reading("shelf", kind.response, "code"),
        ),
    )
    assert resource(read_bindings(RIGHT, MODEL), "scanner").binding == RosBinding(
        {},
        CallChoice("command", (("scan", trigger("/scanner/scan")), ("light", light))),
        (MeasuredTopic("/scanner/zone", STRING, reading("zone", meanings=(("CLOSE", "near"),))),),
    )


def service_of(text: str, kind: str = "Say", model: BehaviorModel = MODEL) -> ServiceCall:
    """Return the service of the scanner of a binding with these lines."""
    head = f"bindings_of: cell\ninterfaces: [{INTERFACES}]\nresources:\n  scanner:\n    service:\n"
    lines = [f"      {line}" for line in (f"name: /call\ntype: my_robot/srv/{kind}\n{text}").splitlines()]
    requests = binding(read_bindings(head + "\n".join(lines), model)).requests
    assert isinstance(requests, ServiceCall)
    return requests


def written_request(call: ServiceCall) -> dict[str, object]:
    return {str(path): content for path, content in call.request}


def test_a_text_that_is_the_name_of_a_variable_is_that_variable_and_any_other_is_itself() -> None:
    call = service_of("request: {a: command, b: near, c: shelf, d: shelf}")
    assert written_request(call) == {
        "a": Reference("command"),
        "b": "near",
        "c": Reference("shelf"),
        "d": Reference("shelf"),
    }
    assert written_request(service_of("request: {a: {text: command}, b: b, c: 0, d: 0}"))["a"] == "command"


def test_a_request_fills_nested_messages_lists_and_arrays() -> None:
    call = service_of(
        """request:
  pose.position.x: {variable: command, values: {none: 0, scan: 1.5, light: 2}}
  pose.orientation.w: 1
  names: [{text: shelf}, command]
  angles[0]: 0.5
  angles[1]: shelf
  id[3]: 7
succeeded: {code: 0, "path[0].position.y": 1}
""".replace(', "path[0].position.y": 1', ""),
        "Move",
    )
    values = request_values(call.request, {"command": "scan", "shelf": 3, "lit": True})
    assert values == {
        "pose": {"position": {"x": 1.5}, "orientation": {"w": 1.0}},
        "names": ["shelf", "scan"],
        "angles": [0.5, 3],
        "id": [None, None, None, 7],
    }
    assert codec_of(call.type.request).complete(values).id == b"\0\0\0\7"


def test_constants_are_written_by_name() -> None:
    battery = "{topic: /b, type: sensor_msgs/msg/BatteryState, field: power_supply_status, values: @}"
    text = "bindings_of: cell\nresources: {arm: {measured: {lit: @}}}\n".replace("@", battery)
    arm = replace(MODEL.resources[1], publishes=("lit",), request=())
    model = replace(MODEL, resources=(MODEL.resources[0], arm))
    meant = "{POWER_SUPPLY_STATUS_FULL: true, POWER_SUPPLY_STATUS_CHARGING: true, 2: false}"
    (measured,) = binding(read_bindings(text.replace("@", meant), model), "arm").measured
    assert measured.reading.meanings == ((4, True), (1, True), (2, False))
    assert (str(measured.reading.path), measured.reading.path.owner) == ("power_supply_status", measured.type)


@pytest.mark.parametrize(
    ("type_", "field"),
    [
        ("std_msgs/msg/Float32", ""),
        ("std_msgs/msg/Int8", ""),
        ("sensor_msgs/msg/Range", "field: range"),
        ("sensor_msgs/msg/JointState", 'field: "position[name=elbow]"'),
        ("geometry_msgs/msg/PoseStamped", "field: pose.position.x"),
    ],
)
def test_a_measured_topic_has_any_type_and_a_path(type_: str, field: str) -> None:
    topic = f"{{topic: /x, type: {type_}, ranges: {{near: ..1, far: 1..}}, {field}}}"
    scanner = f"{{topics: {{request: /a, reply: /b}}, measured: {{zone: {topic}}}}}"
    text = f"bindings_of: cell\nresources: {{scanner: {scanner}}}\n"
    (measured,) = binding(read_bindings(text, MODEL)).measured
    assert (measured.type.name, measured.reading.path.text in field or not field) == (type_, True)


@pytest.mark.parametrize(("written", "succeeded"), [("{}", ()), ("{success: false}", ((SUCCESS[0][0], False),))])
def test_what_a_response_must_contain_can_be_written(
    written: str, succeeded: tuple[tuple[FieldPath, Scalar], ...]
) -> None:
    service = f"{{name: /scan, type: std_srvs/srv/Trigger, succeeded: {written}}}"
    bound = read_bindings(f"bindings_of: cell\nresources: {{arm: {{service: {service}}}}}\n", MODEL)
    assert resource(bound, "arm").binding == RosBinding({}, ServiceCall("/scan", TRIGGER, (), succeeded))


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
    measured_topics = binding(read_bindings(text, MODEL)).measured
    zone, shelf = (measured.reading.ranges for measured in measured_topics)
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
    measured_topics = binding(read_bindings(text, MODEL)).measured
    assert [measured.is_best_effort for measured in measured_topics] == [is_best_effort]


def test_bindings_are_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "drivers.yaml"
    path.write_text(RIGHT, encoding="utf-8")
    assert load_bindings(path, MODEL) == read_bindings(RIGHT, MODEL)
    with pytest.raises(InputError) as raised:
        load_bindings(tmp_path / "driver.yaml", MODEL)
    assert [diagnostic.slug for diagnostic in raised.value.diagnostics] == [Slug.FILE_MISSING]


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
        (RIGHT.replace("on: lit", "on: shelf"), Slug.WRONG_TYPE),
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


def test_fields_may_have_all_names_that_ros_2_allows() -> None:
    names = ["class", "from", "self", "serialize", "guid", "seq"]
    fields = ", ".join(f"{name}: true" for name in names)
    call = service_of(f"request: {{{fields}}}\nsucceeded: {{}}", "Odd")
    assert written_request(call) == dict.fromkeys(names, True)


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


def test_a_type_of_another_file_may_have_other_fields_at_another_service(tmp_path: Path, wording: Wording) -> None:
    bound = read_bindings(RIGHT, MODEL)
    file = tmp_path / "my_robot" / "srv" / "Light.srv"
    file.parent.mkdir(parents=True)
    file.write_text("---\nbool success\n", encoding="utf-8")
    text = f"bindings_of: cell\ninterfaces: [{tmp_path}]\nresources: {{arm: {{service: @}}}}\n"
    read_bindings(text.replace("@", "{name: /x, type: my_robot/srv/Light}"), bound)
    (problems,) = diagnostics_of(text.replace("@", "{name: /scanner/light, type: my_robot/srv/Light}"), bound)
    assert problems.slug is Slug.TYPES_DIFFER
    wording(problems.message)


WRONG_REQUESTS = {
    "an unknown path": "pose.positon.x: 1",
    "a message": "pose.position: 1",
    "a constant of a message": "pose.position.x: one",
    "the second element first": "angles[1]: 1.0",
    "an element by name": '"angles[names=a]": 1.0',
    "an element that an array does not have": "id[4]: 1",
    "a huge index": "angles[9999999999]: 1.0",
    "a list and its element": "angles: [1.0]\n  angles[0]: 1.0",
    "a list of another length": "id: [1, 2, 3]",
    "no list": "angles: 1.0",
    "a list where one value is": "pose.position.x: [1.0]",
    "a wrong element": "id: [1, 2, 3, 256]",
    "not a number": "pose.position.x: .nan",
    "partial values": "pose.position.x: {variable: command, values: {none: 0, scan: 1}}",
    "a value that no variable has": "pose.position.x: {variable: lit, values: {true: 0, false: 1, maybe: 2}}",
    "a variable that is not carried": "pose.position.x: {variable: zone, values: {near: 0, far: 1}}",
    "a variable without values": "pose.position.x: {variable: command}",
    "both ways": "pose.position.x: {variable: lit, text: a, values: {true: 0, false: 1}}",
    "an unknown key": "pose.position.x: {variabel: lit, values: {true: 0, false: 1}}",
    "a text for a number": "pose.position.x: {text: a}",
    "a variable that does not fit": "pose.position.x: command",
}


@pytest.mark.parametrize("case", WRONG_REQUESTS)
def test_a_wrong_field_of_a_request_is_reported_at_its_place(case: str, wording: Wording) -> None:
    with pytest.raises(InputError) as raised:
        service_of(f"request:\n  {WRONG_REQUESTS[case]}\nsucceeded: {{}}", "Move")
    wording(f"{d.place.line}:{d.place.column} {d.slug}: {d.message} = {d.remedy}" for d in raised.value.diagnostics)


WRONG_MEASURED = {
    "no path": "{topic: /x, type: S/Range, ranges: {near: ..1}}",
    "an unknown field": "{topic: /x, type: S/Range, field: rnge, ranges: {near: ..1}}",
    "a list": "{topic: /x, type: S/JointState, field: position, ranges: {near: ..1}}",
    "a message": "{topic: /x, type: S/JointState, field: header, ranges: {near: ..1}}",
    "a list without names": '{topic: /x, type: S/JointState, field: "position[nam=a]", ranges: {near: ..1}}',
    "values for fractions": "{topic: /x, type: S/Range, field: range, values: {1: near}}",
    "an unknown constant": "{topic: /x, type: S/Range, field: radiation_type, values: {ULTRASOUD: near}}",
    "one value twice": "{topic: /x, type: S/Range, field: radiation_type, values: {INFRARED: near, 1: far}}",
    "ranges and values": "{topic: /x, type: S/Range, field: radiation_type, values: {0: near}, ranges: {far: 1..}}",
    "an unknown type": "{topic: /x, type: S/Rang, field: range, ranges: {near: ..1}}",
    "a service": "{topic: /x, type: std_srvs/srv/Trigger, ranges: {near: ..1}}",
}


@pytest.mark.parametrize("case", WRONG_MEASURED)
def test_a_wrong_measured_topic_is_reported_at_its_place(case: str, wording: Wording) -> None:
    text = (
        "bindings_of: cell\nresources:\n  scanner:\n    topics: {request: /a, reply: /b}\n    measured:\n      zone: "
    )
    found = diagnostics_of(text + WRONG_MEASURED[case].replace("S/", "sensor_msgs/msg/"))
    wording(f"{d.place.line}:{d.place.column} {d.slug}: {d.message} = {d.remedy}" for d in found)


@pytest.mark.parametrize("written", ["nowhere", "[my_robot, 5]", "../models", "{a: b}", "''"])
def test_a_path_without_interfaces_is_reported(written: str, wording: Wording) -> None:
    listed = written if written.startswith(("[", "{")) else f"[{written}]"
    found = diagnostics_of(f"bindings_of: cell\ninterfaces: {listed}\nresources: {{}}\n")
    wording(f"{d.place.line}:{d.place.column} {d.slug}: {d.message} = {d.remedy}" for d in found)


def test_paths_of_interfaces_begin_at_the_file(tmp_path: Path) -> None:
    package = tmp_path / "cell" / "ros" / "my_robot" / "msg"
    package.mkdir(parents=True)
    (package / "Lamp.msg").write_text("bool lit\n", encoding="utf-8")
    lamp = "ros: {measured: {lit: {topic: /lamp, type: my_robot/msg/Lamp}}}"
    model = (
        "behavior_model: cell\ninterfaces: [ros]\nvariables: {lit: {domain: bool, initial: false}}\n@\noperations: {}\n"
    )
    path = tmp_path / "cell" / "cell.yaml"
    path.write_text(model.replace("@", f"resources: {{lamp: {{measures: [lit], {lamp}}}}}"), encoding="utf-8")
    loaded = load_model(path)
    assert binding(loaded, "lamp").measured[0].type.name == "my_robot/msg/Lamp"
    assert loaded.interfaces == ("ros",)
    assert "interfaces: [ros]" in write_model(loaded)
    assert digest_of(loaded) == digest_of(replace(loaded, interfaces=()))


def test_without_the_extra_bindings_are_kept_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scbm.nodes.bindings.binding_keys.has_library", lambda: False)
    text = MODEL_TEXT.replace("{topics: {request: /scanner/request, reply: /scanner/reply}}", "{servise: [1, {a: ~}]}")
    kept = read_model(text)
    assert type(resource(kept, "scanner").binding) is Binding
    assert read_model(write_model(kept)).resources == kept.resources
    assert write_model(read_model(write_model(kept))) == write_model(kept)


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


@pytest.mark.parametrize(
    "word",
    [":0", "- a", "#", "a: b", "\n", " ", "true", "null", "5", "1e3", "", "'", '"', "\\", "{", "*a", "!a", "é", "<<"],
)
def test_any_text_that_a_driver_may_say_or_want_is_written_as_it_is(word: str) -> None:
    quoted = json.dumps(word, ensure_ascii=False)
    request = f"{{a: {{text: {quoted}}}, b: {quoted}, c: 1.5, d: -0}}"
    rest = f"succeeded: {{a: {quoted}}}, measured: {{zone: {{field: a, values: {{{quoted}: near}}}}}}"
    service = f"{{service: {{name: /say, type: my_robot/srv/Say, request: {request}, {rest}}}}}"
    text = MODEL_TEXT.replace("{topics: {request: /scanner/request, reply: /scanner/reply}}", service)
    model = read_model(f"interfaces: [{INTERFACES}]\n{text}")
    again = read_model(write_model(model))
    assert again == model
    assert write_model(again) == write_model(model)
    call = binding(again).requests
    assert isinstance(call, ServiceCall)
    assert dict(call.request)[path_to(call.type.request, "a")] == word
    assert repr(again.resources) == repr(model.resources)  # `1 == 1.0 == True` to Python


# the schema


def faults_of(text: str) -> list[str]:
    data = YAML(typ="safe", pure=True).load(text)
    return [fault.message for fault in Draft202012Validator(bindings_schema()).iter_errors(data)]


def test_the_schema_of_bindings_is_one() -> None:
    Draft202012Validator.check_schema(bindings_schema())
    assert list(bindings_schema()["properties"]) == ["bindings_of", "interfaces", "resources"]
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
        ("std_srvs/srv/Trigger", "Trigger"),
        ("level: 0.5", "level: {texts: a}"),
        ("0.5..", "0.5"),
        ("std_msgs/msg/String", "string"),
        ("{CLOSE: near}", "near"),
        ("field: left", "fields: left"),
    ],
)
def test_a_typical_mistake_does_not_satisfy_the_schema(right: str, wrong: str) -> None:
    assert RIGHT.count(right) == 1
    assert faults_of(RIGHT.replace(right, wrong))
