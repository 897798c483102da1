"""Model files, case files and files of bindings: reading, with every error located, and writing.

`yaml` knows YAML and the places in a text, `language` the predicates, actions and quantities inside of scalars, and
`codec` the keys. This package alone imports `ruamel.yaml` and `lark`. It never prints and never runs anything.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.files.case_editing import edited_case
    from scbm.files.codec.case_files import (
        CaseDocument,
        is_case_text,
        is_model_text,
        open_case,
        parse_case,
        read_case,
        read_network,
        write_case,
        write_network,
    )
    from scbm.files.codec.model_files import (
        Places,
        count_entries,
        digest_of,
        load_bindings,
        load_located,
        load_model,
        load_waivers,
        read_bindings,
        read_located,
        read_model,
        read_waivers,
        write_model,
        write_operation,
        write_waivers,
    )
    from scbm.files.file_writer import FileWriter, protecting
    from scbm.files.goal_editing import add_goals, with_goals
    from scbm.files.key_reference import bindings_schema, case_schema, model_schema, part_schema, waivers_schema
    from scbm.files.language.dotted_text import DottedText
    from scbm.files.language.expressions import (
        parse_action,
        parse_predicate,
        parse_requirement,
        parse_state,
        parse_value,
    )
    from scbm.files.language.quantities import parse_duration, parse_share
    from scbm.files.language.scope import Scope, Where
    from scbm.files.spelling import nearest, suggestion
    from scbm.files.yaml.text_files import open_input, read_file, real_path, without_detours

__all__ = [
    "CaseDocument",
    "DottedText",
    "FileWriter",
    "Places",
    "Scope",
    "Where",
    "add_goals",
    "bindings_schema",
    "case_schema",
    "count_entries",
    "digest_of",
    "edited_case",
    "is_case_text",
    "is_model_text",
    "load_bindings",
    "load_located",
    "load_model",
    "load_waivers",
    "model_schema",
    "nearest",
    "open_case",
    "open_input",
    "parse_action",
    "parse_case",
    "parse_duration",
    "parse_predicate",
    "parse_requirement",
    "parse_share",
    "parse_state",
    "parse_value",
    "part_schema",
    "protecting",
    "read_bindings",
    "read_case",
    "read_file",
    "read_located",
    "read_model",
    "read_network",
    "read_waivers",
    "real_path",
    "suggestion",
    "waivers_schema",
    "with_goals",
    "without_detours",
    "write_case",
    "write_model",
    "write_network",
    "write_operation",
    "write_waivers",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "case_editing": "edited_case",
        "codec.case_files": (
            "CaseDocument is_case_text is_model_text open_case parse_case read_case read_network "
            "write_case write_network"
        ),
        "codec.model_files": (
            "Places count_entries digest_of load_bindings load_located load_model load_waivers read_bindings "
            "read_located read_model read_waivers write_model write_operation write_waivers"
        ),
        "file_writer": "FileWriter protecting",
        "goal_editing": "add_goals with_goals",
        "key_reference": "bindings_schema case_schema model_schema part_schema waivers_schema",
        "language.dotted_text": "DottedText",
        "language.expressions": "parse_action parse_predicate parse_requirement parse_state parse_value",
        "language.quantities": "parse_duration parse_share",
        "language.scope": "Scope Where",
        "spelling": "nearest suggestion",
        "yaml.text_files": "open_input read_file real_path without_detours",
    },
)
