"""A domain and a problem of PDDL as the text of a lifted model (decision 54)."""

from __future__ import annotations

from functools import partial
from itertools import product
from math import prod
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.model import Diagnostic, InputError, Place
from scbm.pddl.action_cases import MAX_ACTION_CASES, TooManyCasesError, ValueClashError, VariableChange, cases_of
from scbm.pddl.constant_terms import number_faults
from scbm.pddl.import_names import NOTHING, OPERATION_FORMS, ImportNames
from scbm.pddl.imported_requests import ImportedRequests
from scbm.pddl.number_ranges import NumberRanges
from scbm.pddl.parameter_join import Exclusion, ParameterJoin
from scbm.pddl.pddl_reader import conjuncts, inner_formulas, negated
from scbm.pddl.pddl_task import FALSE, TRUE, PddlFormula
from scbm.pddl.pddl_text import merged_errors
from scbm.pddl.predicate_groups import PredicateGroups, without
from scbm.pddl.temporary_facts import temporary_faults
from scbm.pddl.undefined_values import UndefinedValues

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.pddl.action_cases import ActionCase
    from scbm.pddl.pddl_task import (
        Fact,
        FormulaKind,
        PddlEffect,
        PddlFluent,
        PddlLiftedAction,
        PddlTask,
    )
    from scbm.pddl.pddl_text import PddlText

_WIDTH = 110
"""A guard that is longer has one conjunct in each line."""


class PddlImportOptions(Struct, frozen=True):
    """The options of an import: the choices of the user about a domain.

    Attributes:
        groups: predicates whose values exclude each other: `at`, `at.zone`.
        resources: parameters, or types of parameters, that name the resource of an action.
        ranges: the ranges of numeric fluents: `fuel=0..10`.
        arguments: whether requests carry the arguments of actions.
    """

    groups: tuple[str, ...] = ()
    resources: tuple[str, ...] = ()
    ranges: tuple[str, ...] = ()
    arguments: bool = False


class ImportedModel(Struct, frozen=True):
    """A model for a problem of PDDL.

    Attributes:
        text: the text of the model.
        warnings: what nothing proves about it.
        domain: the text of the domain.
        origins: finds the action of an operation, or the predicate of a variable, by the first line of its entry.
    """

    text: str
    warnings: tuple[Diagnostic, ...]
    domain: PddlText
    origins: Mapping[int, Callable[[], Place]]

    def at_origin(self, fault: Diagnostic) -> Diagnostic:
        """Return an error about the text of the model with a place in the domain instead."""
        lines = [line for line in self.origins if line <= fault.place.line]
        place = self.origins[max(lines)]() if lines else self.domain.first("define")
        return self.domain.error(f"the model would not load: {fault.message}", place, fault.remedy, fault.slug)


def imported_model(task: PddlTask, domain: PddlText, problem: PddlText, options: PddlImportOptions) -> ImportedModel:
    """Return a model that means the same as a problem of PDDL. Raise `InputError` with all errors."""
    return _ModelText(task, domain, problem, options).model()


class _ModelText:
    def __init__(self, task: PddlTask, domain: PddlText, problem: PddlText, options: PddlImportOptions) -> None:
        self._task = task
        self._domain = domain
        self._problem = problem
        self._errors = dict.fromkeys(task.errors)
        self._objects_of = {kind: task.objects_of(kind) for kind in task.types}
        self._read = self._read_fluents()
        undefined = UndefinedValues(task, (domain, problem), self._read, self._objects_of)
        self._errors |= dict.fromkeys(undefined.errors)
        self._partial = undefined.partial
        self._task = task = undefined.task
        self._names = ImportNames(task)
        self._changed = {effect.fluent.name: None for action in task.actions for effect in action.effects}
        unread = [n for n, f in task.fluents.items() if f.is_numeric and n not in self._read]
        self._ignored = dict.fromkeys(unread)
        self._errors |= dict.fromkeys(number_faults(task, domain, problem, self._read))
        self._errors |= dict.fromkeys(temporary_faults(task, domain, problem, self._objects_of))
        self._static = {
            name: None for name, f in task.fluents.items() if name not in self._changed and not f.is_numeric
        }
        self._requests = ImportedRequests(task, self._names, domain, options.resources, arguments=options.arguments)
        groups = PredicateGroups(task, domain, problem, self._static, options.groups)
        self._groups = groups.chosen
        self._unproved = groups.unproved
        self._complete = {name: groups.is_complete(name, self._objects_of) for name in self._groups}
        self._warnings = tuple(groups.warnings)
        self._errors |= groups.errors
        tables = {name: dict.fromkeys(f for f, holds in task.initial[name].items() if holds) for name in self._static}
        self._join = ParameterJoin(tables, self._simplified, self._exclusions)
        numbers = [f for n, f in task.fluents.items() if f.is_numeric and n not in self._ignored]
        self._ranges = NumberRanges(task, numbers, domain, options.ranges)
        self._errors |= dict.fromkeys(self._ranges.errors)
        self._tables: list[str] = []
        self._assigned: dict[str, None] = {}
        self._origins: dict[str, Callable[[], Place]] = {}

    def model(self) -> ImportedModel:
        lines = self._lines()
        origins = {number: self._origins[line] for number, line in enumerate(lines, start=1) if line in self._origins}
        return ImportedModel("\n".join(lines) + "\n", self._warnings, self._domain, origins)

    def _order(self, error: Diagnostic) -> tuple[int, int, int]:
        """Return the sort key of an error: those of the domain, of the problem, and of options, each from the top."""
        files = [self._domain.file, self._problem.file]
        return (files.index(error.place.file) if error.place.file in files else len(files), *error.order)

    def _lines(self) -> list[str]:
        operations = [line for action in self._task.actions for line in self._operation_lines(action)]
        goals = self._goal_lines()
        variables = self._variable_lines()
        resources = self._requests.resource_lines()
        self._errors |= self._requests.errors
        if self._errors:
            raise InputError(merged_errors(sorted(self._errors, key=self._order)))
        used = "\n".join((*operations, *goals, *variables))
        tables = [*self._tables, *self._static_tables(used)]
        sections = [
            ("types", self._type_lines()),
            ("tables", tables),
            ("variables", variables),
            ("resources", resources),
            ("operations", operations),
            ("goals", goals),
        ]
        name = self._names.fresh(self._task.name)
        lines = [f"# Imported from PDDL: {self._domain.file}, {self._problem.file}"]
        timing = _fluents_in(
            term for a in self._task.actions if a.duration for term in (a.duration.lowest, a.duration.highest)
        )
        for reader, names in (
            ("no condition reads it", [name for name in self._ignored if name not in timing]),
            ("only durations read it", [name for name in self._ignored if name in timing]),
        ):
            lines += [f"# Left out, since {reader}: {', '.join(names)}"] if names else []
        if self._partial:
            lines.append(f"# Only for the objects that the problem gives a value for: {', '.join(self._partial)}")
        if self._unproved:
            lines.append(f"# Not proved to have one value at a time: {', '.join(self._unproved)}")
        lines.append(f"behavior_model: {name}")
        for section, content in sections:
            if content:
                lines += ["", f"{section}:", *content]
            elif section in {"variables", "operations"}:
                lines += ["", f"{section}: {{}}"]
        return lines

    # objects

    def _type_lines(self) -> list[str]:
        lines = []
        for kind, parent in self._task.types.items():
            own = [name for name, each in self._task.objects.items() if each == kind]
            below = [each for each, above in self._task.more_parents.items() if kind in above]  # `of` names one type
            own += [name for each in below for name in self._objects_of[each]]
            listed = f"[{', '.join(self._names.objects[name] for name in dict.fromkeys(own))}]"
            name = self._names.types[kind]
            text = listed if parent is None else f"{{objects: {listed}, of: {self._names.types[parent]}}}"
            lines.append(f"  {name}: {text}")
        return lines

    def _static_tables(self, used: str) -> list[str]:
        lines = []
        for name in self._static:
            fluent = self._task.fluents[name]
            if fluent.parameters and f"{self._names.fluents[name]}(" in used:
                rows = [fact for fact, value in self._task.initial[name].items() if value]
                lines.append(self._table(self._names.fluents[name], fluent.types, rows))
        return lines

    def _table(self, name: str, types: Sequence[str], rows: Iterable[Fact]) -> str:
        shown = ", ".join(f"[{', '.join(self._names.objects[each] for each in row)}]" for row in rows)
        return f"  {name}: {{of: [{', '.join(self._names.types[t] for t in types)}], rows: [{shown}]}}"

    def _read_fluents(self) -> dict[str, None]:
        """Return the fluents that conditions or values of read fluents read."""
        task = self._task
        formulas = [*task.goals]
        for action in task.actions:
            formulas += action.conditions
            formulas += [effect.condition for effect in action.effects]
        read = _fluents_in(formulas)
        size = -1
        while size != (size := len(read)):
            values = [e.value for a in task.actions for e in a.effects if e.fluent.name in read]
            read |= _fluents_in(values)
        return read

    # conditions

    def _simplified(self, formula: PddlFormula) -> PddlFormula:  # noqa: C901, PLR0911 - one branch for each kind
        """Return a condition with the static facts about objects decided."""
        parts = tuple(self._simplified(part) for part in formula.parts)
        match formula.kind:
            case "and":
                flat = [each for part in parts for each in conjuncts(part)]
                flat = [each for each in dict.fromkeys(flat) if each != TRUE]
                if FALSE in flat:
                    return FALSE
                return flat[0] if len(flat) == 1 else PddlFormula("and", tuple(flat))
            case "or":
                flat = [each for part in parts for each in (part.parts if part.kind == "or" else (part,))]
                flat = [each for each in dict.fromkeys(flat) if each != FALSE]
                if TRUE in flat:
                    return TRUE
                return flat[0] if len(flat) == 1 else PddlFormula("or", tuple(flat))
            case "not":
                if parts[0] in (TRUE, FALSE):
                    return FALSE if parts[0] == TRUE else TRUE
                return negated(parts[0])
            case "forall" | "exists":
                if parts[0] in (TRUE, FALSE) and all(self._objects_of[kind] for _, kind in formula.variables):
                    return parts[0]
            case "equals" | "<=" | "<" if (decided := self._decided(replace(formula, parts=parts))) is not None:
                return TRUE if decided else FALSE
            case "fluent" if formula.name in self._static and all(part.kind == "object" for part in parts):
                holds = self._task.initial[formula.name].get(tuple(part.name for part in parts), 0)
                return TRUE if holds else FALSE
            case _:
                pass
        return replace(formula, parts=parts)

    def _decided(self, comparison: PddlFormula) -> bool | None:
        """Return whether a comparison always holds or never; `None` if that depends on parameters or states."""
        left, right = comparison.parts
        if left == right:
            return comparison.kind != "<"
        if left.kind == right.kind == "object":
            return False
        return self._ranges.decided(comparison)

    def _distinguished(self, condition: PddlFormula, scope: Mapping[str, str]) -> PddlFormula:
        """Return a condition, simplified, in which no terms are compared that have no object in common."""

        def folded(formula: PddlFormula, scope: Mapping[str, str]) -> PddlFormula:
            if formula.kind == "equals" and all(part.kind in {"parameter", "object"} for part in formula.parts):
                terms = [{t.name} if t.kind == "object" else {*self._objects_of[scope[t.name]]} for t in formula.parts]
                return formula if set.intersection(*terms) else FALSE
            inside = {**scope, **dict(formula.variables)}
            return replace(formula, parts=tuple(folded(part, inside) for part in formula.parts))

        return self._simplified(folded(condition, scope))

    def _is_static(self, formula: PddlFormula) -> bool:
        return not any(f.kind == "fluent" and f.name not in self._static for f in inner_formulas(formula))

    def _shown(  # noqa: PLR0911 - one branch for each kind
        self, formula: PddlFormula, scope: Mapping[str, str], *, inner: bool = False
    ) -> str:
        """Return a condition as text; `inner` if it is an operand."""
        match formula.kind:
            case "and" | "or":
                if not formula.parts:
                    return "true" if formula.kind == "and" else "!true"
                sign = " && " if formula.kind == "and" else " || "
                text = sign.join(self._shown(part, scope, inner=True) for part in formula.parts)
                return f"({text})" if inner else text
            case "not":
                return self._negation(formula.parts[0], scope)
            case "forall" | "exists":
                return self._quantified(formula, scope, inner=inner)
            case "equals" | "<=" | "<":
                return self._comparison(formula, scope)
            case "fluent" if not self._task.fluents[formula.name].is_numeric:
                return self._fact(formula, scope, "==")
            case _:
                return self._term(formula, scope)

    def _negation(self, formula: PddlFormula, scope: Mapping[str, str]) -> str:
        if formula.kind == "fluent":
            return self._fact(formula, scope, "!=")
        if formula.kind == "equals":
            return self._comparison(formula, scope, "!=")
        if formula.kind in {"<=", "<"}:
            opposite: FormulaKind = "<" if formula.kind == "<=" else "<="
            return self._comparison(PddlFormula(opposite, formula.parts[::-1]), scope)
        return f"!({self._shown(formula, scope)})"

    def _fact(self, formula: PddlFormula, scope: Mapping[str, str], sign: str) -> str:
        name = self._names.fluents[formula.name]
        if formula.name in self._static:
            arguments = ", ".join(self._term(part, scope) for part in formula.parts)
            return f"{'!' if sign == '!=' else ''}{name}({arguments})"
        index = self._groups.get(formula.name)
        if index is None:
            return f"{self._reference(name, formula.parts, scope)} == {'true' if sign == '==' else 'false'}"
        reference = self._reference(name, without(formula.parts, index), scope)
        return f"{reference} {sign} {self._term(formula.parts[index], scope)}"

    def _reference(self, name: str, key: Iterable[PddlFormula], scope: Mapping[str, str]) -> str:
        return ".".join([name, *(self._term(term, scope) for term in key)])

    def _comparison(self, formula: PddlFormula, scope: Mapping[str, str], sign: str = "") -> str:
        left, right = formula.parts
        sign = sign or {"equals": "=="}.get(formula.kind, formula.kind)
        if self._is_constant(left) and not self._is_constant(right):
            left, right = right, left
            sign = {"<=": ">=", "<": ">"}.get(sign, sign)
        return f"{self._term(left, scope)} {sign} {self._term(right, scope)}"

    def _is_constant(self, formula: PddlFormula) -> bool:
        """Return whether a term is a number, or a function that no action changes, such as `distance`."""
        numeric = [each for each in inner_formulas(formula) if each.kind == "fluent"]
        is_number = formula.kind in {"number", "fluent", "+", "-"}
        return is_number and not any(each.name in self._changed for each in numeric)

    def _quantified(self, formula: PddlFormula, scope: Mapping[str, str], *, inner: bool) -> str:
        own = self._names.parameters([name for name, _ in formula.variables], scope.values())
        inside = {**scope, **own}
        text = f"({self._shown(formula.parts[0], inside)})"
        for name, kind in reversed(formula.variables):
            text = f"{formula.kind} {inside[name]} in {self._names.types[kind]}. {text}"
            if name != formula.variables[0][0]:
                text = f"({text})"
        return f"({text})" if inner else text

    def _term(self, formula: PddlFormula, scope: Mapping[str, str]) -> str:  # noqa: PLR0911 - one branch for each kind
        match formula.kind:
            case "parameter":
                return scope[formula.name]
            case "object":
                return self._names.objects[formula.name]
            case "number":
                return str(formula.number)
            case "fluent":
                return self._reference(self._names.fluents[formula.name], formula.parts, scope)
            case "+" | "*" | "/":
                return f" {formula.kind} ".join(self._term(part, scope) for part in formula.parts)
            case "-":
                first, *others = formula.parts
                return " - ".join([self._term(first, scope), *(self._operand(each, scope) for each in others)])
            case _:
                return self._shown(formula, scope, inner=True)

    def _operand(self, formula: PddlFormula, scope: Mapping[str, str]) -> str:
        text = self._term(formula, scope)
        return f"({text})" if formula.kind in {"+", "-"} else text

    # variables

    def _variable_lines(self) -> list[str]:
        lines: list[str] = []
        for name, fluent in self._task.fluents.items():
            if name not in self._static and name not in self._ignored:
                declared = self._declaration(fluent)
                self._origins |= dict.fromkeys(declared, partial(self._domain.declared, name))
                lines += declared
        return [*lines, *self._requests.variable_lines()]

    def _declaration(self, fluent: PddlFluent) -> list[str]:
        """Return the entries of a variable: one for each initial value."""
        name, index = fluent.name, self._groups.get(fluent.name)
        parameters = fluent.parameters if index is None else without(fluent.parameters, index)
        keys = list(product(*(self._objects_of[kind] for _, kind in parameters)))
        if index is not None:
            kind = self._names.types[fluent.types[index]]
            domain = kind if self._complete[name] else f"[{kind}, {NOTHING}]"
            held = {without(f, index): self._names.objects[f[index]] for f, v in self._task.initial[name].items() if v}
            values = {key: held.get(key, NOTHING) for key in keys}
        elif fluent.is_numeric:
            domain = self._ranges.shown(name)
            given = self._task.initial[name]
            values = {key: str(given.get(key, 0)) for key in keys if key in given or not key}  # else an error
        else:
            domain = "bool"
            values = {key: "true" if self._task.initial[name].get(key, 0) else "false" for key in keys}
        entries = self._entries(self._names.fluents[name], parameters, domain, values)
        source = "" if name in self._assigned else ", source: constant"  # the default is an input
        return [f"{entry}{source}}}" for entry in entries]

    def _entries(
        self, name: str, parameters: Sequence[tuple[str, str]], domain: str, values: Mapping[Fact, str]
    ) -> Iterator[str]:
        """Yield the entries, each without its last bracket. Functions may have values for some objects only."""
        if not parameters:
            yield f"  {name}: {{domain: {domain}, initial: {values[()]}"
            return
        different = list(dict.fromkeys(values.values()))
        is_partial = 0 < len(values) < prod(len(self._objects_of[kind]) for _, kind in parameters)
        if len(different) <= 1 and not is_partial:
            types = ", ".join(self._names.types[kind] for _, kind in parameters)
            if different:
                yield f"  {name}[{types}]: {{domain: {domain}, initial: {different[0]}"
            else:
                yield f"  {name}[{types}]: {{domain: {domain}, initial: {self._some_value(domain)}"
            return
        rest = max(different, key=lambda value: sum(v == value for v in values.values()))
        if domain == "bool":
            rest = "false"
        listed = different if is_partial else [*(value for value in different if value != rest), rest]
        excluded: list[str] = []
        used: list[str] = []  # each entry has parameters of its own: two keys of one variable differ
        for value in listed:
            own = list(self._names.parameters([p for p, _ in parameters], used).values())
            used += own
            if value == rest and not is_partial:
                where = " && ".join(self._call(e, own, negate=True) for e in excluded)
            else:
                facts = [key for key, each in values.items() if each == value]
                table = self._initial_table(name, value, [kind for _, kind in parameters], facts)
                excluded.append(table)
                where = self._call(table, own)
            shown = ", ".join(f"{w} in {self._names.types[k]}" for w, (_, k) in zip(own, parameters, strict=True))
            yield f'  {name}[{shown}]: {{where: "{where}", domain: {domain}, initial: {value}'

    def _initial_table(self, name: str, value: str, types: Sequence[str], facts: Sequence[Fact]) -> str:
        """Return a table, a set of objects, or `= OBJECT`, for the variables with one initial value."""
        if len(types) == len(facts) == 1:
            return f"= {self._names.objects[facts[0][0]]}"
        if len(types) == 1 and len(facts) <= 8:  # noqa: PLR2004 - so many names fit into one line
            return f"{{{', '.join(self._names.objects[fact[0]] for fact in facts)}}}"
        word = "" if value == "true" else f"_{value}" if not value.lstrip("-").isdigit() else f"_at_{value}"
        table = self._names.fresh(f"{name}_first{word}")
        self._tables.append(self._table(table, types, facts))
        return table

    @staticmethod
    def _call(table: str, words: Sequence[str], *, negate: bool = False) -> str:
        """Return the condition that a table, a set or a single object has the words, or has them not."""
        if table.startswith("= "):
            return f"{words[0]} {'!' if negate else '='}{table}"
        text = f"({words[0]} in {table})" if table.startswith("{") else f"{table}({', '.join(words)})"
        return f"!{text}" if negate else text

    def _some_value(self, domain: str) -> str:
        return "false" if domain == "bool" else domain.partition("..")[0] if ".." in domain else NOTHING

    # operations

    def _operation_lines(self, action: PddlLiftedAction) -> list[str]:
        action = replace(action, effects=tuple(e for e in action.effects if e.fluent.name not in self._ignored))
        try:
            cases = cases_of(action, self._objects_of.__getitem__, self._change, self._simplified, self._join)
        except TooManyCasesError as many:
            what, remedy = (
                "parameters that can be the same object",
                "write `(not (= ?x ?y))` for parameters that differ",
            )
            if many.have_conditions:
                what, remedy = "effects with conditions", "write several actions"
            message = f"{action.name} has more than {MAX_ACTION_CASES} cases: {what} are told apart"
            place = self._domain.inside_action(action.name, "when" if many.have_conditions else ":effect")
            self._errors[self._domain.error(message, place, remedy)] = None
            return []
        except ValueClashError as clash:
            message = f"{action.name} gives `{clash.fluent}` two values at once"
            place = self._domain.inside_action(action.name, clash.fluent)
            self._errors[self._domain.error(message, place, "write one effect on it")] = None
            return []
        lines: list[str] = []
        name = self._names.actions[action.name]
        for case in cases:
            made = self._case_lines(name, action, self._with_one_value(self._without_idle(case)))
            if made:
                self._origins[made[0]] = partial(self._domain.action, action.name)
                lines += made
                name = self._names.fresh(self._names.actions[action.name], OPERATION_FORMS)
        return lines

    def _change(self, effect: PddlEffect) -> VariableChange:
        fluent, index = effect.fluent, self._groups.get(effect.fluent.name)
        rank = 2 * effect.moment + (effect.value != FALSE)
        if index is None:
            return VariableChange(fluent.name, fluent.parts, effect.value, effect.kind, rank)
        value = fluent.parts[index] if effect.value == TRUE else None
        return VariableChange(fluent.name, without(fluent.parts, index), value, effect.kind, rank)

    def _condition_of(self, change: VariableChange) -> PddlFormula | None:
        """Return the fact that makes a change change nothing; `None` for numbers and for groups without a value."""
        index = self._groups.get(change.fluent)
        if index is not None and change.value is not None:
            return PddlFormula("fluent", (*change.key[:index], change.value, *change.key[index:]), change.fluent)
        if change.value in (TRUE, FALSE):
            fact = PddlFormula("fluent", change.key, change.fluent)
            return fact if change.value == TRUE else negated(fact)
        return None

    def _without_idle(self, case: ActionCase) -> ActionCase:
        """Return a case without changes that its condition makes idle, and with different values where they are not."""
        changes = [change for change in case.changes if self._condition_of(change) not in case.conditions]
        case = replace(case, changes=tuple(changes))
        if len(changes) != 1 or changes[0].fluent not in self._groups or changes[0].value is None:
            return case
        (change,) = changes
        index = self._groups[change.fluent]
        for condition in case.conditions:
            same = condition.kind == "fluent" and condition.name == change.fluent
            if same and without(condition.parts, index) == change.key:
                old, new = condition.parts[index], changes[0].value
                pairs = [PddlFormula("equals", both) for both in ((old, new), (new, old))]
                if any(pair in case.conditions for pair in pairs):
                    return replace(case, changes=())
                known = any(negated(pair) in case.conditions for pair in pairs)
                if not known and "parameter" in {old.kind, new.kind}:
                    return replace(case, conditions=(*case.conditions, negated(pairs[0])))
        return case

    def _exclusions(self, first: PddlFormula, second: PddlFormula) -> Iterator[Exclusion]:
        """Yield what excludes two facts: a group that both are in, and invariants."""
        index = self._groups.get(first.name) if first.name == second.name else None
        if index is not None:
            keys = zip(without(first.parts, index), without(second.parts, index), strict=True)
            yield Exclusion(tuple(keys), ((first.parts[index], second.parts[index]),))
        for invariant in self._task.invariants:
            parts = {part.fluent: part.keys for part in invariant}
            if first.name in parts and second.name in parts:
                one, other = ([fact.parts[i] for i in parts[fact.name]] for fact in (first, second))
                same = tuple(zip(first.parts, second.parts, strict=True)) if first.name == second.name else None
                yield Exclusion(tuple(zip(one, other, strict=True)), same)

    def _with_one_value(self, case: ActionCase) -> ActionCase:
        """Return a case in which two values that it requires of one group are equal."""
        values: dict[tuple[str, tuple[PddlFormula, ...]], PddlFormula] = {}
        equalities: list[PddlFormula] = []
        for each in case.conditions:
            index = self._groups.get(each.name) if each.kind == "fluent" else None
            if index is not None:
                value = values.setdefault((each.name, without(each.parts, index)), each.parts[index])
                equalities.append(self._simplified(PddlFormula("equals", (value, each.parts[index]))))
        return replace(case, conditions=(*case.conditions, *(each for each in equalities if each != TRUE)))

    def _case_lines(self, name: str, action: PddlLiftedAction, case: ActionCase) -> list[str]:
        needed = self._distinguished(PddlFormula("and", case.conditions), dict(case.parameters))
        if not case.changes or needed == FALSE:
            return []
        case = replace(case, conditions=tuple(conjuncts(needed)))
        self._assigned |= dict.fromkeys(change.fluent for change in case.changes)
        scope = self._names.parameters([parameter for parameter, _ in case.parameters])
        static = [c for c in case.conditions if self._is_static(c) and case.parameters]
        guards = [self._shown(c, scope, inner=len(case.conditions) > 1) for c in case.conditions if c not in static]
        shown = ", ".join(f"{scope[p]} in {self._names.types[kind]}" for p, kind in case.parameters)
        lines = [f"  {name}[{shown}]:" if case.parameters else f"  {name}:"]
        if static:
            where = " && ".join(self._shown(c, scope, inner=len(static) > 1) for c in static)
            lines.append(f"    where: {_scalar(where)}")
        actions = f"[{', '.join(self._assignment(change, scope) for change in case.changes)}]"
        request = self._requests.lines_of(action, case, lambda term: self._term(term, scope))
        if not request:
            lines += _guard_lines("      g", guards)
            lines.insert(len(lines) - len(_guard_lines("      g", guards)), "    pre:")
            return [*lines, f"    post: {{g: true, a: {actions}}}"]
        lines += request
        if guards:
            lines += _guard_lines("    guard", guards)
        return [*lines, f"    effects: {actions}"]

    def _assignment(self, change: VariableChange, scope: Mapping[str, str]) -> str:
        target = self._reference(self._names.fluents[change.fluent], change.key, scope)
        value = change.value
        if value is None:
            return f"{target} <- {NOTHING}"
        if value in (TRUE, FALSE):
            return f"{target} <- {'true' if value == TRUE else 'false'}"
        if change.kind == "assign":
            return f"{target} <- {self._term(value, scope)}"
        adds = change.kind == "increase"
        if value.kind == "number":
            return f"{target} {'+=' if adds == (value.number >= 0) else '-='} {abs(value.number)}"
        return f"{target} <- {target} {'+' if adds else '-'} {self._operand(value, scope)}"

    # goals

    def _goal_lines(self) -> list[str]:
        goal = self._distinguished(PddlFormula("and", self._task.goals), {})
        parts = conjuncts(goal)
        if len(parts) > 1:
            return _guard_lines("  goal", [self._shown(part, {}, inner=True) for part in parts])
        return _guard_lines("  goal", [self._shown(part, {}) for part in parts])


def _fluents_in(formulas: Iterable[PddlFormula]) -> dict[str, None]:
    return {each.name: None for formula in formulas for each in inner_formulas(formula) if each.kind == "fluent"}


def _guard_lines(key: str, conjuncts_shown: Sequence[str]) -> list[str]:
    """Return a guard with its key: in one line, or with one conjunct in each line."""
    text = " && ".join(conjuncts_shown) or "true"
    if len(key) + len(text) <= _WIDTH or len(conjuncts_shown) == 1:
        return [f"{key}: {_scalar(text)}"]
    indent = " " * (len(key) - len(key.lstrip()) + 2)
    return [f"{key}:", *(f"{indent}- {_scalar(each)}" for each in conjuncts_shown)]


def _scalar(text: str) -> str:
    """Return a text as a scalar of YAML."""
    return f'"{text}"' if text[0] in "!{[&*>|%@" or ": " in text or " #" in text else text
