"""`--certificates` and `--waivers`: what decides the statuses of obligations beside the visits of cases."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from msgspec.structs import replace

from scbm import __version__
from scbm.cases.coverage import COVERABLE, WaiverReview
from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.output.terminal import errors
from scbm.closing.current_date import today
from scbm.files import digest_of, load_waivers
from scbm.model import Diagnostic, InputError, Place, Severity, Slug

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases.coverage import Threshold
    from scbm.closing.certificate_files import CheckedCertificate
    from scbm.closing.proved_statuses import StatusEvidence
    from scbm.model import BehaviorModel, Waiver
    from scbm.store import History, StoredCertificate


def _certificate_files(path: Path) -> list[Path]:
    """Return the certificates of a path with the files of reasons beside them."""
    from scbm.closing.certificate_files import certificates_in  # noqa: PLC0415 - few commands read certificates
    from scbm.closing.proof_reasons import REASONS_SUFFIX  # noqa: PLC0415

    found = certificates_in([path])
    return [file for each in found for file in (each, each.with_suffix(REASONS_SUFFIX))]


Certificates = Annotated[
    list[Path] | None,
    HelpSection.VERDICTS.option(
        "--certificates",
        metavar="DIRECTORY",
        help="Check these certificates, and count the obligations that they exclude.",
    ),
    Reads("a certificate", _certificate_files),
]
WaiversFile = Annotated[
    Path | None,
    HelpSection.VERDICTS.option("--waivers", metavar="FILE", help="Waivers, in addition to those of the model."),
    Reads("the waivers"),
]


def read_waivers_of(model: BehaviorModel, file: Path | None) -> WaiverReview:
    """Return the waivers of a model and of a file, as of today; print the warnings of the file.

    Raises:
        InputError: with all errors of the file.
    """
    beside, warnings = ((), ()) if file is None else load_waivers(file, model)
    errors().diagnostics(warnings)
    known = {waiver.obligation for waiver in model.waivers}
    twice = {waiver.place: waiver for waiver in reversed(beside) if waiver.obligation in known}
    if twice:
        raise InputError([_waived_twice(waiver, str(file)) for waiver in reversed(twice.values())])
    return WaiverReview.on(today(), (*model.waivers, *beside))


def _waived_twice(waiver: Waiver, file: str) -> Diagnostic:
    message = f"`{waiver.obligation}` has a waiver in the model already"
    return Diagnostic(Slug.DUPLICATE_VALUE, message, waiver.place or Place(file), "leave out one of the two")


def read_evidence(
    model: BehaviorModel, model_file: Path, certificates: Sequence[Path] | None, waivers: Path | None
) -> tuple[StatusEvidence, tuple[CheckedCertificate, ...]]:
    """Check certificates and read waivers; print a warning for each certificate that does not count.

    Raises:
        InputError: a file is no certificate, or the waivers have errors.
    """
    from scbm.closing.certificate_files import certificates_in, check_file, open_certificates  # noqa: PLC0415 - as above
    from scbm.closing.proved_statuses import StatusEvidence  # noqa: PLC0415

    review = read_waivers_of(model, waivers)
    files = open_certificates(certificates_in(certificates or ()))
    checked = tuple(check_file(file, model) for file in files)
    for each in checked:
        found = each.diagnostics(model_file)[:_MAX_FLAWS]
        errors().diagnostics([replace(one, severity=Severity.WARNING) for one in found])  # the command goes on
    return StatusEvidence.of(checked, review, model), checked


def read_asked_evidence(
    model: BehaviorModel,
    model_file: Path,
    certificates: Sequence[Path] | None,
    waivers: Path | None,
    thresholds: Sequence[Threshold],
) -> StatusEvidence | None:
    """Return the evidence as `read_evidence` does; `None` if neither options nor the model ask for statuses."""
    is_asked = any(threshold.kind == COVERABLE for threshold in thresholds)
    if not (is_asked or certificates or waivers or model.waivers):
        return None
    return read_evidence(model, model_file, certificates, waivers)[0]


def history_of_model(store: Path, model: BehaviorModel) -> History:
    """Return what a store has. Raise `InputError` for a store of another model."""
    from scbm.store import read_history  # noqa: PLC0415 - a database, which few commands read

    history = read_history(store)
    if digest_of(history.model) != digest_of(model):
        message, remedy = "this store is of another model, or of another version of it", "run its cases again"
        raise InputError([Diagnostic(Slug.STORE_OTHER_MODEL, message, Place(str(store)), remedy)])
    return history


def stored_evidence(
    history: History, certificates: Sequence[Path] | None, waivers: Path | None, thresholds: Sequence[Threshold]
) -> StatusEvidence | None:
    """Return the evidence of a store and of options; `None` if neither has any and no threshold asks for statuses.

    A certificate of the store that another version of scbm has checked is checked again.

    Raises:
        InputError: a file is no certificate, or the waivers have errors.
    """
    model = replace(history.model, waivers=history.waivers)
    file = Path(history.source.path)
    is_asked = any(threshold.kind == COVERABLE for threshold in thresholds)
    if not (is_asked or certificates or waivers or model.waivers or history.certificates):
        return None
    evidence, _ = read_evidence(model, file, certificates, waivers)
    for stored in history.certificates:
        why = _why_ignored(stored, model)
        if why:
            evidence = replace(evidence, ignored=(*evidence.ignored, f"{stored.name}: {why}"))
        else:
            evidence = evidence.with_proofs(stored.proofs.items())
    return evidence


def _why_ignored(stored: StoredCertificate, model: BehaviorModel) -> str:
    """Return why a certificate of a store does not count; empty if it does."""
    if stored.is_earlier:
        return "it is for another version of the model"
    if stored.checked_by == __version__:
        return ""
    from scbm.proofcheck import check_certificate, read_certificate  # noqa: PLC0415 - few stores need the checker

    try:
        flaws = check_certificate(read_certificate(stored.text, stored.name), model)
    except InputError as error:  # its format is that of another version
        return error.diagnostics[0].message
    return str(flaws[0]) if flaws else ""


_MAX_FLAWS = 5
"""Maximum number of flaws of a certificate that are shown; one is enough to refuse it."""
