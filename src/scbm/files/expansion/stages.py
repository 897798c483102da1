"""The stages of the expansion of a model file, in their order (decision 51)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from scbm.files.expansion.handshakes import expand_handshakes
from scbm.files.expansion.object_stage import expand_objects
from scbm.files.expansion.parts import expand_parts
from scbm.files.expansion.waiver_stage import expand_waivers

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.text_files import ErrorCollector

    Stage: TypeAlias = Callable[[YamlNode, ErrorCollector], YamlNode]
    """Returns the tree with the keys of this stage expanded, and the same tree if it has none of these keys.

    It notes what it cannot expand. It must not change the nodes of the tree: an alias brings the node of its anchor.
    """

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


def expand(document: YamlNode, report: ErrorCollector) -> ExpandedFile:
    """Expand the tree of a model file.

    Args:
        document: the tree of the file. Its keys are not checked yet, so it can have any shape.
        report: where errors go, and the other files whose nodes the tree then contains.
    """
    lifted = ground = expand_parts(document, report)
    for stage in _AFTER_PARTS:
        ground = stage(ground, report)
    ground = expand_waivers(lifted, ground, report)
    return ExpandedFile(lifted, ground)
