"""Model files and files of bindings: text to model, with every error located, and model to text."""

from __future__ import annotations

from collections import Counter
from hashlib import sha256
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.files.codec.keys import check_shape
from scbm.files.codec.lifted.part_keys import PART_KEY_NAMES
from scbm.files.codec.model_keys import MODEL_OWNERS, ModelKeys
from scbm.files.codec.operation_keys import OperationKeys
from scbm.files.codec.value_reader import ValueReader
from scbm.files.codec.waiver_keys import WAIVERS_OWNERS, WaiverKeys, WaiversKeys
from scbm.files.expansion.lifted_digest import read_object_lists
from scbm.files.expansion.stages import expand, expand_parts
from scbm.files.language.scope import Scope
from scbm.files.yaml.text_files import read_file, read_tree
from scbm.files.yaml.yaml_writer import dump
from scbm.model import Diagnostic, InputError, Place, PlannerChoice, RunsDeclaration, Slug
from scbm.model.lazy_exports import load_named

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.files.yaml.instance_names import EntryInstance
    from scbm.files.yaml.source_text import SourceText
    from scbm.model import BehaviorModel, Operation, Waiver


# models


class Places:
    """The places of the parts of a model in its file.

    Attributes:
        warnings: what reading the file warns of: entries without instances, comparisons that always hold.
    """

    def __init__(self, document: YamlNode, source: SourceText, report: ErrorCollector) -> None:
        """Take the expanded tree, the text of the file, and the collector of its errors and warnings."""
        self._document = document
        self._source = source
        self._report = report
        self._others = report.others
        self.warnings = report.warnings

    def find(self, path: tuple[int | str, ...]) -> tuple[Place, str]:
        """Return the place of the part at the end of a path, or of the last existing part on the way, and its line.

        Args:
            path: keys, and positions in lists.
        """
        place = Place(self._source.file)
        for length, step in enumerate(path):
            owner = self._document.at(path[:length])
            if isinstance(step, str) and step in owner.key_places:
                place = owner.key_places[step]
            elif isinstance(step, int) and step < len(owner.elements):
                place = owner.elements[step].place
            else:
                break
        source = self._others.get(place.file, self._source)
        return place, source.lines[place.line - 1] if place.line else ""

    def instance(self, path: tuple[int | str, ...]) -> EntryInstance | None:
        """Return the instance of an entry with parameters that a path leads to or into; `None` if it leads to none."""
        match path:
            case str(section), str(name), *_:
                return self._report.instance_names.instances.get((section, name))
            case _:
                return None

    def in_entry(self, text: str, instance: EntryInstance) -> str:
        """Return a text about an instance with names as its entry can use them."""
        return self._report.instance_names.in_entry(text, instance)

    def without_objects(self, text: str) -> str:
        """Return a text that is the same for all instances of an entry: without the names of objects."""
        return self._report.instance_names.without_objects(text)

    def line(self, path: tuple[str, ...]) -> int:
        """Return the line of the model file for a key, or for its nearest ancestor that has a line; at least 1.

        What comes from a part has the line that uses the part.
        """
        for length in range(len(path), 0, -1):
            user = self._document.at(path[:length]).user
            if user is not None and self._has(path[:length]):
                return user.line
        place = self.find(path)[0]
        return 1 if place.file in self._others else max(1, place.line)

    def lines(self, path: tuple[str, ...]) -> tuple[int, ...]:
        """Return the numbers of the lines under a path, with those of its key, ascending.

        Blank lines and comments are left out. An alias brings the lines of its anchor, and what is expanded the lines
        that it comes from. A path that does not exist, or comes from another file, has no lines.
        """
        owner = self._document.at(path[:-1])
        if not self._has(path):
            return ()
        key = owner.key_places[path[-1]]
        if key.file in self._others:
            return ()
        numbers = {*self._range(key, owner.value_ends[path[-1]]), *self._lines_of(owner.items[path[-1]])}
        return tuple(number for number in sorted(numbers) if self._says_something(number))

    def _has(self, path: tuple[str, ...]) -> bool:
        """Return whether there is a key at the end of a path."""
        return all(key in self._document.at(path[:length]).items for length, key in enumerate(path))

    def _lines_of(self, node: YamlNode) -> Iterator[int]:
        if node.place.file in self._others:
            return
        yield from self._range(node.place, node.end)
        for child in (*node.items.values(), *node.elements):
            yield from self._lines_of(child)

    def _range(self, place: Place, end: int) -> range:
        """Return the lines from a place to the end of a node, but at least the line of the place."""
        last = self._source.place(max(end - 1, 0)).line
        return range(place.line, max(place.line, last) + 1)

    def _says_something(self, number: int) -> bool:
        line = self._source.lines[number - 1].strip()
        return bool(line) and not line.startswith("#")


def load_model(path: str | Path) -> BehaviorModel:
    """Return the model of a file. Raises `InputError` with all errors of the file."""
    return load_located(path)[0]


def load_located(path: str | Path) -> tuple[BehaviorModel, Places]:
    """Return the model of a file, and the places of its parts. Raises `InputError`."""
    return _read(read_file(Path(path)), str(path))


def read_located(text: str, file: str = "model") -> tuple[BehaviorModel, Places]:
    """Return the model of a text without its bindings, and the places of its parts. Raises `InputError`.

    Bindings name types that are in other files, which need not be where a text from a store is read.
    """
    return _read(text, file, is_bound=False)


def read_model(text: str, file: str = "model") -> BehaviorModel:
    """Return the model of a text. Raises `InputError` with all errors of the text.

    Args:
        text: the YAML text.
        file: the name of the text in errors.
    """
    return _read(text, file)[0]


def count_entries(text: str, file: str = "model") -> Counter[str]:
    """Return the number of entries of each section as they are written, and the numbers of `lines` and `files`.

    A file that the model includes, or uses as a part, counts once.
    """
    document, _, report = read_tree(text, file, "model", _START)
    expand_parts(document, report, PART_KEY_NAMES)
    report.raise_any()
    written = Counter({"lines": len(text.splitlines()), "files": 1 + len(report.others)})
    trees = [document, *(read_tree(each.text, each.file, "part", "")[0] for each in report.others.values())]
    for name, section in (pair for tree in trees for pair in tree.items.items()):
        written[name] += len(section.items)
    for each in report.others.values():
        written["lines"] += len(each.text.splitlines())
    return written


def files_used_by(path: Path) -> tuple[Path, ...]:
    """Return the files of the parts that a model file uses, directly or in parts; none if it cannot be read."""
    try:
        document, _, report = read_tree(read_file(path), str(path), "model", _START)
        expand_parts(document, report, PART_KEY_NAMES)
    except InputError:
        return ()
    return tuple(map(Path, report.others))


_START = "a model begins with `behavior_model: <name>`"
"""The first line of a model file, as a remedy for other texts."""


def _read(text: str, file: str, *, is_bound: bool = True) -> tuple[BehaviorModel, Places]:
    document, source, report = read_tree(text, file, "model", _START)
    lifted, document, facts = expand(document, report, PART_KEY_NAMES)
    places = Places(document, source, report)
    _refuse_too_many(document, places)
    check_shape(document, report, ModelKeys, MODEL_OWNERS)
    reader = ValueReader(report, Scope({}, objects=report.instance_names.objects))
    model = ModelKeys(document, reader).model(is_bound=is_bound)
    report.raise_any()
    if report.leaves_out or not reader.is_whole:
        raise AssertionError(f"{file}: something was not resolved, and nothing was complained of")
    places.warnings = report.warnings
    return replace(model, objects=read_object_lists(lifted, facts)), places


_MAX_ENTRIES = 10_000
"""Maximum number of entries of one section; the largest published model in the benchmarks has 3,160 operations."""


def _refuse_too_many(document: YamlNode, places: Places) -> None:
    """Raise `InputError` for a model that is too large to be read and explored."""
    for key, section in document.items.items():
        if len(section.items) > _MAX_ENTRIES:
            name = next(islice(section.items, _MAX_ENTRIES, None))
            message = f"more than {_MAX_ENTRIES:,} entries in one section, {len(section.items):,} in all"
            place, line = places.find((key, name))
            raise InputError([Diagnostic(Slug.YAML_TOO_LARGE, message, place, source_line=line)])


# files of bindings

BINDINGS_KEYS = "scbm.nodes.bindings.binding_keys:BindingsKeys"
"""The keys of such a file, which `nodes` declares: the core knows nothing of drivers."""


def load_bindings(path: str | Path, model: BehaviorModel) -> BehaviorModel:
    """Return the model with the bindings of a file, which replace those of the model.

    Raises:
        InputError: with all errors of the file.
    """
    return read_bindings(read_file(Path(path)), model, str(path))


def read_bindings(text: str, model: BehaviorModel, file: str = "bindings") -> BehaviorModel:
    """Return the model with the bindings of a text. Raises `InputError` with all errors of the text.

    Args:
        text: the YAML text.
        model: the model whose resources are bound.
        file: the name of the text in errors.
    """
    document, _, report = read_tree(text, file, "bindings", "bindings begin with `bindings_of: <name of the model>`")
    keys = load_named(BINDINGS_KEYS)
    check_shape(document, report, keys, load_named("scbm.nodes.bindings.binding_keys:BINDINGS_OWNERS"))
    bindings = keys(document, ValueReader(report, Scope.of(model))).bindings(model)
    report.raise_any()
    resources = (replace(r, binding=bindings.get(r.name, r.binding)) for r in model.resources)
    return replace(model, resources=tuple(resources))


# files of waivers


def load_waivers(path: str | Path, model: BehaviorModel) -> tuple[tuple[Waiver, ...], tuple[Diagnostic, ...]]:
    """Return the waivers of a file for a model, and warnings. Raises `InputError` with all errors of the file."""
    return _read_waivers(read_file(Path(path)), model, str(path))


def read_waivers(text: str, model: BehaviorModel, file: str = "waivers") -> tuple[Waiver, ...]:
    """Return the waivers of a text for a model. Raises `InputError` with all errors of the text.

    Args:
        text: the YAML text.
        model: the model that has the obligations.
        file: the name of the text in errors.
    """
    return _read_waivers(text, model, file)[0]


def _read_waivers(text: str, model: BehaviorModel, file: str) -> tuple[tuple[Waiver, ...], tuple[Diagnostic, ...]]:
    document, _, report = read_tree(text, file, "waivers", "waivers begin with `waivers_of: <name of the model>`")
    named = document.get("waivers_of")
    if named is not None and named.text == model.name:
        from scbm.files.expansion.waiver_stage import expand_waivers_file  # noqa: PLC0415 - few models have waivers

        document = expand_waivers_file(document, model, report)
    check_shape(document, report, WaiversKeys, WAIVERS_OWNERS)
    waivers = WaiversKeys(document, ValueReader(report, Scope.of(model))).read(model)
    report.raise_any()
    return waivers, report.warnings


def write_waivers(waivers: Sequence[Waiver], model: BehaviorModel) -> str:
    """Return the text of a waivers file for a model."""
    listed = [WaiverKeys.write(waiver) for waiver in waivers]
    return dump({"waivers_of": model.name, "waivers": listed})


# writing


def write_model(model: BehaviorModel) -> str:
    """Return the model as YAML, with every key that differs from its default."""
    return dump(ModelKeys.write(model), short_in_flow=True)


def digest_of(model: BehaviorModel) -> str:
    """Return the SHA-256 that identifies a model: of what it means, without comments and layout.

    Bindings, planner and waivers do not change what the model means. A certificate says itself which runs it is about.
    """
    meaning = replace(model.unbound, planner=PlannerChoice(), waivers=(), runs=RunsDeclaration())
    return sha256(write_model(meaning).encode()).hexdigest()


def write_operation(operation: Operation) -> str:
    """Return one operation as it is written under `operations:` in a model file."""
    return dump({operation.name: OperationKeys.write(operation)}, short_in_flow=True)
