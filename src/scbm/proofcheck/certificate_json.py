"""Certificates as JSON: written with the same bytes for the same certificate, and read with all errors located.

A certificate has one claim, variable or situation on a line. Reading reports every error of its shape at once.
Whether a variable, a value or a claim exists in the model is not a question of shape: the check answers it.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

from msgspec import Struct, ValidationError, convert
from msgspec.structs import replace

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
from scbm.model.json_reader import (
    Digest,
    JsonError,
    JsonRecord,
    line_and_column,
    read_json,
    record_faults,
    value_positions,
)
from scbm.proofcheck.certificate import Certificate, RunsArgument, Situation, Word
from scbm.proofcheck.certificate_arguments import ARGUMENTS, json_list, json_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.json_reader import JsonPath
    from scbm.proofcheck.certificate import ListedValue

FORMAT_VERSION = 5


def certificate_text(certificate: Certificate, model_file: str | None = None) -> str:
    """Return the text that `read_certificate_file` reads; `model_file` is the path of the model relative to it."""
    planner = certificate.planner and {"name": certificate.planner.name, "version": certificate.planner.version}
    parts = [
        f'"{_VERSION}": {FORMAT_VERSION}',
        f'"model": {json_text(certificate.model)}',
        *([] if model_file is None else [f'"model_file": {json_text(model_file)}']),
        f'"digest": {json_text(certificate.digest)}',
        f'"claims": {json_list(map(json_text, certificate.claims))}',
        f'"argument": {json_text(certificate.argument.kind)}, "planner": {json_text(planner)}',
        f'"goals": {json_text(certificate.goals)}, "plans": {json_text(certificate.plans)}',
        *ARGUMENTS[certificate.argument.kind].write(certificate.argument),
    ]
    return "{" + ",\n".join(parts) + "}\n"


MAX_CHARACTERS = 256 * 1024 * 1024
"""Maximum size of a certificate that is read, in characters; it has some hundred thousand situations."""
MAX_FAULTS = 100
"""Maximum number of faults that are reported for one certificate."""

_VERSION = "scbm_certificate"


class _CertificatePlanner(JsonRecord, frozen=True):
    """The planner of a certificate: without limits, which only end runs earlier."""

    name: Word
    version: Word


class _CertificateHead(JsonRecord, frozen=True):
    """The keys of all certificates. Those of the argument stand beside them."""

    scbm_certificate: int
    model: Word
    digest: Digest
    claims: tuple[Word, ...]
    argument: str
    planner: _CertificatePlanner | None
    goals: GoalOrder
    plans: PlanSet
    model_file: Word | None = None


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
    if not isinstance(document, dict) or _VERSION not in document:
        raise InputError([_diagnostic("this is not a certificate of scbm", text, file, 0)])
    remedy = "close its model again: `scbm close MODEL --out DIRECTORY`"
    refuse_other_version("certificate", document[_VERSION], FORMAT_VERSION, Place(file), remedy)
    try:
        return _read(document)
    except ValidationError:
        faults = list(islice(_faults(document), MAX_FAULTS))
    found = value_positions(text, (path for path, _ in faults))
    unique = {_diagnostic(message, text, file, found.get(path, 0)): None for path, message in faults}
    raise InputError(sorted(unique, key=lambda diagnostic: diagnostic.order))


def _diagnostic(message: str, text: str, file: str, position: int) -> Diagnostic:
    line, column, source = line_and_column(text, position)
    return Diagnostic(Slug.BAD_CERTIFICATE, message, Place(file, line, column), source_line=source)


def _read(document: dict[str, Any]) -> tuple[Certificate, str | None]:
    """Return the certificate of a document, and the model file that it names. Raise `ValidationError`."""
    kind = str(document.get("argument"))
    if kind not in ARGUMENTS:
        raise ValidationError
    of_all, of_argument = _split(document, ARGUMENTS[kind].record)
    head, argument = convert(of_all, _CertificateHead), convert(of_argument, ARGUMENTS[kind].record)
    if isinstance(argument, RunsArgument):
        argument = _with_shared_words(argument)
    planner = None if head.planner is None else PlannerIdentity(head.planner.name, head.planner.version)
    certificate = Certificate(head.model, head.digest, head.claims, argument, planner)
    if (certificate.goals, certificate.plans) != (head.goals, head.plans):
        raise ValidationError
    return certificate, head.model_file


def _faults(document: dict[str, Any]) -> Iterator[tuple[JsonPath, str]]:
    """Yield each reason why a document is no certificate, with its path."""
    kind = str(document.get("argument"))
    if kind not in ARGUMENTS:
        path: JsonPath = ("argument",) if "argument" in document else ()
        yield path, f"the key `argument` is one of: {', '.join(ARGUMENTS)}"
        return
    of_all, of_argument = _split(document, ARGUMENTS[kind].record)
    yield from record_faults(of_all, _CertificateHead)
    yield from record_faults(of_argument, ARGUMENTS[kind].record)
    for key, value in (("goals", GoalOrder.SEQUENCE), ("plans", PlanSet.ANY)):
        if key not in of_argument and document.get(key, value) != value:
            yield (key,), f"expected `{value}`: this argument is about any runs"


def _split(document: dict[str, Any], argument: type[Struct]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the keys of all certificates, with those that are unknown, and the keys of the argument. Some are both."""
    own, known = argument.__struct_fields__, _CertificateHead.__struct_fields__
    of_all = {key: value for key, value in document.items() if key in known or key not in own}
    return of_all, {key: value for key, value in document.items() if key in own}


def _with_shared_words(argument: RunsArgument) -> RunsArgument:
    """Return an argument that keeps each word once: the same ones recur in every situation.

    The file has an empty list of operations where a canonical plan leaves none.
    """
    words: dict[ListedValue, ListedValue] = {}

    def shared(values: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple([value if value is True or value is False else words.setdefault(value, value) for value in values])

    def situation(read: Situation) -> Situation:
        has_queue = read.queue is not None and (read.queue or argument.plans is PlanSet.ANY)
        queue = shared(read.queue or ()) if has_queue else None
        return Situation(shared(read.values), queue, shared(read.in_flight), read.awaits)

    runs = (replace(each, situations=tuple(map(situation, each.situations))) for each in argument.runs)
    return replace(argument, runs=tuple(runs))
