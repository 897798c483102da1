"""Mutants of lifted models and of parts: each number is one mutant, the same in every run."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from scbm.files.yaml.yaml_writer import dump
from support.mutations import CHARACTERS, VALUE, VALUES, WORD

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).parents[2]
PARTS = ROOT / "src" / "scbm" / "files" / "parts"
MODELS = [
    *(ROOT / "tests" / "models" / "valid" / f"{name}.yaml" for name in ("objects", "handshakes", "parts")),
    *sorted(
        path for path in (ROOT / "examples").glob("*/*.yaml") if re.search(r"(?m)^(types|parts):", path.read_text())
    ),
]
"""The lifted models of the tests and of the examples."""

_LIFTED_WORDS = [
    *(
        "forall r in robot. (",
        "exists z in zone. ",
        "count r in robot. (",
        ") >= 2",
        "[r in robot]",
        "[zone]",
        "where:",
    ),
    *(
        "[",
        "]",
        "[r, z]",
        ".r",
        ".state",
        "in {",
        "request:",
        "with: {",
        "use:",
        "include: ",
        "types:",
        "parts:",
        "of:",
    ),
    *("tables: {", "$", "{r}", "scbm:gripper", "door.yaml", "../", "objects:", "_req_state", "_req_trigger"),
]
"""Words that only lifted models have."""


@dataclass(frozen=True)
class Mutant:
    """A mutated text, and the file that it is a mutant of."""

    source: Path
    text: str

    @property
    def is_part(self) -> bool:
        """Whether the text is a part, which needs a model that uses it."""
        return self.source.parent == PARTS


def mutant(number: int) -> Mutant:
    """Return the mutant with a number: a model or a part after one to four changes, of its text or of its tree."""
    random = Random(f"mutant {number}")
    source = random.choice(_sources())
    text = _text(source)
    for _ in range(random.choice((1, 1, 2, 3, 4))):
        changed: str | None = random.choice(_CHANGES)(random, text)
        text = changed or text
    return Mutant(source, text.encode("utf-8", "replace").decode("utf-8"))


@cache
def _sources() -> tuple[Path, ...]:
    return (*MODELS, *sorted(PARTS.glob("*.yaml")))


@cache
def _text(source: Path) -> str:
    return source.read_text(encoding="utf-8")


# changes of texts


def _change_characters(random: Random, text: str) -> str:
    at = random.randrange(len(text) + 1)
    inserted: str = random.choice(["", *CHARACTERS])
    return text[:at] + inserted + text[at + random.randrange(3) :]


def _change_lines(random: Random, text: str) -> str:
    lines = text.splitlines(keepends=True)
    first, second = (random.randrange(len(lines)) for _ in range(2))
    match random.randrange(5):
        case 0:
            del lines[first]
        case 1:
            lines.insert(second, lines[first])
        case 2:
            lines[first], lines[second] = lines[second], lines[first]
        case 3:
            lines[first] = " " * random.randrange(8) + lines[first].lstrip(" ")
        case _:
            del lines[first + 1 :]
    return "".join(lines)


def _replace(random: Random, text: str, pattern: re.Pattern[str], replacements: list[str]) -> str | None:
    found = [match.span() for match in pattern.finditer(text)]
    if not found or not replacements:
        return None
    begin, end = random.choice(found)
    return text[:begin] + random.choice(replacements) + text[end:]


def _change_word(random: Random, text: str) -> str | None:
    return _replace(random, text, WORD, sorted(dict.fromkeys(WORD.findall(text))))


def _change_value(random: Random, text: str) -> str | None:
    return _replace(random, text, VALUE, VALUES)


def _insert_lifted_words(random: Random, text: str) -> str | None:
    return _replace(random, text, re.compile(r"\b|(?<=[\[({])|(?=[\])}])"), _LIFTED_WORDS)


def _change_index(random: Random, text: str) -> str | None:
    """Change what stands in brackets: the parameters of a key, an index, a list."""
    words = sorted(dict.fromkeys(WORD.findall(text)))
    indices = ["[]", "[r]", f"[{random.choice(words)}]" if words else "[x]", f"[p in {random.choice(words or ['x'])}]"]
    return _replace(random, text, re.compile(r"\[[^\[\]\n]*\]"), indices)


# changes of trees


def _change_tree(random: Random, text: str) -> str | None:
    """Change the tree of a text once: drop, copy, swap, rename or replace a node; `None` if it is no YAML mapping."""
    try:
        data = YAML(typ="safe", pure=True).load(text)
    except (YAMLError, ValueError):
        return None
    slots = [*_slots(data)]
    if not slots:
        return None
    (owner, key), (other, other_key) = random.choice(slots), random.choice(slots)
    match random.randrange(7):
        case 0:
            del owner[key]
        case 1:
            owner[key] = _copied(other[other_key])
        case 2:
            owner[key], other[other_key] = _copied(other[other_key]), _copied(owner[key])
        case 3:
            owner[key] = random.choice([[], {}, None, [owner[key]], {"x": owner[key]}, {"objects": owner[key]}])
        case 4 if isinstance(owner, dict) and isinstance(other, dict):
            owner[other_key] = owner.pop(key)
        case 5 if isinstance(other, dict):
            other[str(key)] = _copied(owner[key])
        case _:
            owner[key] = [f"o{number}" for number in range(random.choice((1, 3, 30, 300)))]
    try:
        return dump(data)
    except (TypeError, ValueError, RecursionError):
        return None


def _slots(data: object) -> list[tuple[Any, Any]]:
    """Return all places of values in a tree: each as its mapping or list, and the key or the index there."""
    own = [*data.items()] if isinstance(data, dict) else [*enumerate(data)] if isinstance(data, list) else []
    return [slot for key, value in own for slot in ((data, key), *_slots(value))]


def _copied(data: object) -> object:
    if isinstance(data, dict):
        return {key: _copied(value) for key, value in data.items()}
    return [_copied(value) for value in data] if isinstance(data, list) else data


_CHANGES: tuple[Callable[[Random, str], str | None], ...] = (
    _change_characters,
    _change_lines,
    _change_word,
    _change_word,
    _change_value,
    _insert_lifted_words,
    _change_index,
    _change_tree,
    _change_tree,
    _change_tree,
)
