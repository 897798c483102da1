"""`scbm schema`: the JSON Schema of the files that people write, for editors."""

from enum import StrEnum
from typing import Annotated

import typer

from scbm.cli.output import write_json
from scbm.notation import case_schema, model_schema


class Kind(StrEnum):
    """The files that have a schema."""

    MODEL = "model"
    CASE = "case"


def command(
    of: Annotated[Kind, typer.Argument(help="Which files: models or cases.")] = Kind.MODEL,
) -> int:
    """Print the JSON Schema of model files or of case files."""
    write_json(case_schema() if of is Kind.CASE else model_schema())
    return 0
