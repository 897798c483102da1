"""From a file to a behavior model. Every error of the file comes at once, each with its place."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scbm.errors import Place
from scbm.notation.builder import Builder
from scbm.notation.file_types import MODEL_SHAPE
from scbm.notation.files import read_file, read_tree
from scbm.notation.shape import check_shape

if TYPE_CHECKING:
    from scbm.model.behavior import BehaviorModel
    from scbm.notation.document import Node
    from scbm.notation.source import Source


class Places:
    """Where each part of a model stands in its file."""

    def __init__(self, document: Node, source: Source) -> None:
        self._document = document
        self._source = source

    def find(self, path: tuple[str, ...]) -> tuple[Place, str]:
        """The key at the end of a path, or the last one on the way that is there, and the line that it stands in."""
        place = Place(self._source.file)
        for length in range(len(path)):
            owner = self._document.at(path[:length])
            if path[length] not in owner.key_places:
                break
            place = owner.key_places[path[length]]
        return place, self._source.lines[place.line - 1] if place.line else ""


def load_model(path: str | Path) -> BehaviorModel:
    """The model in a file. Raises `InputError` with everything that is wrong with it."""
    return load_located(path)[0]


def load_located(path: str | Path) -> tuple[BehaviorModel, Places]:
    """The model in a file, and where its parts stand there. Raises `InputError`."""
    return _read(read_file(Path(path)), str(path))


def read_model(text: str, file: str = "model") -> BehaviorModel:
    """The model that a text says. Raises `InputError` with everything that is wrong with it.

    Args:
        text: YAML.
        file: what errors call the text.
    """
    return _read(text, file)[0]


def _read(text: str, file: str) -> tuple[BehaviorModel, Places]:
    document, source, report = read_tree(text, file, MODEL_SHAPE, "a model begins with `behavior_model: <name>`")
    check_shape(document, report, MODEL_SHAPE)
    builder = Builder(document, report)
    model = builder.model()
    report.raise_any()
    if not builder.is_whole:
        raise AssertionError(f"{file}: something was not resolved, and nothing was complained of")
    return model, Places(document, source)
