"""The JSON Schemas of model files and of case files, for editors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scbm.files.codec.binding_keys import BindingsFile
from scbm.files.codec.model_keys import ModelFile

if TYPE_CHECKING:
    from scbm.files.codec.key_types import FileType


def model_schema() -> dict[str, Any]:
    """The schema of model files (draft 2020-12), made of the loader's own types."""
    return _schema(ModelFile, "A behavior model for scbm")


def case_schema() -> dict[str, Any]:
    """The schema of case files (draft 2020-12), made of the loader's own types."""
    from scbm.files.codec.case_keys import CaseFile  # noqa: PLC0415 - it takes long to make, and few commands need it

    return _schema(CaseFile, "A test case for scbm")


def bindings_schema() -> dict[str, Any]:
    """The schema of bindings files (draft 2020-12), made of the loader's own types."""
    return _schema(BindingsFile, "Bindings of resources for scbm")


def _schema(kind: type[FileType], title: str) -> dict[str, Any]:
    schema = kind.model_json_schema()
    schema = {key: _without_null_defaults(value) for key, value in schema.items() if key not in _REPLACED}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **schema}


_REPLACED = ("title", "description")


def _without_null_defaults(part: Any) -> Any:  # noqa: ANN401 - any piece of JSON
    """The same piece without `default: null`: editors would write it, and the loader refuses it."""
    if isinstance(part, list):
        return [_without_null_defaults(element) for element in part]
    if not isinstance(part, dict):
        return part
    is_null = "default" in part and part["default"] is None
    kept = {key: _without_null_defaults(value) for key, value in part.items()}
    return {key: value for key, value in kept.items() if key != "default" or not is_null}
