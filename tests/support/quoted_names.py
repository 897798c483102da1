"""Names in backticks, in docstrings and comments, that stand for code which does not exist (any more).

Only names with a slash or a dot are judged: paths of modules and folders, and names inside modules and classes of the
project. Names of other libraries, of examples and of files for users look the same but begin otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import PurePosixPath

_QUOTED = re.compile(r"`([A-Za-z_]\w*(?:[./][\w.-]+)+)(?:\(\))?`")
_CLASS = re.compile(r"^ *class (\w+)\b", re.MULTILINE)
_SOURCE = PurePosixPath("src/scbm")
_FILE_SUFFIXES = frozenset({".js", ".yaml", ".json", ".jsonl", ".toml", ".db", ".md", ".txt"})


class QuotedNames:
    """Which names in backticks stand for code of the project, and which of these exist."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        """Take the text of each module, by its path from the root of the project."""
        self._texts = texts

    def stale(self, text: str) -> Iterator[str]:
        """Yield the names in a text that do not exist, and where they are."""
        for match in _QUOTED.finditer(text):
            if not self._exists(match[1]):
                yield f"{text.count(chr(10), 0, match.start()) + 1}: {match[1]}"

    def _exists(self, name: str) -> bool:
        """Return whether a name exists in the project, or stands for something else."""
        if "/" in name or name.endswith(".py"):
            is_of_project = name.endswith(".py") or name.partition("/")[0] in self._packages
            return not is_of_project or name in self._tails or f"{name}.py" in self._tails
        first, *rest = name.split(".")
        if PurePosixPath(name).suffix in _FILE_SUFFIXES:
            return True
        if first == "scbm" or first in self._packages:
            return self._has(_SOURCE, rest if first == "scbm" else [first, *rest])
        return first not in self._holders or _mentions(self._holders[first], rest[0])

    def _has(self, folder: PurePosixPath, names: list[str]) -> bool:
        """Return whether a package has a module, a package or an exported name; and the module the next name."""
        if not names:
            return True
        first, *rest = names
        if f"{folder / first}/__init__.py" in self._texts:
            return self._has(folder / first, rest)
        module = self._texts.get(f"{folder / first}.py")
        if module is None:
            return _mentions(self._texts.get(f"{folder}/__init__.py", ""), first)
        return not rest or _mentions(module, rest[0])

    @cached_property
    def _packages(self) -> frozenset[str]:
        paths = map(PurePosixPath, self._texts)
        return frozenset(path.parent.name for path in paths if path.parent.parent == _SOURCE)

    @cached_property
    def _tails(self) -> frozenset[str]:
        """The ends of the paths of all modules, and of their folders."""
        parts = {path.parts[:end] for path in map(PurePosixPath, self._texts) for end in range(1, len(path.parts) + 1)}
        return frozenset("/".join(each[begin:]) for each in parts for begin in range(len(each)))

    @cached_property
    def _holders(self) -> Mapping[str, str]:
        """The text of each module of the source by its name, and by the names of its classes."""
        holders = {}
        for path, text in self._texts.items():
            if path.startswith(f"{_SOURCE}/"):
                holders[PurePosixPath(path).stem] = text
                holders |= dict.fromkeys(_CLASS.findall(text), text)
        return holders


def _mentions(text: str, name: str) -> bool:
    """Return whether a text has a name outside of backticks."""
    return re.search(rf"(?<![`.\w]){name}(?!\w)|(?<=self\.){name}(?!\w)", text) is not None
