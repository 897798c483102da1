"""The stage of parts: `include` takes the sections of other files, `parts` copies of them with a prefix."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.files.expansion.expanded_nodes import MappingEntry, entries_of, mapping_node, with_entries
from scbm.files.expansion.part_names import (
    DeclaredNames,
    PartCopy,
    head_of,
    parameters_in_key,
    parameters_in_text,
)
from scbm.files.expansion.stage_keys import LIFTED_SECTIONS, PART_KEYS_OF_MODELS, SHARED_SECTIONS
from scbm.files.expansion.static_facts import WORD
from scbm.files.language.grammar import QUANTIFIERS, keywords
from scbm.files.language.scope import name_fault
from scbm.files.spelling import nearest, suggestion
from scbm.files.yaml.document import YamlNode
from scbm.files.yaml.instance_names import CopiedNames
from scbm.files.yaml.text_files import read_file, read_tree, real_path, without_detours
from scbm.files.yaml.yaml_events import MAX_NODES
from scbm.model import Diagnostic, InputError, Slug

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.expansion.stage_keys import PartKeyNames
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.model import Place


_REQUIRED = ("variables", "operations")
"""Sections that each model has; a part that cannot be used may have had them."""

_SECTIONS = (*SHARED_SECTIONS, *LIFTED_SECTIONS)

_RESERVED = (*keywords(), *QUANTIFIERS, "current", "plan", "state", "name", "none")
"""Words that begin or end other names, or mean something else where names stand."""

_MAX_USES = 1_000
"""The maximum number of parts in a model, those of parts included."""


def expand_parts(document: YamlNode, report: ErrorCollector, keys: PartKeyNames) -> YamlNode:
    """Return the tree of a model with what it includes and with its parts."""
    file = Path(document.place.file)
    expansion = _Expansion(PartFiles(file, report, keys), report)
    whole = expansion.whole(document, (real_path(file),), file)
    prefixes: dict[str, list[str]] = {}
    for copied, prefix in expansion.copies:
        if prefix:
            prefixes.setdefault(copied, []).append(prefix)
    parameters = expansion.files.parameters
    report.name_copies({used: CopiedNames(tuple(each), parameters[used]) for used, each in prefixes.items()})
    return replace(whole, incomplete=whole.incomplete or expansion.misses_names)


class _Use(Struct, frozen=True):
    """One use of a part: the part as it stands for the user, the place that uses it, and its name under `parts`."""

    document: YamlNode
    place: Place
    name: str | None = None


class _Expansion(Struct):
    """The expansion of the parts of one model.

    Attributes:
        files: opens the files of parts.
        report: where errors go.
        uses: the number of uses of parts so far.
        nodes: the number of YAML nodes of all of these.
        copies: the file and the prefix of each copy of a part so far.
        is_whole: whether each part could be used, with all its arguments. If not, names may be missing, and that is no
            further error.
        misses_names: whether a file could not be read, or not all of its sections. Then types and tables may be
            missing, too: they depend on no arguments.
    """

    files: PartFiles
    report: ErrorCollector
    uses: int = 0
    nodes: int = 0
    copies: list[tuple[str, str]] = field(default_factory=list)
    is_whole: bool = True
    misses_names: bool = False

    def whole(self, document: YamlNode, users: tuple[Path, ...], file: Path) -> YamlNode:
        """Return a file with the sections of what it uses before its own.

        Args:
            document: the tree of the file.
            users: the files on the way from the model to it, itself last, without symbolic links.
            file: its path, as it is shown.
        """
        used = [*self._included(document, users, file), *self._parts(document, users, file)]
        own: dict[str, MappingEntry] = {e.key: e for e in entries_of(document) if e.key not in PART_KEYS_OF_MODELS}
        for section in _SECTIONS:
            united = self._united(section, used, own.get(section), document.place)
            if united is not None:
                own[section] = united
        return with_entries(document, own.values())

    # what a file uses

    def _included(self, document: YamlNode, users: tuple[Path, ...], file: Path) -> Iterator[_Use]:
        node = document.get("include")
        if node is None:
            return
        named = node.elements if isinstance(node.plain, list) else [node]
        for each in named:
            part = self._opened(each, users, file)
            if part is not None:
                arguments = self._arguments(part, {}, each.place)
                yield _Use(self._copied(part, "", arguments, users, each.place), each.place)

    def _parts(self, document: YamlNode, users: tuple[Path, ...], file: Path) -> Iterator[_Use]:
        node = document.get("parts")
        if node is None:
            return
        if not isinstance(node.plain, dict):
            remedy = "write for example `parts: {door: {use: door.yaml}}`"
            place = document.key_places["parts"]
            self.report.add(Slug.WRONG_SHAPE, "expected a mapping of names under `parts`", place, remedy)
            self._miss_names()
        for entry in entries_of(node):
            named, given = self._use_of(entry)
            if named is None:
                self._miss_names()
                continue
            name = self._name_of(entry)
            part = self._opened(named, users, file)
            if part is not None:
                arguments = self._arguments(part, given, entry.place, entry.key)
                yield _Use(self._copied(part, f"{name}.", arguments, users, entry.place), entry.place, name)

    def _name_of(self, entry: MappingEntry) -> str:
        """Return the name of a use; for a wrong one, which is noted, another name, so that the part is checked."""
        if not WORD.fullmatch(entry.key):
            message, remedy = f"`{entry.key}` is not a name", "names of parts are letters, digits and `_`"
            self.report.add(Slug.BAD_NAME, message, entry.place, remedy)
        elif entry.key in _RESERVED:
            message = f"`{entry.key}` is a reserved word"
            self.report.add(Slug.RESERVED_NAME, message, entry.place, "choose another word")
        else:
            return entry.key
        self._miss_names()
        return f"unnamed_part_{self.uses}"

    def _use_of(self, entry: MappingEntry) -> tuple[YamlNode | None, dict[str, MappingEntry]]:
        """Return the file and the arguments of an entry of `parts`; note what is wrong with its keys."""
        node = entry.node
        if not isinstance(node.plain, dict):
            remedy = f"write `{entry.key}: {{use: {node.text or 'door.yaml'}}}`"
            self.report.add(Slug.WRONG_SHAPE, f"expected a mapping under `{entry.key}`", entry.place, remedy)
            return None, {}
        for name, at in node.key_places.items():
            if name not in self.files.keys.use:
                near = suggestion(name, self.files.keys.use, "the keys here are")
                self.report.add(Slug.UNKNOWN_KEY, f"unknown key `{name}`", at, near)
        if "use" not in node.items and not node.incomplete and nearest("use", node.items) is None:
            self.report.add(
                Slug.MISSING_KEY, f"`use` is missing in `{entry.key}`", entry.place, "name the file: `use: door.yaml`"
            )
        given = node.get("with")
        if given is not None and not isinstance(given.plain, dict) and not given.condemned:
            message = f"expected a mapping of parameters under `with` of `{entry.key}`"
            self.report.add(Slug.WRONG_SHAPE, message, node.key_places["with"])
        return node.get("use"), {} if given is None else {each.key: each for each in entries_of(given)}

    def _opened(self, named: YamlNode, users: tuple[Path, ...], file: Path) -> PartFile | None:
        """Return the file of a part; note one that uses itself, over others or directly."""
        self.uses += 1
        if self.uses > _MAX_USES:
            message = f"more than {_MAX_USES:,} parts, those of parts included"
            raise InputError([Diagnostic(Slug.YAML_TOO_LARGE, message, named.place)])
        part = self.files.open(named, file)
        if part is not None and part.path in users:
            way = " → ".join(path.name for path in (*users[users.index(part.path) :], part.path))
            self.report.add(Slug.CONTRADICTION, f"`{named.text}` uses itself: {way}", named.place)
            part = None
        if part is None or not part.is_clear:
            self._miss_names()
        return part

    def _miss_names(self) -> None:
        """Note that names may be missing because something is wrong with the use of a part, or with its file."""
        self.is_whole = False
        self.misses_names = True

    def _arguments(
        self, part: PartFile, given: dict[str, MappingEntry], place: Place, name_of_use: str | None = None
    ) -> dict[str, YamlNode]:
        """Return the node of each parameter; note missing and unknown ones. An included file has no name of its use."""
        for name, entry in given.items():
            if name not in part.parameters:
                remedy = suggestion(name, part.parameters, "its parameters are")
                self.report.add(Slug.UNKNOWN_NAME, f"the part has no parameter `{name}`", entry.place, remedy)
        arguments: dict[str, YamlNode] = {}
        for name, default in part.parameters.items():
            node = given[name].node if name in given else default
            arguments[name] = YamlNode(None, place, condemned=True) if node is None else node
            if node is not None:
                continue
            self.is_whole = False
            if nearest(name, (other for other in given if other not in part.parameters)) is None:
                shown = Path(part.document.place.file).name
                message = f"`{name_of_use or shown}` needs a value for the parameter `{name}` of its part"
                remedy = f"write `with: {{{name}: …}}`"
                if name_of_use is None:
                    remedy = f"use it under `parts`: `parts: {{NAME: {{use: {shown}, with: {{{name}: …}}}}}}`"
                self.report.add(Slug.MISSING_KEY, message, place, remedy)
        return arguments

    def _copied(
        self, part: PartFile, prefix: str, arguments: dict[str, YamlNode], users: tuple[Path, ...], place: Place
    ) -> YamlNode:
        """Return a part with its own parts, its prefix and its arguments."""
        shown = Path(part.document.place.file)
        first = len(self.copies)
        whole = self.whole(part.document, (*users, part.path), shown).used_at(place)
        inner = [(file, f"{prefix}{other}") for file, other in self.copies[first:]]
        self.copies[first:] = [*inner, (part.document.place.file, prefix)]
        self._add_to_count(whole.size, place)
        declared = DeclaredNames(whole)
        self._refuse_names(part, whole, declared)
        bound = self._refuse_bound_names(part, whole)
        used = {name: argument for name, argument in arguments.items() if name not in bound}
        copy = PartCopy(prefix, declared, used, self.report)
        file = part.document.place.file
        return with_entries(
            whole,
            (
                entry._replace(
                    node=copy.section(entry.key, entry.node)
                    if entry.key in LIFTED_SECTIONS
                    else copy.shared_section(entry.node, file)
                )
                for entry in entries_of(whole)
                if entry.key in _SECTIONS
            ),
        )

    def _add_to_count(self, size: int, place: Place) -> None:
        self.nodes += size
        if self.nodes > MAX_NODES:
            message = f"with this part the model has more than {MAX_NODES:,} YAML nodes"
            raise InputError([Diagnostic(Slug.YAML_TOO_LARGE, message, place)])

    def _refuse_names(self, part: PartFile, whole: YamlNode, declared: DeclaredNames) -> None:
        """Note entries of a part that cannot have their names, and parameters with the name of an entry."""
        entries: dict[str, None] = {}
        for section in LIFTED_SECTIONS:
            node = whole.get(section)
            for key, place in node.key_places.items() if node is not None else ():
                entries[head_of(key)] = None
                fault = name_fault(head_of(key), section)
                if fault is not None:
                    self.report.add(fault.slug, fault.message, place, fault.remedy)
        parameters = part.document.get("parameters")
        for name in part.parameters:
            if parameters is not None and (name in entries or name in declared):
                message = f"the parameter `{name}` has the name of something that the part declares"
                remedy = "choose another name: arguments do not replace the names of entries"
                self.report.add(Slug.DUPLICATE_NAME, message, parameters.key_places[name], remedy)

    def _refuse_bound_names(self, part: PartFile, whole: YamlNode) -> dict[str, Place]:
        """Note parameters of a part that are also parameters of its entries or quantifiers; return all these names."""
        parameters = part.document.get("parameters")
        bound = _bound_names(whole) if parameters is not None else {}
        for name in part.parameters:
            if parameters is not None and name in bound:
                message = f"`{name}` is also a parameter in {bound[name].file}:{bound[name].line}"
                remedy = "choose another name for one of them: arguments replace all words of this name"
                self.report.add(Slug.DUPLICATE_NAME, message, parameters.key_places[name], remedy)
        return bound

    # sections

    def _united(self, section: str, used: list[_Use], own: MappingEntry | None, at: Place) -> MappingEntry | None:
        """Return a section with the entries of all that is used, then its own; the own one if nothing is used."""
        found = [(use, node) for use in used if (node := use.document.get(section)) is not None]
        if own is not None and not isinstance(own.node.plain, dict):
            return own
        is_whole = self.is_whole if section in LIFTED_SECTIONS else not self.misses_names
        if not found and (own is not None or is_whole or section not in _REQUIRED):
            return own if own is None or is_whole else own._replace(node=replace(own.node, incomplete=True))
        entries: dict[str, MappingEntry] = {}
        names = tuple(use.name for use in used if use.name is not None)
        for use, node in found:
            for entry in entries_of(node):
                self._enter(
                    section, entries, entry._replace(node=replace(entry.node, user=use.place)), use.place, names
                )
        for entry in entries_of(own.node) if own is not None else ():
            self._enter(section, entries, entry, entry.place, names)
        whole = own
        if whole is None:
            place, end = (found[0][0].place, found[0][1].end) if found else (at, 0)
            whole = MappingEntry(section, place, mapping_node((), place, end), end)
        is_wrong = any(node.incomplete or not isinstance(node.plain, dict) for _, node in found)
        incomplete = whole.node.incomplete or is_wrong or not is_whole
        return whole._replace(node=replace(with_entries(whole.node, entries.values()), incomplete=incomplete))

    def _enter(
        self, section: str, entries: dict[str, MappingEntry], entry: MappingEntry, place: Place, names: tuple[str, ...]
    ) -> None:
        """Add an entry to those of a section; note one with the name of another. `names` are those under `parts`."""
        other = entries.setdefault(entry.key, entry).place
        if other != entry.place:
            message = f"`{entry.key}` is there already, from {other.file}:{other.line}"
            remedy = "use one of them under `parts`, with a name of its own"
            name = next((name for name in names if entry.key.startswith(f"{name}.")), None)
            if name is not None:
                remedy = f"rename the use `{name}` under `parts`, whose names begin with `{name}.`, or the other entry"
            if section in SHARED_SECTIONS:
                remedy = f"rename one of them: `{section}` of parts get no prefix, so that other files can use them"
            self.report.add(Slug.DUPLICATE_NAME, message, place, remedy)


LIBRARY = "scbm:"
"""Begins the name of a part of the library, such as `scbm:gripper`."""

_LIBRARY_FOLDER = Path(__file__).parents[1] / "parts"

ALLOWED_FOLDERS = "SCBM_PARTS"
"""The environment variable with further folders that parts may be read from, separated as in `PATH`."""


def _bound_names(whole: YamlNode) -> dict[str, Place]:
    """Return the parameters of the entries and quantifiers of a part, each with the first place that has it."""
    found: dict[str, Place] = {}
    for section in LIFTED_SECTIONS:
        node = whole.get(section)
        for entry in entries_of(node) if node is not None else ():
            for name in parameters_in_key(entry.key):
                found.setdefault(name, entry.place)
            _add_quantified(entry.node, found)
    return found


def _add_quantified(node: YamlNode, found: dict[str, Place]) -> None:
    """Add the parameters of the quantifiers in all texts of a node."""
    for name in parameters_in_text(node.scalar.text) if node.scalar is not None else ():
        found.setdefault(name, node.place)
    for child in (*node.items.values(), *node.elements):
        _add_quantified(child, found)


def _is_text(node: YamlNode) -> bool:
    """Return whether a node is a scalar with a value, or has an error of its own."""
    return node.condemned or (node.text is not None and node.plain is not None)


class PartFile(Struct, frozen=True):
    """A file of a part.

    Attributes:
        path: where it is, without symbolic links.
        document: its tree.
        parameters: its parameters, each with the node of its default; `None` if it has none and must be given.
        is_clear: whether all of its keys are known: an unknown key may mean a section, whose names are missing then.
    """

    path: Path
    document: YamlNode
    parameters: dict[str, YamlNode | None]
    is_clear: bool


class PartFiles(Struct):
    """Opens the files of the parts of one model, each once.

    Attributes:
        model_file: the file of the model, as the user wrote it.
        report: where errors go.
        keys: the keys that parts have.
    """

    model_file: Path
    report: ErrorCollector
    keys: PartKeyNames
    _opened: dict[Path, PartFile | None] = field(default_factory=dict)

    @property
    def parameters(self) -> dict[str, tuple[str, ...]]:
        """The parameters of each opened part, by the file of the part."""
        opened = [part for part in self._opened.values() if part is not None]
        return {part.document.place.file: tuple(part.parameters) for part in opened}

    def open(self, named: YamlNode, user: Path) -> PartFile | None:
        """Return the part that a node names; `None` after an error, which is noted.

        Args:
            named: a path, relative to the file that uses the part, or the name of a part of the library.
            user: the file that uses it.
        """
        if not named.text or named.plain is None:
            if not named.condemned:
                remedy = "write the path of a part, such as `door.yaml`, or one of the library, such as `scbm:gripper`"
                self.report.add(Slug.WRONG_SHAPE, "expected the path of a part", named.place, remedy)
            return None
        shown = self._library_file(named, named.text) if named.text.startswith(LIBRARY) else user.parent / named.text
        if shown is None or not self._is_allowed(shown, named):
            return None
        path = real_path(shown)
        if path not in self._opened:
            self._opened[path] = self._read(without_detours(shown), path, named)
        return self._opened[path]

    def _library_file(self, named: YamlNode, text: str) -> Path | None:
        path = _LIBRARY_FOLDER / f"{text.removeprefix(LIBRARY)}.yaml"
        known = sorted(f"{LIBRARY}{each.stem}" for each in _LIBRARY_FOLDER.glob("*.yaml"))
        if text in known:
            return path
        remedy = suggestion(text, known, "the parts of the library are")
        self.report.add(Slug.FILE_MISSING, f"the library has no part `{text}`", named.place, remedy)
        return None

    def _is_allowed(self, path: Path, named: YamlNode) -> bool:
        """Return whether a part may be read from a path; note an error if it may not."""
        allowed = [self.model_file.parent, _LIBRARY_FOLDER]
        allowed += [Path(folder) for folder in os.environ.get(ALLOWED_FOLDERS, "").split(os.pathsep) if folder]
        if any(real_path(path).is_relative_to(real_path(folder)) for folder in allowed):
            return True
        message = f"`{named.text}` is outside the folder of the model"
        remedy = f"move it there, or name its folder in the environment variable {ALLOWED_FOLDERS}"
        self.report.add(Slug.FILE_UNREADABLE, message, named.place, remedy)
        return False

    def _read(self, shown: Path, path: Path, named: YamlNode) -> PartFile | None:
        try:
            text = read_file(shown)
        except InputError as error:
            (found,) = error.diagnostics
            if found.slug is Slug.NOT_UTF8:  # its place is in the part
                self.report.add_found([found], named.place)
                return None
            folder = str(shown).removesuffix(named.text or "")
            remedy = found.remedy and found.remedy.replace(
                f"`{folder}", "`"
            )  # a path as the user of the part writes it
            self.report.add(found.slug, f"cannot use `{named.text}`: {found.message}", named.place, remedy)
            return None
        try:
            document, source, report = read_tree(text, str(shown), "part", "a part begins with `part: <name>`")
        except InputError as error:
            self.report.add_found(error.diagnostics, named.place)
            return None
        self.report.add_source(source, named.place)
        self.report.add_found(report.diagnostics, named.place)
        is_clear = not document.incomplete and all(key in self.keys.part for key in document.items)
        part = PartFile(path, document, self._parameters(document), is_clear)
        self._check_keys(document)
        return part

    def _check_keys(self, document: YamlNode) -> None:
        """Note keys that a part does not have, and the missing key that identifies a part."""
        for key, place in document.key_places.items():
            if key not in self.keys.part:
                remedy = suggestion(key, self.keys.part, "the keys of a part are")
                self.report.add(Slug.UNKNOWN_KEY, f"unknown key `{key}` in a part", place, remedy)
        unknown = [key for key in document.items if key not in self.keys.part]
        if (named := document.get("part")) is not None and not _is_text(named):
            message = "expected the name of the part under `part`"
            self.report.add(Slug.WRONG_SHAPE, message, document.key_places["part"], "write for example `part: door`")
        elif named is None and all(nearest(key, self.keys.part) != "part" for key in unknown):
            message = "`part` is missing: only parts can be used by other files"
            self.report.add(Slug.MISSING_KEY, message, document.place, "begin the file with `part: <name>`")
        for section in _SECTIONS:
            node = document.get(section)
            if node is not None and not isinstance(node.plain, dict) and not node.condemned:
                message = f"expected a mapping of names under `{section}`"
                self.report.add(Slug.WRONG_SHAPE, message, document.key_places[section])

    def _parameters(self, document: YamlNode) -> dict[str, YamlNode | None]:
        """Return the parameters of a part with their defaults; note what is wrong with them."""
        declared = document.get("parameters")
        if declared is not None and not isinstance(declared.plain, dict) and not declared.condemned:
            message = "expected a mapping of names under `parameters`"
            example = "write for example `parameters: {limit: {default: 5 s}}`"
            self.report.add(Slug.WRONG_SHAPE, message, document.key_places["parameters"], example)
        found: dict[str, YamlNode | None] = {}
        for name, node in declared.items.items() if declared is not None else ():
            found[name] = node.get("default")
            if not isinstance(node.plain, dict) and node.plain is not None:
                remedy = f"write `{name}: {{default: {node.text}}}`" if node.text is not None else None
                message = f"expected a mapping under the parameter `{name}`"
                self.report.add(Slug.WRONG_SHAPE, message, node.place, remedy)
                found[name] = node  # the next error would be that each use misses a value
            for key, place in node.key_places.items():
                if key not in self.keys.parameter:
                    remedy = suggestion(key, self.keys.parameter, "the keys here are")
                    self.report.add(Slug.UNKNOWN_KEY, f"unknown key `{key}` of a parameter", place, remedy)
                    found[name] = found[name] or node.items[key]
            if (text := node.get("help")) is not None and not _is_text(text):
                message = f"expected a text under `help` of the parameter `{name}`"
                self.report.add(Slug.WRONG_SHAPE, message, node.key_places["help"])
        return found
