"""The files that a command line names as inputs: no output of the command may replace them."""

from __future__ import annotations

from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping


def _itself(path: Path) -> Iterable[Path]:
    return (path,)


class Reads(Struct, frozen=True):
    """The part of an annotation that says: the command reads the files that this argument or option names.

    Attributes:
        words: what such a file is, such as `the waivers`.
        files: returns the files that a path of the command line stands for, such as those of a directory.
    """

    words: str
    files: Callable[[Path], Iterable[Path]] = _itself


def input_marks(command: Callable[..., int]) -> dict[str, Reads]:
    """Return the marks of the parameters of a verb that name inputs, by the names of the parameters."""
    parameters = signature(command, eval_str=True).parameters
    return {name: mark for name, each in parameters.items() if (mark := _mark(each.annotation)) is not None}


def inputs_of(command: Callable[..., int], values: Mapping[str, Any]) -> Iterator[tuple[Path, str]]:
    """Yield the files that a verb reads with these values of its parameters, each with what it is in words."""
    for name, mark in input_marks(command).items():
        value = values.get(name) or ()
        paths = [value] if isinstance(value, Path) else value
        yield from ((file, mark.words) for path in paths for file in mark.files(path))


def _mark(annotation: object) -> Reads | None:
    if get_origin(annotation) is not Annotated:
        return None
    return next((part for part in get_args(annotation) if isinstance(part, Reads)), None)
