"""Resolves syntax trees to predicates, actions and requirements; checks names, kinds and domains (semantics 2)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import prod
from typing import TYPE_CHECKING, Protocol, assert_never, cast

from lark import Token
from msgspec import Struct

from scbm.files.language.grammar import form_of
from scbm.files.language.quantities import parse_duration
from scbm.files.language.scope import Scope, Where, overlap
from scbm.files.language.syntax import NO_CLOCKS, NO_HYPHENS, SLUGS, Start, SyntaxFault, SyntaxTree, extent, parse
from scbm.files.spelling import nearest, suggestion
from scbm.model import Slug
from scbm.model.normal_form import MAX_SUM_VALUES, count_cases
from scbm.model.operations import Action, Add, Assign
from scbm.model.predicates import (
    And,
    Constant,
    Equal,
    Extreme,
    ExtremeKind,
    Implies,
    Member,
    Not,
    NotEqual,
    Or,
    Order,
    Predicate,
    Reference,
    Relation,
    Sum,
    Term,
    Truth,
    bounds,
    substituted,
)
from scbm.model.requirements import PlaceholderKind, kinds_of
from scbm.model.values import Domain, Value, ValueKind, format_value, kind_of
from scbm.model.variables import Role, Variable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from scbm.model.requirements import RequirementForm

_CLOCKS = ("elapsed", "time", "now", "clock", "timer")
"""Names under which people look for a clock."""

_COMPARE = "a predicate compares it: write for example `a + b <= 5`"

_MAX_DIGITS = 18
"""The maximum number of digits of an integer in a domain."""


class Complain(Protocol):
    """A callback that notes an error or a warning about the characters `begin..end` of the text being resolved."""

    def __call__(self, slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
        """Note an error or a warning."""


class Suggest(Protocol):
    """Returns a remedy for an unknown name in the stretch of a text from `begin` to `end`."""

    def __call__(self, name: str, known: Iterable[str], what: str, begin: int, end: int) -> str | None:
        """Return the most similar known name; otherwise the known names after the words `what`."""


def _suggestion(name: str, known: Iterable[str], what: str, begin: int, end: int) -> str | None:  # noqa: ARG001 - a text alone is in no part
    return suggestion(name, known, what)


class _Word(Struct, frozen=True):
    """A term that is a name but no variable: a symbol or a mistake, depending on the other operand."""

    name: str


@dataclass(slots=True)
class Resolver:
    """Resolves trees in one scope at one sort of place.

    All errors of a tree are noted; the result is `None` if there are any. Warnings are noted if `warn` is there.
    """

    scope: Scope
    where: Where
    complain: Complain
    suggest: Suggest = _suggestion
    warn: Complain | None = None
    _start: Start = field(default="predicate", init=False)

    # whole texts

    def read_predicate(self, text: str | SyntaxTree) -> Predicate | None:
        """Return the predicate of a text."""
        tree = self._tree(text, "predicate")
        return None if tree is None else self.predicate(tree)

    def read_action(self, text: str | SyntaxTree) -> Action | None:
        """Return the action of a text."""
        tree = self._tree(text, "action")
        return None if tree is None else self.action(tree)

    def read_requirement(self, text: str | SyntaxTree) -> RequirementForm | None:
        """Return the requirement of a text."""
        tree = self._tree(text, "requirement")
        return None if tree is None else self.requirement(tree)

    def _tree(self, text: str | SyntaxTree, start: Start) -> SyntaxTree | None:
        self._start = start
        if not isinstance(text, str):
            return text
        try:
            return parse(text, start)
        except SyntaxFault as fault:
            self.complain(fault.slug, fault.message, fault.begin, fault.end, fault.remedy)
            return None

    # predicates

    def predicate(self, tree: SyntaxTree) -> Predicate | None:
        """Return the predicate of a tree."""
        match tree.data:
            case "comparison":
                return self._comparison(tree)
            case "case":
                return self._case(tree)
            case "member":
                return self._member(tree)
            case "bare":
                return self._bare(_child(tree, 0))
            case _:
                return self._connective(tree)

    def _connective(self, tree: SyntaxTree) -> Predicate | None:
        """Return `!`, `&&`, `||`, `->` or brackets; resolve all operands, even after a wrong one."""
        operands = [self.predicate(_child(tree, index)) for index in range(len(tree.children))]
        whole = tuple(operand for operand in operands if operand is not None)
        return _connect(tree.data, whole) if len(whole) == len(operands) else None

    def _bare(self, tree: SyntaxTree) -> Predicate | None:
        """Return `true` or `false`; note an error for any other operand without a comparison."""
        word = tree.children[0] if tree.data == "term" else None
        if isinstance(word, Token) and word.type in ("TRUE", "FALSE"):
            return Truth(word == "true")
        begin, end = extent(tree)
        if isinstance(word, Token) and word.type == "NAME":
            self._refuse_bare(str(word), begin, end)
        elif not self._has_hyphen(tree):
            what = "number" if word is not None else "sum"
            self.complain(SLUGS[self._start], f"this {what} is compared with nothing", begin, end, _COMPARE)
        return None

    def _refuse_bare(self, name: str, begin: int, end: int) -> None:
        variable = self.scope.variables.get(name)
        if variable is not None:
            value = "true" if variable.domain.kind is ValueKind.BOOLEAN else format_value(variable.initial)
            message = f"`{name}` is a variable, not a predicate"
            self.complain(Slug.NOT_A_PREDICATE, message, begin, end, f"compare it: `{name} == {value}`")
        elif name not in self.scope.variables:
            near = nearest(name, (*self._readable(), "true", "false"))
            remedy = f"did you mean a comparison with `{near}`?" if near else "compare a variable with a value"
            remedy = f"write `{near}`" if near in ("true", "false") else remedy
            self.complain(Slug.NOT_A_PREDICATE, f"`{name}` is not a predicate", begin, end, remedy)

    def _readable(self, domain: Domain | None = None) -> tuple[str, ...]:
        """Return the variables that an expression here can read; with a domain, those that can equal a value of it."""
        return self.scope.readable(domain, has_runner=self.where.has_runner)

    def _comparison(self, tree: SyntaxTree) -> Predicate | None:
        operator = _token(tree, 1)
        left, right = self._term(_child(tree, 0)), self._term(_child(tree, 2))
        if left is None or right is None:
            return None
        if isinstance(left, Sum | Extreme) or isinstance(right, Sum | Extreme):
            return self._sum_comparison(operator, tree, left, right)
        if not isinstance(left, Reference) and not isinstance(right, Reference):
            self._refuse_two_values(tree, left, right)
            return None
        if isinstance(left, Reference) and isinstance(right, Reference) and not self._comparable(tree, left, right):
            return None
        first = self._fitted(left, right, _child(tree, 0))
        second = self._fitted(right, left, _child(tree, 2))
        if first is None or second is None or not self._ordered(operator, tree, first, second):
            return None
        return _compare(operator, first, second)

    def _fitted(self, term: Term | _Word, other: Term | _Word, tree: SyntaxTree) -> Term | None:
        """Return the term itself if it is a variable, else as a value of the variable on the other side."""
        if isinstance(term, Reference):
            return term
        return self._constant(term, other, tree) if isinstance(other, Reference) else None

    def _ordered(self, operator: str, tree: SyntaxTree, first: Term, second: Term) -> bool:
        """Return whether the operator fits its operands: an order needs integers."""
        reference = first if isinstance(first, Reference) else second
        if operator in ("==", "!=") or not isinstance(reference, Reference):
            return True
        domain = self._domain(reference)
        if domain is None or domain.kind is ValueKind.INTEGER:
            return domain is not None
        begin, end = extent(tree)
        message = f"`{operator}` compares integers, and `{reference.name}` is {_described(domain)}"
        self.complain(Slug.ORDER_NEEDS_INTEGERS, message, begin, end)
        return False

    def _member(self, tree: SyntaxTree) -> Predicate | None:
        name = tree.children[0]
        assert isinstance(name, Token)  # noqa: S101 - the grammar says so
        reference = self._variable(str(name), *extent(name))
        members: dict[Constant, None] = {}
        for index in range(1, len(tree.children)):
            child = _child(tree, index)
            term = self._term(child)
            if isinstance(term, Reference):
                message = f"`{term.name}` is a variable, and a set has values"
                remedy = f"write `{name} == {term.name}`, joined with `||`"
                self.complain(Slug.PREDICATE_SYNTAX, message, *extent(child), remedy)
            if reference is None or term is None or isinstance(term, Reference):
                continue
            constant = self._constant(term, reference, child)
            if constant is not None and constant in members:
                self.complain(Slug.DUPLICATE_VALUE, f"`{constant}` is listed twice", *extent(child))
            elif constant is not None:
                members[constant] = None
        if len(tree.children) == 1:
            message = "`in {}` holds for no value"
            self.complain(Slug.PREDICATE_SYNTAX, message, *extent(tree), "list at least one value")
        if reference is None or len(members) < len(tree.children) - 1 or not members:
            return None
        return Member(reference, tuple(members))

    # terms

    def _term(self, tree: SyntaxTree) -> Term | _Word | None:
        """Return a variable, a value, a sum, or a word that may be a symbol; `None` after an error."""
        if tree.data in ("sum", "extreme"):
            return self._calculation(tree)
        token = tree.children[0]
        assert isinstance(token, Token)  # noqa: S101 - the grammar says so
        if token.type == "INTEGER":
            return self._integer(token)
        if token.type in ("TRUE", "FALSE"):
            return Constant(token.type == "TRUE")
        if token in self.scope.variables:
            return self._variable(str(token), *extent(token))
        return _Word(str(token))

    def _integer(self, token: Token) -> Constant | None:
        digits = token.lstrip("-").lstrip("0")
        if len(digits) > _MAX_DIGITS:
            message = f"`{token}` is larger than any integer of a domain"
            self.complain(Slug.VALUE_OUTSIDE_DOMAIN, message, *extent(token))
            return None
        return Constant(-int(digits or "0") if token.startswith("-") else int(digits or "0"))

    def _variable(self, name: str, begin: int, end: int) -> Reference | None:
        if name not in self.scope.variables:
            self._unknown_variable(name, begin, end)
            return None
        variable = self.scope.variables[name]
        if variable is None:
            return None
        if not self.where.has_runner and variable.role.is_runner:
            what = "goals and initial states" if self.where is Where.WORLD else "environment transitions"
            message = f"`{name}` is a variable of the runner; {what} can read none"
            self.complain(Slug.RUNNER_VARIABLE, message, begin, end)
            return None
        return Reference(name)

    def _unknown_variable(self, name: str, begin: int, end: int) -> None:
        if self.scope.is_object(name):
            remedy = self.suggest("", self._readable(), "the variables are", begin, end)
            message = f"`{name}` is an object, and a variable is needed here"
            self.complain(Slug.UNKNOWN_VARIABLE, message, begin, end, remedy)
        elif not self.scope.may_miss(name):
            is_clock = name.lower() in _CLOCKS
            near = None if is_clock else self.suggest(name, self._readable(), "the variables are", begin, end)
            remedy = NO_CLOCKS if is_clock else near
            self.complain(Slug.UNKNOWN_VARIABLE, f"there is no variable `{name}`", begin, end, remedy)

    def _refuse_two_values(self, tree: SyntaxTree, left: object, right: object) -> None:
        """Note a comparison without a variable; name the word that was probably meant to be one."""
        for side, child in ((left, _child(tree, 0)), (right, _child(tree, 2))):
            if isinstance(side, _Word) and (side is left or not self._is_value(side.name)):
                if side is left and self._is_value(side.name) and isinstance(right, _Word):
                    continue  # `home == robot_ta`: the other side is the mistake, unless it is a value too
                self._unknown_variable(side.name, *extent(child))
                return
        message = "this compares two values and no variable"
        self.complain(Slug.COMPARES_NO_VARIABLE, message, *extent(tree))

    def _is_value(self, name: str) -> bool:
        return self.scope.has(name) or self.scope.is_object(name)

    def _constant(self, term: Term | _Word, other: Reference, tree: SyntaxTree) -> Constant | None:
        """Return the term as a value of the variable that it is compared with or assigned to."""
        domain = self._domain(other)
        if domain is None or not isinstance(term, Constant | _Word):
            return None
        value: Value = term.name if isinstance(term, _Word) else term.constant
        if value in domain:
            return Constant(value)
        self._misfit(term, value, other.name, domain, tree)
        return None

    def _misfit(self, term: Constant | _Word, value: Value, name: str, domain: Domain, tree: SyntaxTree) -> None:
        """Note a value outside the domain of variable `name`, or an unknown word."""
        if isinstance(term, _Word) and self.scope.may_miss(term.name):
            return
        shown = format_value(value)
        begin, end = extent(tree)
        if domain.kind is kind_of(value):
            message = f"`{shown}` is not a value of `{name}`"
            self.complain(Slug.VALUE_OUTSIDE_DOMAIN, message, begin, end, self._value_remedy(shown, domain))
        elif isinstance(term, _Word) and not self.scope.has(shown) and not self.scope.is_object(shown):
            self._unknown_name(shown, name, domain, begin, end)
        else:
            what = "an object" if self.scope.is_object(shown) else _KINDS[kind_of(value)]
            message = f"`{name}` is {_described(domain)}, and `{shown}` is {what}"
            remedy = "write `true` or `false`" if domain.kind is ValueKind.BOOLEAN else None
            self.complain(Slug.DIFFERENT_KINDS, message, begin, end, remedy)

    def _unknown_name(self, shown: str, name: str, domain: Domain, begin: int, end: int) -> None:
        """Note an unknown word where only a variable, a number or a truth value fits."""
        truths = [format_value(value) for value in domain.values if domain.kind is ValueKind.BOOLEAN]
        near = nearest(shown, [*truths, *self._readable(domain)])
        remedy = f"did you mean `{near}`?" if near else f"`{name}` is {_described(domain)}"
        if domain.kind is ValueKind.BOOLEAN and not near:
            remedy = "write `true` or `false`"
        self.complain(Slug.UNKNOWN_NAME, f"`{shown}` is neither a variable nor a value", begin, end, remedy)

    def _value_remedy(self, shown: str, domain: Domain) -> str | None:
        if domain.kind is not ValueKind.SYMBOL:
            return f"its domain is {domain}"
        values = [format_value(value) for value in domain.values]
        near = nearest(shown, values)
        if near is None and not self.scope.has(shown):
            near = nearest(shown, self._readable(domain))
        return f"did you mean `{near}`?" if near else suggestion(shown, values, "its values are")

    def _comparable(self, tree: SyntaxTree, left: Reference, right: Reference) -> bool:
        """Return whether two variables can be compared (semantics 2.2)."""
        mine, other = self._domain(left), self._domain(right)
        if mine is None or other is None or left.name in other or right.name in mine:
            return False  # noted already: a wrong declaration, or a name that is a value too
        if mine.kind is not other.kind:
            message = f"`{left.name}` is {_described(mine)}, and `{right.name}` is {_described(other)}"
            self.complain(Slug.DIFFERENT_KINDS, message, *extent(tree))
            return False
        if overlap(mine, other) or _token(tree, 1) not in ("==", "!="):
            return True
        message = f"`{left.name}` and `{right.name}` have no value in common"
        remedy = f"their domains are {mine} and {other}"
        self.complain(Slug.DISJOINT_DOMAINS, message, *extent(tree), remedy)
        return False

    def _domain(self, reference: Reference) -> Domain | None:
        variable = self.scope.variables[reference.name]
        return None if variable is None else variable.domain

    # sums

    def _calculation(self, tree: SyntaxTree) -> Term | None:
        """Return a sum, `min` or `max`; a constant if it reads no variable."""
        if self._has_hyphen(tree):
            return None
        operands = [self._operand(self._term(child), child) for child in tree.children if not isinstance(child, Token)]
        terms = tuple(term for term in operands if term is not None)
        if len(terms) < len(operands):
            return None
        if tree.data == "extreme":
            return substituted(Extreme(ExtremeKind(_token(tree, 0)), terms), {})
        signs = [1, *(-1 if sign == "-" else 1 for sign in tree.children if isinstance(sign, Token))]
        return substituted(Sum.of(zip(signs, terms, strict=True)), {})

    def _has_hyphen(self, tree: SyntaxTree) -> bool:
        """Return whether a sum is meant as a name, such as `robot-at`, and note that."""
        for index, sign in enumerate(tree.children):
            if not isinstance(sign, Token) or sign != "-":
                continue
            begin, end = extent(sign)
            sides = [_child(tree, index - 1), _child(tree, index + 1)]
            is_close = extent(sides[0])[1] == begin and extent(sides[1])[0] == end
            if is_close and any(self._is_unknown(side) for side in sides):
                self.complain(SLUGS[self._start], "`-` cannot stand here", begin, end, NO_HYPHENS)
                return True
        return False

    def _is_unknown(self, tree: SyntaxTree) -> bool:
        """Return whether a term is a name, and surely no variable."""
        if tree.data != "term":
            return False
        token = _leaf_token(tree, 0)
        return token.type == "NAME" and token not in self.scope.variables and not self.scope.may_miss(token)

    def _operand(self, term: Term | _Word | None, tree: SyntaxTree) -> Term | None:
        """Return a term of a sum, if it is an integer."""
        if isinstance(term, _Word):
            if self.scope.is_object(term.name):
                self._refuse_operand(term.name, "an object", tree)
            elif not self.scope.has(term.name):
                self._unknown_variable(term.name, *extent(tree))
            elif not self.scope.may_miss(term.name):
                self._refuse_operand(term.name, "a symbol", tree)
            return None
        if isinstance(term, Constant) and kind_of(term.constant) is not ValueKind.INTEGER:
            self._refuse_operand(format_value(term.constant), _KINDS[kind_of(term.constant)], tree)
            return None
        domain = self._domain(term) if isinstance(term, Reference) else None
        if isinstance(term, Reference) and domain is not None and domain.kind is not ValueKind.INTEGER:
            self._refuse_operand(term.name, _described(domain), tree)
            return None
        return term

    def _refuse_operand(self, shown: str, what: str, tree: SyntaxTree) -> None:
        self.complain(Slug.DIFFERENT_KINDS, f"`{shown}` is {what}, and sums are of integers", *extent(tree))

    def _sum_comparison(
        self, operator: str, tree: SyntaxTree, left: Term | _Word, right: Term | _Word
    ) -> Predicate | None:
        first, second = self._operand(left, _child(tree, 0)), self._operand(right, _child(tree, 2))
        if first is None or second is None:
            return None
        leaf = _compare(operator, first, second)
        domains = self._domains_of(leaf.reads())
        if domains is None or not self._may_hold(operator, leaf, tree, domains):
            return None
        return leaf if self._has_few_cases(str(leaf), count_cases(leaf, _sizes(domains)), tree) else None

    def _case(self, tree: SyntaxTree) -> Predicate | None:
        """Return a comparison with one of the numbers that a count can have; it may well hold always or never."""
        sides = [self._operand(self._term(_child(tree, index)), _child(tree, index)) for index in (0, 2)]
        left, right = sides
        if left is None or right is None:
            return None
        operator, leaf = _token(tree, 1), _compare(_token(tree, 1), left, right)
        domains = self._domains_of(leaf.reads())
        if domains is None:
            return None
        (low, high), (least, most) = bounds(left, domains), bounds(right, domains)
        if high < least or most < low:
            return Truth({"<": high < least, ">": most < low, "!": True, "=": False}[operator[0]])
        return leaf if self._has_few_cases(str(leaf), count_cases(leaf, _sizes(domains)), tree) else None

    def _domains_of(self, names: tuple[str, ...]) -> dict[str, Domain] | None:
        """Return the domains of variables; `None` if one of them is declared wrongly, which is noted already."""
        domains = {name: domain for name in names if (domain := self._domain(Reference(name))) is not None}
        return domains if len(domains) == len(names) else None

    def _may_hold(
        self, operator: str, leaf: Equal | NotEqual | Order, tree: SyntaxTree, domains: dict[str, Domain]
    ) -> bool:
        """Return whether a comparison of two terms can hold (semantics 2.2); warn of a number beyond their values."""
        left, right = bounds(leaf.left, domains), bounds(leaf.right, domains)
        if max(left[0], right[0]) <= min(left[1], right[1]):
            return True
        is_below = left[1] < right[0]
        always = {"<": is_below, ">": not is_below, "!": True, "=": False}[operator[0]]
        if always and isinstance(leaf.left, Constant) is not isinstance(leaf.right, Constant):
            term, (low, high) = (leaf.left, left) if isinstance(leaf.right, Constant) else (leaf.right, right)
            if self.warn is not None:
                message = f"`{term}` is from {low} to {high}, so `{leaf}` always holds"
                self.warn(Slug.SUM_ALWAYS_HOLDS, message, *extent(tree), "leave it out, or correct the number")
            return True
        sides = ((leaf.left, left, leaf.right, _child(tree, 0)), (leaf.right, right, leaf.left, _child(tree, 2)))
        for constant, _, term, child in sides:
            if isinstance(constant, Constant):
                low, high = bounds(term, domains)
                message, remedy = f"`{constant}` is not a value of `{term}`", f"its values are from {low} to {high}"
                self.complain(Slug.VALUE_OUTSIDE_DOMAIN, message, *extent(child), remedy)
                return False
        if isinstance(leaf, Order):
            return True
        message = f"`{leaf.left}` and `{leaf.right}` have no value in common"
        remedy = f"their values are from {left[0]} to {left[1]} and from {right[0]} to {right[1]}"
        self.complain(Slug.DISJOINT_DOMAINS, message, *extent(tree), remedy)
        return False

    def _sum_fits(self, tree: SyntaxTree, target: Variable, term: Sum | Extreme) -> bool:
        """Return whether a sum can be assigned to a variable."""
        if target.domain.kind is not ValueKind.INTEGER:
            message = f"`{target.name}` is {_described(target.domain)}, and `{term}` is an integer"
            self.complain(Slug.DIFFERENT_KINDS, message, *extent(tree))
            return False
        domains = self._domains_of(term.reads())
        if domains is None:
            return False
        low, high = bounds(term, domains)
        if max(low, int(target.domain.values[0])) > min(high, int(target.domain.values[-1])):
            message = f"no value of `{term}` is a value of `{target.name}`"
            remedy = f"its values are from {low} to {high}, and the domain is {target.domain}"
            self.complain(Slug.NEVER_FITS, message, *extent(tree), remedy)
            return False
        sizes = _sizes(domains)
        changes = count_cases(NotEqual(Reference(target.name), term), {**sizes, target.name: len(target.domain)})
        return self._has_few_cases(str(term), max(changes, prod(sizes.values())), tree)

    def _has_few_cases(self, shown: str, count: int, tree: SyntaxTree) -> bool:
        if count <= MAX_SUM_VALUES:
            return True
        message = f"`{shown}` has {count:,} cases, and a sum may have {MAX_SUM_VALUES:,}"
        remedy = "use smaller domains, or fewer variables in one sum"
        self.complain(Slug.DOMAIN_TOO_LARGE, message, *extent(tree), remedy)
        return False

    # actions

    def action(self, tree: SyntaxTree) -> Action | None:
        """Return the action of a tree."""
        token = tree.children[0]
        assert isinstance(token, Token)  # noqa: S101 - the grammar says so
        if token not in self.scope.variables:
            self._unknown_variable(str(token), *extent(token))
            return None
        target = self.scope.variables[str(token)]
        if target is None or not self._assignable(target, *extent(token)):
            return None
        return self._assign(tree, target) if tree.data == "assign" else self._add(tree, target)

    def _assignable(self, target: Variable, begin: int, end: int) -> bool:
        """Return whether an action at this place may assign to the variable."""
        if self.where is Where.ENVIRONMENT and target.role is not Role.DECLARED:
            self._refuse_environment(target, begin, end)
            return False
        if not target.assignable:
            message = f"`{target.name}` is kept by the runner, and a model cannot assign it"
            self.complain(Slug.NOT_ASSIGNABLE, message, begin, end)
            return False
        if target.role in (Role.OPERATION_STATE, Role.CURRENT_STATE) and self.where is not Where.AUTOMATIC:
            message = f"only an automatic transition can assign `{target.name}`"
            remedy = "use the operation's `failed:` transition, or an automatic transition"
            self.complain(Slug.NOT_ASSIGNABLE, message, begin, end, remedy)
            return False
        if target.role is Role.PLAN_STATE and self.where is Where.PLANNED:
            message = "the planner sees `a`, and a plan cannot abort itself"
            self.complain(Slug.NOT_ASSIGNABLE, message, begin, end, f"write `{target.name} <- aborted` into `ar`")
            return False
        return True

    def _refuse_environment(self, target: Variable, begin: int, end: int) -> None:
        """Note an action of an environment transition on a variable that the model file does not declare."""
        if target.role.is_runner:
            message = f"`{target.name}` is a variable of the runner; environment transitions can assign none"
            self.complain(Slug.RUNNER_VARIABLE, message, begin, end)
            return
        message = f"`{target.name}` follows the requests of a resource; environment transitions cannot assign it"
        remedy = "if others use the resource as well, write `shared: true` for it"
        self.complain(Slug.NOT_ASSIGNABLE, message, begin, end, remedy)

    def _assign(self, tree: SyntaxTree, target: Variable) -> Action | None:
        child = _child(tree, 1)
        term = self._term(child)
        reference = Reference(target.name)
        if term is None:
            return None
        if isinstance(term, Reference):
            return Assign(target.name, term) if self._assignable_from(child, target, term) else None
        if isinstance(term, Sum | Extreme):
            return Assign(target.name, term) if self._sum_fits(child, target, term) else None
        constant = self._constant(term, reference, child)
        if constant is None:
            return None
        if constant.constant not in target.assignable:
            allowed = " or ".join(f"`{format_value(value)}`" for value in target.assignable)
            message = f"a model may assign only {allowed} to `{target.name}`"
            self.complain(Slug.NOT_ASSIGNABLE, message, *extent(child))
            return None
        return Assign(target.name, constant)

    def _assignable_from(self, tree: SyntaxTree, target: Variable, source: Reference) -> bool:
        domain = self._domain(source)
        if domain is None or source.name in target.domain:
            return False  # noted already: a wrong declaration, or a name that is a value too
        if target.role.is_runner:
            allowed = " or ".join(f"`{format_value(value)}`" for value in target.assignable)
            message = f"a model may assign only {allowed} to `{target.name}`"
            self.complain(Slug.NOT_ASSIGNABLE, message, *extent(tree))
            return False
        if domain.kind is not target.domain.kind:
            message = f"`{target.name}` is {_described(target.domain)}, and `{source.name}` is {_described(domain)}"
            self.complain(Slug.DIFFERENT_KINDS, message, *extent(tree))
            return False
        if not overlap(domain, target.domain):
            message = f"no value of `{source.name}` is a value of `{target.name}`"
            self.complain(Slug.NEVER_FITS, message, *extent(tree), f"their domains are {domain} and {target.domain}")
            return False
        return True

    def _add(self, tree: SyntaxTree, target: Variable) -> Action | None:
        begin, end = extent(tree)
        if target.domain.kind is not ValueKind.INTEGER:
            message = f"only integer ranges can be counted, and `{target.name}` is {_described(target.domain)}"
            self.complain(Slug.NOT_A_COUNTER, message, begin, end)
            return None
        written = self._integer(_leaf_token(tree, 1))
        if written is None:
            return None
        amount = int(written.constant)
        if amount <= 0:
            message = f"`{_token(tree, 1)}` is not a number of steps to count by"
            self.complain(Slug.NOT_A_COUNTER, message, begin, end, "write a positive number, with `+=` or `-=`")
            return None
        if amount >= len(target.domain):
            message = f"counting by {_token(tree, 1)} always leaves the domain {target.domain} of `{target.name}`"
            self.complain(Slug.NEVER_FITS, message, begin, end)
            return None
        return Add(target.name, amount if tree.data == "add" else -amount)

    # requirements

    def requirement(self, tree: SyntaxTree) -> RequirementForm | None:
        """Return the requirement of a tree; `None` if a part of it is wrong."""
        form = form_of(tree.data)
        make: Callable[..., RequirementForm] = form
        parts = zip(kinds_of(form.pattern), cast("list[SyntaxTree | Token | None]", tree.children), strict=True)
        values = [(part, None if part is None else self._value(kind, part)) for kind, part in parts]
        is_wrong = any(value is None and part is not None for part, value in values)
        return None if is_wrong else make(*(value for _, value in values))

    def _value(self, kind: PlaceholderKind, part: SyntaxTree | Token) -> Predicate | int | None:
        """Return what stands in the place of a letter of a pattern; `None` if it is wrong."""
        match kind:
            case PlaceholderKind.PREDICATE:
                return self.predicate(cast("SyntaxTree", part))
            case PlaceholderKind.DURATION:
                return self._duration(cast("Token", part))
            case PlaceholderKind.NUMBER:
                return self._number(cast("Token", part))
            case _:
                assert_never(kind)

    def _duration(self, written: Token) -> int | None:
        duration_ns = parse_duration(str(written))
        if duration_ns is None:
            message = f"`{written}` is not a duration"
            self.complain(Slug.BAD_DURATION, message, *extent(written), "write for example `10 s` or `500 ms`")
        return duration_ns

    def _number(self, written: Token) -> int | None:
        """Return a number of a requirement, 0 or more."""
        digits = written.lstrip("0") or "0"
        if written.startswith("-"):
            message, remedy = f"`{written}` is too small: the least is 0", "write a number from 0 on"
        elif len(digits) > _MAX_DIGITS:
            message, remedy = f"`{written}` is too large", f"write at most {_MAX_DIGITS} digits"
        else:
            return int(digits)
        self.complain(Slug.BAD_NUMBER, message, *extent(written), remedy)
        return None


def _connect(connective: str, operands: tuple[Predicate, ...]) -> Predicate:
    match connective:
        case "no":
            return Not(operands[0])
        case "conjunction":
            return And(operands)
        case "disjunction":
            return Or(operands)
        case "implication":
            return Implies(*operands)
        case _:
            return operands[0]


def _sizes(domains: dict[str, Domain]) -> dict[str, int]:
    return {name: len(domain) for name, domain in domains.items()}


def _compare(operator: str, left: Term, right: Term) -> Equal | NotEqual | Order:
    if operator == "==":
        return Equal(left, right)
    if operator == "!=":
        return NotEqual(left, right)
    return Order(left, Relation(operator), right)


def _child(tree: SyntaxTree, index: int) -> SyntaxTree:
    child = tree.children[index]
    assert not isinstance(child, Token)  # noqa: S101 - the grammar says which children are trees
    return child


def _leaf_token(tree: SyntaxTree, index: int) -> Token:
    token = tree.children[index]
    assert isinstance(token, Token)  # noqa: S101 - the grammar says which children are tokens
    return token


def _token(tree: SyntaxTree, index: int) -> str:
    return str(tree.children[index])


_KINDS = {ValueKind.BOOLEAN: "a boolean", ValueKind.INTEGER: "an integer", ValueKind.SYMBOL: "a symbol"}


def _described(domain: Domain) -> str:
    described = _KINDS[domain.kind]
    return f"{described} in {domain}" if domain.kind is ValueKind.INTEGER else described
