"""From a file to a behavior model. Every error of the file comes at once, each with its place."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scbm.files.codec.model_builder import Builder
from scbm.files.codec.model_keys import MODEL_SHAPE
from scbm.files.codec.shape_check import check_shape
from scbm.files.yaml.text_files import read_file, read_tree
from scbm.model import Place

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.source_text import SourceText
    from scbm.model.behavior import BehaviorModel


class Places:
    """Where each part of a model stands in its file."""

    def __init__(self, document: YamlNode, source: SourceText) -> None:
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

    def lines(self, path: tuple[str, ...]) -> tuple[int, ...]:
        """The numbers of the lines that say something under a path, with those of its key, rising.

        Blank lines and those of comments are left out. An alias brings the lines of what it stands for. Nothing is
        under a path that is not there.
        """
        owner = self._document.at(path[:-1])
        if not self._has(path):
            return ()
        first = owner.key_places[path[-1]].line
        written = range(first, self._line(owner.value_ends[path[-1]]) + 1)
        numbers = {*written, *self._lines_of(owner.items[path[-1]])}
        return tuple(number for number in sorted(numbers) if self._says_something(number))

    def _has(self, path: tuple[str, ...]) -> bool:
        """Whether there is a key at the end of a path."""
        return all(key in self._document.at(path[:length]).items for length, key in enumerate(path))

    def _lines_of(self, node: YamlNode) -> Iterator[int]:
        yield from range(node.place.line, self._line(node.end) + 1)
        for child in (*node.items.values(), *node.elements):
            yield from self._lines_of(child)

    def _line(self, end: int) -> int:
        return self._source.place(max(end - 1, 0)).line

    def _says_something(self, number: int) -> bool:
        line = self._source.lines[number - 1].strip()
        return bool(line) and not line.startswith("#")


def load_model(path: str | Path) -> BehaviorModel:
    """The model in a file. Raises `InputError` with everything that is wrong with it."""
    return load_located(path)[0]


def load_located(path: str | Path) -> tuple[BehaviorModel, Places]:
    """The model in a file, and where its parts stand there. Raises `InputError`."""
    return _read(read_file(Path(path)), str(path))


def read_located(text: str, file: str = "model") -> tuple[BehaviorModel, Places]:
    """The model that a text says, and where its parts stand there. Raises `InputError`."""
    return _read(text, file)


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
