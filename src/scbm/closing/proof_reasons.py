"""Why what certificates claim is not covered, in words: files beside certificates, for people.

A certificate claims only what its check verifies. The reasons that closing found stand in a file of their own beside
it, such as `runs.reasons` beside `runs.json`. Nothing depends on them: without the file reports name the argument.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from scbm.files import read_file
from scbm.model import Diagnostic, InputError, Place, Slug, refuse_other_version
from scbm.model.json_reader import (
    Digest,
    JsonError,
    JsonRecord,
    LongText,
    line_and_column,
    read_json_object,
    read_located,
)
from scbm.proofcheck import (
    ContinuationsArgument,
    RequirementsArgument,
    RequirementSetsArgument,
    RunsArgument,
    SetsArgument,
    StructureArgument,
    ValuesArgument,
)

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
    SetsArgument.kind: "no situation in the set of the certificate leads to it",
    RequirementSetsArgument.kind: "no situation in the set of the certificate violates it",
    RequirementsArgument.kind: "none of the runs that the certificate is about violates it",
    ContinuationsArgument.kind: "from each run that the certificate is about goals stay reachable",
}


def reasons_text(certificate: Certificate, reasons: Mapping[str, str]) -> str:
    """Return the file of reasons beside a certificate, one claim on a line; `reasons` are of obligations."""
    known = {**_known(certificate), **reasons}
    lines = (f"{_text(name)}: {_text(known[name])}" for name in certificate.claims)
    listed = ",\n".join(lines)
    return f'{_HEAD}{_VERSION},\n"digest": {_text(certificate.digest)},\n"reasons": {{\n{listed}}}}}\n'


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _known(certificate: Certificate) -> dict[str, str]:
    """Return for each claim what the argument says."""
    return dict.fromkeys(certificate.claims, _ARGUMENTS.get(certificate.argument.kind, "a certificate excludes it"))


def is_reasons_text(text: str) -> bool:
    """Return whether a text begins like a file of reasons."""
    return text.startswith(_HEAD)


def read_reasons(certificate_file: Path, certificate: Certificate) -> dict[str, str]:
    """Return a reason for each claim of a certificate: from the file beside it, or else what its argument says.

    Raises:
        InputError: there is such a file, and it cannot be read, or it is about another version of the model.
    """
    known = _known(certificate)
    path = certificate_file.with_suffix(REASONS_SUFFIX)
    if not path.exists():
        return known
    text = read_file(path, MAX_BYTES)
    try:
        found = _read(text, path, certificate.digest)
    except JsonError as error:
        line, column, source = line_and_column(text, error.position)
        place = Place(str(path), line, column)
        raise InputError(
            [Diagnostic(Slug.BAD_CERTIFICATE, error.message, place, _REMEDY, source_line=source)]
        ) from None
    return known | {name: reason for name, reason in found.items() if name in known}


class _ReasonsFile(JsonRecord, frozen=True):
    scbm_reasons: int
    digest: Digest
    reasons: dict[str, LongText]


def _read(text: str, path: Path, digest: str) -> dict[str, str]:
    """Return the reasons in a text. Raise `JsonError`, or `InputError` for a text of another version."""
    document = read_json_object(text, MAX_BYTES)
    refuse_other_version("file of reasons", document.get("scbm_reasons"), _VERSION, Place(str(path)), _REMEDY)
    read: _ReasonsFile = read_located(document, _ReasonsFile, text)
    if read.digest != digest:
        raise JsonError("these are not the reasons of this certificate")
    return read.reasons
