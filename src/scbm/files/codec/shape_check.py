"""Whether a document has the shape of its kind of file; every deviation is noted with its place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

from pydantic import ValidationError

from scbm.files.codec.key_types import FileType, wrong_shape
from scbm.files.language.spelling import nearest, suggestion
from scbm.model import Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pydantic_core import ErrorDetails

    from scbm.files.codec.key_types import Shape
    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.text_files import ErrorCollector

_EXPECTED = {
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
    "dict_type": "a mapping of names",
    "list_type": "a list",
    "string_type": "text",
}


def check_shape(document: YamlNode, report: ErrorCollector, shape: Shape) -> None:
    """Note every key that is unknown or missing and every piece of the wrong sort."""
    try:
        shape.root.model_validate(document.plain)
    except ValidationError as error:
        checker = _Checker(document, report, shape)
        for detail in error.errors(include_url=False):
            checker.note(detail)


class _Checker:
    """Tells what pydantic found, in our words and at the places of a document."""

    def __init__(self, document: YamlNode, report: ErrorCollector, shape: Shape) -> None:
        self._document = document
        self._report = report
        self._shape = shape

    def note(self, detail: ErrorDetails) -> None:
        """Note one deviation."""
        path = detail["loc"]
        owner = self._document.at(path[:-1])
        if self._document.at(path).condemned:
            return
        match detail["type"]:
            case "extra_forbidden":
                key = str(path[-1])
                message = f"unknown key `{key}`"
                self._report.add(
                    Slug.UNKNOWN_KEY, message, owner.key_places[key], self._key_remedy(key, self._keys(path[:-1]))
                )
            case "missing":
                self._note_missing(path)
            case Slug.WRONG_SHAPE.value:
                message = detail["msg"] + _where(path)
                self._report.add(Slug.WRONG_SHAPE, message, self._place_of(path), detail["ctx"]["remedy"])
            case kind:
                problem = wrong_shape(_EXPECTED.get(kind, "something else"), self._document.at(path).plain)
                message = problem.message() + _where(path)
                remedy = self._mapping_remedy(path, is_list=kind == "list_type")
                self._report.add(Slug.WRONG_SHAPE, message, self._place_of(path), remedy)

    def _key_remedy(self, key: str, known: list[str]) -> str | None:
        """What to do about an unknown key; one from elsewhere tells that a line above it is lost or badly indented."""
        near = nearest(key, known)
        owner = next((owner for kind, owner in self._shape.owners if key in kind.keys()), None)  # noqa: SIM118 - no dict
        if owner is not None and near is None:
            return f"`{key}` belongs to {owner}; the keys here are: {', '.join(known)}"
        return suggestion(key, known, "the keys here are")

    def _note_missing(self, path: tuple[int | str, ...]) -> None:
        """Note a missing key, unless one is there that is told of and that was probably meant."""
        known = self._keys(path[:-1])
        owner = self._document.at(path[:-1])
        others = [key for key in owner.items if key not in known]
        if not owner.incomplete and all(nearest(key, known) != path[-1] for key in others):
            whose = f" in {_named(path[:-1])}" if len(path) > 1 else ""
            self._report.add(Slug.MISSING_KEY, f"`{path[-1]}` is missing{whose}", self._place_of(path[:-1]))

    def _mapping_remedy(self, path: tuple[int | str, ...], *, is_list: bool) -> str | None:
        keys = self._keys(path)
        if keys:
            return f"its keys are: {', '.join(keys)}"
        if self._document.at(path).plain is not None:
            return None
        return "write `[]` for none" if is_list else "write `{}` for none"

    def _place_of(self, path: tuple[int | str, ...]) -> Place:
        """The key that leads to a node, as it is easier found than what stands behind it; else the node itself."""
        if not path:
            return self._document.place
        owner = self._document.at(path[:-1])
        if isinstance(path[-1], str) and path[-1] in owner.key_places:
            return owner.key_places[path[-1]]
        return self._document.at(path).place

    def _keys(self, path: Iterable[int | str]) -> list[str]:
        """The keys that the file type at the end of a path knows."""
        kind: Any = self._shape.root
        for step in path:
            if _is_file_type(kind):
                # A number counts the elements of a list of such mappings, where one alone could stand as well.
                kind = kind if isinstance(step, int) else kind.keys().get(step)
            else:
                kind = get_args(kind)[-1] if get_args(kind) else None
            kind = get_args(kind)[0] if get_origin(kind) is Annotated else kind
        return list(kind.keys()) if _is_file_type(kind) else []


def _is_file_type(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, FileType)


def _named(path: tuple[int | str, ...]) -> str:
    """What a message calls the node at the end of a path."""
    return f"`{path[-1]}`" if isinstance(path[-1], str) else f"this element of `{_names(path)[-1]}`"


def _where(path: tuple[int | str, ...]) -> str:
    names = _names(path)
    return f" under `{names[-1]}`" if names else ""


def _names(path: tuple[int | str, ...]) -> list[str]:
    return [step for step in path if isinstance(step, str)]
