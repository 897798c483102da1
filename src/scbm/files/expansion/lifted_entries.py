"""Entries with parameters, such as `move[r in robot, to in zone]`, and the choices of objects for them."""

from __future__ import annotations

import re
from itertools import chain, product
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.files.expansion.static_facts import WORD
from scbm.files.language.grammar import QUANTIFIERS, keywords
from scbm.files.spelling import suggestion
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from scbm.files.expansion.lifted_names import LiftedScope
    from scbm.files.expansion.object_formulas import Choice, Formula
    from scbm.files.expansion.static_facts import StaticFacts
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.model import Place

_KEY = re.compile(r"(?P<base>[^\[\]]*?)\s*\[(?P<index>.*)\](?P<rest>[^\[\]]*)", re.DOTALL)
_PARAMETER = re.compile(r"(?:(?P<name>[^\s:]+)(?:\s+in\s+|\s*:\s*))?(?P<kind>\S+)")

MAX_CHOICES = 10_000
"""Maximum number of instances of one entry; no section of a model has more entries."""

_MAX_VISITED = 300_000
"""Maximum number of partial choices that are tried, so that a refusal takes about a second."""

_MAX_COUNTED = 100_000
"""Maximum number of partial choices that are tried once there are too many choices, to say how many."""


_MAX_TRIED = 20_000
"""Maximum number of partial choices that are tried to find one choice; an import of PDDL asks for hundreds."""


class LiftedKey(Struct, frozen=True):
    """A key with parameters.

    Attributes:
        base: the name before the bracket.
        kinds: the type of each parameter.
        names: the name of each parameter; one without a name has `None`.
        rest: what follows the bracket: the state of an obligation.
        place: where the key stands.
        is_right: whether the parameters have no errors; the type of one with an error is empty.
    """

    base: str
    kinds: tuple[str, ...]
    names: tuple[str | None, ...]
    rest: str
    place: Place
    is_right: bool = True

    @property
    def parameters(self) -> dict[str, str]:
        """The parameters that have names, with their types."""
        return self.objects(self.kinds)

    def objects(self, choice: Sequence[str]) -> dict[str, str]:
        """Return the objects of a choice by the parameters that have names."""
        return {name: each for name, each in zip(self.names, choice, strict=True) if name is not None}

    @property
    def shown(self) -> str:
        """The key as messages show it."""
        parts = (
            kind if name is None else f"{name} in {kind}" for name, kind in zip(self.names, self.kinds, strict=True)
        )
        return f"{self.base}[{', '.join(parts)}]"


def lifted_key(
    text: str, place: Place, scope: LiftedScope, report: ErrorCollector, *, is_named: bool
) -> LiftedKey | None:
    """Return a key with parameters; `None` for one without brackets, or without names for its parameters. Note errors.

    Args:
        text: the key.
        place: where it stands.
        scope: the names of the model, and the part that has the key.
        report: where errors go.
        is_named: whether its parameters need names, as what stands below uses them.
    """
    match = _KEY.fullmatch(text)
    if match is None or (match["rest"] and not match["rest"].startswith("/")):
        if "[" in text:
            report.add(Slug.BAD_NAME, f"`{text}` is not a name with an index", place, "write `name[r in robot]`")
        return None
    reader = _KeyReader(text, place, scope, report)
    return reader.key(match, is_named=is_named)


def without_errors(text: str, facts: StaticFacts) -> tuple[str, ...] | None:
    """Return the types of the parameters of a key; `None` for a key without parameters, or with errors."""
    match = _KEY.fullmatch(text)
    parts = [_PARAMETER.fullmatch(part.strip()) for part in match["index"].split(",")] if match is not None else []
    kinds = tuple(part["kind"] for part in parts if part is not None and part["kind"] in facts.types)
    return kinds if kinds and len(kinds) == len(parts) else None


class _KeyReader(Struct):
    text: str
    place: Place
    scope: LiftedScope
    report: ErrorCollector
    is_right: bool = True
    is_read: bool = True
    kinds: list[str] = field(default_factory=list)
    params: list[str | None] = field(default_factory=list)

    def key(self, match: re.Match[str], *, is_named: bool) -> LiftedKey | None:
        at = match.start("index")
        for part in match["index"].split(","):
            begin = at + len(part) - len(part.lstrip())
            self._parameter(part.strip(), begin, is_named=is_named)
            at += len(part) + 1
        if not self.is_read:
            return None
        kinds, names = tuple(self.kinds), tuple(self.params)
        return LiftedKey(match["base"], kinds, names, match["rest"], self.place, all(kinds))

    def _parameter(self, part: str, begin: int, *, is_named: bool) -> None:
        found = _PARAMETER.fullmatch(part)
        if found is None:
            message = f"`{part}` is not a parameter" if part else "a parameter is missing"
            self._refuse(Slug.BAD_NAME, message, begin, len(part), "write `r in robot`")
            self.is_read = False
            return
        name, kind = found["name"], found["kind"]
        self.is_right = True
        self._check_kind(kind, begin + found.start("kind"))
        if name is not None:
            self._check_name(name, begin)
        elif is_named and self.is_right:
            message = f"a parameter of the type `{kind}` has no name"
            self._refuse(Slug.BAD_NAME, message, begin, len(part), f"write for example `{kind[:1]} in {kind}`")
        self.is_read = self.is_read and (name is not None or not is_named)
        self.kinds.append(kind if self.is_right else "")
        self.params.append(name)

    def _check_kind(self, kind: str, begin: int) -> None:
        types = self.scope.names.facts.types
        if kind not in types and self.scope.names.facts.misses_names:
            self.is_right = False
        elif kind not in types:
            remedy = suggestion(kind, types, "the types are") or "declare it under `types`"
            self._refuse(Slug.UNKNOWN_TYPE, f"there is no type `{kind}`", begin, len(kind), remedy)

    def _check_name(self, name: str, begin: int) -> None:
        if not WORD.fullmatch(name):
            self._refuse(Slug.BAD_NAME, f"`{name}` is not a name", begin, len(name), "write letters, digits and `_`")
            self.is_read = False
        elif name in keywords() or name in QUANTIFIERS:
            self._refuse(Slug.RESERVED_NAME, f"`{name}` is a reserved word", begin, len(name), "choose another name")
            self.is_read = False
        elif name in self.params:
            self._refuse(Slug.DUPLICATE_NAME, f"`{name}` is a parameter already", begin, len(name))
        elif (hidden := self.scope.hidden_by(name)) is not None:
            message = f"the parameter `{name}` has the name of {hidden}"
            self._refuse(Slug.AMBIGUOUS_SYMBOL, message, begin, len(name), "choose another name")

    def _refuse(self, slug: Slug, message: str, begin: int, length: int, remedy: str | None = None) -> None:
        self.is_right = False
        self.report.add(slug, message, self._place_of(begin, length), remedy)

    def _place_of(self, begin: int, length: int) -> Place:
        """Return the place of some characters of the key; in a part, the written key has no prefix."""
        written = self.report.underlined(self.place)
        word = self.text[begin : begin + length]
        if self.text in written or not WORD.fullmatch(word):
            return part_of_key(self.place, self.text, begin, length)
        found = list(re.finditer(rf"\b{re.escape(word)}\b", written))
        if len(found) != 1:
            return self.place
        return replace(self.place, column=self.place.column + found[0].start(), length=length)


def part_of_key(place: Place, text: str, begin: int, length: int) -> Place:
    """Return the place of some characters of a key; that of the key if it has escapes or several lines."""
    quotes = place.length - len(text)
    if quotes not in (0, 2):
        return place
    return replace(place, column=place.column + quotes // 2 + begin, length=max(1, length))


class TooManyChoices(Exception):  # noqa: N818 - it never leaves this package; outside it is a diagnostic
    """More choices than a section may have entries; or too many partial choices were tried to find out.

    Attributes:
        shown: what an entry has too much of, for messages.
    """

    def __init__(self, count: int, *, is_all: bool) -> None:
        super().__init__(count)
        self.shown = f"{'' if is_all else 'more than '}{count:,} instances; at most {MAX_CHOICES:,} are built"
        if count <= MAX_CHOICES:
            self.shown = f"more than {_MAX_VISITED:,} choices of objects to try for its condition"


def choices_of(
    key: LiftedKey, objects: Mapping[str, Sequence[str]], conditions: Sequence[Formula]
) -> list[tuple[str, ...]]:
    """Return the choices of objects that satisfy all conditions, in the order of the objects, the last one fastest.

    Parameters that no condition joins are chosen apart, so the number of all choices is a product. A condition is
    decided as soon as all its parameters are chosen, so what it excludes is not enumerated.

    Raises:
        TooManyChoices: there are more than `MAX_CHOICES`.
        SyntaxFault: a condition cannot be decided.
    """
    names = [name or f"#{number}" for number, name in enumerate(key.names)]
    listed = {name: objects[kind] for name, kind in zip(names, key.kinds, strict=True)}
    if not all(condition.ground({}) is True for condition in conditions if not condition.parameters):
        return []
    groups = [_Group(group, listed, conditions) for group in _joined_names(names, conditions)]
    count = 1
    for group in groups:
        group.search(count)
        count *= group.count
        if not count:
            return []
    if count > MAX_CHOICES or not all(group.is_all for group in groups):
        raise TooManyChoices(count, is_all=all(group.is_all for group in groups))
    return _products(groups, listed)


def has_choice(objects: Mapping[str, Sequence[str]], conditions: Sequence[Formula]) -> bool:
    """Return whether some objects for parameters satisfy all conditions; also true if there are too many to try.

    Args:
        objects: the objects of each parameter.
        conditions: the conditions.
    """
    if not all(condition.ground({}) for condition in conditions if not condition.parameters):
        return False
    groups = [_Group(names, objects, conditions) for names in _joined_names([*objects], conditions)]
    for group in groups:
        group.search(1, enough=1, most=_MAX_TRIED)
    return all(group.count or not group.is_all for group in groups)


def _joined_names(names: Sequence[str], conditions: Sequence[Formula]) -> list[list[str]]:
    """Return the parameters in groups, small ones first: no condition reads parameters of two groups."""
    groups = [[name] for name in names]
    for condition in conditions:
        read = [group for group in groups if not condition.parameters.isdisjoint(group)]
        if len(read) > 1:
            groups = [group for group in groups if group not in read]
            groups.append([name for name in names if any(name in group for group in read)])
    return sorted(groups, key=len)


def _products(groups: Sequence[_Group], listed: Mapping[str, Sequence[str]]) -> list[tuple[str, ...]]:
    """Return the choices that the choices of all groups make together, in the order of the objects."""
    if len(listed) == len(groups):  # each parameter is chosen apart: they are in order
        return [tuple(each for (each,) in chosen) for chosen in product(*(group.found for group in groups))]
    ranks = {name: {each: rank for rank, each in enumerate(objects)} for name, objects in listed.items()}
    order = [name for group in groups for name in group.names]
    columns = [order.index(name) for name in listed]
    whole = [tuple(chain.from_iterable(chosen)) for chosen in product(*(group.found for group in groups))]
    choices = [tuple([chosen[column] for column in columns]) for chosen in whole]
    orders = list(ranks.values())
    return sorted(choices, key=lambda choice: [rank[each] for rank, each in zip(orders, choice, strict=True)])


class _Group:
    """Parameters that conditions join.

    Attributes:
        names: the parameters in the order in which they are chosen: those that others decide as soon as possible.
        found: the choices, at most `MAX_CHOICES`.
        count: the number of all choices that were found.
        is_all: whether the search ended, so that there are no more.
    """

    def __init__(
        self, names: Sequence[str], listed: Mapping[str, Sequence[str]], conditions: Sequence[Formula]
    ) -> None:
        """Take the parameters, the objects of each, and the conditions of the entry."""
        conditions = [each for each in conditions if not each.parameters.isdisjoint(names)]
        self.names: list[str] = []
        self.found: list[tuple[str, ...]] = []
        self.count = 0
        self.is_all = True
        self._ranks: list[dict[str, int]] = []
        self._due: list[list[Formula]] = []
        self._joined: list[list[Formula]] = []
        readers = {name: [each for each in conditions if name in each.parameters] for name in names}
        sizes = {name: min(_sizes(name, readers[name], listed[name])) for name in names}

        def order(name: str) -> tuple[bool, bool, int]:
            is_joined = any(not each.parameters.isdisjoint(self.names) for each in readers[name])
            return not _due(name, self.names, conditions), not is_joined, sizes[name]

        while len(self.names) < len(names):
            name = min((name for name in names if name not in self.names), key=order)
            self._due.append(_due(name, self.names, conditions))
            self._joined.append(readers[name])
            self._ranks.append({each: rank for rank, each in enumerate(listed[name])})
            self.names.append(name)

    def search(self, factor: int, *, enough: int | None = None, most: int = _MAX_VISITED) -> None:
        """Find the choices that satisfy the conditions. Raises `SyntaxFault`.

        Args:
            factor: the number of choices of earlier groups, each of which is joined with each of these.
            enough: the number of choices after which the search ends.
            most: the maximum number of partial choices that are tried.
        """
        choice: dict[str, str] = {}
        last = len(self.names)
        visited = 0
        open_objects = [iter(self._candidates(0, choice))]
        while open_objects and self.count != enough:
            depth = len(open_objects)
            chosen = next(open_objects[-1], None)
            if chosen is None:
                open_objects.pop()
                choice.pop(self.names[depth - 1], None)
                continue
            visited += 1
            if visited > (most if self.count * factor <= MAX_CHOICES else _MAX_COUNTED):
                self.is_all = False
                return
            choice[self.names[depth - 1]] = chosen
            if not all(condition.ground(choice) for condition in self._due[depth - 1]):
                continue
            if depth < last:
                open_objects.append(iter(self._candidates(depth, choice)))
                continue
            self.count += 1
            if self.count <= MAX_CHOICES:
                self.found.append(tuple([choice[name] for name in self.names]))

    def _candidates(self, depth: int, choice: Choice) -> Collection[str]:
        """Return the objects of a parameter in the order of its type: those that all conditions allow, or all."""
        ranks = self._ranks[depth]
        name = self.names[depth]
        found = (condition.candidates(name, choice) for condition in self._joined[depth])
        narrow = sorted((each for each in found if each is not None and len(each) < len(ranks)), key=len)
        if not narrow:
            return ranks
        fewest, *others = narrow
        return sorted(
            (each for each in fewest if each in ranks and all(each in other for other in others)), key=ranks.__getitem__
        )


def _sizes(name: str, conditions: Sequence[Formula], objects: Sequence[str]) -> Iterator[int]:
    """Yield how many objects a parameter can have: those of its type, and those that each condition alone allows."""
    yield len(objects)
    yield from (len(each) for condition in conditions if (each := condition.candidates(name, {})) is not None)


def _due(name: str, chosen: Sequence[str], conditions: Sequence[Formula]) -> list[Formula]:
    """Return the conditions that can be decided once one more parameter is chosen."""
    known = {*chosen, name}
    return [each for each in conditions if name in each.parameters and each.parameters <= known]
