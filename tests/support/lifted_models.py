"""Random lifted models, and an independent expansion of them: slow, by texts, over all choices of objects.

A model is drawn as a tree that can be written in two ways: lifted, with parameters and quantifiers, and ground, where
each instance is a text of its own, facts are the words `true` and `false`, and a count lists all sets of objects.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING, TypeAlias

from hypothesis import strategies as st

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from hypothesis.strategies import DrawFn

Choice: TypeAlias = dict[str, str]

TYPES = {"zone": ("a", "b", "c", "d"), "robot": ("r1", "r2"), "cold": ("b",), "nothing": ()}
"""`cold` is a subtype of `zone`, and lists an object of it."""

INDICES = {"at": ("robot",), "full": ("zone",), "near": ("robot", "zone"), "gone": ("nothing",)}
DOMAINS = {"at": "zone", "full": "bool", "near": "bool", "gone": "bool"}
ROWS = {
    "way": (("a", "b"), ("b", "d"), ("b", "c"), ("b", "a")),
    "likes": (("r1", "a"), ("r2", "c")),
    "calm": (("d",), ("a",), ("c",)),
}
COLUMNS = {"way": ("zone", "zone"), "likes": ("robot", "zone"), "calm": ("zone",)}
"""Rows stand in another order than objects: instances stand in the order of the objects."""

HEADER = """behavior_model: lifted
types:
  zone: [a, b, c, d]
  robot: [r1, r2]
  cold: {objects: [b], of: zone}
  nothing: []
tables:
  way: {of: [zone, zone], rows: [[a, b], [b, d], [b, c], [b, a]]}
  likes: {of: [robot, zone], rows: [[r1, a], [r2, c]]}
  calm: {of: [zone], rows: [d, a, c]}
variables:
  at[robot]: {domain: zone, initial: a}
  full[zone]: {domain: bool, initial: false}
  near[robot, zone]: {domain: bool, initial: true}
  gone[nothing]: {domain: bool, initial: false}
"""


def declared_by_hand() -> str:
    """Return the variables as the naive expansion declares them."""
    lines = ["behavior_model: lifted", "variables:"]
    for name, kinds in INDICES.items():
        for objects in product(*(TYPES[kind] for kind in kinds)):
            domain, initial = ("[a, b, c, d]", "a") if name == "at" else ("bool", str(name == "near").lower())
            lines.append(f"  {'.'.join((name, *objects))}: {{domain: {domain}, initial: {initial}}}")
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class Expression:
    """A predicate: as it is written with parameters, and as the naive expansion writes it for a choice."""

    lifted: str
    ground: Callable[[Choice], str]


def _object(term: str, choice: Choice) -> str:
    return choice.get(term, term)


def _truth(truth: object) -> str:
    return "true" if truth else "false"


def _terms(scope: Choice, kind: str) -> list[str]:
    """Return the parameters and objects that are of a type; `scope` has the types of the parameters."""
    kinds = ("zone", "cold") if kind == "zone" else (kind,)
    return [*(name for name, other in scope.items() if other in kinds), *TYPES[kind]]


def _may_be_equal(left: str, right: str, scope: Choice) -> bool:
    """Return whether two terms may be compared: a parameter and what it can never be are an error of their own."""
    if left not in scope and right not in scope:
        return True
    objects = [TYPES[scope[term]] if term in scope else (term,) for term in (left, right)]
    return any(each in objects[1] for each in objects[0])


@st.composite
def expressions(draw: DrawFn, scope: Choice, *, static: bool, depth: int = 3) -> Expression:
    """A predicate over some parameters; a static one reads no variable."""
    facts = ["row", "same", "one_of"]
    leaves = [*facts, "of_type"] if static else [*facts, "compare", "compare", "compare", "truth"]
    kind = draw(st.sampled_from([*leaves, *(["not", "and", "or", "implies", "quantified", "count"] if depth else [])]))
    inner = expressions(scope, static=static, depth=depth - 1)
    match kind:
        case "truth":
            word = draw(st.sampled_from(["true", "false"]))
            return Expression(word, lambda _: word)
        case "row" | "same" | "one_of" | "of_type":
            return draw(_static_atoms(scope, kind))
        case "compare":
            return draw(_comparisons(scope))
        case "not":
            operand = draw(inner)
            return Expression(f"!({operand.lifted})", lambda choice: f"!({operand.ground(choice)})")
        case "quantified" | "count":
            return draw(_quantified(scope, kind, static=static, depth=depth))
    symbol = {"and": "&&", "or": "||", "implies": "->"}[kind]
    left, right = draw(inner), draw(inner)
    return Expression(
        f"({left.lifted}) {symbol} ({right.lifted})",
        lambda choice: f"({left.ground(choice)}) {symbol} ({right.ground(choice)})",
    )


@st.composite
def _static_atoms(draw: DrawFn, scope: Choice, kind: str) -> Expression:
    if kind == "row":
        name = draw(st.sampled_from(sorted(ROWS)))
        terms = [draw(st.sampled_from(_terms(scope, column))) for column in COLUMNS[name]]
        text = f"{name}({', '.join(terms)})"
        return Expression(text, lambda choice: _truth(tuple(_object(t, choice) for t in terms) in ROWS[name]))
    first = draw(st.sampled_from(_terms(scope, "zone")))
    if kind == "of_type":
        return Expression(f"{first} in cold", lambda choice: _truth(_object(first, choice) in TYPES["cold"]))
    comparable = [term for term in _terms(scope, "zone") if _may_be_equal(first, term, scope)]
    if kind == "one_of":
        listed = draw(st.lists(st.sampled_from(comparable), min_size=1, max_size=3, unique=True))
        text = f"{first} in {{{', '.join(listed)}}}"
        return Expression(text, lambda choice: _truth(_object(first, choice) in [_object(t, choice) for t in listed]))
    second = draw(st.sampled_from(comparable))
    sign = draw(st.sampled_from(["==", "!="]))
    return Expression(
        f"{first} {sign} {second}",
        lambda choice: _truth((_object(first, choice) == _object(second, choice)) == (sign == "==")),
    )


def _name(variable: str, terms: list[str], *, dotted: bool) -> str:
    return ".".join((variable, *terms)) if dotted else f"{variable}[{', '.join(terms)}]"


@st.composite
def _comparisons(draw: DrawFn, scope: Choice) -> Expression:
    variable = draw(st.sampled_from(["at", "full", "near"]))
    terms = [draw(st.sampled_from(_terms(scope, kind))) for kind in INDICES[variable]]
    value = draw(st.sampled_from(_terms(scope, "zone") if variable == "at" else ["true", "false"]))
    lifted = f"{_name(variable, terms, dotted=draw(st.booleans()))} == {value}"
    return Expression(
        lifted,
        lambda choice: f"{'.'.join((variable, *(_object(t, choice) for t in terms)))} == {_object(value, choice)}",
    )


@st.composite
def _quantified(draw: DrawFn, scope: Choice, kind: str, *, static: bool, depth: int) -> Expression:
    name = f"q{len(scope)}"
    over = draw(st.sampled_from(sorted(TYPES)))
    body = draw(expressions({**scope, name: over}, static=static, depth=depth - 1))
    head = f"{name} in {over}. ({body.lifted})"

    def instances(choice: Choice) -> list[str]:
        return [f"({body.ground({**choice, name: each})})" for each in TYPES[over]]

    if kind == "quantified":
        word, symbol, none = draw(st.sampled_from([("forall", " && ", "true"), ("exists", " || ", "false")]))
        return Expression(f"({word} {head})", lambda choice: f"({symbol.join(instances(choice)) or none})")
    relation, number = draw(st.sampled_from(_bounds_of_count(len(TYPES[over]))))
    return Expression(
        f"(count {head} {relation} {number})", lambda choice: _counted(instances(choice), relation, number)
    )


_RELATIONS: dict[str, Callable[[int, int], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def _bounds_of_count(most: int) -> list[tuple[str, int]]:
    """Return how a count from 0 to `most` may be compared: what can never hold is an error of its own."""
    pairs = [(relation, number) for relation in _RELATIONS for number in range(5)]
    return [pair for pair in pairs if not most or any(_RELATIONS[pair[0]](n, pair[1]) for n in range(most + 1))]


def _counted(instances: list[str], relation: str, number: int) -> str:
    """Return a disjunction over all sets of instances of which exactly these hold."""
    fits = _RELATIONS[relation]
    ways = []
    for size in range(len(instances) + 1):
        for chosen in combinations(range(len(instances)), size) if fits(size, number) else ():
            parts = [each if at in chosen else f"!{each}" for at, each in enumerate(instances)]
            ways.append(f"({' && '.join(parts) or 'true'})")
    return f"({' || '.join(ways) or 'false'})"


@dataclass(frozen=True)
class LiftedEntry:
    """An entry with parameters.

    Attributes:
        section: its section.
        name: its name.
        parameters: the types of its parameters.
        where: which choices it has.
        predicate: its guard or its predicate.
        action: the target and the value of its action, with the index of the target.
    """

    section: str
    name: str
    parameters: Choice
    where: Expression
    predicate: Expression
    action: tuple[str, list[str], str]

    def choices(self) -> Iterator[Choice]:
        """Yield all choices that satisfy `where`, the last parameter fastest."""
        for objects in product(*(TYPES[kind] for kind in self.parameters.values())):
            choice = dict(zip(self.parameters, objects, strict=True))
            if holds(self.where.ground(choice)):
                yield choice

    def lifted(self) -> str:
        """Return the entry as it is written with parameters."""
        head = ", ".join(f"{name} in {kind}" for name, kind in self.parameters.items())
        variable, terms, value = self.action
        body = self._body(self.predicate.lifted, f"{_name(variable, terms, dotted=True)} <- {value}")
        return f"  {self.name}[{head}]:\n    where: '{self.where.lifted}'\n{body}"

    def ground(self) -> str:
        """Return all instances."""
        variable, terms, value = self.action
        texts = []
        for choice in self.choices():
            target = ".".join((variable, *(_object(term, choice) for term in terms)))
            body = self._body(self.predicate.ground(choice), f"{target} <- {_object(value, choice)}")
            texts.append(f"  {'.'.join((self.name, *choice.values()))}:\n{body}")
        return "".join(texts)

    def _body(self, predicate: str, action: str) -> str:
        match self.section:
            case "operations":
                return f"    pre: {{g: '{predicate}'}}\n    post: {{g: true, a: ['{action}']}}\n"
            case "automatic_transitions":
                return f"    g: '{predicate}'\n    a: ['{action}']\n"
            case "environment":
                return f"    guard: '{predicate}'\n    actions: ['{action}']\n"
            case _:
                return f"    goal: '{predicate}'\n"


def holds(text: str) -> bool:
    """Return whether a predicate of the words `true` and `false` holds."""
    words = text.replace("&&", " and ").replace("||", " or ").replace("!", " not ").replace("true", "1==1")
    return bool(eval(_without_implications(words.replace("false", "1==0"))))  # noqa: S307 - a text that the test wrote


def _without_implications(text: str) -> str:
    """Return Python's form of `p -> q`, which binds least of all: both sides stand in brackets."""
    return text.replace("->", "<=")


@st.composite
def _entries(draw: DrawFn, section: str) -> LiftedEntry:
    kinds = draw(st.lists(st.sampled_from(["zone", "robot", "cold"]), min_size=1, max_size=3))
    parameters = {f"p{number}": kind for number, kind in enumerate(kinds)}
    variable = draw(st.sampled_from(["at", "full", "near"]))
    terms = [draw(st.sampled_from(_terms(parameters, kind))) for kind in INDICES[variable]]
    value = draw(st.sampled_from(_terms(parameters, "zone") if variable == "at" else ["true", "false"]))
    return LiftedEntry(
        section,
        f"{section[:3]}_entry",
        parameters,
        draw(expressions(parameters, static=True, depth=2)),
        draw(expressions(parameters, static=False)),
        (variable, terms, value),
    )


SECTIONS = ("operations", "automatic_transitions", "environment", "goals")


@st.composite
def lifted_models(draw: DrawFn) -> tuple[str, str]:
    """A random lifted model, and its naive expansion."""
    entries = [draw(_entries(section)) for section in SECTIONS]
    allowed = draw(expressions({}, static=False))
    always = draw(expressions({}, static=False))
    lifted = [HEADER, *(f"{entry.section}:\n{entry.lifted()}" for entry in entries)]
    ground = [declared_by_hand(), *(f"{entry.section}:\n{entry.ground()}" for entry in entries)]
    ground = [text if text.count("\n") > 1 else text.replace(":\n", ": {}\n") for text in ground]
    lifted.append(f"initial_states: '{allowed.lifted}'\nrequirements: {{safe: 'always {always.lifted}'}}\n")
    ground.append(f"initial_states: '{allowed.ground({})}'\nrequirements: {{safe: 'always {always.ground({})}'}}\n")
    return "".join(lifted), "".join(ground)
