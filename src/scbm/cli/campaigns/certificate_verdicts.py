"""`scbm close --check`: certificates, checked one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scbm.cli.output.terminal import errors, results, write_json
from scbm.closing.certificate_files import SUFFIX, CheckedCertificate, check_file, find_certificates, open_certificate
from scbm.files import load_model
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.reports import counted
from scbm.reports.figure_table import shown_path

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

FORMAT_VERSION = 1

_MAX_FLAWS = 5
"""So many flaws of a certificate are shown; one of them is enough to refuse it."""


def check_certificates(files: Sequence[Path], *, json: bool) -> int:
    """Checks certificates: each against the model that it names, or all against a model that stands before them.

    Raises:
        InputError: a file is no certificate, or a model cannot be read.
    """
    model_path = files[0] if len(files) > 1 and files[0].suffix != SUFFIX and not files[0].is_dir() else None
    asked = files[1:] if model_path is not None else files
    if not asked:
        message = "which certificates are to be checked?"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place("--check"), "write `scbm close --check FILE`")])
    opened = [open_certificate(path) for path in find_certificates(asked)]
    paths = [model_path or file.required_model_path() for file in opened]
    models = {path: load_model(path) for path in dict.fromkeys(paths)}
    checked = [check_file(file, models[path]) for file, path in zip(opened, paths, strict=True)]
    if json:
        write_json({"format_version": FORMAT_VERSION, "certificates": [_json(each) for each in checked]})
    else:
        for each, path in zip(checked, paths, strict=True):
            _tell(each, path)
    return 0 if all(each.is_sound for each in checked) else 1


def _tell(checked: CheckedCertificate, model_path: Path) -> None:
    path = str(checked.file.path)
    if checked.is_sound:
        results().line(f"{path}: sound: {', '.join(_sizes(checked))}")
        return
    errors().diagnostics(_wrong(checked, model_path)[:_MAX_FLAWS])
    if len(checked.flaws) > _MAX_FLAWS:
        errors().line(f"{path}: and {len(checked.flaws) - _MAX_FLAWS} more flaws")


def _sizes(checked: CheckedCertificate) -> list[str]:
    told = [counted(len(checked.obligations), "obligation")]
    situations = checked.situations
    return told if situations is None else [*told, f"{counted(situations, 'situation')} checked"]


def _wrong(checked: CheckedCertificate, model_path: Path) -> list[Diagnostic]:
    place = Place(str(checked.file.path))
    if not checked.is_of_this_model:
        message = f"this certificate is for another version of the model than {model_path}"
        remedy = f"close it again: `scbm close {shown_path(str(model_path))} --out DIRECTORY`"
        return [Diagnostic(Slug.CERTIFICATE_WRONG, message, place, remedy)]
    return [Diagnostic(Slug.CERTIFICATE_WRONG, str(flaw), place) for flaw in checked.flaws]


def _json(checked: CheckedCertificate) -> dict[str, Any]:
    return {
        "file": str(checked.file.path),
        "model": checked.file.certificate.model,
        "kind": checked.file.certificate.argument.kind,
        "sound": checked.is_sound,
        "is_of_this_model": checked.is_of_this_model,
        "obligations": list(checked.obligations),
        "situations": checked.situations,
        "flaws": [str(flaw) for flaw in checked.flaws],
    }
