"""The stages of the expansion of a model file, in their order (decision 51)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from scbm.files.expansion.handshakes import expand_handshakes
from scbm.files.expansion.stage_keys import has_objects, has_parts

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.files.expansion.stage_keys import PartKeyNames
    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.error_collector import ErrorCollector

    Stage: TypeAlias = Callable[[YamlNode, ErrorCollector], YamlNode]
    """Returns the tree with the keys of this stage expanded, and the same tree if it has none of these keys.

    It notes what it cannot expand. It must not change the nodes of the tree: an alias brings the node of its anchor.
    """


def expand_parts(document: YamlNode, report: ErrorCollector, keys: PartKeyNames) -> YamlNode:
    """Return the tree of a model with what it includes and with its parts; the same tree if it has neither."""
    if not has_parts(document):
        return document
    from scbm.files.expansion.parts import expand_parts as expand  # noqa: PLC0415 - few models have parts

    return expand(document, report, keys)


def expand_objects(document: YamlNode, report: ErrorCollector) -> YamlNode:
    """Return the tree without types, tables and parameters; the same tree if it has none."""
    if not has_objects(document):
        return document
    from scbm.files.expansion.object_stage import expand_objects as expand  # noqa: PLC0415 - few models have objects

    return expand(document, report)


_AFTER_PARTS: tuple[Stage, ...] = (expand_objects, expand_handshakes)
"""The stages after that of parts, since parts have objects; handshakes last, as they name ground resources."""


class ExpandedFile(NamedTuple):
    """A model file before and after its objects are expanded.

    Attributes:
        lifted: its tree with all parts, and with the entries for several objects as they are written.
        ground: its tree in the language underneath; the same tree if there is nothing to expand.
    """

    lifted: YamlNode
    ground: YamlNode


def expand(document: YamlNode, report: ErrorCollector, keys: PartKeyNames) -> ExpandedFile:
    """Expand the tree of a model file.

    Args:
        document: the tree of the file. Its keys are not checked yet, so it can have any shape.
        report: where errors go, and the other files whose nodes the tree then contains.
        keys: the keys of parts.
    """
    lifted = ground = expand_parts(document, report, keys)
    for stage in _AFTER_PARTS:
        ground = stage(ground, report)
    if ground.get("waivers") is not None:
        from scbm.files.expansion.waiver_stage import expand_waivers  # noqa: PLC0415 - few models have waivers

        ground = expand_waivers(lifted, ground, report)
    return ExpandedFile(lifted, ground)
