"""The JSON Schema of model files, for editors."""

from __future__ import annotations

from typing import Any

from scbm.notation.file_types import ModelFile


def model_schema() -> dict[str, Any]:
    """The schema (draft 2020-12), made of the loader's own types."""
    schema = ModelFile.model_json_schema()
    schema = {key: _without_null_defaults(value) for key, value in schema.items() if key not in _REPLACED}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A behavior model for scbm",
        **schema,
    }


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
