"""Files of parts: where they may be, their parameters, and the errors of how they are used."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.files.expansion.part_names import NAMED_SECTIONS
from scbm.files.spelling import nearest, suggestion
from scbm.files.yaml.text_files import read_file, read_tree
from scbm.model import InputError, Slug

if TYPE_CHECKING:
    from scbm.files.expansion.stage_keys import PartKeyNames
    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.text_files import ErrorCollector

SHARED_SECTIONS = ("types", "tables")
"""The sections of a part that get no prefix: what they declare is known everywhere."""

LIBRARY = "scbm:"
"""Begins the name of a part of the library, such as `scbm:gripper`."""

_LIBRARY_FOLDER = Path(__file__).parents[1] / "parts"

ALLOWED_FOLDERS = "SCBM_PARTS"
"""The environment variable with further folders that parts may be read from, separated as in `PATH`."""


@dataclass(frozen=True, slots=True)
class PartFile:
    """A file of a part.

    Attributes:
        path: where it is, without symbolic links.
        document: its tree.
        parameters: its parameters, each with the node of its default; `None` if it has none and must be given.
    """

    path: Path
    document: YamlNode
    parameters: dict[str, YamlNode | None]


@dataclass(slots=True)
class PartFiles:
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
        path = shown.resolve()
        plain = Path(os.path.normpath(shown))
        shown = plain if plain.resolve() == path else shown  # with a symbolic link before `..`, they may differ
        if path not in self._opened:
            self._opened[path] = self._read(shown, path, named)
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
        if any(path.resolve().is_relative_to(folder.resolve()) for folder in allowed):
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
            self.report.add(found.slug, f"cannot use `{named.text}`: {found.message}", named.place, found.remedy)
            return None
        try:
            document, source, report = read_tree(text, str(shown), "part", "a part begins with `part: <name>`")
        except InputError as error:
            used = f" (used in {named.place.file}:{named.place.line})"
            self.report.add_found(replace(each, message=f"{each.message}{used}") for each in error.diagnostics)
            return None
        self.report.add_source(source, named.place)
        self.report.add_found(report.diagnostics)
        part = PartFile(path, document, self._parameters(document))
        self._check_keys(document)
        return part

    def _check_keys(self, document: YamlNode) -> None:
        """Note keys that a part does not have, and the missing key that identifies a part."""
        for key, place in document.key_places.items():
            if key not in self.keys.part:
                remedy = suggestion(key, self.keys.part, "the keys of a part are")
                self.report.add(Slug.UNKNOWN_KEY, f"unknown key `{key}` in a part", place, remedy)
        if "part" not in document.items and nearest("part", document.items) is None:
            message = "`part` is missing: only parts can be used by other files"
            self.report.add(Slug.MISSING_KEY, message, document.place, "begin the file with `part: <name>`")
        for section in (*SHARED_SECTIONS, *NAMED_SECTIONS):
            node = document.get(section)
            if node is not None and not isinstance(node.plain, dict) and not node.condemned:
                message = f"expected a mapping of names under `{section}`"
                self.report.add(Slug.WRONG_SHAPE, message, document.key_places[section])

    def _parameters(self, document: YamlNode) -> dict[str, YamlNode | None]:
        """Return the parameters of a part with their defaults; note what is wrong with them."""
        declared = document.get("parameters")
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
        return found
