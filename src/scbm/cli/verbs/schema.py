"""`scbm schema`: prints the JSON Schema of model, case, bindings, waivers and part files, for editors."""

from enum import StrEnum
from typing import Annotated

import typer

from scbm.cli.output.terminal import write_json
from scbm.files import bindings_schema, case_schema, model_schema, part_schema, waivers_schema


class SchemaKind(StrEnum):
    """The files that have a schema."""

    MODEL = "model"
    CASE = "case"
    BINDINGS = "bindings"
    WAIVERS = "waivers"
    PART = "part"


def command(
    of: Annotated[SchemaKind, typer.Argument(help="The kind of files.")] = SchemaKind.MODEL,
) -> int:
    """Print the JSON Schema of model files, case files, files of bindings, of waivers or of parts."""
    schemas = {
        SchemaKind.MODEL: model_schema,
        SchemaKind.CASE: case_schema,
        SchemaKind.BINDINGS: bindings_schema,
        SchemaKind.WAIVERS: waivers_schema,
        SchemaKind.PART: part_schema,
    }
    write_json(schemas[of]())
    return 0
