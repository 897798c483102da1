"""The rules for the layout of the source: small folders, and names of modules and classes that are used once.

The functions take texts by path, so that they also judge a source with the samples of a recipe.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path, PurePosixPath

SOURCE = Path(__file__).parents[2] / "src" / "scbm"

MAX_MODULES = 20
"""In one folder, `__init__.py` included."""

_CLASS = re.compile(r"^ *class _*(\w+)[(:\[]", re.MULTILINE)
"""Nested classes too; the name is without underscores in front."""


@cache
def source_texts() -> Mapping[str, str]:
    """Return the text of each module, by its path from `src/scbm`."""
    return {path.relative_to(SOURCE).as_posix(): path.read_text("utf-8") for path in sorted(SOURCE.rglob("*.py"))}


def full_folders(texts: Mapping[str, str]) -> dict[str, int]:
    """Return the folders with too many modules, and how many each has."""
    sizes = Counter(str(PurePosixPath(path).parent) for path in texts)
    return {folder: size for folder, size in sizes.items() if size > MAX_MODULES}


def repeated_modules(texts: Mapping[str, str]) -> list[str]:
    """Return the names of modules that occur more than once."""
    stems = (PurePosixPath(path).stem for path in texts)
    return _repeated(stem for stem in stems if not stem.startswith("__"))


def repeated_classes(texts: Mapping[str, str]) -> list[str]:
    """Return the names of classes that occur more than once."""
    return _repeated(name for text in texts.values() for name in _CLASS.findall(text))


def _repeated(names: Iterable[str]) -> list[str]:
    return sorted(name for name, count in Counter(names).items() if count > 1)
