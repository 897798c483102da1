"""Certificates in files: the same certificate, and the file of its model beside it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.closing.certificate_files import (
    CertificateFile,
    check_file,
    find_certificates,
    is_certificate_text,
    model_path_in,
    open_certificate,
)
from scbm.files import load_model
from scbm.model import InputError, Slug
from scbm.proofcheck import GoalRuns, RunsArgument, Situation, certificate_text
from support.closings import closing_of
from support.models import scan_cell

CELL = scan_cell()
((_, CERTIFICATE),) = closing_of(CELL).certificates


@pytest.mark.parametrize("model_file", ["cell.yaml", "../a b/ü.yaml", 'with "quotes".yaml', "back\\slash\\1.yaml"])
@pytest.mark.parametrize("name", ["scan_cell", "x"])
def test_a_certificate_is_read_as_it_was_written(tmp_path: Path, model_file: str, name: str) -> None:
    path = tmp_path / "certificate.json"
    certificate = replace(CERTIFICATE, model=name)
    path.write_text(certificate_text(certificate, model_file), encoding="utf-8")
    opened = open_certificate(path)
    assert opened.certificate == certificate
    assert str(opened.required_model_path()) == os.path.normpath(tmp_path / model_file)
    assert is_certificate_text(path.read_text(encoding="utf-8"))


def test_a_certificate_whose_model_file_is_no_text_names_no_model(tmp_path: Path) -> None:
    text = certificate_text(CERTIFICATE, "cell.yaml")
    assert model_path_in(text, tmp_path / "c.json") == tmp_path / "cell.yaml"
    assert model_path_in(text.replace("cell.yaml", r"\ud800.yaml"), tmp_path / "c.json") is None


def test_other_json_is_no_certificate() -> None:
    for text in ("", "{}", '{"format": "scbm-trace"}', '[{"scbm_certificate": 1, "model": "x"}]'):
        assert not is_certificate_text(text)


def test_a_file_that_names_no_model_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError) as raised:
        CertificateFile(CERTIFICATE, tmp_path / "x.json", None).required_model_path()
    assert raised.value.diagnostics[0].slug is Slug.MODEL_MISSING


def test_a_path_through_a_link_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "a" / "b")
    path = tmp_path / "link" / "x.json"
    path.write_text(certificate_text(CERTIFICATE, "../cell.yaml"), encoding="utf-8")
    assert open_certificate(path).required_model_path().resolve() == tmp_path / "a" / "cell.yaml"


@pytest.mark.parametrize("model_file", ["round.yaml", "../round.yaml/x.yaml", "a\0b.yaml"])
def test_a_name_that_leads_to_no_model_is_an_error_of_the_model(model_file: str, tmp_path: Path) -> None:
    (tmp_path / "round.yaml").symlink_to("round.yaml")
    path = tmp_path / "x.json"
    path.write_text(certificate_text(CERTIFICATE, model_file), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        load_model(open_certificate(path).required_model_path())
    assert raised.value.diagnostics[0].slug in {Slug.FILE_UNREADABLE, Slug.FILE_MISSING}


def test_files_are_found_below_directories(tmp_path: Path) -> None:
    for name in ("b/y.json", "b/x.json", "b/note.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    alone = tmp_path / "b" / "y.json"
    assert find_certificates([alone, tmp_path]) == (alone, tmp_path / "b" / "x.json")


def test_a_missing_file_and_a_directory_are_reported_as_such(tmp_path: Path) -> None:
    for path, slug in ((tmp_path / "x.json", Slug.FILE_MISSING), (tmp_path, Slug.FILE_IS_DIRECTORY)):
        with pytest.raises(InputError) as raised:
            open_certificate(path)
        assert raised.value.diagnostics[0].slug is slug


def test_another_version_of_the_model_is_not_looked_at() -> None:
    file = CertificateFile(CERTIFICATE, Path("x.json"), None)
    checked = check_file(file, scan_cell(("deadline: 10 seconds", "deadline: 9 seconds")))
    assert (checked.is_of_this_model, checked.is_sound, checked.flaws) == (False, False, ())
    checked = check_file(file, CELL)
    assert (checked.is_of_this_model, checked.is_sound) == (True, False)
    assert checked.flaws, "the hand-made certificate claims what is not so"


def test_situations_are_counted_of_all_goals() -> None:
    situation = Situation((), None, ())
    runs = replace(
        CERTIFICATE, argument=RunsArgument((), (GoalRuns("a", (situation,) * 2), GoalRuns("b", (situation,))))
    )
    assert check_file(CertificateFile(runs, Path("x.json"), None), scan_cell(("10 s", "9 s"))).situations == 3
    assert check_file(CertificateFile(CERTIFICATE, Path("x.json"), None), CELL).situations is None
