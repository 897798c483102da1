"""`scbm schema`: the JSON Schema of the files that people write, for editors."""

from enum import StrEnum
from typing import Annotated

import typer

from scbm.cli.output import write_json
from scbm.notation import bindings_schema, case_schema, model_schema


class Kind(StrEnum):
    """The files that have a schema."""

    MODEL = "model"
    CASE = "case"
    BINDINGS = "bindings"


def command(
    of: Annotated[Kind, typer.Argument(help="Which files: models, cases or bindings.")] = Kind.MODEL,
) -> int:
    """Print the JSON Schema of model files, case files or files of bindings."""
    schemas = {Kind.MODEL: model_schema, Kind.CASE: case_schema, Kind.BINDINGS: bindings_schema}
    write_json(schemas[of]())
    return 0
