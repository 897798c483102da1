"""Case files: text to case, with every error located, and case to text.

A file is parsed at once; its names are resolved as soon as the model is known.
"""

from __future__ import annotations

import re
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.files.codec.case_keys import CaseKeys, CaseToWrite, case_owners
from scbm.files.codec.keys import check_shape
from scbm.files.codec.network_keys import NetworkKeys, network_owners
from scbm.files.codec.recorded_keys import RecordedKeys
from scbm.files.codec.value_reader import ValueReader
from scbm.files.expansion.case_indices import ground_case
from scbm.files.language.scope import Scope
from scbm.files.yaml.text_files import read_file, read_tree, similar_file_remedy
from scbm.files.yaml.yaml_writer import FlowMapping, dump, dump_folded
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases import Case, Network, RecordedRun
    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.files.yaml.source_text import SourceText
    from scbm.model import BehaviorModel

_START = "a case begins with `case: <name>`"
_CASE = re.compile(r"""^\ufeff?(?:\{\s*)?["']?case["']?[ \t]*:(?=\s|$)""", re.MULTILINE | re.IGNORECASE)
_GOAL = re.compile(r"""^\ufeff?["']?goals?["']?[ \t]*:(?=\s|$)""", re.MULTILINE)
_ITS_MODEL = re.compile(r"""^\ufeff?["']?model["']?[ \t]*:(?=\s|$)""", re.MULTILINE)
_MODEL = re.compile(r"""^\ufeff?["']?(?:behavior_model|part)["']?[ \t]*:(?=\s|$)""", re.MULTILINE)


def is_case_text(text: str) -> bool:
    """Return whether a text looks like a case: it has the key `case`, or `model` with `goal` or `goals`."""
    return bool(_CASE.search(text) or (_GOAL.search(text) and _ITS_MODEL.search(text)))


def is_model_text(text: str) -> bool:
    """Return whether a text looks like the file of a model or of a part: it has a line with the key of one."""
    return _MODEL.search(text) is not None


class CaseDocument:
    """A case file that is parsed, but whose names are not resolved yet."""

    def __init__(self, document: YamlNode, source: SourceText, report: ErrorCollector) -> None:
        self._document = document
        self._source = source
        self._report = report

    @property
    def tree(self) -> YamlNode:
        """The tree of the text."""
        return self._document

    @property
    def source(self) -> SourceText:
        """The text."""
        return self._source

    @property
    def name(self) -> str:
        """The name of the case, or of the file if the case has none."""
        node = self._document.get("case")
        return (node.text if node is not None else None) or Path(self._source.file).stem

    @property
    def model_path(self) -> Path | None:
        """The path of the model file, resolved against the directory of the case file."""
        node = self._document.get("model")
        if node is None or not node.text or node.plain is None:
            return None
        return Path(self._source.file).parent / node.text

    def required_model_path(self) -> Path:
        """Return `model_path`. Raise `InputError` if there is no such file, with all other errors of the shape."""
        path = self.model_path
        wrong = self._wrong_model(path)
        if path is None or wrong is not None:
            report = self._report.copy()
            check_shape(self._document, report, CaseKeys, case_owners())
            others = report.error().diagnostics if len(report) else ()
            raise InputError(sorted((*((wrong,) if wrong else ()), *others), key=lambda found: found.order))
        return path

    def _wrong_model(self, path: Path | None) -> Diagnostic | None:
        """Return the error if the model file is missing."""
        if path is None:
            message = "the case names no model"
            remedy = "add `model: <path>`, relative to the directory of this file"
            return Diagnostic(Slug.MODEL_MISSING, message, Place(self._source.file), remedy)
        place = self._document.items["model"].place
        line = self._source.lines[place.line - 1]
        if not _exists(path):
            message = f"there is no such file: `{path}`"
            return Diagnostic(Slug.FILE_MISSING, message, place, similar_file_remedy(path), line)
        if path.is_dir():
            return Diagnostic(Slug.FILE_IS_DIRECTORY, f"`{path}` is a directory, not a model file", place, None, line)
        return None

    def read(self, model: BehaviorModel) -> Case:
        """Return the case for a model. Raises `InputError` with all errors of the file."""
        report = self._report.copy()
        scope = Scope.of(model)
        document = ground_case(self._document, report, self._source.text, scope.variables)
        check_shape(document, report, CaseKeys, case_owners())
        reader = ValueReader(report, scope)
        case = CaseKeys(document, reader).case_for(model)
        report.raise_any()
        if not reader.is_whole:
            raise AssertionError(f"{self._source.file}: something was not resolved, and nothing was complained of")
        return case


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def open_case(path: str | Path) -> CaseDocument:
    """Return the parsed case of a file. Raises `InputError` if the file cannot be read, or is no YAML mapping."""
    return parse_case(read_file(Path(path)), str(path))


def parse_case(text: str, file: str = "case") -> CaseDocument:
    """Return the parsed case of a text. Raises `InputError` if it is no YAML mapping; `file` is its name in errors."""
    return CaseDocument(*read_tree(text, file, "case", _START))


def read_case(text: str, model: BehaviorModel, file: str = "case") -> Case:
    """Return the case of a text. Raises `InputError` with all errors of the text.

    Args:
        text: the YAML text.
        model: the model that names are resolved in.
        file: the name of the text in errors.
    """
    return parse_case(text, file).read(model)


def read_network(text: str, model: BehaviorModel, file: str = "--network") -> Network:
    """Return the network of one line, such as `loss: 2 %, jitter: 10 ms`. Raises `InputError` with places in it.

    Args:
        text: the network as in a case, with or without braces.
        model: the model with the resources.
        file: the name of the text in errors.
    """
    line = re.sub(r"[\r\n]", " ", text)
    if line.strip().startswith("{"):
        return _network(line, model, file)
    end = "\n" if "#" in line else ""  # a comment must not swallow the brace
    try:
        return _network(f"{{{line}{end}}}", model, file)
    except InputError as error:
        raise InputError([_without_braces(diagnostic, line) for diagnostic in error.diagnostics]) from None


def _network(text: str, model: BehaviorModel, file: str) -> Network:
    start = "write for example `loss: 2 %, jitter: 10 ms`"
    document, _, report = read_tree(text, file, "network", start)
    check_shape(document, report, NetworkKeys, network_owners())
    network = NetworkKeys(document, ValueReader(report, Scope.of(model))).network()
    report.raise_any()
    return network


def _without_braces(diagnostic: Diagnostic, line: str) -> Diagnostic:
    """Return the error with its place in the line that the user wrote."""
    place = diagnostic.place
    if not place.line:
        return diagnostic
    column = len(line) + 1 if place.line > 1 else min(max(1, place.column - 1), len(line) + 1)
    length = max(1, min(place.length, len(line) + 1 - column))
    return replace(diagnostic, place=Place(place.file, 1, column, length), source_line=line)


# writing


def write_case(case: Case, model: BehaviorModel, model_path: str | None, comment: Sequence[str] = ()) -> str:
    """Return the case as YAML, with every key that differs from its default.

    What a request cannot have is left out: the reply of a request that times out, and values measured by one that
    fails. Of several rules for one request, the first is written. Equal requests in a row are counted.

    Args:
        case: the case.
        model: the model that it is for.
        model_path: the path of the model, relative to the directory of the file to be written.
        comment: lines of a comment at the top.
    """
    data = CaseKeys.write(CaseToWrite(replace(case, recorded=None), model, model_path))
    lines = chain.from_iterable(words.splitlines() or [""] for words in comment)
    recorded = "" if case.recorded is None else write_recorded(case.recorded)
    return "".join(f"{_comment(line)}\n" for line in lines) + dump(data) + recorded


def write_recorded(recorded: RecordedRun, *, in_flow: bool = False) -> str:
    """Return the key `recorded` of a case file, the last one of a written case, with long lists folded.

    Args:
        recorded: the run.
        in_flow: whether it is written for a case in braces: on one line, without a line end.
    """
    data = {"recorded": RecordedKeys.write(recorded)}
    if in_flow:
        return dump(FlowMapping(data)).strip().removeprefix("{").removesuffix("}")
    return dump_folded(data)


def write_network(network: Network) -> str:
    """Return the network as `read_network` reads it: on one line, without braces."""
    return dump(FlowMapping(NetworkKeys.write(network))).strip().removeprefix("{").removesuffix("}")


def _comment(line: str) -> str:
    return f"# {printable(line)}".rstrip()
