"""`scbm schema`: the JSON Schema of model files."""

from scbm.cli.output import write_json
from scbm.notation import model_schema


def command() -> int:
    """Print the JSON Schema of model files, for editors."""
    write_json(model_schema())
    return 0
