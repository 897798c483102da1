"""The stage of waivers: a waiver of an entry with parameters becomes one for each instance that it is for.

Waivers in a model file and in a file of their own are expanded in the same way, after everything else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.files.expansion.expanded_nodes import MappingEntry, entries_of, list_node, text_node, with_entries
from scbm.files.expansion.handshakes import misses_requests
from scbm.files.expansion.lifted_entries import LiftedKey, TooManyChoices, choices_of, lifted_key, without_errors
from scbm.files.expansion.lifted_names import LiftedNames, LiftedScope
from scbm.files.expansion.node_templates import (
    PredicateTemplate,
    TemplateMaker,
    last_line,
    refuse_parameters_in_text,
    without,
)
from scbm.files.expansion.static_facts import StaticFacts, facts_of, joined, read_facts
from scbm.files.language.syntax import SyntaxFault
from scbm.files.spelling import nearest, suggestion
from scbm.files.yaml.document import YamlNode
from scbm.model import Slug
from scbm.model.variables import OperationState

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.expansion.object_formulas import Formula
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.model import BehaviorModel

_PREFIXES = {"operations": "", "automatic_transitions": "automatic/"}
"""The sections whose entries have obligations, and how the names of these begin."""

_STATES = tuple(state.value for state in OperationState if state is not OperationState.INITIAL)
"""The states of operations that are obligations, beside `queued`."""


class WaivableEntries(Struct):
    """The operations and automatic transitions of a model, by the names that their obligations begin with.

    Attributes:
        instances: the choices of objects of each entry with parameters.
        plain: the entries without parameters.
        variables: the variables of the model, which conditions on objects cannot read.
        kinds: the types of the parameters of each entry with parameters; none for a model whose file is not at hand.
        misses_transitions: whether transitions for failed replies may be missing: an operation requests no resource.
    """

    instances: dict[str, list[tuple[str, ...]]] = field(default_factory=dict)
    plain: list[str] = field(default_factory=list)
    variables: tuple[str, ...] = ()
    kinds: dict[str, list[tuple[str, ...]]] = field(default_factory=dict)
    misses_transitions: bool = False

    def add(self, section: str, name: str, lifted: str | None) -> None:
        """Add a ground entry; `lifted` is the entry that it is an instance of."""
        prefix = _PREFIXES[section]
        if lifted is None:
            self.plain.append(f"{prefix}{name}")
        else:
            choice = tuple(name.removeprefix(f"{lifted}.").split("."))
            self.instances.setdefault(f"{prefix}{lifted}", []).append(choice)

    @staticmethod
    def of_trees(lifted: YamlNode, ground: YamlNode, facts: StaticFacts) -> WaivableEntries:
        """Return the entries of a model file: the tree before its objects are expanded, and the tree after that."""
        variables = ground.get("variables")
        found = WaivableEntries(variables=tuple(variables.items) if variables is not None else ())
        found.misses_transitions = misses_requests(ground)
        for section, prefix in _PREFIXES.items():
            written, node = lifted.get(section), ground.get(section)
            for key in written.items if written is not None else ():
                if "[" in key:
                    base = f"{prefix}{key.partition('[')[0].rstrip()}"
                    found.instances.setdefault(base, [])
                    kinds = without_errors(key, facts)
                    found.kinds.setdefault(base, []).extend([kinds] if kinds is not None else [])
            for name, entry in node.items.items() if node is not None else ():
                found.add(section, name, entry.origin)
        return found

    @staticmethod
    def of_model(model: BehaviorModel) -> WaivableEntries:
        """Return the entries of a model."""
        found = WaivableEntries(variables=tuple(variable.name for variable in model.variables))
        for section, name in model.objects.entries if model.objects is not None else ():
            found.instances.setdefault(f"{_PREFIXES[section]}{name}", [])
        origins = {(origin.section, origin.name): origin.lifted for origin in model.origins}
        parts = [("operations", operation.name) for operation in model.operations]
        parts += [("automatic_transitions", transition.name) for transition in model.automatic_transitions]
        for section, name in parts:
            found.add(section, name, origins.get((section, name)))
        return found


def expand_waivers(lifted: YamlNode, ground: YamlNode, facts: StaticFacts | None, report: ErrorCollector) -> YamlNode:
    """Return the tree of a model file with waivers of ground obligations.

    Args:
        lifted: the tree before its objects are expanded.
        ground: the tree after that.
        facts: its types and tables; `None` for a file without objects.
        report: where errors and warnings go.
    """
    facts = read_facts(lifted, report) if facts is None else facts
    return _WaiverStage(WaivableEntries.of_trees(lifted, ground, facts), facts, report).expanded(ground)


def expand_waivers_file(document: YamlNode, model: BehaviorModel, report: ErrorCollector) -> YamlNode:
    """Return the tree of a file of waivers with waivers of ground obligations of a model."""
    facts = StaticFacts() if model.objects is None else facts_of(model.objects, document.place)
    return _WaiverStage(WaivableEntries.of_model(model), facts, report).expanded(document)


class _WaiverStage:
    def __init__(self, entries: WaivableEntries, facts: StaticFacts, report: ErrorCollector) -> None:
        """Take the entries of the model, and its types and tables."""
        self._entries = entries
        variables = dict.fromkeys((*entries.variables, *(name.partition(".")[0] for name in entries.variables)))
        self._names = LiftedNames(facts, plain=frozenset(name for name in variables if name not in facts.places))
        self._report = report

    def expanded(self, document: YamlNode) -> YamlNode:
        node = document.get("waivers")
        if node is None or not isinstance(node.plain, list):
            return document
        waivers = [ground for waiver in node.elements for ground in self._waivers(waiver)]
        new = list_node(waivers, node.place, node.end)
        entries = entries_of(document)
        return with_entries(document, [e if e.key != "waivers" else e._replace(node=new) for e in entries])

    def _waivers(self, waiver: YamlNode) -> Iterator[YamlNode]:
        """Yield the waivers of ground obligations: one for each instance that exists; note what is wrong."""
        obligation = waiver.get("obligation")
        text = obligation.text if obligation is not None else None
        if obligation is None or text is None:
            yield waiver
            return
        key = lifted_key(text, obligation.place, LiftedScope(self._names), self._report, is_named=False)
        if key is None and "[" in text:
            yield self._without_obligation(waiver)
            return
        base, rest = (key.base, key.rest) if key is not None else _split(text)
        scope = LiftedScope(self._names).with_parameters(key.parameters if key is not None else {})
        node, conditions = self._conditions(waiver, key, scope)
        template = TemplateMaker(scope, self._report).template(node)
        instances = self._entries.instances.get(base)
        if instances is None:
            is_unknown = self._is_unknown(obligation, text, base, rest, is_lifted=key is not None)
            yield self._without_obligation(waiver) if is_unknown else node
            return
        if not self._has_state(obligation, text, base, rest) or (key is not None and not key.is_right):
            yield self._without_obligation(waiver)
            return
        self._report.fold_lines(waiver.place, last_line(waiver))
        chosen = instances if key is None else self._chosen(key, instances, conditions)
        if chosen is None:
            yield self._without_obligation(waiver)
        elif not chosen:
            self._warn_of_no_instance(obligation, base, has_any=bool(instances))
        reason = node.get("reason")
        if key is None and reason is not None:
            remedy = f"give the obligation parameters: `{base}[r in robot]{rest}`, or leave out the braces"
            refuse_parameters_in_text(reason, self._report, remedy)
        for choice in chosen or ():
            ground = template.node({} if key is None else key.objects(choice))
            yield replace(_renamed(ground, f"{base}{joined(choice)}{rest}"), origin=text)

    def _without_obligation(self, waiver: YamlNode) -> YamlNode:
        """Return a waiver whose obligation has an error, which is noted, so that its other keys are checked, too."""
        wrong = YamlNode(None, waiver.items["obligation"].place, condemned=True)
        entries = (each for each in entries_of(waiver) if each.key != "where")
        return with_entries(waiver, [e if e.key != "obligation" else e._replace(node=wrong) for e in entries])

    def _conditions(
        self, waiver: YamlNode, key: LiftedKey | None, scope: LiftedScope
    ) -> tuple[YamlNode, list[Formula]]:
        """Return a waiver without `where`, and its conditions."""
        where = waiver.get("where")
        if where is None:
            return waiver, []
        node = without(waiver, "where")
        if key is None:
            message = "`where` chooses objects, and the obligation has no parameters"
            remedy = "write for example `obligation: move[r in robot]/failed`, or leave out `where`"
            self._report.add(Slug.NOT_STATIC, message, waiver.key_places["where"], remedy)
            return node, []
        return node, [*PredicateTemplate(where, scope, self._report, is_static=True).conditions()]

    def _is_unknown(self, obligation: YamlNode, text: str, base: str, rest: str, *, is_lifted: bool) -> bool:
        """Return whether an obligation of no entry with parameters is an error, which is noted."""
        lifted = list(self._entries.instances)
        is_automatic = base.startswith(_PREFIXES["automatic_transitions"])
        if self._names.facts.misses_names or (is_automatic and self._entries.misses_transitions):
            return is_lifted
        if is_lifted:
            message = f"no entry with parameters has the name `{base}`"
            remedy = suggestion(base, lifted, "with parameters there are")
            if base in self._entries.plain:
                remedy = f"it has none: write `{base}{rest}`"
            self._report.add(Slug.UNKNOWN_OBLIGATION, message, obligation.place, remedy)
            return True
        is_ground = base in self._entries.plain or any(base.startswith(f"{each}.") for each in lifted)
        near = None if is_ground else nearest(base, lifted)
        if near is not None:
            message = f"the model has no obligation `{text}`"
            self._report.add(Slug.UNKNOWN_OBLIGATION, message, obligation.place, f"did you mean `{near}{rest}`?")
        return near is not None

    def _has_state(self, obligation: YamlNode, text: str, base: str, rest: str) -> bool:
        """Return whether the end of an obligation names a state where there are some; note another end."""
        is_automatic = base.startswith(_PREFIXES["automatic_transitions"])
        ends = [""] if is_automatic else [f"/{state}" for state in (*_STATES, "queued")]
        if rest in ends:
            return True
        remedy = suggestion(f"{base}{rest}", [f"{base}{end}" for end in ends], "its obligations are")
        message = f"the model has no obligation `{text}`"
        self._report.add(Slug.UNKNOWN_OBLIGATION, message, obligation.place, remedy)
        return False

    def _chosen(
        self, key: LiftedKey, instances: list[tuple[str, ...]], conditions: list[Formula]
    ) -> list[tuple[str, ...]] | None:
        """Return the instances that a key with parameters is for; `None` if the key does not fit, which is noted."""
        arity = len(instances[0]) if instances else len(key.kinds)
        if len(key.kinds) != arity:
            count = f"{arity} parameter{'s' if arity != 1 else ''}"
            message = f"`{key.base}` has {count}, and this has {len(key.kinds)}"
            self._report.add(Slug.WRONG_INDEX, message, key.place, "name a type for each, in their order")
            return None
        if self._has_other_type(key, instances):
            return None
        try:
            choices = dict.fromkeys(choices_of(key, self._names.facts.types, conditions))
        except TooManyChoices as error:
            remedy = "exclude choices with `where`"
            self._report.add(Slug.TOO_MANY_INSTANCES, f"`{key.shown}` has {error.shown}", key.place, remedy)
            return None
        except SyntaxFault as fault:
            self._report.add(fault.slug, fault.message, key.place, fault.remedy)
            return None
        return [choice for choice in instances if choice in choices]

    def _has_other_type(self, key: LiftedKey, instances: list[tuple[str, ...]]) -> bool:
        """Note each parameter that never is an object of an instance; return whether there is one.

        A type fits if it has an object in common with the type of the parameter: `where` may exclude that object.
        A waiver beside a model knows the objects of the instances, and not the types that their entry names. The same
        holds for transitions that handshakes generate. Then each type with one of these objects can be that type.
        """
        types = self._names.facts.types
        found = False
        columns = [dict.fromkeys(column) for column in zip(*instances, strict=False)] or [{} for _ in key.kinds]
        named = list(zip(*self._entries.kinds.get(key.base, ()), strict=False)) or [() for _ in columns]
        for number, (kind, objects, kinds) in enumerate(zip(key.kinds, columns, named, strict=False), start=1):
            alike = [name for name, own in types.items() if not objects.keys().isdisjoint(own)]
            known = {each for name in kinds for each in types[name]}
            fitting = list(dict.fromkeys(kinds)) if objects.keys() <= known else alike
            if types[kind] and fitting and all(self._are_disjoint(kind, name) for name in fitting):
                message = f"parameter {number} of `{key.base}` is never a `{kind}`"
                remedy = suggestion(kind, alike or fitting, "the types that fit are")
                self._report.add(Slug.WRONG_INDEX, message, key.place, remedy)
                found = True
        return found

    def _are_disjoint(self, kind: str, other: str) -> bool:
        """Return whether two types have no object in common; a type without objects may get some."""
        objects = self._names.facts.types[other]
        return bool(objects) and frozenset(self._names.facts.types[kind]).isdisjoint(objects)

    def _warn_of_no_instance(self, obligation: YamlNode, base: str, *, has_any: bool) -> None:
        reason = f"no instance of `{base}` has these objects" if has_any else f"`{base}` has no instance"
        remedy = "correct the types or `where`, or remove the waiver" if has_any else "remove it, or add objects"
        message = f"this waiver has no effect: {reason}"
        self._report.warn(Slug.NO_INSTANCE, message, obligation.place, remedy)


def _renamed(waiver: YamlNode, name: str) -> YamlNode:
    """Return a waiver with another obligation, at the place of the written one."""
    entries = list(entries_of(waiver))
    return with_entries(waiver, [e if e.key != "obligation" else _with_text(e, name) for e in entries])


def _with_text(entry: MappingEntry, text: str) -> MappingEntry:
    return entry._replace(node=text_node(text, entry.node.place, entry.node.end))


def _split(text: str) -> tuple[str, str]:
    """Return the name of what an obligation is about, and the rest: the state."""
    if text.startswith(_PREFIXES["automatic_transitions"]):
        return text, ""
    base, slash, state = text.partition("/")
    return base, slash + state
