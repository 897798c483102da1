"""How models are written: YAML with predicates, actions, durations inside; read with every error located.

The one room that knows `ruamel.yaml`, `lark` and `pydantic`. It never prints and never runs anything.
"""

from scbm.notation.durations import parse_duration
from scbm.notation.expressions import parse_action, parse_predicate, parse_requirement, parse_state, parse_value
from scbm.notation.loader import Places, load_located, load_model, read_model
from scbm.notation.nearest import nearest, suggestion
from scbm.notation.schema import model_schema
from scbm.notation.scope import Scope, Where
from scbm.notation.writer import write_model, write_operation

__all__ = [
    "Places",
    "Scope",
    "Where",
    "load_located",
    "load_model",
    "model_schema",
    "nearest",
    "parse_action",
    "parse_duration",
    "parse_predicate",
    "parse_requirement",
    "parse_state",
    "parse_value",
    "read_model",
    "suggestion",
    "write_model",
    "write_operation",
]
