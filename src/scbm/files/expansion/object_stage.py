"""The stage of objects: writes out types, tables, names with an index and entries with parameters (decision 51)."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.files.expansion.expanded_nodes import MappingEntry, entries_of, list_node, text_node, with_entries
from scbm.files.expansion.lifted_entries import (
    MAX_CHOICES,
    LiftedKey,
    TooManyChoices,
    choices_of,
    lifted_key,
    part_of_key,
    without_errors,
)
from scbm.files.expansion.lifted_names import IndexedName, LiftedNames, LiftedScope
from scbm.files.expansion.node_templates import PredicateTemplate, TemplateMaker, last_line, listed_at, without
from scbm.files.expansion.stage_keys import LIFTED_SECTIONS, REQUIREMENT_KEYS
from scbm.files.expansion.static_facts import WORD, StaticFacts, joined, read_facts
from scbm.files.language.scope import name_fault
from scbm.files.language.syntax import SyntaxFault
from scbm.files.spelling import nearest, suggestion
from scbm.files.yaml.document import YamlNode
from scbm.files.yaml.instance_names import EntryInstance, InstanceNames
from scbm.model import Slug
from scbm.model.variables import (
    CURRENT_NAME,
    CURRENT_STATE,
    PLAN_STATE,
    operation_state_name,
    resource_variables,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.expansion.node_templates import NodeTemplate
    from scbm.files.expansion.object_formulas import Formula
    from scbm.files.expansion.stage_keys import NodeKind
    from scbm.files.yaml.error_collector import ErrorCollector

_INDEXED = ("variables", "resources", "operations")
"""The sections whose names have an index that predicates and actions use."""

_KINDS: dict[str, NodeKind] = {"goals": "predicate", "requirements": "requirement"}
"""The kind of text of an entry that is no mapping, for each section."""

_GUARDS = ("guard", "g")
"""The keys of guards of entries without the key `pre`."""


def expand_objects(document: YamlNode, report: ErrorCollector) -> tuple[YamlNode, StaticFacts]:
    """Return the tree without types, tables and parameters, and its types and tables."""
    stage = _ObjectStage(document, report)
    return stage.expanded(), stage.facts


class _LiftedEntry(Struct):
    """An entry of a section: its key, its template, and its choices of objects.

    Attributes:
        written: the entry in the file.
        key: its key; `None` without parameters.
        template: makes its ground nodes.
        choices: its choices of objects; one empty choice without parameters.
    """

    written: MappingEntry
    key: LiftedKey | None
    template: NodeTemplate
    choices: list[tuple[str, ...]] = field(default_factory=lambda: [()])


class _ObjectStage:
    def __init__(self, document: YamlNode, report: ErrorCollector) -> None:
        self._document = document = _with_square_brackets(document, report)
        self._report = report
        self.facts = read_facts(document, report)
        self._names = _names_of(document, self.facts)
        self._entries: dict[str, list[_LiftedEntry]] = {}
        self._incomplete: list[str] = []
        self._unnamed: dict[str, str] = {}

    def expanded(self) -> YamlNode:
        self._report.name_instances(self._no_names)
        self._refuse_clashes()
        for section in LIFTED_SECTIONS:
            node = self._document.get(section)
            kind = _KINDS.get(section)
            if node is not None and isinstance(node.plain, dict):
                self._entries[section] = [self._lifted(section, entry, kind) for entry in entries_of(node)]
                self._refuse_many(section)
        for lifted in (each for listed in self._entries.values() for each in listed):
            lifted.template.expect(len(lifted.choices))
        entries = [self._ground(entry) for entry in entries_of(self._document)]
        self._report.name_instances(self._instance_names)
        return with_entries(self._document, [entry for entry in entries if entry.key not in ("types", "tables")])

    def _instance_names(self) -> InstanceNames:
        """Return the names of all instances, with those that come from them, and the entries as they are written."""
        lifted = dict(self._unnamed)
        choices: dict[str, tuple[str, ...]] = {}
        instances: dict[tuple[str, str], EntryInstance] = {}
        every = ((section, entry) for section, entries in self._entries.items() for entry in entries)
        for section, key, chosen in ((section, entry.key, entry.choices) for section, entry in every):
            if key is None:
                continue
            if key.base in self._unnamed:
                lifted |= {f"{key.base}{joined(choice)}": self._unnamed[key.base] for choice in chosen}
                continue
            for choice in chosen:
                names = dict(_names_from(section, key, joined(choice)))
                lifted |= names
                choices |= dict.fromkeys(names, choice)
                instances[section, f"{key.base}{joined(choice)}"] = _instance(key, choice, len(chosen))
        return replace(self._no_names(), lifted=lifted, choices=choices, instances=instances)

    def _no_names(self) -> InstanceNames:
        return InstanceNames(
            objects=frozenset((*self.facts.places, *self.facts.integers)), types=frozenset(self.facts.types)
        )

    def _refuse_clashes(self) -> None:
        """Note objects that have the name of a variable."""
        variables = self._document.get("variables")
        declared = dict.fromkeys(variables.items) if variables is not None else {}
        for name, place in self.facts.places.items():
            if name in declared or name in self._names.indexed:
                message = f"the object `{name}` has the name of a variable, a resource or an operation"
                self._report.add(Slug.AMBIGUOUS_SYMBOL, message, place, "choose another word")

    # entries

    def _lifted(self, section: str, entry: MappingEntry, kind: NodeKind | None) -> _LiftedEntry:
        """Return an entry with its template and its choices; one with a wrong key, which is noted, has no name."""
        key, last, parameters = None, 0, dict[str, str]()
        scope = LiftedScope(self._names, part_file=_part_file(entry))
        if "[" in entry.key:
            is_named = section not in _INDEXED[:2]
            key = lifted_key(entry.key, entry.place, scope, self._report, is_named=is_named)
            parameters = {} if key is None else key.parameters
            if key is None or not key.is_right or not self._has_name(section, entry, key):
                scope = scope if key is not None else replace(scope, misses_parameters=True, may_be_unread=True)
                key = self._unnamed_key(section, entry, key)
            last = last_line(entry.node)
            self._report.fold_lines(entry.place, last)
        scope, noted = scope.with_parameters(parameters), len(self._report)
        maker = TemplateMaker(scope, self._report)
        node, conditions = self._conditions(entry, key, scope)
        lifted = _LiftedEntry(entry, key, maker.template(self._shaped(section, node), kind))
        if key is not None:
            conditions += _conditions_of_guard(lifted.template)
            lifted.choices = self._choices(section, key, conditions, is_sure=len(self._report) == noted)
            parameters = {kind: name for name, kind in reversed(key.parameters.items())}
            self._report.fold_lines(entry.place, last, len(lifted.choices), parameters)
            if not lifted.choices:
                self._warn_of_no_instance(key)
        return lifted

    def _shaped(self, section: str, node: YamlNode) -> YamlNode:
        """Return the node of an entry without `where` as the codec reads it."""
        if section == "variables":
            return self._with_domain(node)
        if section == "requirements" and "requirement" in node.items:
            self._refuse_other_keys(node)
            return node.items["requirement"]
        return node

    def _miss_names(self, section: str, base: str) -> None:
        """Note that names of a section are missing, and those of the instances of an entry."""
        self._incomplete.append(section)
        self._report.leaves_out = True
        for indexed in self._owned(section, base):
            indexed.is_whole = False

    def _unnamed_key(self, section: str, entry: MappingEntry, key: LiftedKey | None) -> LiftedKey:
        """Return another key for an entry whose key is wrong, which is noted: the rest of the entry is checked, too.

        It has the parameters without errors. What depends on others is left out.
        """
        self._miss_names(section, entry.key.partition("[")[0].rstrip())
        base = f"unnamed_entry_{len(self._unnamed)}"
        self._unnamed[base] = entry.key
        right = [pair for pair in zip(key.names, key.kinds, strict=True) if pair[1]] if key is not None else []
        names, kinds = tuple(name for name, _ in right), tuple(kind for _, kind in right)
        return LiftedKey(base, kinds, names, "", entry.place)

    def _has_name(self, section: str, entry: MappingEntry, key: LiftedKey) -> bool:
        """Return whether an entry can have its name; note what is wrong with it."""
        if section in _INDEXED and not self._is_declared(section, key):
            return False
        fault = name_fault(key.base, section)
        if fault is not None:
            place = part_of_key(entry.place, entry.key, 0, len(key.base))
            self._report.add(fault.slug, fault.message, place, fault.remedy)
        return fault is None

    def _refuse_other_keys(self, requirement: YamlNode) -> None:
        """Note the keys of a mapping that a requirement does not have: only its text is checked later."""
        for name, place in requirement.key_places.items():
            if name not in REQUIREMENT_KEYS:
                remedy = suggestion(name, REQUIREMENT_KEYS, "the keys here are")
                self._report.add(Slug.UNKNOWN_KEY, f"unknown key `{name}`", place, remedy)

    def _is_declared(self, section: str, key: LiftedKey) -> bool:
        """Return whether the names of the file have the name of an entry; note one that contradicts an earlier one."""
        first = self._names.indexed[key.base]
        if first.section != section:
            message = f"`{key.base}` has an index under `{first.section}` already"
            self._report.add(Slug.DUPLICATE_NAME, message, key.place, "choose another name")
        elif first.arity != len(key.kinds):
            message = f"`{key.shown}` has {len(key.kinds)} indices, and `{first.shown}` has {first.arity}"
            self._report.add(Slug.WRONG_INDEX, message, key.place, "choose another name")
        elif (owned := self._owned_twice(section, key.base)) is not None:
            message = f"`{owned}` belongs to the resource `{key.base}`, and is also declared in `variables`"
            self._report.add(Slug.DUPLICATE_NAME, message, key.place, "choose another name")
        else:
            return True
        return False

    def _owned_twice(self, section: str, base: str) -> str | None:
        """Return the name of a variable of a resource that is declared with an index, too; `None` if none is."""
        names = _request_names(base) if section == "resources" else ()
        return next((name for name in names if self._names.indexed[name].section != section), None)

    def _conditions(
        self, entry: MappingEntry, key: LiftedKey | None, scope: LiftedScope
    ) -> tuple[YamlNode, list[Formula]]:
        """Return the node of an entry without `where`, and its conditions."""
        where = entry.node.get("where")
        if where is None:
            return entry.node, []
        node = without(entry.node, "where")
        if key is None:
            message = f"`where` chooses objects, and `{entry.key}` has no parameters"
            remedy = f"write `{entry.key}[r in robot]`, or move the condition to the guard, or to a goal itself"
            self._report.add(Slug.NOT_STATIC, message, entry.node.key_places["where"], remedy)
            return node, []
        return node, [*PredicateTemplate(where, scope, self._report, is_static=True).conditions()]

    def _choices(
        self, section: str, key: LiftedKey, conditions: list[Formula], *, is_sure: bool
    ) -> list[tuple[str, ...]]:
        """Return the choices of an entry; one for too many choices, and for none after an error, to check the entry.

        Too many choices are an error if `is_sure`: no other error explains them.
        """
        objects = [self.facts.objects(kind) for kind in key.kinds]
        choices: list[tuple[str, ...]] | None = None
        try:
            choices = choices_of(key, self.facts.types, conditions)
        except TooManyChoices as error:
            message = f"`{key.shown}` has {error.shown}"
            remedy = "use fewer objects, or exclude choices with `where`"
            if is_sure:
                self._report.add(Slug.TOO_MANY_INSTANCES, message, key.place, remedy)
        except SyntaxFault as fault:
            self._report.add(fault.slug, fault.message, key.place, fault.remedy)
            raise self._report.error() from None
        if choices is None or (not choices and not is_sure and all(objects)):
            self._miss_names(section, key.base)
            # conditions often forbid equal objects
            choices = [tuple(listed[place % len(listed)] for place, listed in enumerate(objects))]
        for indexed in self._owned(section, key.base):
            indexed.declared.update(dict.fromkeys(choices))
        return choices

    def _warn_of_no_instance(self, key: LiftedKey) -> None:
        """Note an entry without any choice of objects."""
        empty = next((kind for kind in key.kinds if not self.facts.objects(kind)), None)
        reason = "its condition holds for no objects" if empty is None else f"the type `{empty}` has no objects"
        remedy = "correct `where`, or the guard" if empty is None else f"list them: `{empty}: [a, b]`"
        self._report.warn(Slug.NO_INSTANCE, f"`{key.base}` has no instance: {reason}", key.place, remedy)

    def _owned(self, section: str, base: str) -> Iterator[IndexedName]:
        """Yield the names with an index that an entry declares."""
        if section == "resources":
            yield from (
                self._names.indexed[name] for name in (base, *_request_names(base)) if name in self._names.indexed
            )
        elif section in _INDEXED and base in self._names.indexed:
            yield self._names.indexed[base]

    def _refuse_many(self, section: str) -> None:
        """Note a section with more entries than a model may have, before they are built."""
        entries = self._entries[section]
        count = sum(len(entry.choices) for entry in entries)
        if count > MAX_CHOICES:
            message = f"`{section}` has {count:,} entries when they are written out; at most {MAX_CHOICES:,} are built"
            place = self._document.key_places[section]
            self._report.add(Slug.TOO_MANY_INSTANCES, message, place, "use fewer objects")
            for entry in entries:
                self._miss_names(section, entry.written.key.partition("[")[0].rstrip())
                del entry.choices[1:]

    def _with_domain(self, node: YamlNode) -> YamlNode:
        """Return a variable whose domain lists the objects of the types that it names."""
        domain = node.get("domain")
        if domain is None or domain.condemned:
            return node
        types = self.facts.types
        text = domain.text
        if text is not None and self._is_noted(text):
            new = YamlNode(None, domain.place, condemned=True, end=domain.end)
        elif text is not None and (near := self._close_type(text)) is not None:
            self._report.add(Slug.BAD_DOMAIN, f"`{text}` is not a domain", domain.place, f"did you mean `{near}`?")
            new = YamlNode(None, domain.place, condemned=True, end=domain.end)
        elif text is not None and text in types:
            objects = types[text]
            new = listed_at(domain.place, domain.end, objects)
            if self.facts.is_of_integers(text):
                new = text_node(f"{objects[0]}..{objects[-1]}", domain.place, domain.end)
        elif any(element.text in types for element in domain.elements):
            elements: list[YamlNode] = []
            for element in domain.elements:
                words = types.get(element.text or "")
                elements += [element] if words is None else [text_node(w, element.place, element.end) for w in words]
            new = list_node(elements, domain.place, domain.end)
        else:
            return node
        return with_entries(
            node, (entry if entry.key != "domain" else entry._replace(node=new) for entry in entries_of(node))
        )

    def _is_noted(self, domain: str) -> bool:
        """Return whether an error is noted for the type that a domain names, or for what may declare this type."""
        if domain in self.facts.types:
            return self.facts.is_unread(domain)
        return self.facts.misses_names and _is_type(domain)

    def _close_type(self, word: str) -> str | None:
        """Return the type that a misspelt domain probably means; `None` for a type, `bool`, and any other text."""
        types = self.facts.types
        is_other = word in types or nearest(word, ("bool", "boolean")) is not None or not WORD.fullmatch(word)
        return None if is_other else nearest(word, types)

    # ground entries

    def _ground(self, entry: MappingEntry) -> MappingEntry:
        if entry.key in self._entries:
            return entry._replace(node=self._ground_section(entry))
        if entry.key == "initial_states":
            maker = TemplateMaker(LiftedScope(self._names), self._report)
            return entry._replace(node=maker.template(entry.node, "predicate").node({}))
        return entry

    def _ground_section(self, section: MappingEntry) -> YamlNode:
        ground: dict[str, MappingEntry] = {}
        for lifted in self._entries[section.key]:
            for choice in lifted.choices:
                made = _made(lifted, choice)
                if made.key in ground:
                    self._refuse_duplicate(made, ground[made.key], lifted)
                else:
                    ground[made.key] = made
        node = with_entries(section.node, ground.values())
        return replace(node, incomplete=node.incomplete or section.key in self._incomplete)

    def _refuse_duplicate(self, made: MappingEntry, first: MappingEntry, lifted: _LiftedEntry) -> None:
        line = f"line {first.place.line}"
        message = f"`{made.key}` is in {line} already"
        if lifted.key is not None:
            message = f"`{lifted.key.shown}` has the instance `{made.key}`, which is in {line} already"
        remedy = "leave out one of them, or exclude these objects with `where`"
        self._report.add(Slug.DUPLICATE_NAME, message, made.place, remedy)


def _conditions_of_guard(template: NodeTemplate) -> list[Formula]:
    """Return the conjuncts of the guard of an entry that read no variable: they exclude choices as `where` does."""
    guards = (template.below("pre", "g"), *(template.below(key) for key in _GUARDS if template.below("pre") is None))
    guard = next((each for each in guards if isinstance(each, PredicateTemplate)), None)
    return [] if guard is None else [*guard.conditions()]


def _is_type(domain: str) -> bool:
    """Return whether a domain can be the name of a type."""
    return WORD.fullmatch(domain) is not None and domain != "bool"


def _part_file(entry: MappingEntry) -> str | None:
    """Return the file of the part whose copy has an entry; `None` for entries without the prefix of a use."""
    has_prefix = "." in entry.key.partition("[")[0]
    return entry.place.file if entry.node.user is not None and has_prefix else None


def _names_from(section: str, key: LiftedKey, objects: str) -> Iterator[tuple[str, str]]:
    """Yield the names that an instance of an entry brings, each with the name as it is written."""
    base, index = key.base, key.shown.removeprefix(key.base)
    yield f"{base}{objects}", key.shown
    if section == "operations":
        yield operation_state_name(f"{base}{objects}"), operation_state_name(key.shown)
        for prefix in ("start_", "complete_", "fail_"):
            yield f"{prefix}{base}{objects}", f"{prefix}{key.shown}"
    if section == "resources":
        for suffix in (name.removeprefix(base) for name in _request_names(base)):
            yield f"{base}{objects}{suffix}", f"{base}{suffix}{index}"
        yield f"{base}_failed{objects}", f"{base}_failed{index}"


def _instance(key: LiftedKey, choice: tuple[str, ...], count: int) -> EntryInstance:
    parameters = {each: name for name, each in key.objects(choice).items() if choice.count(each) == 1}
    return EntryInstance(f"{key.base}{joined(choice)}", key.base, parameters, count)


def _made(lifted: _LiftedEntry, choice: tuple[str, ...]) -> MappingEntry:
    """Return the ground entry for a choice of objects."""
    if lifted.key is None:
        return lifted.written._replace(node=lifted.template.node({}))
    node = lifted.template.node(lifted.key.objects(choice))
    name = f"{lifted.key.base}{joined(choice)}"
    node = replace(node, origin=lifted.key.base, written=lifted.key.shown)
    return MappingEntry(name, lifted.written.place, node, lifted.written.end)


# names


def _request_names(resource: str) -> tuple[str, ...]:
    return tuple(variable.name for variable in resource_variables(resource))


def _with_square_brackets(document: YamlNode, report: ErrorCollector) -> YamlNode:
    """Return the tree with `go[r in robot]` for each key `go(r in robot)`, which is noted; both have equal places."""
    entries = []
    for section in entries_of(document):
        keys = [_square(entry.key) for entry in entries_of(section.node)] if section.key in LIFTED_SECTIONS else []
        if any(keys):
            pairs = zip(keys, entries_of(section.node), strict=True)
            node = with_entries(section.node, [_renamed(entry, key, report) for key, entry in pairs])
            section = section._replace(node=node)  # noqa: PLW2901 - the same section, with other keys
        entries.append(section)
    return with_entries(document, entries) if document.items else document


def _square(key: str) -> str | None:
    """Return a key with square brackets for one with round brackets around its parameters; `None` for others."""
    return f"{key.replace('(', '[', 1)[:-1]}]" if _ROUND_KEY.fullmatch(key) else None


def _renamed(entry: MappingEntry, key: str | None, report: ErrorCollector) -> MappingEntry:
    if key is None:
        return entry
    message = f"`{entry.key}` has round brackets, and parameters stand in square brackets"
    report.add(Slug.BAD_NAME, message, entry.place, f"write `{key}`")
    return entry._replace(key=key)


_ROUND_KEY = re.compile(r"[A-Za-z_][\w.]*\s*\([\w\s,:]*\w\s*\)", re.ASCII)
"""A key with its parameters as PDDL and ST have them."""


def _names_of(document: YamlNode, facts: StaticFacts) -> LiftedNames:
    """Return the names that the texts of a file can use; wrong keys are left out, and noted where they are read."""
    indexed: dict[str, IndexedName] = {}
    plain: dict[str, None] = dict.fromkeys((CURRENT_NAME, CURRENT_STATE, PLAN_STATE))
    symbols: dict[str, None] = {}
    is_whole = not document.incomplete
    for section in _INDEXED:
        node = document.get(section)
        is_whole = is_whole and (node is None or (isinstance(node.plain, dict) and not node.incomplete))
        for entry in entries_of(node) if node is not None else ():
            kinds = without_errors(entry.key, facts)
            is_whole = is_whole and (kinds is not None or "[" not in entry.key)
            base = entry.key.partition("[")[0].rstrip()
            for name, suffix in _declared(section, base):
                if kinds is not None:
                    _declare(indexed, IndexedName(section, name, base, suffix, kinds), facts)
                elif "[" not in entry.key and section != "operations":
                    plain[name] = None
            if section == "operations" and kinds is None:
                plain[operation_state_name(base)] = None
            domain = entry.node.get("domain")
            symbols |= dict.fromkeys(element.text or "" for element in domain.elements) if domain is not None else {}
    return LiftedNames(facts, indexed, frozenset(plain), frozenset(symbols), is_whole=is_whole)


def _declared(section: str, base: str) -> Iterator[tuple[str, str]]:
    """Yield the names that an entry declares, each with what follows the objects in the ground name."""
    yield base, ""
    if section == "resources":
        for name in _request_names(base):
            yield name, name.removeprefix(base)


def _declare(indexed: dict[str, IndexedName], new: IndexedName, facts: StaticFacts) -> None:
    """Add a name; one that is declared for several types has the objects of all."""
    old = indexed.get(new.base)
    objects = tuple(dict.fromkeys(facts.objects(kind)) for kind in new.kinds)
    if old is None:
        new.objects = objects
        indexed[new.base] = new
    elif old.arity == new.arity and old.section == new.section:
        pairs = zip(old.kinds, new.kinds, strict=True)
        old.kinds = tuple(a if b in a.split(" or ") else f"{a} or {b}" for a, b in pairs)
        old.objects = tuple({**known, **more} for known, more in zip(old.objects, objects, strict=True))
