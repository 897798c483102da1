"""Where the definition of a type is found, and what is wrong with files of interfaces."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from scbm.model import InputError, Slug
from scbm.nodes.types.definitions import BOOL, STRING, TRIGGER, ListShape, MessageDefinition, Primitive
from scbm.nodes.types.interface_files import MAX_FILE_BYTES, InterfaceFolder
from scbm.nodes.types.type_library import TypeLibrary, UnknownTypeError
from support.wording import Wording


@pytest.fixture(autouse=True)
def no_workspace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


def write(folder: Path, **files: str | bytes) -> TypeLibrary:
    """Write files such as `robot__msg__Arm`, and return a library that looks in the folder."""
    for name, text in files.items():
        package, kind, short = name.split("__")
        path = folder / package / kind / f"{short}.{kind}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode() if isinstance(text, str) else text)
    return library_of(folder, ".")


def library_of(beside: Path, *written: str) -> TypeLibrary:
    return TypeLibrary(InterfaceFolder.of(each, beside) for each in written)


ARM = """
# An arm.
uint8 IDLE=0
uint8 BUSY = 0x1  # now
string NAME="arm # 1"
float64[6] joints
string<=8[<=3] tools ["a"]
geometry_msgs/Point[] path
Grip grip
byte class 5
"""


def test_a_message_is_read_from_its_package(tmp_path: Path) -> None:
    library = write(tmp_path, robot__msg__Arm=ARM, robot__msg__Grip="bool closed\n")
    arm = library.message("robot/msg/Arm")
    point = MessageDefinition(
        "geometry_msgs/msg/Point", tuple((name, Primitive("float64")) for name in ("x", "y", "z"))
    )
    assert arm.fields == (
        ("joints", ListShape(Primitive("float64"), 6, is_array=True)),
        ("tools", ListShape(Primitive("string", 8), 3)),
        ("path", ListShape(point)),
        ("grip", MessageDefinition("robot/msg/Grip", (("closed", Primitive("bool")),))),
        ("class", Primitive("byte")),
    )
    assert arm.constants == (("IDLE", 0), ("BUSY", 1), ("NAME", "arm # 1"))
    assert [str(shape) for _, shape in arm.fields[:3]] == ["float64[6]", "string<=8[<=3]", "geometry_msgs/msg/Point[]"]
    assert library.message("robot/msg/Arm") is arm


def test_services_and_actions_are_read_from_their_parts(tmp_path: Path) -> None:
    library = write(
        tmp_path,
        robot__msg__Grip="bool closed\n",
        robot__srv__Pick="int8 LOW=1\nint8 shelf\n---\nint8 FULL=2\nint8 code\nGrip grip\n",
        robot__action__Move="float64 to\n---\n---\nfloat64 left\n",
    )
    pick, move = library.service("robot/srv/Pick"), library.action("robot/action/Move")
    assert (pick.request.constants, pick.response.constants) == ((("LOW", 1),), (("FULL", 2),))
    assert pick.response.fields[1][1] == library.message("robot/msg/Grip")
    assert (move.goal.name, move.result.fields) == ("robot/action/Move_Goal", ())
    assert [name for name, _ in move.send_goal.request.fields] == ["goal_id", "goal"]
    assert move.get_result.response.fields[1][1] is move.result
    assert move.feedback_message.name == "robot/action/Move_FeedbackMessage"


@pytest.mark.parametrize("written", [".", "robot", "robot/msg/Arm.msg", "./robot/../robot"])
def test_a_folder_of_packages_a_package_or_a_file_may_be_named(tmp_path: Path, written: str) -> None:
    write(tmp_path, robot__msg__Arm="bool busy\n")
    assert library_of(tmp_path, written).message("robot/msg/Arm").fields == (("busy", Primitive("bool")),)


def test_files_come_before_the_types_of_ros_2_and_the_first_folder_before_the_second(tmp_path: Path) -> None:
    write(tmp_path / "a", std_msgs__msg__Bool="int8 data\n")
    write(tmp_path / "b", std_msgs__msg__Bool="int16 data\n", robot__msg__Arm="std_msgs/Bool busy\n")
    library = library_of(tmp_path, "a", "b")
    assert library.message("std_msgs/msg/Bool").fields == (("data", Primitive("int8")),)
    assert library.message("robot/msg/Arm").fields[0][1] == library.message("std_msgs/msg/Bool")


def test_a_sourced_workspace_is_looked_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "install" / "share", robot__msg__Arm="bool busy\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path / 'none'}{os.pathsep}{tmp_path / 'install'}")
    assert TypeLibrary().message("robot/msg/Arm").fields == (("busy", Primitive("bool")),)


def test_types_of_ros_2_need_no_files() -> None:
    library = TypeLibrary()
    assert library.message("std_msgs/msg/String") is STRING
    assert library.service("std_srvs/srv/Trigger") is TRIGGER
    assert library.message("std_msgs/msg/Empty").fields == ()
    assert [name for name, _ in library.message("sensor_msgs/msg/JointState").fields][1:] == [
        "name", "position", "velocity", "effort",
    ]  # fmt: skip
    assert dict(library.message("sensor_msgs/msg/BatteryState").constants)["POWER_SUPPLY_STATUS_FULL"] == 4


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("message", "sensor_msgs/msg/JointSate"),
        ("message", "JointState"),
        ("message", "sensor_msgs/JointState"),
        ("message", "robot/msg/Amr"),
        ("message", "robot/msg/Nothing"),
        ("message", "robot/srv/Pick"),
        ("message", ""),
        ("message", "../robot/msg/Arm"),
        ("service", "robot/srv/Pik"),
        ("service", "std_srvs/srv/Triger"),
        ("service", "std_msgs/msg/Bool"),
        ("action", "robot/action/Mvoe"),
        ("action", "nav2_msgs/action/Spin"),
    ],
)
def test_an_unknown_type_is_an_error_with_the_nearest_name(
    tmp_path: Path, kind: str, name: str, wording: Wording
) -> None:
    write(
        tmp_path,
        robot__msg__Arm="bool busy\n",
        robot__srv__Pick="---\n",
        robot__action__Move="---\n---\n",
    )
    with pytest.raises(UnknownTypeError) as raised:
        getattr(library_of(tmp_path, "robot"), kind)(name)
    wording((raised.value.message, raised.value.remedy))


WRONG: dict[str, dict[str, str | bytes]] = {
    "a line": {"robot__msg__Arm": "bool busy\nbool 9lives\nbusy\nbool Other?\n"},
    "a name twice": {"robot__msg__Arm": "bool busy\nint8 busy\n"},
    "an unknown type": {"robot__msg__Arm": "bool busy\nsensor_msgs/JointSate[] joints\n"},
    "an unknown type of its package": {"robot__msg__Arm": "  Amr arm  # which\n"},
    "a type in itself": {"robot__msg__Arm": "Grip grip\n", "robot__msg__Grip": "bool a\nArm[] arm\n"},
    "wstring": {"robot__msg__Arm": "wstring name\n"},
    "lists of wstring": {"robot__msg__Arm": "wstring[3] name\n"},
    "bounded wstring": {"robot__msg__Arm": "wstring<=3 name\n"},
    "an array that is too long": {"robot__msg__Arm": "int8[9999999999] a\n"},
    "arrays of arrays": {"robot__msg__Arm": "Grip[5000] a\n", "robot__msg__Grip": "float64[5000] b\n"},
    "no UTF-8": {"robot__msg__Arm": b"bool a # \xff\n"},
    "a large file": {"robot__msg__Arm": "#" * (MAX_FILE_BYTES + 1)},
    "a message with ---": {"robot__msg__Arm": "---\n"},
    "NUL": {"robot__msg__Arm": "bool a\0b\n"},
    "many levels": {
        "robot__msg__Arm": "T0 a\n",
        **{f"robot__msg__T{number}": f"T{number + 1} a\n" for number in range(60)},
    },
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_with_a_file_is_reported_at_its_place(tmp_path: Path, case: str, wording: Wording) -> None:
    with pytest.raises(InputError) as raised:
        write(tmp_path, **WRONG[case]).message("robot/msg/Arm")
    wording(str(found).replace(str(tmp_path), "…") for found in raised.value.diagnostics)


@pytest.mark.parametrize(("kind", "parts"), [("srv", 1), ("srv", 3), ("action", 2), ("action", 4)])
def test_a_wrong_number_of_parts_is_reported(tmp_path: Path, kind: str, parts: int, wording: Wording) -> None:
    library = write(tmp_path, **{f"robot__{kind}__Do": "---\n".join(["bool a\n"] * parts)})
    with pytest.raises(InputError) as raised:
        (library.service if kind == "srv" else library.action)(f"robot/{kind}/Do")
    wording(found.message for found in raised.value.diagnostics)


def test_a_file_of_just_a_mebibyte_is_read(tmp_path: Path) -> None:
    text = "bool busy\n"
    library = write(tmp_path, robot__msg__Arm=text + "#" * (MAX_FILE_BYTES - len(text)))
    assert library.message("robot/msg/Arm").fields == (("busy", Primitive("bool")),)


def test_links_to_files_are_followed_as_workspaces_have_them_and_others_are_errors(
    tmp_path: Path, wording: Wording
) -> None:
    write(tmp_path / "source", robot__msg__Arm="bool busy\n")
    folder = tmp_path / "install" / "robot" / "msg"
    folder.mkdir(parents=True)
    (folder / "Arm.msg").symlink_to(tmp_path / "source" / "robot" / "msg" / "Arm.msg")
    (folder / "Gone.msg").symlink_to(tmp_path / "source" / "robot" / "msg" / "Gone.msg")
    (folder / "Circle.msg").symlink_to(folder / "Circle.msg")
    library = library_of(tmp_path, "install")
    assert library.message("robot/msg/Arm").fields == (("busy", Primitive("bool")),)
    for name, slug in (("Gone", Slug.FILE_MISSING), ("Circle", Slug.FILE_UNREADABLE)):
        with pytest.raises(InputError) as raised:
            library.message(f"robot/msg/{name}")
        (found,) = raised.value.diagnostics
        assert found.slug is slug
        wording(found.message)


@pytest.mark.parametrize("written", ["none", "empty", "robot/msg", "loose.msg", "robot/msg/Arm.txt", "circle", "a\0b"])
def test_a_path_without_types_has_a_fault(tmp_path: Path, written: str, wording: Wording) -> None:
    write(tmp_path, robot__msg__Arm="bool busy\n")
    (tmp_path / "empty").mkdir()
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    for file in ("loose.msg", "robot/msg/Arm.txt"):
        (tmp_path / file).write_text("bool busy\n", encoding="utf-8")
    wording(InterfaceFolder.of(written, tmp_path).fault())
    assert InterfaceFolder.of("robot", tmp_path).fault() is None


def test_a_definition_is_found_by_its_name_and_compared_as_a_whole() -> None:
    other = MessageDefinition(BOOL.name, (("data", Primitive("int8")),))
    assert hash(other) == hash(BOOL)
    assert other != BOOL
