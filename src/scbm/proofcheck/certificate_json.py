"""Certificates as JSON: written with the same bytes for the same certificate, and read with all errors located.

A certificate has one claim, variable or situation on a line. Reading reports every error of its shape at once.
Whether a variable, a value or a claim exists in the model is not a question of shape: the check answers it.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from scbm.model import (
    Diagnostic,
    GoalOrder,
    InputError,
    Place,
    PlannerIdentity,
    PlanSet,
    Slug,
    refuse_other_version,
)
from scbm.model.json_reader import JsonError, line_and_column, read_json, value_positions
from scbm.proofcheck.certificate import Certificate, RunsArgument
from scbm.proofcheck.certificate_arguments import ARGUMENTS, json_list, json_text
from scbm.proofcheck.certificate_parts import MAX_WORD, CertificateParts, FaultError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import TypeVar

    from scbm.model.json_reader import JsonPath

    Part = TypeVar("Part")

FORMAT_VERSION = 5


def certificate_text(certificate: Certificate, model_file: str | None = None) -> str:
    """Return the text that `read_certificate_file` reads; `model_file` is the path of the model relative to it."""
    parts = [
        f'"{_VERSION}": {FORMAT_VERSION}',
        f'"model": {json_text(certificate.model)}',
        *([] if model_file is None else [f'"model_file": {json_text(model_file)}']),
        f'"digest": {json_text(certificate.digest)}',
        f'"claims": {json_list(map(json_text, certificate.claims))}',
        f'"argument": {json_text(certificate.argument.kind)}, "planner": {_planner_text(certificate.planner)}',
        f'"goals": {json_text(certificate.goals)}, "plans": {json_text(certificate.plans)}',
        *ARGUMENTS[certificate.argument.kind].write(certificate.argument),
    ]
    return "{" + ",\n".join(parts) + "}\n"


def _planner_text(planner: PlannerIdentity | None) -> str:
    return "null" if planner is None else json_text({"name": planner.name, "version": planner.version})


MAX_CHARACTERS = 256 * 1024 * 1024
"""Maximum size of a certificate that is read, in characters; it has some hundred thousand situations."""

_VERSION = "scbm_certificate"
_HEAD = (_VERSION, "model", "digest", "claims", "argument", "planner", "goals", "plans")
_DIGEST = re.compile(r"[0-9a-f]{64}")


def read_certificate(text: str, file: str = "certificate") -> Certificate:
    """Return the certificate in `text`. Raises `InputError`, located in the text."""
    return read_certificate_file(text, file)[0]


def read_certificate_file(text: str, file: str = "certificate") -> tuple[Certificate, str | None]:
    """Return the certificate in `text`, and the model file that it names, if any. Raises `InputError`, located."""
    text = text.removeprefix("\ufeff")
    try:
        document = read_json(text, MAX_CHARACTERS)
    except JsonError as error:
        raise InputError([_diagnostic(error.message, text, file, error.position)]) from None
    if isinstance(document, dict) and _VERSION in document:
        remedy = "close its model again: `scbm close MODEL --out DIRECTORY`"
        refuse_other_version("certificate", document[_VERSION], FORMAT_VERSION, Place(file), remedy)
    reading = _CertificateReader()
    read = reading.read(document)
    if read is None:
        found = value_positions(text, (fault.path for fault in reading.faults))
        unique = {_diagnostic(f.message, text, file, found.get(f.path, 0)): None for f in reading.faults}
        raise InputError(sorted(unique, key=lambda diagnostic: diagnostic.order))
    return read


def _diagnostic(message: str, text: str, file: str, position: int) -> Diagnostic:
    line, column, source = line_and_column(text, position)
    return Diagnostic(Slug.BAD_CERTIFICATE, message, Place(file, line, column), source_line=source)


class _CertificateReader(CertificateParts):
    """Reads a document as a certificate."""

    def read(self, document: object) -> tuple[Certificate, str | None] | None:
        """Return the certificate and the model file that it names, if any; `None` if there are faults."""
        try:
            certificate = self._certificate(document)
            model_file = self._model_file(document)
        except FaultError as fault:
            self.faults.append(fault)
            return None
        return None if self.faults else (certificate, model_file)

    def _certificate(self, document: object) -> Certificate:
        if not isinstance(document, dict) or _VERSION not in document:
            raise FaultError((), "this is not a certificate of scbm")
        kind = document.get("argument")
        if not isinstance(kind, str) or kind not in ARGUMENTS:
            path: JsonPath = ("argument",) if "argument" in document else ()
            raise FaultError(path, f"the key `argument` is one of: {', '.join(ARGUMENTS)}")
        optional = ("model_file",) if "model_file" in document else ()
        self.keys(document, (*_HEAD, *optional, *ARGUMENTS[kind].keys), ())
        self._refuse_other_runs(document, kind)
        return Certificate(
            self.word(document["model"], ("model",)),
            self._digest(document["digest"], ("digest",)),
            self.words(document["claims"], ("claims",)),
            ARGUMENTS[kind].read(self, document),
            self._planner(document["planner"], ("planner",)),
        )

    def _refuse_other_runs(self, document: dict[str, Any], kind: str) -> None:
        """Refuse goals and plans that an argument of this kind is not about."""
        is_about_runs = kind == RunsArgument.kind
        known: dict[str, Iterable[str]] = {
            "goals": GoalOrder if is_about_runs else [GoalOrder.SEQUENCE],
            "plans": PlanSet if is_about_runs else [PlanSet.ANY],
        }
        for key, words in known.items():
            if document[key] not in tuple(words):
                raise FaultError((key,), f"expected one of: {', '.join(words)}")

    def _planner(self, value: object, path: JsonPath) -> PlannerIdentity | None:
        """Return the planner that a certificate names, if any."""
        if value is None:
            return None
        planner = self.keys(value, ("name", "version"), path)
        return PlannerIdentity(
            self.word(planner["name"], (*path, "name")), self.word(planner["version"], (*path, "version"))
        )

    def _model_file(self, document: object) -> str | None:
        """Return the path of the model that a document names; certificates outside of files name none."""
        written = document.get("model_file") if isinstance(document, dict) else None
        if written is not None and (not isinstance(written, str) or not 0 < len(written) <= MAX_WORD):
            raise FaultError(("model_file",), f"the path of a model is a text of 1 to {MAX_WORD} characters")
        return written

    def _digest(self, value: object, path: JsonPath) -> str:
        if not isinstance(value, str) or not _DIGEST.fullmatch(value):
            raise FaultError(path, "a digest has 64 digits, `0` to `9` and `a` to `f`")
        return value
