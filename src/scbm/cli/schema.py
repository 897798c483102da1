"""`scbm schema`: prints the JSON Schema of model, case and bindings files, for editors."""

from enum import StrEnum
from typing import Annotated

import typer

from scbm.cli.output.terminal import write_json
from scbm.files import bindings_schema, case_schema, model_schema


class SchemaKind(StrEnum):
    """The files that have a schema."""

    MODEL = "model"
    CASE = "case"
    BINDINGS = "bindings"


def command(
    of: Annotated[SchemaKind, typer.Argument(help="Which files: models, cases or bindings.")] = SchemaKind.MODEL,
) -> int:
    """Print the JSON Schema of model files, case files or files of bindings."""
    schemas = {SchemaKind.MODEL: model_schema, SchemaKind.CASE: case_schema, SchemaKind.BINDINGS: bindings_schema}
    write_json(schemas[of]())
    return 0
