"""Files of interfaces, `.msg`, `.srv` and `.action`, laid out as in packages of ROS 2, and what they define."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from msgspec import Struct

from scbm.files.yaml.text_files import read_file
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import counted

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

PARTS = {"msg": ("",), "srv": ("_Request", "_Response"), "action": ("_Goal", "_Result", "_Feedback")}
"""What a file of each kind defines: the ends of the names of its parts, which `---` separates."""

MAX_FILE_BYTES = 1024 * 1024
"""Maximum size of a file; the largest ones of ROS 2 have a hundredth of it."""

Described: TypeAlias = tuple[Any, Any]
"""A type as `rosbags` describes it: a kind of node, and what belongs to it."""


class WrittenField(Struct, frozen=True):
    """A field of a message as its file has it, with its place and its line there; types of `rosbags` are in no file."""

    name: str
    type: Described
    place: Place | None = None
    line: str = ""


class WrittenMessage(Struct, frozen=True):
    """A message as its file has it: fields, and constants with their values."""

    fields: tuple[WrittenField, ...]
    constants: tuple[tuple[str, bool | int | float | str], ...]


class InterfaceFolder(Struct, frozen=True):
    """A file of interfaces, a package, or a folder of packages.

    Attributes:
        path: the path, as programs of this folder have it.
        shown: the path as it is written.
    """

    path: Path
    shown: str

    @staticmethod
    def of(written: str, beside: Path) -> InterfaceFolder:
        """Return what a path stands for that is written in a file of this folder."""
        return InterfaceFolder(Path(os.path.normpath(beside / written)), written)

    def fault(self) -> str | None:
        """Return why no type can be found here; `None` if one can."""
        if self.path.is_file():
            return None if self._types_of_files([self.path]) else "is not laid out as `<package>/msg/<Type>.msg`"
        if not self.path.is_dir():
            return "is no file and no folder"
        return None if any(self.types()) else "has no files such as `<package>/msg/<Type>.msg`"

    def file(self, type_name: str) -> Path | None:
        """Return the file that defines a type such as `pkg/msg/Name`; `None` if none does."""
        package, kind, short = type_name.split("/")
        inside = Path(kind) / f"{short}.{kind}"
        candidates = [self.path / package / inside]
        if self.path.absolute().name == package:
            candidates.append(self.path / inside)
        if self.path.is_file():
            candidates = [self.path] if type_name in self._types_of_files([self.path]) else []
        return next((path for path in candidates if os.path.lexists(path)), None)

    def types(self) -> Iterator[str]:
        """Yield the names of all types."""
        for kind in PARTS:
            files = [self.path] if self.path.is_file() else self.path.glob(f"{kind}/*.{kind}")
            yield from self._types_of_files(files)
            yield from self._types_of_files(self.path.glob(f"*/{kind}/*.{kind}"))

    def _types_of_files(self, files: Iterable[Path]) -> list[str]:
        named = [(path.absolute().parent.parent.name, path.suffix[1:], path) for path in files]
        return sorted(
            f"{package}/{kind}/{path.stem}" for package, kind, path in named if path.parent.name == kind in PARTS
        )


def read_interface(path: Path, type_name: str) -> dict[str, WrittenMessage]:
    """Return the messages that a file defines, by the ends of their names.

    Raises:
        InputError: with all errors of the file.
    """
    file, kind = str(path), type_name.split("/")[1]
    lines = read_file(path, MAX_FILE_BYTES).splitlines()
    parts: list[list[tuple[int, str]]] = [[]]
    for number, line in enumerate(lines, start=1):
        if line.strip() == "---":
            parts.append([])
        else:
            parts[-1].append((number, line))
    ends = PARTS[kind]
    if len(parts) != len(ends):
        message = f"a `.{kind}` file has {counted(len(ends) - 1, 'line')} `---`, and this one {len(parts) - 1}"
        raise InputError([Diagnostic(Slug.BAD_ROS_TYPE, message, Place(file))])
    faults: list[Diagnostic] = []
    read = {end: _message(file, type_name, part, faults) for end, part in zip(ends, parts, strict=True)}
    if faults:
        raise InputError(faults)
    return read


def _message(file: str, type_name: str, lines: list[tuple[int, str]], faults: list[Diagnostic]) -> WrittenMessage:
    """Return the message of some lines with their numbers; each line defines one thing, or nothing."""
    from rosbags.typesys import TypesysError, get_types_from_msg  # noqa: PLC0415 - it may be missing

    package, _, short = type_name.split("/")
    name = f"{package}/msg/{short}"  # so that a type without a package is one of `msg`
    fields: dict[str, WrittenField] = {}
    constants: dict[str, bool | int | float | str] = {}
    for number, line in lines:
        place = Place(file, number, 1 + len(line) - len(line.lstrip()), len(line.strip()))
        try:
            found_constants, found_fields = get_types_from_msg(f"{line}\n", name)[name]
        except (TypesysError, ValueError):
            message = f"`{line.strip()[:60]}` is no line of a definition"
            remedy = "write `<type> <field>` or `<type> <CONSTANT>=<value>`"
            if line.split()[:1] == ["wstring"] or line.lstrip().startswith(("wstring<", "wstring[")):
                message, remedy = "`wstring` is not supported", "write `string`"
            faults.append(Diagnostic(Slug.BAD_ROS_TYPE, message, place, remedy, line))
            continue
        for each, *_ in (*found_fields, *found_constants):
            if each in fields or each in constants:
                faults.append(Diagnostic(Slug.BAD_ROS_TYPE, f"`{each}` is defined twice", place, None, line))
        fields |= {each: WrittenField(each, described, place, line) for each, described in found_fields}
        constants |= {each: value for each, _, value in found_constants}
    return WrittenMessage(tuple(fields.values()), tuple(constants.items()))
