"""Certificate files: each names the file of its model, so that it can be checked without naming the model."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from typing import TYPE_CHECKING

from msgspec import Struct, field

from scbm.cases.coverage import Decision
from scbm.cases.coverage.assumptions import assumptions
from scbm.closing.proof_reasons import REASONS_SUFFIX, read_reasons
from scbm.files import digest_of, open_input, read_file, without_detours
from scbm.model import Diagnostic, GoalOrder, InputError, Place, Slug
from scbm.model.json_reader import JsonError, read_json
from scbm.model.struct_classes import PartlyCompared
from scbm.model.visible_text import shell_word
from scbm.proofcheck import RunsArgument

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from scbm.model import BehaviorModel
    from scbm.proofcheck import Certificate, CertificateFlaw

SUFFIX = ".json"

MAX_BYTES = 256 * 1024 * 1024
"""Maximum size of a certificate file; it has some hundred thousand situations."""

_FIRST_BYTES = 1024
"""The number of characters that are read first: a file that is no certificate need not be read as a whole."""

_HEAD = re.compile(r'\{\s*"scbm_certificate": \d+,\s*"model": "')
"""The beginning of each certificate."""

_WORD = r'"(?:[^"\\\x00-\x1f]|\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4}))*"'
_MODEL_FILE = re.compile(rf'"model"\s*:\s*{_WORD}\s*,\s*"model_file"\s*:\s*({_WORD})\s*,')
"""The name of the model file in the beginning of a certificate, which may be too large to be read for that alone."""


class CertificateFile(PartlyCompared, frozen=True):
    """A certificate and the file that it was read from.

    Attributes:
        model_path: the model file that the certificate names; `None` if it names none.
        reasons: for each claim why, in words for people, which no check verifies.
    """

    certificate: Certificate
    path: Path
    model_path: Path | None
    reasons: Mapping[str, str] = field(default_factory=dict)
    uncompared = ("reasons",)

    def required_model_path(self) -> Path:
        """Return `model_path`. Raises `InputError` if it is `None`."""
        if self.model_path is None:
            message = "the certificate does not say in which file its model is"
            remedy = f"name the model: `scbm close MODEL --check {shell_word(str(self.path))}`"
            raise InputError([Diagnostic(Slug.MODEL_MISSING, message, Place(str(self.path)), remedy)])
        return self.model_path


class CheckedCertificate(Struct, frozen=True):
    """The result of checking a certificate.

    Attributes:
        file: the certificate and its file.
        is_of_this_model: whether the certificate is for this version of the model; if not, nothing else was checked.
        flaws: why the certificate proves nothing; empty if it is sound.
        assumptions: what a sound certificate assumes, one sentence each.
    """

    file: CertificateFile
    is_of_this_model: bool
    flaws: tuple[CertificateFlaw, ...] = ()
    assumptions: tuple[str, ...] = ()

    @property
    def is_sound(self) -> bool:
        """Whether the certificate proves its claims about this model."""
        return self.is_of_this_model and not self.flaws

    def diagnostics(self, model_path: Path) -> list[Diagnostic]:
        """Return why the certificate does not count, with its place; nothing if it is sound.

        Args:
            model_path: the file of the model that it was checked against.
        """
        place = Place(str(self.file.path))
        remedy = f"close it again: `scbm close {shell_word(str(model_path))} --out DIRECTORY`"
        if not self.is_of_this_model:
            message = f"this certificate is for another version of the model than {model_path}"
            return [Diagnostic(Slug.CERTIFICATE_WRONG, message, place, remedy)]
        first, *others = [str(flaw) for flaw in self.flaws] or [""]
        if not first:
            return []
        found = [Diagnostic(Slug.CERTIFICATE_WRONG, first, place, remedy)]
        return [*found, *(Diagnostic(Slug.CERTIFICATE_WRONG, flaw, place) for flaw in others)]

    @property
    def why_ignored(self) -> str:
        """Why the certificate does not count, as a sentence without a full stop; empty if it is sound."""
        if not self.is_of_this_model:
            return f"{self.file.path}: it is for another version of the model"
        return f"{self.file.path}: {self.flaws[0]}" if self.flaws else ""

    @property
    def obligations(self) -> tuple[str, ...]:
        """The obligations that the certificate claims to be uncoverable."""
        return () if self.file.certificate.is_about_requirements else self.file.certificate.claims

    @property
    def requirements(self) -> tuple[str, ...]:
        """The requirements that the certificate claims to hold."""
        return self.file.certificate.claims if self.file.certificate.is_about_requirements else ()

    @property
    def situations(self) -> int | None:
        """The number of situations in the certificate; `None` if its argument is not about all runs."""
        argument = self.file.certificate.argument
        if not isinstance(argument, RunsArgument):
            return None
        return sum(len(runs.situations) for runs in argument.runs)


def is_certificate_text(text: str) -> bool:
    """Return whether a text begins like a certificate."""
    return _HEAD.match(text) is not None


def find_certificates(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the certificate files of paths: files as they are, and all JSON files below directories.

    The reasons beside a certificate are left out, so that a shell may name all files of a directory.

    Raises:
        InputError: a directory has no such file below it.
    """
    found: dict[Path, None] = {}
    known = list(paths)
    beside = {path.with_suffix(REASONS_SUFFIX) for path in known if path.suffix == SUFFIX}
    for path in known:
        if path in beside:
            continue
        files = sorted(path.rglob(f"*{SUFFIX}")) if path.is_dir() else [path]
        if not files:
            message = f"there are no certificates below: no file that ends in `{SUFFIX}`"
            raise InputError([Diagnostic(Slug.BAD_CERTIFICATE, message, Place(str(path)))])
        found |= dict.fromkeys(files)
    return tuple(found)


def _certificates_below(directory: Path) -> tuple[Path, ...]:
    """Return the JSON files below a directory that begin like a certificate, in the order of their paths."""
    return tuple(path for path in sorted(directory.rglob(f"*{SUFFIX}")) if is_certificate_text(_start(path)))


def certificates_in(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the certificates of paths: files as they are, and all certificates below directories, if there are any.

    Where all obligations are covered, closing writes no certificate.
    """
    found: dict[Path, None] = {}
    for path in paths:
        found |= dict.fromkeys(_certificates_below(path) if path.is_dir() else (path,))
    return tuple(found)


def _start(path: Path) -> str:
    """Return the first bytes of a file as text; empty if it cannot be read."""
    try:
        with open_input(path) as stream:
            return stream.read(_FIRST_BYTES).decode("utf-8", errors="replace")
    except (OSError, ValueError):
        return ""


def open_certificate(path: Path) -> CertificateFile:
    """Return the certificate in a file. Raises `InputError` if it or its reasons cannot be read, or are none."""
    from scbm.proofcheck import read_certificate_file  # noqa: PLC0415 - the checker, which few commands need

    text = _read(path)
    certificate, model_file = read_certificate_file(text, str(path))
    model_path = None if model_file is None else without_detours(path.parent / model_file)
    return CertificateFile(certificate, path, model_path, read_reasons(path, certificate))


def open_certificates(paths: Iterable[Path]) -> tuple[CertificateFile, ...]:
    """Return the certificates in files. Raises `InputError` with the errors of all files."""
    opened: list[CertificateFile] = []
    wrong: list[Diagnostic] = []
    for path in paths:
        try:
            opened.append(open_certificate(path))
        except InputError as error:
            wrong += error.diagnostics
    if wrong:
        raise InputError(wrong)
    return tuple(opened)


def model_path_in(text: str, path: Path) -> Path | None:
    """Return the model file that the text of a certificate names; the text may be its beginning.

    Returns `None` if the text names no file, or its name is damaged.
    """
    named = _MODEL_FILE.search(text)
    try:
        return None if named is None else without_detours(path.parent / str(read_json(named[1], len(text))))
    except JsonError:
        return None


def _read(path: Path) -> str:
    """Return the text of a file, or the first bytes of a file that holds no JSON object."""
    with suppress(OSError, ValueError), open_input(path) as stream:  # `read_file` reports these errors
        start = stream.read(_FIRST_BYTES).decode("utf-8", errors="replace")
        is_object = start.removeprefix("\ufeff").lstrip().startswith("{")
        if not is_object and os.fstat(stream.fileno()).st_size <= MAX_BYTES:
            return start
    return read_file(path, MAX_BYTES)


def check_file(file: CertificateFile, model: BehaviorModel) -> CheckedCertificate:
    """Check a certificate against a model."""
    if file.certificate.digest != digest_of(model):
        return CheckedCertificate(file, is_of_this_model=False)
    from scbm.proofcheck import check_certificate  # noqa: PLC0415 - as above

    flaws = check_certificate(file.certificate, model)
    assumed = () if flaws else assumed_by([file.certificate], model)
    return CheckedCertificate(file, is_of_this_model=True, flaws=flaws, assumptions=assumed)


def proved_status(certificate: Certificate) -> Decision:
    """Return the status that a sound certificate gives its obligations: it depends on the plans that it is about."""
    return Decision.UNCOVERABLE if certificate.is_for_any_plan else Decision.EXCLUDED


def assumed_by(certificates: Iterable[Certificate], model: BehaviorModel) -> tuple[str, ...]:
    """Return what sound certificates of a model assume, one sentence each; none without certificates."""
    known = tuple(certificates)
    goals = GoalOrder.SINGLE if any(each.goals is GoalOrder.SINGLE for each in known) else GoalOrder.SEQUENCE
    return assumptions(model, [proved_status(each) for each in known], goals)
