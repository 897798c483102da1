"""Checks a domain and a problem of PDDL, so that all their errors are located and come at once.

What is right is written again for `unified-planning`, in the forms and in the order of sections that it reads. Each
name gets a prefix, since in PDDL a type, an object and a predicate can have one name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.files.spelling import nearest
from scbm.files.yaml.error_collector import MAX_ERRORS
from scbm.model import InputError
from scbm.pddl.checks.action_check import ActionCheck
from scbm.pddl.checks.condition_check import ConditionCheck
from scbm.pddl.checks.declared_names import PddlNames, remedy_for
from scbm.pddl.checks.pddl_nodes import FileFaults, read_nodes
from scbm.pddl.pddl_text import NUMBER, merged_errors

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import Diagnostic
    from scbm.pddl.checks.pddl_nodes import PddlNode
    from scbm.pddl.pddl_text import PddlText

_LEAVE_OUT = "leave them out of the import"

SUPPORTED = (
    *(":strips", ":typing", ":negative-preconditions", ":disjunctive-preconditions", ":equality"),
    *(":existential-preconditions", ":universal-preconditions", ":quantified-preconditions", ":conditional-effects"),
    *(":adl", ":fluents", ":numeric-fluents", ":action-costs", ":durative-actions", ":duration-inequalities"),
)
"""The words of `:requirements` that need nothing else: what they allow is read, declared or not."""

_UNSUPPORTED = {
    ":derived-predicates": "derived predicates",
    ":domain-axioms": "derived predicates",
    ":timed-initial-literals": "facts at given times",
    ":timed-initial-effects": "changes at given times",
    ":constraints": "constraints on plans",
    ":preferences": "preferences",
    ":continuous-effects": "changes that go on with time",
    ":time": "processes and events",
    ":object-fluents": "functions whose values are objects",
    ":goal-utilities": "utilities of goals",
    ":hierarchy": "hierarchies of tasks",
    ":method-preconditions": "hierarchies of tasks",
    ":htn": "hierarchies of tasks",
    ":contingent": "unknown facts and observations",
    ":non-deterministic": "effects by chance",
    ":probabilistic-effects": "effects by chance",
    ":rewards": "rewards",
    ":mdp": "effects by chance",
    ":multi-agent": "several agents",
    ":factored-privacy": "several agents",
    ":unfactored-privacy": "several agents",
}
"""The words of `:requirements` that a model cannot express, and what each allows."""

_REFUSED_SECTIONS = {
    ":derived": "derived predicates",
    ":axiom": "derived predicates",
    ":constraints": "constraints on plans",
    ":process": "processes",
    ":event": "events",
    ":task": "hierarchies of tasks",
    ":method": "hierarchies of tasks",
    ":htn": "hierarchies of tasks",
    ":length": "limits on the length of plans",
}
_ACTIONS = (":action", ":durative-action")
_DOMAIN = (":requirements", ":types", ":constants", ":predicates", ":functions", *_ACTIONS)
_PROBLEM = (":domain", ":requirements", ":objects", ":init", ":goal", ":metric")


class CheckedPddl(Struct, frozen=True):
    """A domain and a problem as texts for `unified-planning`.

    Attributes:
        name: of the problem.
        declarations: the types, constants, predicates and functions.
        actions: the actions with their names.
        objects, init, goal: the sections of the problem.
        fluents: the parameters of each predicate and function, with their types.
        more_parents: the types above a type, besides the first one.
        errors: what a model cannot express; these texts leave it out.
    """

    name: str
    declarations: str
    actions: tuple[tuple[str, str], ...]
    objects: str
    init: str
    goal: str
    fluents: Mapping[str, tuple[tuple[str, str], ...]]
    more_parents: Mapping[str, tuple[str, ...]]
    errors: tuple[Diagnostic, ...]

    def domain_text(self, actions: Sequence[str]) -> str:
        """Return the domain with some of its actions."""
        return f"(define (domain d) {self.declarations} {' '.join(actions)})"

    def problem_text(self, *, init: bool = True, goal: bool = True) -> str:
        """Return the problem, or one without facts or without a goal."""
        facts, wanted = self.init if init else "", self.goal if goal else "(and)"
        return f"(define (problem p) (:domain d) (:objects {self.objects}) (:init {facts}) (:goal {wanted}))"


def checked_pddl(domain: PddlText, problem: PddlText) -> CheckedPddl:
    """Return a domain and a problem that are right PDDL. Raise `InputError` with all errors of both if they are not."""
    return _PddlCheck(domain, problem).checked()


class _PddlCheck:
    def __init__(self, domain: PddlText, problem: PddlText) -> None:
        self._domain = FileFaults(domain)
        self._problem = FileFaults(problem)
        self._names = PddlNames()

    def checked(self) -> CheckedPddl:
        domain = _sections("domain", _DOMAIN, self._domain)
        problem = _sections("problem", _PROBLEM, self._problem)
        declarations, actions = ("", ()) if domain is None else self._domain_texts(domain, problem)
        objects, init, goal = "", "", ""
        if domain is not None and problem is not None:
            objects, init, goal = self._problem_texts(domain, problem)
        errors = (*_sorted(self._domain), *_sorted(self._problem))
        if self._domain.are_of_pddl or self._problem.are_of_pddl or domain is None or problem is None:
            raise InputError(errors)
        declarations = f"{self._names.types_text()} {declarations}"
        types = self._names
        fluents = {
            name: tuple((parameter, types.one_type(kinds)) for parameter, kinds in fluent.parameters)
            for name, fluent in types.fluents.items()
        }
        more_parents = {kind: tuple(above) for kind, above in types.more_parents.items()}
        return CheckedPddl(problem.name.word, declarations, actions, objects, init, goal, fluents, more_parents, errors)

    def _domain_texts(self, domain: _Sections, problem: _Sections | None) -> tuple[str, tuple[tuple[str, str], ...]]:
        """Return the declarations and the actions of the domain."""
        of_problem = problem.parts(":objects") if problem is not None else ()
        names = self._names
        names.reserve([*domain.parts(":constants"), *of_problem], [part.word for part in of_problem])
        _check_requirements(domain, self._domain)
        names.read_types(domain.parts(":types"), self._domain)
        names.read_unions(domain.nodes, self._domain)
        texts = {
            ":constants": names.read_objects(domain.parts(":constants"), self._domain),
            ":predicates": names.read_fluents(domain.parts(":predicates"), self._domain, are_numeric=False),
            ":functions": names.read_fluents(domain.parts(":functions"), self._domain, are_numeric=True),
        }
        declarations = " ".join(f"({key} {text})" for key, text in texts.items() if text)
        return declarations, self._actions(domain, names)

    def _problem_texts(self, domain: _Sections, problem: _Sections) -> tuple[str, str, str]:
        """Return the objects, the initial facts and the goal of the problem."""
        _check_requirements(problem, self._problem)
        self._check_name_of_domain(domain, problem)
        objects = self._names.read_objects(problem.parts(":objects"), self._problem)
        conditions = ConditionCheck(self._names, self._problem, is_domain=False)
        if not problem.all(":init"):
            self._problem.wrong(problem.name, "the problem has no initial state", "write `(:init FACT …)`")
        init = _InitCheck(conditions, self._problem).facts(problem.parts(":init"))
        goal = problem.all(":goal")
        if goal and len(goal[0].parts) == 2:  # noqa: PLR2004 - `:goal` and its condition
            return objects, init, conditions.condition(goal[0].parts[1], {})
        message = "`:goal` has one condition" if goal else "the problem has no goal"
        place = goal[0] if goal else problem.name
        self._problem.wrong(place, message, "write `(:goal CONDITION)`, with `and` for several")
        return objects, init, "(and)"

    def _actions(self, domain: _Sections, names: PddlNames) -> tuple[tuple[str, str], ...]:
        check = ActionCheck(names, self._domain)
        found: dict[str, str] = {}
        for node in domain.nodes:
            if node.head in _ACTIONS:
                name, text = check.action(node)
                if name in found:
                    self._domain.wrong(node.parts[1], f"there is an action `{name}` already", "choose another name")
                found[name] = text
        return tuple(found.items())

    def _check_name_of_domain(self, domain: _Sections, problem: _Sections) -> None:
        node = next(iter(problem.all(":domain")), None)
        if node is None:
            self._problem.wrong(problem.name, "the problem names no domain", f"write `(:domain {domain.name.word})`")
        elif len(node.parts) != 2 or node.parts[1].is_list:  # noqa: PLR2004 - `:domain` and the name
            self._problem.wrong(node, "a name is expected after `:domain`", f"write `(:domain {domain.name.word})`")
        elif node.parts[1].word != domain.name.word:
            used = node.parts[1]
            message = f"the problem is one of the domain `{used.word}`, and the domain is called `{domain.name.word}`"
            self._problem.wrong(used, message, "name the files of one domain")


class _Sections(Struct, frozen=True):
    """The sections of a file, and the name of the domain or problem."""

    name: PddlNode
    nodes: tuple[PddlNode, ...]

    def all(self, *words: str) -> list[PddlNode]:
        """Return the sections that begin with one of some words."""
        return [node for node in self.nodes if node.head in words]

    def parts(self, word: str) -> tuple[PddlNode, ...]:
        """Return the parts of the section that begins with a word; none without one."""
        return next((node.parts[1:] for node in self.all(word)), ())


def _sorted(faults: FileFaults) -> list[Diagnostic]:
    return merged_errors(sorted(faults.found, key=lambda each: each.order))[:MAX_ERRORS]


def _sections(kind: str, known: Sequence[str], faults: FileFaults) -> _Sections | None:
    """Return the sections of a domain or problem; `None` if it cannot be read at all."""
    root, errors = read_nodes(faults.text)
    faults.found |= dict.fromkeys(errors)
    if root is None:
        return None
    form = f"write `(define ({kind} NAME) …)`"
    title = root.parts[1] if len(root.parts) > 1 else None
    if root.head != "define" or title is None or title.head not in ("domain", "problem"):
        faults.wrong(root, f"this is no {kind} of PDDL", form)
        return None
    if title.head != kind:
        remedy = "name the domain first, then the problem: `scbm import pddl DOMAIN PROBLEM`"
        faults.wrong(title, f"this is a {title.head}, and a {kind} is expected here", remedy)
        return None
    if len(title.parts) != 2 or title.parts[1].is_list:  # noqa: PLR2004 - the word and the name
        faults.wrong(title, f"a name is expected after `{kind}`", form)
        return None
    nodes = tuple(_known_sections(root.parts[2:], kind, known, faults))
    return _Sections(title.parts[1], nodes)


def _known_sections(
    parts: Sequence[PddlNode], kind: str, known: Sequence[str], faults: FileFaults
) -> Iterator[PddlNode]:
    """Yield the sections of a domain or problem, and note errors about the others."""
    seen: dict[str, None] = {}
    for node in parts:
        if not node.head.startswith(":"):
            shown = f"`{node.word or node.head or '()'}`"
            remedy = remedy_for(f":{node.head}", known, f"sections of a {kind}: {', '.join(known)}")
            faults.wrong(node, f"a section is expected in place of {shown}", remedy)
        elif node.head in _REFUSED_SECTIONS:
            faults.refuse(node, f"{_REFUSED_SECTIONS[node.head]} cannot be expressed in a model", _LEAVE_OUT)
            yield node
        elif node.head not in known:
            others = (*_DOMAIN, *_PROBLEM)
            elsewhere = f"`{node.head}` belongs into the {'problem' if kind == 'domain' else 'domain'}"
            if node.head in (":objects", ":constants"):
                elsewhere = f"write `{':constants' if kind == 'domain' else ':objects'}`"
            listed = f"sections of a {kind}: {', '.join(known)}"
            remedy = elsewhere if node.head in others else remedy_for(node.head, known, listed)
            faults.wrong(node, f"a {kind} has no section `{node.head}`", remedy)
            meant = None if node.head in others else nearest(node.head, known)
            if meant is not None and meant not in seen:
                seen[meant] = None
                yield node.with_head(meant)
        elif node.head in seen and node.head not in _ACTIONS:
            faults.wrong(node, f"there is a section `{node.head}` already", "write both as one section")
        else:
            seen[node.head] = None
            yield node


def _check_requirements(sections: _Sections, faults: FileFaults) -> None:
    for each in sections.parts(":requirements"):
        if each.is_list:
            faults.wrong(each, "a word is expected in `:requirements`", "write it without brackets")
        elif each.word in _UNSUPPORTED:
            message = f"`{each.word}` asks for {_UNSUPPORTED[each.word]}, which a model cannot express"
            faults.refuse(each, message, "leave this word out, with all that needs it")
        elif each.word not in SUPPORTED:
            word = each.word if each.word.startswith(":") else f":{each.word}"
            remedy = remedy_for(word, (*SUPPORTED, *_UNSUPPORTED), "leave it out; its meaning is unknown")
            faults.wrong(each, f"`{each.word}` is no requirement of PDDL", remedy)


class _InitCheck:
    """Checks the initial state of a problem."""

    def __init__(self, conditions: ConditionCheck, faults: FileFaults) -> None:
        self._conditions = conditions
        self._faults = faults
        self._given: dict[str, str] = {}

    def facts(self, parts: Sequence[PddlNode]) -> str:
        """Return the facts and values of the initial state as a text for `unified-planning`."""
        if len(parts) == 1 and parts[0].head == "and":
            parts = parts[0].parts[1:]
        return " ".join(text for node in parts for text in self._fact(node))

    def _fact(self, node: PddlNode) -> Iterator[str]:
        if not self._conditions.is_expression(node, "fact") or not node.parts:
            return
        if node.head == "=":
            yield from self._value(node)
            return
        if node.head == "at" and len(node.parts) > 1 and NUMBER.fullmatch(node.parts[1].word):
            self._faults.refuse(node, "facts at given times cannot be expressed in a model", _LEAVE_OUT)
            return
        value, fact = "true", node
        if node.head == "not":
            if not self._conditions.has_parts(node, 1, "(not FACT)"):
                return
            value, fact = "false", node.parts[1]
            if not self._conditions.is_expression(fact, "fact"):
                return
        text = self._conditions.fluent(fact, {}, is_numeric=False)
        self._note(fact, text, value)
        if value == "true":
            yield text

    def _value(self, node: PddlNode) -> Iterator[str]:
        if not self._conditions.has_parts(node, 2, "(= (FUNCTION) NUMBER)"):
            return
        _, target, value = node.parts
        shown = self._conditions.number(target, {})
        if target.word and target.word not in self._conditions.names.fluents:
            return
        if not NUMBER.fullmatch(value.word):
            self._faults.wrong(
                value, f"`{value}` is no number, and the function has a number at first", "write a number"
            )
            return
        declared = self._conditions.names.fluents.get(target.head or target.word)
        if declared is not None and declared.is_numeric:
            self._note(target, shown, value.word)
        yield f"(= {shown} {value.word})"

    def _note(self, node: PddlNode, text: str, value: str) -> None:
        before = self._given.setdefault(text, value)
        if before != value:
            message = f"`{node}` is {value} here, and {before} before"
            self._faults.wrong(node, message, "leave out one of them")
