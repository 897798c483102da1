"""The stages of the expansion of a model file, in their order (decision 51)."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.files.expansion.handshakes import expand_handshakes
from scbm.files.expansion.object_stage import expand_objects
from scbm.files.expansion.parts import expand_parts

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.text_files import ErrorCollector

    Stage: TypeAlias = Callable[[YamlNode, ErrorCollector], YamlNode]
    """Returns the tree with the keys of this stage expanded, and the same tree if it has none of these keys.

    It notes what it cannot expand. It must not change the nodes of the tree: an alias brings the node of its anchor.
    """

STAGES: tuple[Stage, ...] = (expand_parts, expand_objects, expand_handshakes)
"""All stages: parts before objects, as parts have objects, and handshakes last, as they name ground resources."""


def expand(document: YamlNode, report: ErrorCollector) -> YamlNode:
    """Return the tree of a model file in the language underneath; the same tree if there is nothing to expand.

    Args:
        document: the tree of the file. Its keys are not checked yet, so it can have any shape.
        report: where errors go, and the other files whose nodes the tree then contains.
    """
    for stage in STAGES:
        document = stage(document, report)
    return document
