"""JSON Schemas for editors and tables for the documentation, generated from the declared keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scbm.files.codec.case_keys import CaseKeys
from scbm.files.codec.keys import Definitions
from scbm.files.codec.lifted.part_keys import PartKeys
from scbm.files.codec.model_files import BINDINGS_KEYS
from scbm.files.codec.model_keys import ModelKeys
from scbm.files.codec.waiver_keys import WaiversKeys
from scbm.model.lazy_exports import load_named

if TYPE_CHECKING:
    from scbm.files.codec.keys import Data, Keys


def model_schema() -> dict[str, Any]:
    """Return the schema of model files (draft 2020-12)."""
    return json_schema(ModelKeys, "A behavior model for scbm")


def case_schema() -> dict[str, Any]:
    """Return the schema of case files (draft 2020-12)."""
    return json_schema(CaseKeys, "A test case for scbm")


def bindings_schema() -> dict[str, Any]:
    """Return the schema of bindings files (draft 2020-12)."""
    return json_schema(load_named(BINDINGS_KEYS), "Bindings of resources for scbm")


def waivers_schema() -> dict[str, Any]:
    """Return the schema of waivers files (draft 2020-12)."""
    return json_schema(WaiversKeys, "Waivers of obligations for scbm")


def part_schema() -> dict[str, Any]:
    """Return the schema of files with parts (draft 2020-12)."""
    return json_schema(PartKeys, "A part of behavior models for scbm")


def json_schema(root: type[Keys], title: str) -> dict[str, Data]:
    """Return the JSON Schema (draft 2020-12) of a file whose root has these keys."""
    definitions = Definitions()
    whole = _sorted(root.schema(definitions))
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title}
    return {**head, "$defs": _sorted(definitions.sorted(), is_named=True), **whole}


def _sorted(part: Data, *, is_named: bool = False) -> Data:
    """Return the same JSON with the words of each schema in alphabetical order; names keep the order of the file."""
    if isinstance(part, list):
        return [_sorted(element) for element in part]
    if not isinstance(part, dict):
        return part
    names = part if is_named else sorted(part)
    return {name: _sorted(part[name], is_named=name == "properties" and not is_named) for name in names}


def mappings_of(root: type[Keys]) -> list[type[Keys]]:
    """Return the mappings of a file in the order in which its keys name them, the root first; each once."""
    found = [root]
    for keys in found:  # grows while it is iterated over
        inner = [mapping for key in keys.declared.values() for mapping in key.kind.mappings()]
        found += [mapping for mapping in dict.fromkeys(inner) if mapping not in found]
    return found


def key_table(keys: type[Keys]) -> str:
    """Return the Markdown table of a mapping's keys: name, type, default and meaning."""
    head = "| key | type | default | meaning |\n| --- | --- | --- | --- |\n"
    return head + "".join(f"{key.row()}\n" for key in keys.declared.values())
