"""Reads the syntax trees of lifted predicates, actions and requirements: checks names once, for all choices of objects.

A name that depends on no choice, and what is compared with it, is checked by the resolver, in each ground tree.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from math import prod
from typing import TYPE_CHECKING, NamedTuple

from lark import Token, Tree
from msgspec.structs import replace

from scbm.files.expansion.formulas import (
    AtomFormula,
    Bound,
    CompoundFormula,
    ConjunctionFormula,
    CountCasesFormula,
    CountedFormula,
    DisjunctionFormula,
    GroupFormula,
    ImpliedFormula,
    IntegerFormula,
    NegatedFormula,
    QuantifiedFormula,
    SentenceFormula,
    UndecidedFormula,
    relation_holds,
)
from scbm.files.expansion.lifted_names import IndexSlot, LiftedToken, NameSlot, ObjectSlot
from scbm.files.expansion.object_formulas import ConstantFormula, EqualityFormula, Formula, ObjectTerm, TableFormula
from scbm.files.expansion.static_facts import WORD
from scbm.files.expansion.work_limit import MAX_INSTANCES
from scbm.files.language.grammar import keywords
from scbm.files.language.quantifier_faults import EXAMPLE_OF_COUNT, quantifier_fault
from scbm.files.language.syntax import SyntaxFault, extent, misspelt_opening, operands_in, parse
from scbm.files.spelling import nearest, suggestion
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.expansion.lifted_names import LiftedScope, NoteFault
    from scbm.files.expansion.static_facts import ObjectTable
    from scbm.files.language.syntax import Start, SyntaxTree

_INDEX = re.compile(r"(?P<base>[A-Za-z_][\w.]*)\s*\[(?P<index>[^\]]*)\](?P<suffix>_\w+|(?:\.\w+)*)")
_COMPOUND: dict[str, type[CompoundFormula]] = {
    "group": GroupFormula,
    "no": NegatedFormula,
    "conjunction": ConjunctionFormula,
    "disjunction": DisjunctionFormula,
    "implication": ImpliedFormula,
}
_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}
_PART = re.compile(r"[^\s,](?:[^,]*[^\s,])?")
"""A part of an index, without the blanks around it."""

_NAME = re.compile(
    r"(?<![\w.])(?<!\d )[A-Za-z_]\w*(?:\.\w+)*(?!(?u:\w))(?:\s*\[[^\[\](){}]*\](?:_\w+|(?:\.\w+)*))?",
    re.ASCII,
)
"""A name in a text that is one name or one value."""


class LiftedAction(NamedTuple):
    """An action, and the parameters of the quantifiers before it."""

    bounds: tuple[Bound, ...]
    atom: AtomFormula


class LiftedReader:
    """Reads one text in one scope. Errors are noted, and the part where they are is an `UndecidedFormula`.

    Attributes:
        is_lifted: whether the text has a quantifier, an index, or anything else that the objects replace.
    """

    def __init__(self, text: str, scope: LiftedScope, note: NoteFault) -> None:
        self._text = text
        self._scope = scope
        self._report = note
        self._noted = 0
        self._instances = 1
        self._dynamic: list[SyntaxTree] = []
        self.is_lifted = False

    def _note(self, slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
        self._noted += 1
        self._report(slug, message, begin, end, remedy)

    def tree(self, start: Start) -> SyntaxTree | None:
        """Return the syntax tree of the text; `None` after a syntax error, which is noted."""
        try:
            return parse(self._text, start, is_lifted=True)
        except SyntaxFault as found:
            fault = misspelt_opening(self._text) if start == "requirement" else None
            fault = fault or quantifier_fault(self._text, start) or found
            self._note(fault.slug, fault.message, fault.begin, fault.end, fault.remedy)
            return self._readable_tree() if start == "predicate" else None

    def _readable_tree(self) -> SyntaxTree | None:
        """Return a tree of what stands between `&&`, `||` and `->` and can be read alone; `None` if nothing can."""
        operands = [self._operand(begin, end) for begin, end in operands_in(self._text)]
        readable: list[SyntaxTree | Token] = [each for each in operands if each is not None]
        if not readable:
            return None
        meta = next(each.meta for each in operands if each is not None)
        tree: SyntaxTree = Tree("conjunction", [*readable, Tree("unread", [], meta)], meta)
        is_conjunction = "||" not in self._text and "->" not in self._text
        return tree if is_conjunction else Tree("disjunction", [tree], meta)  # whose operands decide no choices

    def _operand(self, begin: int, end: int) -> SyntaxTree | None:
        try:
            return parse(f"{' ' * begin}{self._text[begin:end]}", "predicate", is_lifted=True)
        except SyntaxFault:
            return None

    def static_predicate(self, tree: SyntaxTree) -> Formula:
        """Return a predicate; note each part of it that is not decided as the model is read."""
        formula = self.predicate(tree)
        for part in self._dynamic:
            self._refuse_dynamic(part)
        return formula

    def _refuse_dynamic(self, tree: SyntaxTree) -> None:
        """Note an unknown name in a part of a condition, or that it reads a variable."""
        words = [t for t in map(_word, _names_in(tree)) if self._scope.term(t.text) is None]
        variables = [word for word in words if "[" in word.text or self._is_variable(word)]
        begin, end = extent(tree)
        if any(self._is_table(word.text.partition("[")[0].rstrip()) for word in variables):
            return  # which is noted: it is written with round brackets
        if any(map(self._scope.is_unread, _names_in(tree))):
            return  # the error of the parameter explains it
        if words and not variables:
            self._scope.refuse_unknown(words[0].text, words[0].begin, words[0].end, self._note)
            return
        shown = variables[0].text.partition("[")[0].rstrip() if words else self._text[begin:end]
        message = f"`where` is decided as the model is read, and `{shown}` is no parameter, object or table"
        remedy = "move this condition to the guard, or to the predicate of a goal"
        self._note(Slug.NOT_STATIC, message, begin, end, remedy)

    def _is_table(self, name: str) -> bool:
        return name in self._scope.names.facts.tables

    def _is_variable(self, word: LiftedToken) -> bool:
        names = self._scope.names
        return word.text in names.plain or word.text in names.indexed or self._scope.dotted(word) is not None

    # connectives

    def predicate(self, tree: SyntaxTree) -> Formula:
        """Return the predicate of a tree; a part with an error decides nothing, so that the others are checked."""
        noted, formula = self._noted, self._part(tree)
        hides = formula.is_static or not isinstance(formula, CompoundFormula) or formula.is_empty
        is_wrong = self._noted > noted and hides
        is_unread = self._scope.may_be_unread and any(map(self._scope.is_unread, formula.parameters))
        return UndecidedFormula(tree) if is_wrong or is_unread else formula

    def _part(self, tree: SyntaxTree) -> Formula:
        if tree.data == "predicate":
            return self.predicate(_child(tree, 0))
        if tree.data == "unread":
            return UndecidedFormula(tree)
        compound = _COMPOUND.get(tree.data)
        if compound is not None:
            return compound(tree, [self.predicate(_child(tree, index)) for index in range(len(tree.children))])
        if tree.data == "bare":
            return self._bare(tree)
        static = self._static(tree)
        if static is None:
            return self.atom(tree)
        self.is_lifted = True
        return static

    def _bare(self, tree: SyntaxTree) -> Formula:
        word = _simple(tree.children[0])
        if word is not None and word.text in ("true", "false"):
            return ConstantFormula(word.text == "true")
        counted = next(_counts_in(tree), None)
        if counted is not None:
            message = "a count is compared with a number, a variable or a sum"
            self._note(Slug.PREDICATE_SYNTAX, message, *extent(_token(counted, 0)), EXAMPLE_OF_COUNT)
            return ConstantFormula(True)
        term = self._scope.term(word.text) if word is not None and word.is_name else None
        if word is None or term is None:
            return self.atom(tree)
        self._scope.refuse_bare(term, word, self._note)
        return ConstantFormula(True)

    # quantifiers

    def _quantifier(self, tree: SyntaxTree) -> tuple[Formula, Bound]:
        """Return the predicate below a quantifier or a count, and its parameters."""
        with self._within_bound(tree) as bound:
            return self.predicate(_child(tree, -1)), bound

    @contextmanager
    def _within_bound(self, tree: SyntaxTree) -> Iterator[Bound]:
        """Read what stands in the brackets behind some parameters; note too many instances."""
        word = _word(_token(tree, 0))
        outer, outer_instances = self._scope, self._instances
        bound, self._scope = self.bound(tree)
        self._instances *= bound.count
        if self._instances > MAX_INSTANCES:
            message = f"this `{word.text}` has {self._instances:,} instances; at most {MAX_INSTANCES:,} are built"
            self._note(Slug.TOO_MANY_INSTANCES, message, word.begin, word.end)
            bound = replace(bound, objects=dict.fromkeys(bound.objects, ()))
            self._instances = 0  # the quantifiers in the brackets have more instances, which is no further error
        yield bound
        self._scope, self._instances = outer, outer_instances

    def bound(self, tree: SyntaxTree) -> tuple[Bound, LiftedScope]:
        """Return the parameters of a quantifier with the scope of its body; note what is wrong with them."""
        kinds: dict[str, str] = {}
        for child in tree.children:
            if isinstance(child, Tree) and child.data == "bound":
                token, kind = (_word(_token(child, index)) for index in (0, 1))
                self._check_parameter(token, kinds)
                self._check_type(kind)
                kinds[token.text] = kind.text
        scope = self._scope.with_parameters(kinds)
        word = _token(tree, 0)
        return Bound({name: scope.parameters[name] for name in kinds}, *extent(word), scope.names.limit), scope

    def _counts(self, tree: SyntaxTree) -> Formula | None:
        """Return a comparison with counts; `None` for one without."""
        counted = [*_counts_in(tree)]
        if not counted:
            return None
        self.is_lifted = True
        sides, relation = [tree.children[0], tree.children[2]], str(_token(tree, 1))
        if sides[1] is counted[0]:  # `1 <= count …`
            sides.reverse()
            relation = _MIRRORED.get(relation, relation)
        limit = _simple(sides[1])
        if sides[0] is counted[0] and limit is not None and not limit.is_name:
            body, bound = self._quantifier(counted[0])
            if not self._can_hold(bound, relation, limit):
                return QuantifiedFormula(counted[0], body, bound)  # so that the body is checked
            return CountedFormula(tree, body, bound, relation, int(limit.text[:18]))
        counts = {_token(each, 0).start_pos or 0: CountedFormula(each, *self._quantifier(each)) for each in counted}
        return CountCasesFormula(tree, self.atom(tree), counts)

    def _can_hold(self, bound: Bound, relation: str, number: LiftedToken) -> bool:
        """Return whether a comparison of a count can hold; note one that never does, warn of one that always does."""
        most = prod(map(len, bound.objects.values()))
        truths = {relation_holds(relation, least, int(number.text[:18])) for least in range(most + 1)}
        if not most or len(truths) > 1:
            return True
        values = f"this count is from 0 to {most}"
        compared = f"so `{relation} {number.text}`"
        if truths == {True}:
            message = f"{values}, {compared} always holds"
            self._note(Slug.COUNT_ALWAYS_HOLDS, message, number.begin, number.end)
        else:
            message = f"{values}, {compared} can never hold"
            self._note(Slug.VALUE_OUTSIDE_DOMAIN, message, number.begin, number.end)
        return truths == {True}

    def _check_parameter(self, token: LiftedToken, kinds: dict[str, str]) -> None:
        if not WORD.fullmatch(token.text):
            message = f"`{token.text}` is not a name"
            self._note(Slug.BAD_NAME, message, token.begin, token.end, "write letters, digits and `_`")
            return
        taken = "a parameter" if token.text in kinds or token.text in self._scope.parameters else None
        if token.text not in self._scope.names.indexed:  # whose index tells the two apart
            taken = self._scope.hidden_by(token.text) or taken
        if taken is not None:
            message = f"`{token.text}` is {taken} already"
            self._note(Slug.DUPLICATE_NAME, message, token.begin, token.end, "choose another name")

    def _check_type(self, token: LiftedToken) -> None:
        facts = self._scope.names.facts
        if token.text not in facts.types:
            remedy = suggestion(token.text, facts.types, "the types are")
            message = "" if facts.misses_names else f"there is no type `{token.text}`"
            self._note(Slug.UNKNOWN_TYPE, message, token.begin, token.end, remedy)

    # actions and requirements

    def action(self, tree: SyntaxTree) -> LiftedAction:
        """Return an action, and the quantifiers before it: one action for each choice of objects."""
        bounds = []
        while tree.data == "all_actions":
            self.is_lifted = True
            bound, self._scope = self.bound(tree)
            bounds.append(bound)
            tree = _child(tree, -1)
        for counted in _counts_in(tree):
            message = "an action assigns no count: what it counts may change in the same step"
            remedy = "write one action for each number, with the count in its guard, or keep the number in a variable"
            self._note(Slug.ACTION_SYNTAX, message, *extent(_token(counted, 0)), remedy)
            return LiftedAction(tuple(bounds), AtomFormula(tree, {}, {}))
        return LiftedAction(tuple(bounds), self.atom(tree))

    def requirement(self, tree: SyntaxTree) -> SentenceFormula:
        """Return a requirement."""
        predicates = {index: self.predicate(each) for index, each in enumerate(tree.children) if isinstance(each, Tree)}
        return SentenceFormula(tree, predicates)

    # atoms

    def _static(self, tree: SyntaxTree) -> Formula | None:
        """Return what is about objects, or has parameters of its own; `None` for an atom that reads variables."""
        match tree.data:
            case "quantified":
                return QuantifiedFormula(tree, *self._quantifier(tree))
            case "row":
                return self._row(tree)
            case "within":
                return self._within(tree)
            case "member":
                return self._member(tree)
            case _:
                return self._comparison(tree)

    def _comparison(self, tree: SyntaxTree) -> Formula | None:
        counts = self._counts(tree)
        if counts is not None:
            return counts
        if self._scope.names.facts.integers and self._is_of_integers(tree):
            self._refuse_no_integer(tree)
            return IntegerFormula(self.atom(tree, is_dynamic=False))
        left, right = _simple(tree.children[0]), _simple(tree.children[2])
        is_truth = any(side is not None and side.text in ("true", "false") for side in (left, right))
        if _token(tree, 1) not in ("==", "!=") and not is_truth:
            return self._order(left, right)
        return self._equality(tree, left, right) if left is not None and right is not None else None

    def _is_of_integers(self, tree: SyntaxTree) -> bool:
        """Return whether a comparison has parameters that stand for integers, numbers, and nothing else."""
        words = [*tree.scan_values(_is_word)]
        is_plain = next(tree.find_data("aggregate"), None) is None
        return bool(words) and is_plain and all(self._scope.is_integer(word) for word in words)

    def _refuse_no_integer(self, tree: SyntaxTree) -> None:
        """Note a parameter that is compared with a number that no object of its type is."""
        left, right = _simple(tree.children[0]), _simple(tree.children[2])
        for name, number in ((left, right), (right, left)):
            if name is None or number is None or number.is_name or _token(tree, 1) not in ("==", "!="):
                continue
            objects = self._scope.parameters.get(name.text, ())
            if objects and str(int(number.text[:9])) not in objects:
                kind = self._scope.kinds[name.text]
                message = f"`{number.text}` is not an object of the type `{kind}`"
                remedy = f"its objects are {objects[0]}..{objects[-1]}"
                self._note(Slug.VALUE_OUTSIDE_DOMAIN, message, number.begin, number.end, remedy)

    def _equality(self, tree: SyntaxTree, first: LiftedToken, second: LiftedToken) -> Formula | None:
        left, right = self._scope.term(first.text), self._scope.term(second.text)
        if left is not None and right is None and self._is_no_variable(second, is_likely=True):
            self._scope.refuse_unlike_term(left, second, self._note)
            return ConstantFormula(True)
        if right is not None and left is None and self._is_no_variable(first, is_likely=False):
            self._scope.refuse_unlike_term(right, first, self._note)
            return ConstantFormula(True)
        if left is None or right is None:
            return None
        self._scope.refuse_unlike(left, right, (first.begin, second.end), self._note)
        return EqualityFormula(left, right, equal=_token(tree, 1) == "==")

    def _is_no_variable(self, token: LiftedToken, *, is_likely: bool) -> bool:
        """Return whether the operand that is compared with an object is no variable, and probably means none.

        Args:
            token: the operand.
            is_likely: whether an unknown word there that is similar to no name is an object rather than a variable.
        """
        names = self._scope.names
        if not token.is_name or token.text in keywords():
            return token.text[:1].isdecimal() or token.text in ("true", "false")
        if self._is_variable(token):
            return False
        if nearest(token.text, self._scope.terms) is not None:
            return True
        known = [*names.plain_in_order, *names.indexed]
        return is_likely and names.is_whole and nearest(token.text, known) is None

    def _order(self, *sides: LiftedToken | None) -> Formula | None:
        """Note a parameter or an object that is an operand of `<` and the like; `None` if there is none."""
        words = [side for side in sides if side is not None and side.is_name and not self._scope.is_integer(side.text)]
        found = [(side, term) for side in words if (term := self._scope.term(side.text))]
        for token, term in found:
            self._scope.refuse_order(term, token, self._note)
        return ConstantFormula(True) if found else None

    def _within(self, tree: SyntaxTree) -> Formula:
        """Return `p in zone` for a parameter, and `v in zone` for a variable."""
        name, kind = _token(tree, 0), _word(_token(tree, 1))
        facts = self._scope.names.facts
        term = self._scope.term(name)
        if kind.text not in facts.types:
            self._check_type(kind)
            return ConstantFormula(True)
        objects = facts.objects(kind.text)
        if term is not None:
            self._scope.refuse_unrelated_type(term, kind.text, _word(name), self._note)
            return TableFormula([term], dict.fromkeys((each,) for each in objects))
        if not objects:
            return ConstantFormula(False)
        members = [Tree("term", [Token.new_borrow_pos("NAME", each, _token(tree, 1))], tree.meta) for each in objects]
        return self.atom(Tree("member", [name, *members], tree.meta))

    def _member(self, tree: SyntaxTree) -> Formula | None:
        """Return `p in {a, b}` for a parameter."""
        term = self._scope.term(_token(tree, 0))
        if term is None or len(tree.children) == 1:
            return None
        listed = [_word(_token(_child(tree, index), 0)) for index in range(1, len(tree.children))]
        members_of = [self._scope.term(token.text) for token in listed]
        for member, token in zip(members_of, listed, strict=True):
            if member is not None:
                self._scope.refuse_unlike(term, member, (token.begin, token.end), self._note)
            else:
                self._scope.refuse_unlike_term(term, token, self._note)
        equal = [EqualityFormula(term, member, equal=True) for member in members_of if member is not None]
        return DisjunctionFormula(tree, equal) if equal else None

    def _row(self, tree: SyntaxTree) -> Formula:
        """Return the lookup of a row."""
        name, facts = _word(_token(tree, 0)), self._scope.names.facts
        table = facts.tables.get(name.text)
        if table is None:
            remedy = suggestion(name.text, facts.tables, "the tables are") or "declare it under `tables`"
            message = "" if facts.misses_names or name.text in facts.unread else f"there is no table `{name.text}`"
            self._note(Slug.UNKNOWN_TABLE, message, name.begin, name.end, remedy)
            return ConstantFormula(True)
        trees = [child for child in tree.children[1:] if isinstance(child, Tree)]
        arguments = [_simple(each.children[0]) if each.data == "bare" else None for each in trees]
        for each in (each for each, argument in zip(trees, arguments, strict=True) if argument is None):
            begin, end = extent(each)
            message = f"the arguments of a table are parameters or objects, and `{self._text[begin:end]}` is neither"
            self._note(Slug.NOT_STATIC, message, begin, end, f"write for example `{self._example_of(table)}`")
        listed = [argument for argument in arguments if argument is not None]
        if len(listed) < len(arguments):
            return ConstantFormula(True)
        if len(listed) != len(table.types) or len(tree.children) > max(2, len(listed) + 1):
            columns = ", ".join(table.types)
            message = f"`{table.name}({columns})` has {len(table.types)} columns, and this has {len(listed)}"
            self._note(Slug.WRONG_ROW, message, *extent(tree))
            return ConstantFormula(True)
        terms = [self._argument(token, kind) for token, kind in zip(listed, table.types, strict=True)]
        whole = [term for term in terms if term is not None]
        if any(kind not in facts.types for kind in table.types):  # which explains rows without these objects
            self._note(Slug.UNKNOWN_TYPE, "", name.begin, name.end)
        return TableFormula(whole, table.rows) if len(whole) == len(listed) else ConstantFormula(True)

    def _argument(self, token: LiftedToken, kind: str) -> ObjectTerm | None:
        """Return an argument of a table; `None` if it is no object of its type, which is noted."""
        term = self._scope.term(token.text)
        if term is not None:
            self._scope.refuse_other_type(term, kind, token, self._note)
        elif token.text in self._scope.names.plain or token.text in self._scope.names.indexed:
            message = f"a table is about objects, and `{token.text}` is a variable"
            self._note(Slug.NOT_STATIC, message, token.begin, token.end, "write a parameter or an object")
        else:
            self._scope.refuse_unknown(token.text, token.begin, token.end, self._note)
        return term

    def _example_of(self, table: ObjectTable) -> str:
        """Return a row of a table with parameters that are in scope, and else with objects."""
        names = {kind: name for name, kind in self._scope.kinds.items()}
        objects = self._scope.names.facts.objects
        return f"{table.name}({', '.join(names.get(kind) or (*objects(kind), kind)[0] for kind in table.types)})"

    def atom(self, tree: SyntaxTree, *, is_dynamic: bool = True) -> AtomFormula:
        """Return a part of a text that the resolver reads; with `is_dynamic`, it reads variables."""
        self._dynamic += [tree] if is_dynamic else []
        slots: dict[int, NameSlot] = {}
        bounds: dict[int, Bound] = {}
        self._collect(tree, slots, bounds)
        self.is_lifted = self.is_lifted or bool(slots) or bool(bounds)
        return AtomFormula(tree, slots, bounds)

    def _collect(
        self, tree: SyntaxTree, slots: dict[int, NameSlot], bounds: dict[int, Bound], *, is_below: bool = False
    ) -> None:
        """Add the names of a part of an atom that depend on a choice, and the parameters of terms over objects."""
        if tree.data == "counted":
            if is_below:
                message = "a count is a term of comparisons, and no part of another term over objects"
                remedy = "write the predicate with its number for each object, or keep the number in a variable"
                self._note(Slug.PREDICATE_SYNTAX, message, *extent(_token(tree, 0)), remedy)
            return  # it is a formula of its own
        if tree.data == "aggregate":
            with self._within_bound(tree) as bound:
                bounds[bound.begin] = bound
                self._refuse_no_term(tree)
                self._collect(_child(tree, -1), slots, bounds, is_below=True)
            return
        for child in tree.children:
            if isinstance(child, Tree):
                self._collect(child, slots, bounds, is_below=is_below)
            elif child.type == "NAME" and (slot := self._slot(_word(child))) is not None:
                slots[child.start_pos or 0] = slot

    def _refuse_no_term(self, tree: SyntaxTree) -> None:
        """Note `min` and `max` over no objects, which have no value."""
        word = _word(_token(tree, 0))
        kinds = [str(_token(each, 1)) for each in tree.find_data("bound")]
        types = self._scope.names.facts.types
        empty = next((kind for kind in kinds if kind in types and not types[kind]), None)
        if empty is not None and word.text != "sum":
            message = f"the type `{empty}` has no objects, so this `{word.text}` has no value"
            self._note(Slug.PREDICATE_SYNTAX, message, word.begin, word.end, f"list them: `{empty}: [a, b]`")

    def names(self) -> dict[tuple[int, int], NameSlot]:
        """Return the slots of a text that is one name or one value, by where they begin and end."""
        found = (LiftedToken(match[0], *match.span(), is_name=True) for match in _NAME.finditer(self._text))
        return {(token.begin, token.end): slot for token in found if (slot := self._slot(token)) is not None}

    # names with an index

    def _slot(self, token: LiftedToken) -> NameSlot | None:
        """Return the slot of a name that depends on the choice; `None` for other names, and after an error."""
        slot = self._slot_of_choice(token)
        words = (token.text,) if slot is None else slot.parameters
        if self._scope.may_be_unread and any(map(self._scope.is_unread, words)):
            self._note(Slug.UNKNOWN_OBJECT, "", token.begin, token.end)
            return None
        return slot

    def _slot_of_choice(self, token: LiftedToken) -> NameSlot | None:
        index = _INDEX.fullmatch(token.text)
        if index is not None:
            return self._bracketed(token, index)
        if token.text in self._scope.parameters:
            return ObjectSlot(token.text)
        dotted = self._scope.dotted(token)
        if dotted is not None and dotted.indexed.has_state and [part[0] for part in dotted.parts] == ["state"]:
            self._scope.refuse_missing_index(dotted.indexed, token.begin, token.end, self._note)
            return None
        if dotted is not None:
            terms = self._scope.index(dotted.indexed, dotted.parts, token.begin, token.end, self._note)
            return None if terms is None else IndexSlot(dotted.indexed, terms, dotted.suffix, token.begin, token.end)
        names = self._scope.names
        before, _, last = token.text.rpartition(".")
        if before in names.plain and last in self._scope.parameters and token.text not in names.plain:
            self._note(Slug.WRONG_INDEX, f"`{before}` has no index", token.begin, token.end)
        indexed = names.indexed.get(token.text)
        if indexed is not None and token.text not in names.symbols and token.text not in names.plain:
            self._scope.refuse_missing_index(indexed, token.begin, token.end, self._note)
        return None

    def _bracketed(self, token: LiftedToken, index: re.Match[str]) -> IndexSlot | None:
        suffix = index["suffix"]
        base = f"{index['base']}{suffix if suffix.startswith('_') else ''}"  # `scanner[r]_req_state`
        indexed = self._scope.names.indexed.get(base)
        if indexed is None:
            self._refuse_index(LiftedToken(index["base"], token.begin, token.begin + len(index["base"]), is_name=True))
            return None
        at = token.begin + index.start("index")
        parts = [(part[0], at + part.start(), at + part.end()) for part in _PART.finditer(index["index"])]
        terms = self._scope.index(indexed, parts, token.begin, token.end, self._note)
        rest = "" if suffix.startswith("_") else suffix
        return None if terms is None else IndexSlot(indexed, terms, rest, token.begin, token.end)

    def _refuse_index(self, token: LiftedToken) -> None:
        if token.text in self._scope.names.plain:
            self._note(Slug.WRONG_INDEX, f"`{token.text}` has no index", token.begin, token.end)
            return
        table = self._scope.names.facts.tables.get(token.text)
        if table is not None:
            message = f"`{token.text}` is a table, whose arguments stand in round brackets"
            example = f"write for example `{self._example_of(table)}`"
            self._note(Slug.WRONG_INDEX, message, token.begin, token.end, example)
            return
        remedy = suggestion(token.text, self._scope.names.indexed, "names with an index are")
        message = f"there is no variable, resource or operation `{token.text}` with an index"
        message = message if self._scope.names.is_whole else ""
        self._note(Slug.UNKNOWN_VARIABLE, message, token.begin, token.end, remedy)


def _names_in(tree: SyntaxTree) -> Iterator[Token]:
    return tree.scan_values(_is_name)


def _counts_in(tree: SyntaxTree) -> Iterator[SyntaxTree]:
    """Yield the counts among the terms of a comparison, in their order; not those below other terms over objects."""
    if tree.data == "counted":
        yield tree
    elif tree.data != "aggregate":
        for child in tree.children:
            if isinstance(child, Tree):
                yield from _counts_in(child)


def _is_name(token: object) -> bool:
    return isinstance(token, Token) and token.type == "NAME"


def _is_word(token: object) -> bool:
    return isinstance(token, Token) and token.type in ("NAME", "TRUE", "FALSE")


def _word(token: Token) -> LiftedToken:
    return LiftedToken(str(token), token.start_pos or 0, token.end_pos or 0, _is_word(token))


def _simple(part: object) -> LiftedToken | None:
    """Return the token of an operand that is one word or number without an index; `None` for any other operand."""
    if not isinstance(part, Tree) or part.data != "term" or "[" in _token(part, 0):
        return None
    return _word(_token(part, 0))


def _child(tree: SyntaxTree, index: int) -> SyntaxTree:
    child = tree.children[index]
    assert isinstance(child, Tree)  # noqa: S101 - the grammar says which children are trees
    return child


def _token(tree: SyntaxTree, index: int) -> Token:
    token = tree.children[index]
    assert isinstance(token, Token)  # noqa: S101 - the grammar says which children are tokens
    return token
