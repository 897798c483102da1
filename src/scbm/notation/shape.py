"""Whether a document has the shape of a model file; every deviation is noted with its place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

from pydantic import ValidationError

from scbm.errors import Place, Slug
from scbm.notation.file_types import (
    FileType,
    ModelFile,
    OperationFile,
    ResourceFile,
    SimulationFile,
    TransitionFile,
    VariableFile,
    wrong_shape,
)
from scbm.notation.nearest import nearest, suggestion

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pydantic_core import ErrorDetails

    from scbm.notation.document import Node
    from scbm.notation.report import Report

_EXPECTED = {
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
    "dict_type": "a mapping of names",
    "list_type": "a list",
    "string_type": "text",
}


_OWNERS: tuple[tuple[type[FileType], str], ...] = (
    (VariableFile, "a variable"),
    (ResourceFile, "a resource"),
    (SimulationFile, "the `simulation` of a resource"),
    (OperationFile, "an operation"),
    (TransitionFile, "a transition"),
    (ModelFile, "the model"),
)


def check_shape(document: Node, report: Report) -> None:
    """Note every key that is unknown or missing and every piece of the wrong sort."""
    try:
        ModelFile.model_validate(document.plain)
    except ValidationError as error:
        for detail in error.errors(include_url=False):
            _note(detail, document, report)


def _note(detail: ErrorDetails, document: Node, report: Report) -> None:
    path = detail["loc"]
    owner = document.at(path[:-1])
    if document.at(path).condemned:
        return
    match detail["type"]:
        case "extra_forbidden":
            key = str(path[-1])
            report.add(
                Slug.UNKNOWN_KEY, f"unknown key `{key}`", owner.key_places[key], _key_remedy(key, _keys(path[:-1]))
            )
        case "missing":
            _note_missing(path, document, report)
        case Slug.WRONG_SHAPE.value:
            message = detail["msg"] + _where(path)
            report.add(Slug.WRONG_SHAPE, message, _place_of(document, path), detail["ctx"]["remedy"])
        case kind:
            problem = wrong_shape(_EXPECTED.get(kind, "something else"), document.at(path).plain)
            message = problem.message() + _where(path)
            report.add(Slug.WRONG_SHAPE, message, _place_of(document, path), _mapping_remedy(path, document))


def _key_remedy(key: str, known: list[str]) -> str | None:
    """What to do about an unknown key; one from elsewhere tells that a line above it is lost or indented wrongly."""
    near = nearest(key, known)
    owner = next((owner for kind, owner in _OWNERS if key in kind.model_fields), None)
    if owner is not None and near is None:
        return f"`{key}` belongs to {owner}; the keys here are: {', '.join(known)}"
    return suggestion(key, known, "the keys here are")


def _note_missing(path: tuple[int | str, ...], document: Node, report: Report) -> None:
    """Note a missing key, unless one is there that is told of and that was probably meant."""
    known = _keys(path[:-1])
    owner = document.at(path[:-1])
    others = [key for key in owner.items if key not in known]
    if not owner.incomplete and all(nearest(key, known) != path[-1] for key in others):
        whose = f" in `{path[-2]}`" if len(path) > 1 else ""
        report.add(Slug.MISSING_KEY, f"`{path[-1]}` is missing{whose}", _place_of(document, path[:-1]))


def _mapping_remedy(path: tuple[int | str, ...], document: Node) -> str | None:
    keys = _keys(path)
    if keys:
        return f"its keys are: {', '.join(keys)}"
    return "write `{}` for none" if document.at(path).plain is None else None


def _where(path: tuple[int | str, ...]) -> str:
    names = [str(step) for step in path if isinstance(step, str)]
    return f" under `{names[-1]}`" if names else ""


def _place_of(document: Node, path: tuple[int | str, ...]) -> Place:
    """The key that leads to a node, as it is easier found than what stands behind it; else the node itself."""
    if not path:
        return document.place
    owner = document.at(path[:-1])
    if isinstance(path[-1], str) and path[-1] in owner.key_places:
        return owner.key_places[path[-1]]
    return document.at(path).place


def _keys(path: Iterable[int | str]) -> list[str]:
    """The keys that the file type at the end of a path knows."""
    kind: Any = ModelFile
    for step in path:
        if isinstance(kind, type) and issubclass(kind, FileType):
            kind = kind.model_fields[str(step)].annotation if str(step) in kind.model_fields else None
        else:
            kind = get_args(kind)[-1] if get_args(kind) else None
    return list(kind.model_fields) if isinstance(kind, type) and issubclass(kind, FileType) else []
