"""Parses predicates, actions and requirements with parameters, as far as the expansion has to understand them.

The connectives, brackets, quantifiers, tables and names with an index are parsed. All else is passed on as it is
written, and read by the language underneath: that notes its errors, in the words that users know.
"""

from __future__ import annotations

from math import prod
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.files.expansion.formulas import (
    MAX_INSTANCES,
    AtomFormula,
    Bound,
    ConstantFormula,
    CountedFormula,
    EqualityFormula,
    Formula,
    GroupFormula,
    ImpliedFormula,
    IndexedName,
    IndexSlot,
    JointFormula,
    LiftedFault,
    NegatedFormula,
    ObjectSlot,
    ObjectTerm,
    QuantifiedFormula,
    TableFormula,
    TextSlot,
    Tightness,
    relation_holds,
)
from scbm.files.expansion.lifted_syntax import quantified_fault
from scbm.files.expansion.lifted_tokens import CONNECTIVES, RELATIONS, LiftedToken, phrase_at, tokens_of
from scbm.files.expansion.static_facts import QUANTIFIERS, WORD
from scbm.files.language.grammar import keywords
from scbm.files.language.syntax import misspelt_opening
from scbm.files.spelling import nearest, suggestion
from scbm.model import FORMS, Slug

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.files.expansion.lifted_names import LiftedScope, NoteFault
    from scbm.files.expansion.lifted_tokens import Piece
    from scbm.files.expansion.static_facts import ObjectTable
    from scbm.files.language.syntax import Start

_CLOSING = {"(": ")", "[": "]", "{": "}"}
_EXAMPLE = "write for example `{} r in robot. (robot_at[r] == dock)`"
_EXAMPLE_OF_COUNT = "write for example `count r in robot. (robot_at[r] == dock) <= 1`"

MAX_DEPTH = 40
"""The maximum nesting of brackets and quantifiers; the language underneath refuses less than twice as many."""


class _Unparsed(Exception):  # noqa: N818 - it never leaves this module
    """The connectives or brackets of a text are wrong: the language underneath notes that."""


def _passed_on(slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
    """Note nothing: the language underneath notes what is wrong with the text."""


class LiftedParser:
    """Parses one text in one scope. Errors are noted, and the part where they are becomes `true`.

    Attributes:
        is_lifted: whether the text has a quantifier, an index, or anything else that the expansion replaces.
    """

    def __init__(self, text: str, scope: LiftedScope, note: NoteFault) -> None:
        self._text = text
        self._tokens = tokens_of(text)
        self._scope = scope
        self._note = note
        self._index = 0
        self._depth = 0
        self._instances = 1
        self._dynamic_atoms: list[Sequence[LiftedToken]] = []
        self._is_unparsed = False
        self._is_region = False
        self.is_lifted = False

    # whole texts

    def predicate(self) -> Formula:
        """Return the predicate."""
        if not self._tokens:
            return AtomFormula([(self._text, 0, len(self._text))])
        if not self._is_region and self._has_fault("predicate"):
            return ConstantFormula(True)
        outer = self._scope
        try:
            formula = self._implication()
            self._expect_end()
        except _Unparsed:
            self._scope = outer
            self._is_unparsed = True
            self._note = _passed_on
            return self._dynamic(0, len(self._tokens))
        return formula

    def _has_fault(self, start: Start) -> bool:
        """Return whether a text with quantifiers has a syntax error, which is noted."""
        fault = quantified_fault(self._text, start, self._scope.names.facts.tables)
        if fault is not None:
            self._note(fault.slug, fault.message, fault.begin, fault.end, fault.remedy)
            self.is_lifted = True
        return fault is not None

    def _expect_end(self) -> None:
        if self._index < len(self._tokens):
            raise _Unparsed

    def static_predicate(self) -> Formula:
        """Return the predicate; note each part of it that is not decided as the model is read."""
        note = self._note
        formula = self.predicate()
        self._note = note
        if self._is_unparsed:
            message = "this condition cannot be read: an operand, a bracket or a connective is wrong"
            example = "write for example `connected(from, to) && from != to`"
            self._note(Slug.PREDICATE_SYNTAX, message, 0, len(self._text), example)
        for tokens in self._dynamic_atoms:
            self._refuse_dynamic(tokens)
        return formula

    def _refuse_dynamic(self, tokens: Sequence[LiftedToken]) -> None:
        """Note an unknown name in a part of a condition, or that it reads a variable."""
        words = [t for t in tokens if t.is_name and t.text not in keywords() and self._scope.term(t.text) is None]
        names = self._scope.names
        variables = [w for w in words if w.text in names.plain or w.text in names.indexed or self._is_index(w)]
        if words and not variables:
            self._scope.refuse_unknown(words[0].text, words[0].begin, words[0].end, self._note)
            return
        shown = variables[0].text if words else self._text[tokens[0].begin : tokens[-1].end]
        message = f"`where` is decided as the model is read, and `{shown}` is no parameter, object or table"
        remedy = "move this condition to the guard, or to the predicate of a goal"
        self._note(Slug.NOT_STATIC, message, tokens[0].begin, tokens[-1].end, remedy)

    def _is_index(self, word: LiftedToken) -> bool:
        return self._text[word.end : word.end + 1] == "[" or self._scope.dotted(word) is not None

    def action(self) -> tuple[tuple[Bound, ...], AtomFormula]:
        """Return the action, and the quantifiers before it: one action for each choice of objects."""
        bounds = []
        while self._is_quantifier("forall"):
            self.is_lifted = True
            bound, inner = self._bound(self._tokens[self._index], self._parameters())
            bounds.append(bound)
            self._scope = inner
        begin, end = self._index, len(self._tokens)
        if bounds and self._peek() == "(":
            if self._tokens[-1].text != ")":
                opening = self._tokens[begin]
                message = "this `(` is not closed, or something follows the action in brackets"
                remedy = "write for example `forall r in robot. (robot_at[r] <- dock)`"
                raise LiftedFault(Slug.ACTION_SYNTAX, message, opening.begin, opening.end, remedy)
            begin, end = begin + 1, end - 1
        return tuple(bounds), self._dynamic(begin, end)

    def requirement(self) -> list[Formula | Piece]:
        """Return the predicates of a requirement, and the words between them."""
        misspelt = misspelt_opening(self._text)
        if misspelt is not None and self._tokens[1].is_name and self._tokens[0].text not in QUANTIFIERS:
            self._note(misspelt.slug, misspelt.message, misspelt.begin, misspelt.end, misspelt.remedy)
            return [ConstantFormula(True)]
        if self._has_fault("requirement"):
            return [ConstantFormula(True)]
        parts: list[Formula | Piece] = []
        index = begin = 0
        forms = tuple(FORMS.values())
        while index < len(self._tokens):
            length = phrase_at(self._tokens, index, forms)
            if not length:
                index += 1
                continue
            parts += self._region(begin, index)
            first, last = self._tokens[index].begin, self._tokens[index + length - 1].end
            parts.append((self._text[first:last], first, last))
            begin = index = index + length
        return [*parts, *self._region(begin, len(self._tokens))]

    def _region(self, begin: int, end: int) -> list[Formula]:
        if begin == end:
            return []
        part = LiftedParser(self._text, self._scope, self._note)
        part._tokens = self._tokens[begin:end]
        part._is_region = True
        predicate = part.predicate()
        self.is_lifted = self.is_lifted or part.is_lifted
        return [predicate]

    def reference(self) -> AtomFormula:
        """Return a text that is one name."""
        return self._dynamic(0, len(self._tokens))

    # connectives

    def _implication(self) -> Formula:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise _Unparsed
        left = self._joined("||", Tightness.DISJUNCTION)
        if self._peek() == "->":
            arrow = self._next()
            left = ImpliedFormula(left, self._implication(), (arrow.begin, arrow.end))
        self._depth -= 1
        return left

    def _joined(self, symbol: str, tightness: Tightness) -> Formula:
        operands = [self._operand(tightness)]
        span = (0, 0)
        while self._peek() == symbol:
            token = self._next()
            span = (token.begin, token.end)
            operands.append(self._operand(tightness))
        return operands[0] if len(operands) == 1 else JointFormula(tightness, operands, span)

    def _operand(self, tightness: Tightness) -> Formula:
        return self._joined("&&", Tightness.CONJUNCTION) if tightness is Tightness.DISJUNCTION else self._negation()

    def _negation(self) -> Formula:
        negations = []
        while self._peek() == "!":
            negations.append(self._next().begin)
        formula = self._unit()
        for begin in reversed(negations):
            formula = NegatedFormula(formula, begin)
        return formula

    def _unit(self) -> Formula:
        if any(self._is_quantifier(word) for word in QUANTIFIERS):
            return self._quantifier()
        begin = self._index
        if self._peek() == "(":
            closing = self._closing(begin)
            if closing + 1 == len(self._tokens) or self._tokens[closing + 1].text in (*CONNECTIVES, ")"):
                opening = self._next()
                inner = self._implication()
                if self._index != closing:
                    raise _Unparsed
                return GroupFormula(inner, opening.begin, self._next().end)
        while self._index < len(self._tokens) and self._tokens[self._index].text not in (*CONNECTIVES, ")"):
            self._refuse_misplaced_quantifier(is_first=self._index == begin)
            text = self._tokens[self._index].text
            self._index = self._closing(self._index) + 1 if text in _CLOSING else self._index + 1
        if begin == self._index:
            raise _Unparsed
        return self._atom(begin, self._index)

    def _closing(self, index: int) -> int:
        """Return the index of the token that closes the bracket at an index."""
        opened: list[str] = []
        for at in range(index, len(self._tokens)):
            text = self._tokens[at].text
            if text in _CLOSING:
                opened.append(_CLOSING[text])
            elif text in _CLOSING.values():
                if opened.pop() != text:
                    raise _Unparsed
                if not opened:
                    return at
        raise _Unparsed

    def _peek(self, ahead: int = 0) -> str:
        index = self._index + ahead
        return self._tokens[index].text if index < len(self._tokens) else ""

    def _next(self) -> LiftedToken:
        token = self._tokens[self._index]
        self._index += 1
        return token

    # quantifiers

    def _is_quantifier(self, word: str) -> bool:
        """Return whether a quantifier begins here: the word alone may be the name of a variable."""
        following = self._index + 1
        is_word = following < len(self._tokens) and self._tokens[following].is_word
        return self._peek() == word and is_word and self._peek(1) != "in"

    def _refuse_misplaced_quantifier(self, *, is_first: bool) -> None:
        """Refuse `sum r in robot. (…)`, `exists in robot. (…)` and `1 < count r in robot. (…)`."""
        word = self._tokens[self._index]
        if not word.is_name or self._index + 1 == len(self._tokens):
            return
        example = _EXAMPLE.format(word.text)
        if word.text in QUANTIFIERS and self._peek(1) == "(" and self._peek(3) in ("in", ":"):
            self._refuse(word, f"the parameters of this `{word.text}` stand in brackets", example)
        if word.text in QUANTIFIERS and self._peek(1) in ("in", ":") and self._peek(3) == ".":
            self._refuse(word, f"a parameter is missing after this `{word.text}`", example)
        if not self._tokens[self._index + 1].is_name or self._peek(2) not in ("in", ":") or self._peek(4) != ".":
            return
        if word.text not in QUANTIFIERS:
            remedy = "write `forall`, `exists` or `count`; name each object in a sum: `n.r1 + n.r2 <= 3`"
            self._refuse(word, f"there is no quantifier `{word.text}`", remedy)
        if not is_first:
            example = _EXAMPLE_OF_COUNT if word.text == "count" else example
            self._refuse(word, f"`{word.text}` stands first in its condition", example)

    def _quantifier(self) -> Formula:
        self.is_lifted = True
        word = self._tokens[self._index]
        outer, outer_instances = self._scope, self._instances
        words = self._parameters()
        if self._peek() != "(":
            self._refuse_quantifier(word, "the predicate of a quantifier stands in brackets")
        bound, inner = self._bound(word, words)
        for objects in bound.objects.values():
            self._instances *= len(objects)
        if self._instances > MAX_INSTANCES:
            message = f"this `{word.text}` has {self._instances:,} instances; at most {MAX_INSTANCES:,} are built"
            self._note(Slug.TOO_MANY_INSTANCES, message, word.begin, word.end)
            bound = replace(bound, objects=dict.fromkeys(bound.objects, ()))
            self._instances = 0  # the quantifiers in the brackets have more instances, which is no further error
        self._scope = inner
        opening = self._next()
        body = self._implication()
        if self._peek() != ")":
            self._refuse(opening, "this `(` is not closed", "a `)` is missing, or a connective before it")
        self._next()
        self._scope, self._instances = outer, outer_instances
        if word.text == "count":
            return self._comparison_of_count(word, bound, body)
        tightness = Tightness.CONJUNCTION if word.text == "forall" else Tightness.DISJUNCTION
        return QuantifiedFormula(tightness, bound, body)

    def _comparison_of_count(self, word: LiftedToken, bound: Bound, body: Formula) -> Formula:
        relation, number = self._peek(), self._peek(1)
        if relation not in RELATIONS or not number.isdecimal() or self._peek(2) not in ("", ")", *CONNECTIVES):
            self._refuse(word, "a count is compared with a number", _EXAMPLE_OF_COUNT)
        limit = self._tokens[self._index + 1]
        self._index += 2
        self._check_count(bound, relation, limit)
        return CountedFormula(bound, body, relation, int(number[:18]))

    def _check_count(self, bound: Bound, relation: str, number: LiftedToken) -> None:
        """Note a comparison of a count that can never hold; warn of one that always holds."""
        most = prod(map(len, bound.objects.values()))
        truths = {relation_holds(relation, least, int(number.text[:18])) for least in range(most + 1)}
        if not most or len(truths) > 1:
            return
        values = f"this count is from 0 to {most}"
        compared = f"so `{relation} {number.text}`"
        if truths == {True}:
            message = f"{values}, {compared} always holds"
            self._note(Slug.COUNT_ALWAYS_HOLDS, message, number.begin, number.end)
        else:
            message = f"{values}, {compared} can never hold"
            self._note(Slug.VALUE_OUTSIDE_DOMAIN, message, number.begin, number.end)

    def _parameters(self) -> list[tuple[LiftedToken, LiftedToken]]:
        """Return the parameters of a quantifier with their types: the tokens up to the dot."""
        word = self._next()
        words: list[tuple[LiftedToken, LiftedToken]] = []
        while True:
            has_type = self._peek(1) in ("in", ":") and self._index + 2 < len(self._tokens)
            if not has_type or not self._tokens[self._index + 2].is_word:
                self._refuse_quantifier(word, f"a parameter of this `{word.text}` has no type")
            words.append((self._tokens[self._index], self._tokens[self._index + 2]))
            self._index += 3
            if self._peek() != ",":
                break
            self._next()
        if self._peek() != ".":
            self._refuse_quantifier(word, f"a `.` is missing after the parameters of this `{word.text}`")
        self._next()
        return words

    def _bound(self, word: LiftedToken, words: list[tuple[LiftedToken, LiftedToken]]) -> tuple[Bound, LiftedScope]:
        """Return the parameters of the quantifier `word` with the scope of its body; note what is wrong with them."""
        kinds: dict[str, str] = {}
        for token, kind in words:
            self._check_parameter(token, kinds)
            self._check_type(kind)
            kinds[token.text] = kind.text
        scope = self._scope.with_parameters(kinds)
        objects = {name: scope.parameters[name] for name in kinds}
        return Bound(objects, word.begin, word.end, scope.names.limit), scope

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

    def _refuse_quantifier(self, word: LiftedToken, message: str) -> None:
        self._refuse(word, message, _EXAMPLE.format(word.text))

    def _refuse(self, word: LiftedToken, message: str, remedy: str) -> None:
        raise LiftedFault(Slug.PREDICATE_SYNTAX, message, word.begin, word.end, remedy)

    # atoms

    def _atom(self, begin: int, end: int) -> Formula:
        """Return what stands between connectives."""
        tokens = self._tokens[begin:end]
        words = [token.text for token in tokens]
        if words in (["true"], ["false"]):
            return ConstantFormula(words == ["true"])
        if len(tokens) > 2 and words[1] == "(" and tokens[0].is_name and ")" not in words[:-1]:  # noqa: PLR2004 - `t ( )`
            self.is_lifted = True
            table = self._scope.names.facts.tables.get(words[0])
            return self._row(table, tokens) if table is not None else self._unknown_table(tokens)
        term = self._scope.term(words[0])
        if len(tokens) == 1 and term is not None:
            self._scope.refuse_bare(term, tokens[0], self._note)
            return ConstantFormula(True)
        static = self._equality(tokens) or self._misspelt_type(tokens)
        static = static or self._membership(tokens) or self._order(tokens)
        if static is None:
            self._dynamic_atoms.append(tokens)
            return self._dynamic(begin, end)
        self.is_lifted = True
        return static

    def _equality(self, tokens: Sequence[LiftedToken]) -> Formula | None:
        if len(tokens) != 3 or tokens[1].text not in ("==", "!="):  # noqa: PLR2004 - `p == q`
            return None
        left, right = self._scope.term(tokens[0].text), self._scope.term(tokens[2].text)
        if left is not None and right is None and self._is_no_variable(tokens[2], is_likely=True):
            self._scope.refuse_unlike_term(left, tokens[2], self._note)
            return ConstantFormula(True)
        if right is not None and left is None and self._is_no_variable(tokens[0], is_likely=False):
            self._scope.refuse_unlike_term(right, tokens[0], self._note)
            return ConstantFormula(True)
        if left is None or right is None:
            return None
        self._scope.refuse_unlike(left, right, (tokens[0].begin, tokens[2].end), self._note)
        return EqualityFormula(left, right, equal=tokens[1].text == "==")

    def _is_no_variable(self, token: LiftedToken, *, is_likely: bool) -> bool:
        """Return whether the operand that is compared with an object is no variable, and probably means none.

        Args:
            token: the operand.
            is_likely: whether an unknown word there that is similar to no name is an object rather than a variable.
        """
        names = self._scope.names
        if not token.is_name or token.text in keywords():
            return token.text[:1].isdecimal() or token.text in ("true", "false")
        if token.text in names.plain or token.text in names.indexed or self._scope.dotted(token) is not None:
            return False
        if nearest(token.text, self._scope.terms) is not None:
            return True
        known = [*names.plain_in_order, *names.indexed]
        return is_likely and names.is_whole and nearest(token.text, known) is None

    def _order(self, tokens: Sequence[LiftedToken]) -> Formula | None:
        """Note a parameter or an object that is an operand of `<` and the like; `None` if there is none."""
        if len(tokens) < 3 or not any(token.text in ("<", "<=", ">", ">=") for token in tokens):  # noqa: PLR2004
            return None
        sides = (tokens[0], tokens[1].text), (tokens[-1], tokens[-2].text)
        found = [(token, term) for token, sign in sides if sign in RELATIONS and (term := self._scope.term(token.text))]
        for token, term in found:
            self._scope.refuse_order(term, token, self._note)
        return ConstantFormula(True) if found else None

    def _membership(self, tokens: Sequence[LiftedToken]) -> Formula | None:
        """Return `p in {a, b}` and `p in zone` for a parameter, and `v in zone` for a variable."""
        at = next((index for index, token in enumerate(tokens) if token.text == "in"), None)
        if at is None or at in (0, len(tokens) - 1):
            return None
        facts = self._scope.names.facts
        term = self._scope.term(tokens[0].text) if at == 1 else None
        last = tokens[-1]
        if at == len(tokens) - 2 and last.text in facts.types:
            objects = facts.objects(last.text)
            if term is not None:
                self._scope.refuse_unrelated_type(term, last.text, tokens[0], self._note)
                return TableFormula([term], dict.fromkeys((each,) for each in objects))
            members = (f"{{{', '.join(objects)}}}", last.begin, last.end)
            gap = (self._text[tokens[at - 1].end : last.begin], tokens[at - 1].end, last.begin)
            return AtomFormula([*self._parts(tokens[:at]), gap, members]) if objects else ConstantFormula(False)
        if term is None or tokens[at + 1].text != "{" or last.text != "}":
            return None
        listed = tokens[at + 2 : -1 : 2]
        members_of = [self._scope.term(token.text) for token in listed]
        if any(t.text != "," for t in tokens[at + 3 : -1 : 2]):
            return None
        for member, token in zip(members_of, listed, strict=True):
            if member is not None:
                self._scope.refuse_unlike(term, member, (token.begin, token.end), self._note)
            else:
                self._scope.refuse_unlike_term(term, token, self._note)
        equal = [EqualityFormula(term, member, equal=True) for member in members_of if member is not None]
        span = (tokens[at].begin, tokens[at].end)
        return JointFormula(Tightness.DISJUNCTION, equal, span) if equal else None

    def _misspelt_type(self, tokens: Sequence[LiftedToken]) -> Formula | None:
        """Note `v in zonee`, with a word close to a type; `None` for anything else."""
        last, types = tokens[-1], self._scope.names.facts.types
        if len(tokens) < 3 or tokens[-2].text != "in" or not last.is_name or last.text in (*types, *keywords()):  # noqa: PLR2004 - `v in zone`
            return None
        if nearest(last.text, types) is None:
            return None
        self._check_type(last)
        return ConstantFormula(True)

    def _unknown_table(self, tokens: Sequence[LiftedToken]) -> Formula:
        facts = self._scope.names.facts
        name = tokens[0]
        remedy = suggestion(name.text, facts.tables, "the tables are") or "declare it under `tables`"
        message = "" if facts.misses_names or name.text in facts.unread else f"there is no table `{name.text}`"
        self._note(Slug.UNKNOWN_TABLE, message, name.begin, name.end, remedy)
        return ConstantFormula(True)

    def _row(self, table: ObjectTable, tokens: Sequence[LiftedToken]) -> Formula:
        """Return the lookup of a row."""
        arguments = _between_commas(tokens[2:-1])
        odd = [argument for argument in arguments if len(argument) > 1]
        for argument in odd:
            begin, end = argument[0].begin, argument[-1].end
            message = f"the arguments of a table are parameters or objects, and `{self._text[begin:end]}` is neither"
            self._note(Slug.NOT_STATIC, message, begin, end, f"write for example `{self._example_of(table)}`")
        if odd:
            return ConstantFormula(True)
        listed = [argument[0] for argument in arguments if argument]
        if len(listed) != len(table.types) or len(listed) < len(arguments):
            columns = ", ".join(table.types)
            message = f"`{table.name}({columns})` has {len(table.types)} columns, and this has {len(listed)}"
            self._note(Slug.WRONG_ROW, message, tokens[0].begin, tokens[-1].end)
            return ConstantFormula(True)
        terms = [self._argument(token, kind) for token, kind in zip(listed, table.types, strict=True)]
        whole = [term for term in terms if term is not None]
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

    def _dynamic(self, begin: int, end: int) -> AtomFormula:
        return AtomFormula(self._parts(self._tokens[begin:end]))

    def _parts(self, tokens: Sequence[LiftedToken]) -> list[Piece | TextSlot]:
        """Return the text of some tokens, in which parameters and names with an index are slots."""
        parts: list[Piece | TextSlot] = []
        copied = tokens[0].begin if tokens else 0
        index = 0
        while index < len(tokens):
            slot, after = self._slot(tokens, index)
            if slot is not None:
                self.is_lifted = True
                if copied < tokens[index].begin:
                    parts.append((self._text[copied : tokens[index].begin], copied, tokens[index].begin))
                parts.append(slot)
                copied = tokens[after - 1].end
            index = after
        if tokens and copied < tokens[-1].end:
            parts.append((self._text[copied : tokens[-1].end], copied, tokens[-1].end))
        return parts

    def _slot(self, tokens: Sequence[LiftedToken], index: int) -> tuple[TextSlot | None, int]:
        """Return the slot that begins at an index, if any, and the index after it."""
        token = tokens[index]
        if not token.is_name or (index and tokens[index - 1].text[:1].isdecimal()):  # the `s` of `10 s` is a unit
            return None, index + 1
        if index + 1 < len(tokens) and tokens[index + 1].text == "[":
            return self._bracketed_index(tokens, index)
        if token.text in self._scope.parameters:
            return ObjectSlot(token.text, token.begin, token.end), index + 1
        dotted = self._scope.dotted(token)
        if dotted is not None and dotted.indexed.has_state and [part[0] for part in dotted.parts] == ["state"]:
            self._scope.refuse_missing_index(dotted.indexed, token.begin, token.end, self._note)
            return None, index + 1
        if dotted is not None:
            terms = self._scope.index(dotted.indexed, dotted.parts, token.begin, token.end, self._note)
            slot = None if terms is None else IndexSlot(dotted.indexed, terms, dotted.suffix, token.begin, token.end)
            return slot, index + 1
        names = self._scope.names
        before, _, last = token.text.rpartition(".")
        if before in names.plain and last in self._scope.parameters and token.text not in names.plain:
            self._note(Slug.WRONG_INDEX, f"`{before}` has no index", token.begin, token.end)
        indexed = names.indexed.get(token.text)
        if indexed is not None and token.text not in names.symbols and token.text not in names.plain:
            self._scope.refuse_missing_index(indexed, token.begin, token.end, self._note)
        return None, index + 1

    def _bracketed_index(self, tokens: Sequence[LiftedToken], index: int) -> tuple[TextSlot | None, int]:
        token = tokens[index]
        closing = next((at for at in range(index, len(tokens)) if tokens[at].text == "]"), None)
        if closing is None:
            return None, index + 1
        indexed = self._scope.names.indexed.get(token.text)
        after, suffix, end = closing + 1, "", tokens[closing].end
        if after < len(tokens) and tokens[after].begin == end:
            following = tokens[after]
            if following.is_name and following.text.startswith("_"):  # `scanner[r]_req_state`
                indexed = self._scope.names.indexed.get(token.text + following.text)
                after, end = after + 1, following.end
            elif following.text == "." and after + 1 < len(tokens) and tokens[after + 1].text == "state":
                after, suffix, end = after + 2, ".state", tokens[after + 1].end
        if indexed is None:
            self._refuse_index(token)
            return None, after
        parts = [(each.text, each.begin, each.end) for each in tokens[index + 2 : closing] if each.text != ","]
        terms = self._scope.index(indexed, parts, token.begin, end, self._note)
        return (None if terms is None else IndexSlot(indexed, terms, suffix, token.begin, end)), after

    def _refuse_index(self, token: LiftedToken) -> None:
        if token.text in self._scope.names.plain:
            self._note(Slug.WRONG_INDEX, f"`{token.text}` has no index", token.begin, token.end)
            return
        known: dict[str, IndexedName] = dict(self._scope.names.indexed)
        remedy = suggestion(token.text, known, "names with an index are")
        message = f"there is no variable `{token.text}` with an index" if self._scope.names.is_whole else ""
        self._note(Slug.UNKNOWN_VARIABLE, message, token.begin, token.end, remedy)


def _between_commas(tokens: Sequence[LiftedToken]) -> list[list[LiftedToken]]:
    """Return the tokens between the commas outside of brackets; nothing for no tokens."""
    groups: list[list[LiftedToken]] = [[]]
    depth = 0
    for token in tokens:
        depth += (token.text in _CLOSING) - (token.text in _CLOSING.values())
        if token.text == "," and not depth:
            groups.append([])
        else:
            groups[-1].append(token)
    return groups if tokens else []
