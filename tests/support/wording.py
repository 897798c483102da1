"""Golden files of wording: what each test of a module prints, in one file per module below tests/golden/wording.

A file has a section for each text, headed by the name of the test. `pytest --update-golden` writes them; the diff shows
how messages changed, while the tests themselves compare slugs, JSON and structure.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from itertools import takewhile
from pathlib import Path
from types import TracebackType
from typing import Generic, TypeVar

import pytest

_E = TypeVar("_E", bound=BaseException)

_HEAD = re.compile(r"^== (.*)$", re.MULTILINE)
_DIAGNOSTIC = re.compile(r"^(\S.*?: (?:error|warning|note)\[[a-z-]+\]): ", re.MULTILINE)
_MAX_HEAD = 120
"""Maximum number of characters of a head; parameters of tests can be whole files."""


def diagnostic_heads(text: str) -> list[str]:
    """Return place, severity and slug of each diagnostic of an output, without its message."""
    return _DIAGNOSTIC.findall(text)


def paragraphs(text: str, *words: str) -> list[str]:
    """Return each line of an output that has one of the words, joined with the lines below that are indented more."""
    lines = text.splitlines()
    indents = [len(line) - len(line.lstrip()) if line.strip() else 0 for line in lines]
    found = []
    for number, line in enumerate(lines):
        if any(word in line for word in words):
            rest = takewhile(lambda each: indents[each] > indents[number], range(number + 1, len(lines)))  # noqa: B023 - used at once
            found.append(" ".join([line.strip(), *(lines[each].strip() for each in rest)]))
    return found


def shown(value: object) -> str:
    """Return a text as it is, and other values as lines of their parts."""
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return "\n".join(map(str, value))
    return str(value)


def masked(text: str, paths: Mapping[str, str]) -> str:
    """Return the text with directories and processes that differ between runs replaced by names."""
    for path, name in paths.items():
        text = text.replace(path, name)
    return text


def head_of(test: str) -> str:
    """Return the name of a test; a long name is cut and ends with a digest, so that it stays unique."""
    if len(test) <= _MAX_HEAD:
        return test
    return f"{test[:_MAX_HEAD]}… {sha256(test.encode()).hexdigest()[:8]}"


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
        paths: directories and processes that differ between runs, and the names that stand for them.
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
        head = head_of(self.test) + (f" ({self.count})" if self.count > 1 else "")
        text = masked(shown(value), self.paths)
        if self.is_update:
            write_sections(self.path, {**read_sections(self.path), head: text})
        expected = read_sections(self.path).get(head)
        assert expected is not None, f"{self.path} has no section `{head}`; `--update-golden` writes it"
        assert text == expected

    def raises(self, kind: type[_E]) -> ExpectedError[_E]:
        """Expect an exception of a kind, as `pytest.raises` does, and compare its message with the next section."""
        return ExpectedError(self, kind)


class ExpectedError(Generic[_E]):
    """A block that must raise an exception whose message is the next section of a test."""

    def __init__(self, wording: Wording, kind: type[_E]) -> None:
        self._wording = wording
        self._raises = pytest.raises(kind)

    def __enter__(self) -> pytest.ExceptionInfo[_E]:
        self._raised = self._raises.__enter__()
        return self._raised

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> bool:
        is_expected = self._raises.__exit__(kind, error, traceback)
        if is_expected:
            self._wording(self._raised.value)
        return is_expected
