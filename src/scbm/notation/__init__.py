"""How models are written: YAML with predicates, actions, durations inside; read with every error located.

The one room that knows `ruamel.yaml`, `lark` and `pydantic`. It never prints and never runs anything.
"""

from scbm.notation.durations import parse_duration
from scbm.notation.loader import load_model, read_model
from scbm.notation.nearest import nearest, suggestion
from scbm.notation.schema import model_schema

__all__ = ["load_model", "model_schema", "nearest", "parse_duration", "read_model", "suggestion"]
