"""The JSON Schema of model files, for editors."""

from __future__ import annotations

from typing import Any

from scbm.notation.file_types import ModelFile


def model_schema() -> dict[str, Any]:
    """The schema (draft 2020-12), made of the loader's own types."""
    schema = ModelFile.model_json_schema()
    schema = {key: value for key, value in schema.items() if key not in ("title", "description")}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A behavior model for scbm",
        **schema,
    }
