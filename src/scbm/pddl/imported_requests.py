"""The requests of imported actions: their resources, and the variables that carry commands and arguments."""

from __future__ import annotations

from fractions import Fraction
from math import ceil
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.files.spelling import suggestion
from scbm.model import Diagnostic, Place, Slug
from scbm.pddl.constant_terms import UnknownValueError, decimal, values_of
from scbm.pddl.import_names import RESOURCE_FORMS
from scbm.pddl.pddl_task import PddlFormula

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.pddl.action_cases import ActionCase
    from scbm.pddl.import_names import ImportNames
    from scbm.pddl.pddl_task import PddlDuration, PddlLiftedAction, PddlTask
    from scbm.pddl.pddl_text import PddlText

_WIDTH = 110
"""A mapping that is longer has one entry in each line."""

_DEADLINE = Fraction(10)
"""The deadline, in seconds, of a request whose action has no duration."""


class _SentParameter(Struct, frozen=True):
    """A variable that carries an argument of actions to a resource, with the types of its values."""

    variable: str
    types: tuple[str, ...]


class ImportedRequests:
    """The resources that the actions of a task send requests to.

    Attributes:
        errors: options that are wrong, and durations that a model cannot express.
    """

    def __init__(
        self, task: PddlTask, names: ImportNames, domain: PddlText, asked: Sequence[str], *, arguments: bool
    ) -> None:
        self._task = task
        self._names = names
        self._domain = domain
        self.errors: dict[Diagnostic, None] = {}
        self._resources = self._resource_parameters(asked)
        self._drivers = {
            action.name: names.fresh(f"{names.actions[action.name]}_driver", RESOURCE_FORMS)
            for action in task.actions
            if action.duration is not None and action.name not in self._resources
        }
        self._arguments = self._argument_variables() if arguments else {}
        self._commands: dict[str, dict[str, None]] = {}
        self._latencies: dict[str, list[tuple[Fraction, Fraction]]] = {}
        self._resource_types: dict[str, dict[str, None]] = {}
        self._longest = self._longest_durations()

    def lines_of(self, action: PddlLiftedAction, case: ActionCase, term: Callable[[PddlFormula], str]) -> list[str]:
        """Return the lines of an operation about its request; none without a request. `term` shows a term."""
        resource = self._resource_of(action, case, term)
        if resource is None:
            return []
        base, index = resource
        deadline = _time(2 * max(self._longest[base], Fraction(1)) if base in self._longest else _DEADLINE)
        command = self._names.actions[action.name]
        self._commands.setdefault(base, {})[command] = None
        sent = {f"{base}_command{index}": command}
        for name, argument in self._arguments.get(base, {}).items():
            known = name in dict(action.parameters)
            value = case.binding.get(name, PddlFormula("parameter", name=name))
            sent[f"{argument.variable}{index}"] = term(value) if known else "none"
        return [f"    request: {base}{index}", *_mapping_lines("    with", sent), f"    deadline: {deadline}"]

    def variable_lines(self) -> list[str]:
        """Return the variables that the operations so far send."""
        lines = []
        for base, commands in self._commands.items():
            domains = {f"{base}_command": ["none", *commands]}
            for argument in self._arguments.get(base, {}).values():
                domains[argument.variable] = [*(self._names.types[each] for each in argument.types), "none"]
            for variable, values in domains.items():
                entry = f"{{domain: [{', '.join(values)}], initial: none}}"
                lines += [f"  {variable}{index}: {entry}" for index in self._index_types(base)]
        return lines

    def resource_lines(self) -> list[str]:
        """Return the resources of the operations so far."""
        lines = []
        for base in self._commands:
            times = self._latencies.get(base)
            latency = ""
            if times:
                low, high = min(t for t, _ in times), max(t for _, t in times)
                shown = _time(low) if low == high else f"{{uniform: [{_time(low)}, {_time(high)}]}}"
                latency = f", simulation: {{latency: {shown}}}"
            carried = [f"{base}_command", *(argument.variable for argument in self._arguments.get(base, {}).values())]
            for kind in self._index_kinds(base):
                word = "" if kind is None else self._names.parameters([kind])[kind]
                key = base if kind is None else f"{base}[{word} in {self._names.types[kind]}]"
                shown = ", ".join(each if kind is None else f"{each}.{word}" for each in carried)
                lines.append(f"  {key}: {{request: [{shown}]{latency}}}")
        return lines

    def _resource_parameters(self, asked: Sequence[str]) -> dict[str, tuple[str, str]]:
        """Return the parameter of each action that names its resource, and the name of the resource."""
        found: dict[str, tuple[str, str]] = {}
        known: dict[str, None] = {}
        for text in asked:
            word = text.lower().lstrip("?")
            uses, before = 0, dict[str, None]()
            for action in self._task.actions:
                known |= dict.fromkeys(word for parameter in action.parameters for word in parameter)
                for name, kind in action.parameters:
                    if word not in (name, kind):
                        continue
                    uses += 1
                    before[found.setdefault(action.name, (name, word))[1]] = None
            if not uses:
                message = f"no action has a parameter `{word}`"
                remedy = suggestion(word, list(known), "parameters and types")
                self.errors[Diagnostic(Slug.BAD_OPTION, message, Place("--resource"), remedy)] = None
            elif word not in before:
                given = " and ".join(f"`--resource {each}`" for each in before)
                message = f"each action with a parameter `{word}` has a resource already, that of {given}"
                remedy = f"leave out `--resource {word}`, or write it before {given}"
                self.errors[Diagnostic(Slug.BAD_OPTION, message, Place("--resource"), remedy)] = None
        types: dict[str, str] = {}
        for action in self._task.actions:
            if action.name in found:
                name, word = found[action.name]
                types.setdefault(word, dict(action.parameters)[name])
        names = {word: self._names.fresh(f"{kind}_controller", RESOURCE_FORMS) for word, kind in types.items()}
        return {action: (name, names[word]) for action, (name, word) in found.items()}

    def _base_of(self, action: PddlLiftedAction) -> str | None:
        """Return the name of the resource of an action, without its index; `None` without a request."""
        chosen = self._resources.get(action.name)
        if chosen is not None:
            return chosen[1]
        return self._drivers.get(action.name)

    def _argument_variables(self) -> dict[str, dict[str, _SentParameter]]:
        """Return for each resource the variables that carry the arguments of its actions, by the parameter."""
        found: dict[str, dict[str, _SentParameter]] = {}
        for action in self._task.actions:
            base = self._base_of(action)
            if base is None:
                continue
            of_resource = self._resources.get(action.name, ("", ""))[0]
            known = found.setdefault(base, {})
            for name, kind in action.parameters:
                if name != of_resource:
                    before = known.get(name) or _SentParameter(self._names.fresh(f"{base}_{name}"), ())
                    types = tuple(self._widest(dict.fromkeys((*before.types, kind))))
                    known[name] = replace(before, types=types)
        return found

    def _widest(self, types: Iterable[str]) -> list[str]:
        """Return the types that are below no other of these types."""
        known = dict.fromkeys(types)
        return [kind for kind in known if not any(parent in known for parent in self._task.types_above(kind))]

    def _resource_of(
        self, action: PddlLiftedAction, case: ActionCase, shown: Callable[[PddlFormula], str]
    ) -> tuple[str, str] | None:
        """Return the resource of an operation and its index; `None` without a request."""
        chosen = self._resources.get(action.name)
        times = self._seconds(action, action.duration) if action.duration is not None else None
        base, index = self._base_of(action), ""
        if base is None or (chosen is None and times is None):
            return None
        if chosen is not None:
            parameter, _ = chosen
            term = case.binding.get(parameter, PddlFormula("parameter", name=parameter))
            index = f".{shown(term)}"
            kind = dict(action.parameters)[parameter]
            self._resource_types.setdefault(base, {})[kind] = None
        if times is not None:
            self._latencies.setdefault(base, []).append(times)
        self._commands.setdefault(base, {})
        return base, index

    def _longest_durations(self) -> dict[str, Fraction]:
        """Return the longest duration of each resource, in seconds.

        A resource has one latency for all of its actions, so that the deadline of each must cover the longest one.
        """
        longest: dict[str, Fraction] = {}
        for action in self._task.actions:
            base = self._base_of(action)
            times = self._seconds(action, action.duration) if action.duration is not None else None
            if base is not None and times is not None:
                longest[base] = max(longest.get(base, Fraction(0)), times[1])
        return longest

    def _seconds(self, action: PddlLiftedAction, duration: PddlDuration) -> tuple[Fraction, Fraction] | None:
        try:
            lowest = min(values_of(duration.lowest, self._task))
            highest = max(values_of(duration.highest, self._task))
        except UnknownValueError as unknown:
            message = f"the duration of {action.name} {unknown}"
            remedy = "write a number, or functions that no action changes"
        else:
            if 0 <= lowest <= highest:
                return lowest, highest
            wrong = f"{decimal(lowest)} s at least"
            if lowest >= 0:
                wrong = f"from {decimal(lowest)} s to {decimal(highest)} s"
            message, remedy = f"the duration of {action.name} is {wrong}", "write values that are durations"
        place = self._domain.inside_action(action.name, ":duration")
        self.errors[self._domain.error(message, place, remedy)] = None
        return None

    def _index_kinds(self, base: str) -> list[str | None]:
        """Return the types that index a resource: none of them below another one."""
        kinds = self._resource_types.get(base)
        if kinds is None:
            return [None]
        return [*self._widest(kinds)]

    def _index_types(self, base: str) -> list[str]:
        return ["" if kind is None else f"[{self._names.types[kind]}]" for kind in self._index_kinds(base)]


def _time(seconds: Fraction) -> str:
    """Return a time in seconds; in milliseconds, rounded up, if it is no whole number."""
    return f"{seconds} s" if seconds.denominator == 1 else f"{ceil(seconds * 1000)} ms"


def _mapping_lines(key: str, values: Mapping[str, str]) -> list[str]:
    """Return a mapping with its key: in one line, or with one entry in each line."""
    entries = [f"{name}: {value}" for name, value in values.items()]
    line = f"{key}: {{{', '.join(entries)}}}"
    indent = " " * (len(key) - len(key.lstrip()) + 2)
    return [line] if len(line) <= _WIDTH else [f"{key}:", *(f"{indent}{each}" for each in entries)]
