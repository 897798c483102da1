"""Entries with parameters, such as `move[r in robot, to in zone]`, and the choices of objects for them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from scbm.files.expansion.static_facts import QUANTIFIERS, WORD
from scbm.files.language.grammar import keywords
from scbm.files.spelling import suggestion
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.files.expansion.formulas import Formula
    from scbm.files.expansion.lifted_names import LiftedNames
    from scbm.files.expansion.static_facts import StaticFacts
    from scbm.files.yaml.text_files import ErrorCollector
    from scbm.model import Place

_KEY = re.compile(r"(?P<base>[^\[\]]*?)\s*\[(?P<index>.*)\](?P<rest>[^\[\]]*)", re.DOTALL)
_PARAMETER = re.compile(r"(?:(?P<name>[^\s:]+)(?:\s+in\s+|\s*:\s*))?(?P<kind>\S+)")

MAX_CHOICES = 10_000
"""Maximum number of instances of one entry; no section of a model has more entries."""

_MAX_VISITED = 1_000_000
"""Maximum number of partial choices that are tried, so that a refusal takes about a second."""


@dataclass(frozen=True, slots=True)
class LiftedKey:
    """A key with parameters.

    Attributes:
        base: the name before the bracket.
        kinds: the type of each parameter.
        names: the name of each parameter; one without a name has `None`.
        rest: what follows the bracket: the state of an obligation.
        place: where the key stands.
    """

    base: str
    kinds: tuple[str, ...]
    names: tuple[str | None, ...]
    rest: str
    place: Place

    @property
    def parameters(self) -> dict[str, str]:
        """The parameters that have names, with their types."""
        return {name: kind for name, kind in zip(self.names, self.kinds, strict=True) if name is not None}

    @property
    def shown(self) -> str:
        """The key as messages show it."""
        parts = (
            kind if name is None else f"{name} in {kind}" for name, kind in zip(self.names, self.kinds, strict=True)
        )
        return f"{self.base}[{', '.join(parts)}]"


def lifted_key(
    text: str, place: Place, names: LiftedNames, report: ErrorCollector, *, is_named: bool
) -> LiftedKey | None:
    """Return a key with parameters; `None` for one without brackets, or after an error, which is noted.

    Args:
        text: the key.
        place: where it stands.
        names: the names of the model.
        report: where errors go.
        is_named: whether its parameters need names, as what stands below uses them.
    """
    match = _KEY.fullmatch(text)
    if match is None or (match["rest"] and not match["rest"].startswith("/")):
        if "[" in text:
            report.add(Slug.BAD_NAME, f"`{text}` is not a name with an index", place, "write `name[r in robot]`")
        return None
    reader = _KeyReader(text, place, names, report)
    return reader.key(match, is_named=is_named)


def without_errors(text: str, facts: StaticFacts) -> tuple[str, ...] | None:
    """Return the types of the parameters of a key; `None` for a key without parameters, or with errors."""
    match = _KEY.fullmatch(text)
    parts = [_PARAMETER.fullmatch(part.strip()) for part in match["index"].split(",")] if match is not None else []
    kinds = tuple(part["kind"] for part in parts if part is not None and part["kind"] in facts.types)
    return kinds if kinds and len(kinds) == len(parts) else None


@dataclass(slots=True)
class _KeyReader:
    text: str
    place: Place
    names: LiftedNames
    report: ErrorCollector
    is_right: bool = True
    kinds: list[str] = field(default_factory=list)
    params: list[str | None] = field(default_factory=list)

    def key(self, match: re.Match[str], *, is_named: bool) -> LiftedKey | None:
        at = match.start("index")
        for part in match["index"].split(","):
            begin = at + len(part) - len(part.lstrip())
            self._parameter(part.strip(), begin, is_named=is_named)
            at += len(part) + 1
        if not self.is_right:
            return None
        return LiftedKey(match["base"], tuple(self.kinds), tuple(self.params), match["rest"], self.place)

    def _parameter(self, part: str, begin: int, *, is_named: bool) -> None:
        found = _PARAMETER.fullmatch(part)
        if found is None:
            message = f"`{part}` is not a parameter" if part else "a parameter is missing"
            self._refuse(Slug.BAD_NAME, message, begin, len(part), "write `r in robot`")
            return
        name, kind = found["name"], found["kind"]
        self._check_kind(kind, begin + found.start("kind"))
        if name is not None:
            self._check_name(name, begin)
        elif is_named and kind in self.names.facts.types:
            message = f"a parameter of the type `{kind}` has no name"
            self._refuse(Slug.BAD_NAME, message, begin, len(part), f"write for example `{kind[:1]} in {kind}`")
        self.kinds.append(kind)
        self.params.append(name)

    def _check_kind(self, kind: str, begin: int) -> None:
        types = self.names.facts.types
        if kind not in types:
            remedy = suggestion(kind, types, "the types are") or "declare it under `types`"
            self._refuse(Slug.UNKNOWN_TYPE, f"there is no type `{kind}`", begin, len(kind), remedy)

    def _check_name(self, name: str, begin: int) -> None:
        if not WORD.fullmatch(name):
            self._refuse(Slug.BAD_NAME, f"`{name}` is not a name", begin, len(name), "write letters, digits and `_`")
        elif name in keywords() or name in QUANTIFIERS:
            self._refuse(Slug.RESERVED_NAME, f"`{name}` is a reserved word", begin, len(name), "choose another name")
        elif name in self.params:
            self._refuse(Slug.DUPLICATE_NAME, f"`{name}` is a parameter already", begin, len(name))
        elif name in self.names.facts.places:
            message = f"the parameter `{name}` has the name of an object"
            self._refuse(Slug.AMBIGUOUS_SYMBOL, message, begin, len(name), "choose another name")
        elif name in self.names.plain or name in self.names.indexed:
            message = f"the parameter `{name}` has the name of a variable"
            self._refuse(Slug.AMBIGUOUS_SYMBOL, message, begin, len(name), "choose another name")

    def _refuse(self, slug: Slug, message: str, begin: int, length: int, remedy: str | None = None) -> None:
        self.is_right = False
        self.report.add(slug, message, part_of_key(self.place, self.text, begin, length), remedy)


def part_of_key(place: Place, text: str, begin: int, length: int) -> Place:
    """Return the place of some characters of a key; that of the key if it has escapes or several lines."""
    quotes = place.length - len(text)
    if quotes not in (0, 2):
        return place
    return replace(place, column=place.column + quotes // 2 + begin, length=max(1, length))


class TooManyChoices(Exception):  # noqa: N818 - it never leaves this package; outside it is a diagnostic
    """More choices than a section may have entries: how many, and whether there are still more."""

    def __init__(self, count: int, *, is_all: bool) -> None:
        super().__init__(count)
        self.shown = f"{count:,}" if is_all else f"more than {count:,}"


def choices_of(
    key: LiftedKey, objects: Mapping[str, Sequence[str]], conditions: Sequence[Formula]
) -> list[tuple[str, ...]]:
    """Return the choices of objects that satisfy all conditions, in the order of the objects, the last one fastest.

    A condition is decided as soon as all its parameters are chosen, so what it excludes is not enumerated.

    Raises:
        TooManyChoices: there are more than `MAX_CHOICES`.
        LiftedFault: a condition cannot be decided.
    """
    names = [name or f"#{number}" for number, name in enumerate(key.names)]
    listed = [objects[kind] for kind in key.kinds]
    if not conditions:
        return _all_choices(listed)
    due = _due(names, conditions)
    found: list[tuple[str, ...]] = []
    count = 0
    if not all(condition.ground({}) is True for condition in due[0]):
        return []
    for visited, chosen in enumerate(_search(names, listed, due)):
        if chosen is not None:
            count += 1
            if count <= MAX_CHOICES:
                found.append(chosen)
        if visited > _MAX_VISITED:
            raise TooManyChoices(max(count, MAX_CHOICES), is_all=False)
    if count > MAX_CHOICES:
        raise TooManyChoices(count, is_all=True)
    return found


def _due(names: Sequence[str], conditions: Sequence[Formula]) -> list[list[Formula]]:
    """Return which conditions can be decided once so many parameters are chosen."""
    due: list[list[Formula]] = [[] for _ in range(len(names) + 1)]
    for condition in conditions:
        needed = [number for number, name in enumerate(names, start=1) if name in condition.parameters]
        due[max(needed, default=0)].append(condition)
    return due


def _search(
    names: Sequence[str], listed: Sequence[Sequence[str]], due: Sequence[Sequence[Formula]]
) -> Iterator[tuple[str, ...] | None]:
    """Yield each choice that satisfies the conditions, and `None` for each partial choice that was tried."""
    choice: dict[str, str] = {}
    open_objects = [iter(listed[0])]
    while open_objects:
        depth = len(open_objects)
        chosen = next(open_objects[-1], None)
        if chosen is None:
            open_objects.pop()
            continue
        choice[names[depth - 1]] = chosen
        if not all(condition.ground(choice) for condition in due[depth]):
            yield None
        elif depth == len(names):
            yield tuple([choice[name] for name in names])
        else:
            yield None
            open_objects.append(iter(listed[depth]))


def _all_choices(listed: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    count = 1
    for objects in listed:
        count *= len(objects)
    if count > MAX_CHOICES:
        raise TooManyChoices(count, is_all=True)
    choices: list[tuple[str, ...]] = [()]
    for objects in listed:
        choices = [(*choice, each) for choice in choices for each in objects]
    return choices
