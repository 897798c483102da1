"""Golden files of wording: what each test of a module prints, in one file per module below tests/golden/wording.

A file has a section for each text, headed by the name of the test. `pytest --update-golden` writes them; the diff shows
how messages changed, while the tests themselves compare slugs, JSON and structure.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

_HEAD = re.compile(r"^== (.*)$", re.MULTILINE)


def shown(value: object) -> str:
    """Return a text as it is, and other values as lines of their parts."""
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return "\n".join(map(str, value))
    return str(value)


def masked(text: str, paths: Mapping[str, str]) -> str:
    """Return the text with directories that differ between runs replaced by names."""
    for path, name in paths.items():
        text = text.replace(path, name)
    return text


def read_sections(path: Path) -> dict[str, str]:
    """Return the sections of a file by their heads; none if it does not exist."""
    if not path.exists():
        return {}
    parts = _HEAD.split(path.read_text(encoding="utf-8"))[1:]
    return {head: text[1:-1] for head, text in zip(parts[::2], parts[1::2], strict=True)}


def write_sections(path: Path, sections: Mapping[str, str]) -> None:
    """Write a file with the sections in the order of their heads."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(f"== {head}\n{sections[head]}\n" for head in sorted(sections)), encoding="utf-8")


@dataclass
class Wording:
    """Compares the texts of one test with its sections, or writes them.

    Attributes:
        path: the golden file of the module.
        test: the name of the test, with its parameters.
        paths: directories that differ between runs, and the names that stand for them.
        is_update: whether to write instead of to compare.
    """

    path: Path
    test: str
    paths: Mapping[str, str]
    is_update: bool
    count: int = 0

    def __call__(self, value: object) -> None:
        """Compare the next text of the test with its section."""
        self.count += 1
        head = self.test if self.count == 1 else f"{self.test} ({self.count})"
        text = masked(shown(value), self.paths)
        if self.is_update:
            write_sections(self.path, {**read_sections(self.path), head: text})
        expected = read_sections(self.path).get(head)
        assert expected is not None, f"{self.path} has no section `{head}`; `--update-golden` writes it"
        assert text == expected
