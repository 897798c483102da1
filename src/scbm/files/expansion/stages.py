"""The stages of the expansion of a model file, in their order (decision 51)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.files.expansion.handshakes import expand_handshakes
from scbm.files.expansion.stage_keys import has_objects, has_parts

if TYPE_CHECKING:
    from scbm.files.expansion.stage_keys import PartKeyNames
    from scbm.files.expansion.static_facts import StaticFacts
    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.error_collector import ErrorCollector


def expand_parts(document: YamlNode, report: ErrorCollector, keys: PartKeyNames) -> YamlNode:
    """Return the tree of a model with what it includes and with its parts; the same tree if it has neither."""
    if not has_parts(document):
        return document
    from scbm.files.expansion.parts import expand_parts as expand  # noqa: PLC0415 - few models have parts

    return expand(document, report, keys)


def expand_objects(document: YamlNode, report: ErrorCollector) -> tuple[YamlNode, StaticFacts | None]:
    """Return the tree without types, tables and parameters, and its types and tables; the same tree without these."""
    if not has_objects(document):
        return document, None
    from scbm.files.expansion.object_stage import expand_objects as expand  # noqa: PLC0415 - few models have objects

    return expand(document, report)


class ExpandedFile(NamedTuple):
    """A model file before and after its objects are expanded.

    Attributes:
        lifted: its tree with all parts, and with the entries for several objects as they are written.
        ground: its tree in the language underneath; the same tree if there is nothing to expand.
        facts: its types and tables; `None` for a file without objects.
    """

    lifted: YamlNode
    ground: YamlNode
    facts: StaticFacts | None


def expand(document: YamlNode, report: ErrorCollector, keys: PartKeyNames) -> ExpandedFile:
    """Expand the tree of a model file: its parts first, as they have objects; handshakes name ground resources.

    No stage changes nodes of the tree that it gets: an alias brings the node of its anchor.

    Args:
        document: the tree of the file. Its keys are not checked yet, so it can have any shape.
        report: where errors go, and the other files whose nodes the tree then contains.
        keys: the keys of parts.
    """
    lifted = expand_parts(document, report, keys)
    ground, facts = expand_objects(lifted, report)
    ground = expand_handshakes(ground, report)
    if ground.get("waivers") is not None:
        from scbm.files.expansion.waiver_stage import expand_waivers  # noqa: PLC0415 - few models have waivers

        ground = expand_waivers(lifted, ground, facts, report)
    return ExpandedFile(lifted, ground, facts)
