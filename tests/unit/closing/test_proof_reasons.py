"""The reasons beside certificates: shown where the file is there, never needed, and refused if they are others'."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from scbm.closing.certificate_files import check_file, find_certificates, open_certificate
from scbm.closing.closing_files import write_output
from scbm.closing.proved_statuses import claims_of
from scbm.model import InputError, Slug
from support.models import SCAN_CELL, scan_cell
from support.shared_closings import shared_closing

if TYPE_CHECKING:
    from support.wording import Wording

CELL = scan_cell(("gr: light != red", "gr: true"))
CLOSED = shared_closing(CELL)


@pytest.fixture
def certificate(tmp_path: Path) -> Path:
    """The certificate of a closing that was written, with reasons beside it."""
    model_file = tmp_path / "cell.yaml"
    model_file.write_text(SCAN_CELL, encoding="utf-8")
    return next(iter(write_output(CLOSED, tmp_path / "out", model_file).certificates.values()))


def shown(certificate: Path) -> dict[str, str]:
    """The reasons that reports show."""
    checked = check_file(open_certificate(certificate), CELL)
    return {name: proof.reason for name, proof in claims_of(checked)}


def test_reports_show_the_reasons_of_closing(certificate: Path) -> None:
    found = {str(each.obligation): each.reason for each in CLOSED.decided if each.certificate is not None}
    assert found
    assert shown(certificate) == found
    assert not any(reason in certificate.read_text(encoding="utf-8") for reason in found.values())


def test_without_the_file_the_argument_is_named(certificate: Path, wording: Wording) -> None:
    certificate.with_suffix(".reasons").unlink()
    (reason,) = set(shown(certificate).values())
    wording(reason)


def test_a_reason_for_what_is_not_claimed_proves_nothing(certificate: Path) -> None:
    beside = certificate.with_suffix(".reasons")
    document = json.loads(beside.read_text(encoding="utf-8"))
    document["reasons"]["scan_box/completed"] = "so it is"
    beside.write_text(json.dumps(document), encoding="utf-8")
    assert "scan_box/completed" not in shown(certificate)


def test_all_files_of_a_directory_may_be_named(certificate: Path) -> None:
    beside = certificate.with_suffix(".reasons")
    assert find_certificates([certificate, beside]) == (certificate,)
    assert find_certificates([beside]) == (beside,), "alone it is refused as no certificate"


@pytest.mark.parametrize(
    "text", ["", "[]", '{"scbm_reasons": 1}',
             '{"scbm_reasons": 1, "digest": "DIGEST", "reasons": {"scan_box/failed": 3}}',
             '{"scbm_reasons": 1, "digest": "DIGEST", "reasons": []}'],
)  # fmt: skip
def test_other_texts_are_errors(certificate: Path, text: str, wording: Wording) -> None:
    beside = certificate.with_suffix(".reasons")
    digest = open_certificate(certificate).certificate.digest
    beside.write_text(text.replace("DIGEST", digest), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        open_certificate(certificate)
    assert [diagnostic.slug for diagnostic in raised.value.diagnostics] == [Slug.BAD_CERTIFICATE]
    wording(raised.value)


def test_reasons_of_another_version_are_an_error(certificate: Path, wording: Wording) -> None:
    beside = certificate.with_suffix(".reasons")
    beside.write_text(beside.read_text(encoding="utf-8").replace('"scbm_reasons": 1', '"scbm_reasons": 2'), "utf-8")
    with pytest.raises(InputError) as raised:
        open_certificate(certificate)
    assert [diagnostic.slug for diagnostic in raised.value.diagnostics] == [Slug.FORMAT_VERSION]
    wording(raised.value)
