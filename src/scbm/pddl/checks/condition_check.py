"""Checks conditions and numbers of PDDL, and writes them for `unified-planning`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.pddl.checks.declared_names import remedy_for, shown_kinds
from scbm.pddl.pddl_text import NUMBER

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.pddl.checks.declared_names import DeclaredFluent, Kinds, PddlNames, Term
    from scbm.pddl.checks.pddl_nodes import FileFaults, PddlNode

COMPARISONS = ("<", ">", "<=", ">=")
_OPERATORS = {"+": 2, "*": 2, "/": 2, "-": 1}
"""The arithmetic operators with their minimum numbers of operands."""

_EFFECTS = ("when", "assign", "increase", "decrease", "scale-up", "scale-down")
_CONTINUOUS = "changes that go on with time cannot be expressed in a model"


class ConditionCheck:
    """Checks the conditions of one file, and returns each as a text for `unified-planning`.

    A text for an expression with an error means nothing. `scope` has the types of all variables, without `?`.
    """

    def __init__(self, names: PddlNames, faults: FileFaults, *, is_domain: bool) -> None:
        self.names = names
        self.faults = faults
        self._is_domain = is_domain
        self.duration: str | None = None

    def condition(  # noqa: C901, PLR0911 - one branch for each kind
        self, node: PddlNode, scope: Mapping[str, Kinds]
    ) -> str:
        """Return a condition as a text for `unified-planning`."""
        if not self.is_expression(node, "condition"):
            return "(and)"
        operands = node.parts[1:]
        match node.head:
            case "":
                return "(and)"
            case "and" | "or":
                return f"({node.head} {' '.join(self.condition(each, scope) for each in operands)})"
            case "not" if self.has_parts(node, 1, "(not CONDITION)"):
                return f"(not {self.condition(operands[0], scope)})"
            case "imply" if self.has_parts(node, 2, "(imply CONDITION CONDITION)"):
                return f"(imply {self.condition(operands[0], scope)} {self.condition(operands[1], scope)})"
            case "forall" | "exists" if self.has_parts(node, 2, f"({node.head} (?NAME - TYPE) CONDITION)"):
                own = self.variables(operands[0])
                inside = self.condition(operands[1], {**scope, **own})
                return f"({node.head} ({self.names.parameters_text(own)}) {inside})" if own else inside
            case "preference":
                return self.condition(self.preferred(node), scope) if self.preferred(node) is not node else "(and)"
            case "=" if self.has_parts(node, 2, "(= TERM TERM)"):
                return self._equality(node, scope)
            case word if word in COMPARISONS and self.has_parts(node, 2, f"({word} NUMBER NUMBER)"):
                return f"({word} {self.number(operands[0], scope)} {self.number(operands[1], scope)})"
            case word if word in ("not", "imply", "forall", "exists", "=", *COMPARISONS):
                return "(and)"
            case word if word in _EFFECTS or word in _OPERATORS:
                self.faults.wrong(
                    node, f"`{word}` is no condition", "write a predicate, a comparison, or `and`, `or` …"
                )
                return "(and)"
            case _:
                return self.fluent(node, scope, is_numeric=False)

    def is_expression(self, node: PddlNode, what: str) -> bool:
        """Return whether an expression is a list that begins with a word, or with nothing; else note an error."""
        if not node.is_list:
            article = "an" if what == "effect" else "a"
            remedy = f"write `({node.word})`" if node.word in self.names.fluents else "write it in brackets"
            self.faults.wrong(node, f"`{node.word}` stands where {article} {what} in brackets is expected", remedy)
        elif node.parts and not node.head:
            self.faults.wrong(node.place, "a word is expected after this `(`", "remove one pair of brackets")
        else:
            return True
        return False

    def has_parts(self, node: PddlNode, count: int, form: str) -> bool:
        """Return whether an expression has so many parts after its word; else note an error with the right form."""
        if len(node.parts) - 1 == count:
            return True
        found = len(node.parts) - 1
        message = (
            f"`{node.head}` has {count} part{'s' * (count != 1)}, and here {'is' if found == 1 else 'are'} {found}"
        )
        self.faults.wrong(node, message, f"write `{form}`")
        return False

    def preferred(self, node: PddlNode) -> PddlNode:
        """Note that preferences cannot be expressed, and return the condition of one; the node itself without it."""
        self.faults.refuse(node, "preferences cannot be expressed in a model", "leave them out of the import")
        return node.parts[-1] if len(node.parts) > 1 and node.parts[-1].is_list else node

    def variables(self, node: PddlNode) -> dict[str, Kinds]:
        """Return the variables of a quantifier with their types."""
        if node.is_list:
            return self.names.read_parameters(node.parts, self.faults)
        self.faults.wrong(
            node, f"`{node.word}` stands where variables in brackets are expected", "write `(?NAME - TYPE)`"
        )
        return {}

    def fluent(self, node: PddlNode, scope: Mapping[str, Kinds], *, is_numeric: bool) -> str:
        """Return a predicate, or a function, with its arguments."""
        what, other = ("function", "predicate") if is_numeric else ("predicate", "function")
        declared = self.names.fluents.get(node.head)
        if declared is None:
            known = [name for name, each in self.names.fluents.items() if each.is_numeric == is_numeric]
            remedy = remedy_for(node.head, known, f"declare it in `:{what}s`")
            self.faults.wrong(node, f"there is no {what} `{node.head}`", remedy)
        elif declared.is_numeric != is_numeric:
            use = "give it a number to compare with" if other == "function" else "write a function, or a number"
            self.faults.wrong(node, f"`{node.head}` is a {other}, and a {what} is expected here", use)
            declared = None
        terms = [self.term(each, scope) for each in node.parts[1:]]
        if declared is not None:
            self._check_arguments(node, declared, [kinds for _, kinds in terms])
        return f"({' '.join([f'f-{node.head}', *(text for text, _ in terms)])})"

    def _check_arguments(self, node: PddlNode, declared: DeclaredFluent, found: Sequence[Kinds]) -> None:
        remedy = f"it is declared as `{declared}`"
        wanted = len(declared.parameters)
        if len(found) != wanted:
            shown = f"{wanted} argument{'s' * (wanted != 1)}" if wanted else "no arguments"
            message = f"`{declared.name}` has {shown}, and here {'is' if len(found) == 1 else 'are'} {len(found)}"
            self.faults.wrong(node, message, remedy)
            return
        for each, kinds, (name, expected) in zip(node.parts[1:], found, declared.parameters, strict=True):
            if kinds and not self.names.fits(kinds, expected):
                message = (
                    f"`{each.word}` is of type {shown_kinds(kinds)}, and `?{name}` of `{declared.name}` is of type"
                    f" {shown_kinds(expected)}"
                )
                self.faults.wrong(each, message, remedy)

    def term(self, node: PddlNode, scope: Mapping[str, Kinds]) -> Term:
        """Return a variable or an object, and its types."""
        word = node.word
        if node.is_list:
            self.faults.wrong(node, f"`{node}` stands where an object is expected", "write an object or a parameter")
        elif word.startswith("?"):
            if word[1:] in scope:
                return word, scope[word[1:]]
            otherwise = "declare it in `:parameters`" if self._is_domain else "write an object"
            remedy = remedy_for(word, [f"?{name}" for name in scope], otherwise)
            self.faults.wrong(node, f"there is no parameter or variable `{word}` here", remedy)
        elif word in self.names.objects:
            return f"o-{word}", self.names.objects[word]
        else:
            remedy = self._remedy_for_object(word, scope)
            self.faults.wrong(node, f"there is no {'constant' if self._is_domain else 'object'} `{word}`", remedy)
        return "o-", ()

    def _remedy_for_object(self, word: str, scope: Mapping[str, Kinds]) -> str:
        if self._is_domain and word in self.names.problem_objects:
            return "it is an object of the problem: declare it in `:constants` of the domain instead"
        section = ":constants" if self._is_domain else ":objects"
        return remedy_for(word, [*self.names.objects, *(f"?{name}" for name in scope)], f"declare it in `{section}`")

    # numbers

    def _equality(self, node: PddlNode, scope: Mapping[str, Kinds]) -> str:
        first, second = node.parts[1:]
        if self._is_number(first) or self._is_number(second):
            return f"(= {self.number(first, scope)} {self.number(second, scope)})"
        terms = self.term(first, scope), self.term(second, scope)
        return f"(= {terms[0][0]} {terms[1][0]})" if self.names.can_be_equal(*terms) else "(or)"

    def _is_number(self, node: PddlNode) -> bool:
        if node.is_list:
            return True
        fluent = self.names.fluents.get(node.word)
        is_function = fluent is not None and fluent.is_numeric and node.word not in self.names.objects
        return is_function or node.word in {"?duration", "#t"} or NUMBER.fullmatch(node.word) is not None

    def number(self, node: PddlNode, scope: Mapping[str, Kinds]) -> str:
        """Return an expression of numbers."""
        if not node.is_list:
            return self._number_word(node, scope)
        if not self.is_expression(node, "number") or not node.parts:
            if not node.parts:
                self.faults.wrong(node, "a number is expected here", "write a number or a function")
            return "0"
        if node.head not in _OPERATORS:
            return self.fluent(node, scope, is_numeric=True)
        operands = [self.number(each, scope) for each in node.parts[1:]]
        most = 2 if node.head in "-/" else len(operands)
        if not _OPERATORS[node.head] <= len(operands) <= most:
            form = f"({node.head} NUMBER NUMBER)"
            self.faults.wrong(
                node, f"`{node.head}` has {len(operands)} operand{'s' * (len(operands) != 1)} here", f"write `{form}`"
            )
            return "0"
        return f"({node.head} {' '.join(['0'] * (node.head == '-' and len(operands) == 1) + operands)})"

    def _number_word(self, node: PddlNode, scope: Mapping[str, Kinds]) -> str:
        word = node.word
        if NUMBER.fullmatch(word):
            return word
        if word == "#t":
            self.faults.refuse(node, _CONTINUOUS, "write an effect at the end")
        elif word == "?duration" and word[1:] not in scope:
            if self.duration is not None:
                return self.duration
            message = "the value of `?duration` is not known here"
            self.faults.refuse(node, message, "write `:duration (= ?duration NUMBER)`, or a number in place of it")
        elif word in self.names.fluents:
            return self.fluent(type(node)("", (node,), node.place), scope, is_numeric=True)
        else:
            what = "an object" if word.startswith("?") or word in self.names.objects else "no number"
            remedy = remedy_for(word, [n for n, f in self.names.fluents.items() if f.is_numeric], "write a number")
            self.faults.wrong(node, f"`{word}` is {what}, and a number is expected here", remedy)
        return "0"
