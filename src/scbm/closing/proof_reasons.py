"""Why what certificates claim is not covered, in words: files beside certificates, for people.

A certificate claims only what its check verifies. The reasons that closing found stand in a file of their own beside
it, such as `runs.reasons` beside `runs.json`. Nothing depends on them: without the file reports name the argument.
"""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from scbm.files import read_file
from scbm.model import Diagnostic, InputError, Place, Slug, refuse_other_version
from scbm.model.json_reader import JsonError, convert_json, line_and_column, read_json_object
from scbm.proofcheck import RunsArgument, StructureArgument, ValuesArgument

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from scbm.proofcheck import Certificate

REASONS_SUFFIX = ".reasons"

MAX_BYTES = 16 * 1024 * 1024
"""Maximum size of a file of reasons: one sentence for each obligation."""

_HEAD = '{"scbm_reasons": '
_VERSION = 1
_REMEDY = "close the model again, or remove this file: no check needs it"

_ARGUMENTS = {
    StructureArgument.kind: "the text of the model excludes it",
    ValuesArgument.kind: "its variables never have values that allow it",
    RunsArgument.kind: "none of the runs that the certificate is about visits it",
}


def reasons_text(certificate: Certificate, reasons: Mapping[str, str]) -> str:
    """Return the file of reasons beside a certificate, one obligation on a line; `reasons` has one for each claim."""
    lines = (f"{_text(name)}: {_text(reasons[name])}" for name in certificate.claims)
    listed = ",\n".join(lines)
    return f'{_HEAD}{_VERSION},\n"digest": {_text(certificate.digest)},\n"reasons": {{\n{listed}}}}}\n'


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def is_reasons_text(text: str) -> bool:
    """Return whether a text begins like a file of reasons."""
    return text.startswith(_HEAD)


def read_reasons(certificate_file: Path, certificate: Certificate) -> dict[str, str]:
    """Return a reason for each claim of a certificate: from the file beside it, or else what its argument says.

    Raises:
        InputError: there is such a file, and it cannot be read, or it is about another version of the model.
    """
    known = dict.fromkeys(certificate.claims, _ARGUMENTS.get(certificate.argument.kind, "a certificate excludes it"))
    path = certificate_file.with_suffix(REASONS_SUFFIX)
    if not path.exists():
        return known
    found = _ReasonsText(path, read_file(path, MAX_BYTES)).reasons(certificate.digest)
    return known | {name: reason for name, reason in found.items() if name in known}


class _ReasonsText:
    """The text of a file of reasons while it is read."""

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._text = text

    def reasons(self, digest: str) -> dict[str, str]:
        try:
            document = read_json_object(self._text, MAX_BYTES)
        except JsonError as error:
            raise self._error(error.message, error.position) from None
        place = Place(str(self._path))
        refuse_other_version("file of reasons", document.get("scbm_reasons"), _VERSION, place, _REMEDY)
        if document.get("digest") != digest:
            raise self._error("these are not the reasons of this certificate")
        return self._sentences(document)

    def _sentences(self, document: dict[str, Any]) -> dict[str, str]:
        with suppress(JsonError):
            return convert_json(document.get("reasons"), dict[str, str])
        raise self._error("the key `reasons` has a text for each obligation")

    def _error(self, message: str, position: int = 0) -> InputError:
        line, column, source = line_and_column(self._text, position)
        place = Place(str(self._path), line, column)
        return InputError([Diagnostic(Slug.BAD_CERTIFICATE, message, place, _REMEDY, source_line=source)])
