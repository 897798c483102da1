"""The directory that closing writes: it can be run and checked, and nothing of anyone else's is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.closing import Closing
from scbm.closing.closing_files import ClosingFiles, write_output
from scbm.files import load_model, read_case, write_model
from scbm.model import InputError, Slug
from scbm.testing import Tester, load_suite
from support.closings import closing_of
from support.models import SCAN_CELL, scan_cell
from support.wording import Wording

CELL = scan_cell()
SCANS = read_case("case: scans\ngoal: scanned\nexpect: {visits: [scan_box/completed]}\n", CELL)
FAILS = read_case("case: fails\ngoal: scanned\noutcomes: {scan: [fail]}\nexpect: {verdict: reached}\n", CELL)
BOTH = closing_of(CELL, [SCANS, FAILS])


@pytest.fixture
def model_file(tmp_path: Path) -> Path:
    path = tmp_path / "models" / "cell.yaml"
    path.parent.mkdir()
    path.write_text(write_model(CELL), encoding="utf-8")
    return path


def _texts(directory: Path) -> dict[str, str]:
    files = sorted(path for path in directory.rglob("*") if path.is_file())
    return {path.relative_to(directory).as_posix(): path.read_text(encoding="utf-8") for path in files}


def _write(closing: Closing, directory: Path, model_file: Path, suite: tuple[Path, ...] = ()) -> ClosingFiles:
    return write_output(closing, directory, model_file, suite)


def test_the_cases_can_be_run_as_they_are(tmp_path: Path, model_file: Path) -> None:
    output = _write(BOTH, tmp_path / "out", model_file)
    written = load_suite([tmp_path / "out"], CELL)
    assert {replace(case.case, recorded=None) for case in written} == {SCANS, FAILS}
    assert all(case.case.recorded is not None and case.case.recorded.goals for case in written)
    assert {case.path for case in written} == set(output.cases.values())
    for case in written:
        assert case.model_path is not None
        assert load_model(case.model_path) == CELL
        assert Tester(CELL).execute(case.case).verdict.passed


def test_a_case_says_what_it_adds(tmp_path: Path, model_file: Path) -> None:
    output = _write(BOTH, tmp_path / "out", model_file)
    assert output.cases["fails"].read_text(encoding="utf-8").startswith(
        "# closed by scbm: a case of scan_cell that adds\n"
        "#   scan_box: failed\n"
        "#   automatic/scan_failed\n"
        "case: fails\n"
        "model: ../../models/cell.yaml\n"
    )  # fmt: skip


def test_paths_are_seen_from_the_files(tmp_path: Path, model_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    output = _write(BOTH, Path("out"), model_file.relative_to(tmp_path))
    assert set(map(str, output.cases.values())) == {"out/cases/scans.yaml", "out/cases/fails.yaml"}
    assert str(output.certificates["structure"]) == "out/certificates/structure.json"
    texts = _texts(Path("out"))
    assert "model: ../../models/cell.yaml\n" in texts["cases/scans.yaml"]
    assert '\n"model_file": "../../models/cell.yaml",\n' in texts["certificates/structure.json"]


def test_the_same_closing_writes_the_same_bytes(tmp_path: Path, model_file: Path) -> None:
    out = tmp_path / "out"
    _write(BOTH, out, model_file)
    before = _texts(out)
    assert _write(BOTH, out, model_file).removed == ()
    assert _texts(out) == before


def test_what_an_earlier_closing_wrote_is_replaced_or_removed(tmp_path: Path, model_file: Path) -> None:
    out = tmp_path / "out"
    _write(BOTH, out, model_file)
    everything = closing_of(CELL, [FAILS], undecided=[str(d.obligation) for d in BOTH.decided])
    output = _write(everything, out, model_file)
    certificates = (out / "certificates" / f"structure.{suffix}" for suffix in ("json", "reasons"))
    assert set(output.removed) == {out / "cases" / "scans.yaml", *certificates}
    assert list(_texts(out)) == ["cases/fails.yaml"]
    assert "scan_box: executing, failed, completed, queued" in _texts(out)["cases/fails.yaml"]


def test_what_others_wrote_stays(tmp_path: Path, model_file: Path) -> None:
    out = tmp_path / "out"
    mine = {"cases/mine.yaml": "case: mine\ngoal: scanned\n", "cases/notes.txt": "# closed by scbm: no case\n",
            "certificates/mine.json": "{}\n", "top.yaml": "# closed by scbm: elsewhere\ncase: x\n"}  # fmt: skip
    for name, text in mine.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text, encoding="utf-8")
    assert _write(BOTH, out, model_file).removed == ()
    assert mine.items() <= _texts(out).items()


@pytest.mark.parametrize(
    ("name", "text"),
    [("cases/fails.yaml", "case: fails\ngoal: scanned\n"), ("certificates/structure.json", "{}"), ("cases", "")],
)
def test_a_file_of_the_same_name_is_an_error_and_nothing_is_written(
    tmp_path: Path, model_file: Path, name: str, text: str
) -> None:
    out = tmp_path / "out"
    (out / name).parent.mkdir(parents=True)
    (out / name).write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        _write(BOTH, out, model_file)
    assert str(raised.value).startswith(f"{out}/")
    assert "error[bad-option]" in str(raised.value)
    assert _texts(out) == {name: text}


def test_what_closing_wrote_for_another_model_stays(tmp_path: Path, model_file: Path, wording: Wording) -> None:
    out, other = tmp_path / "out", model_file.with_name("other.yaml")
    other.write_text(SCAN_CELL, encoding="utf-8")
    _write(BOTH, out, model_file)
    before = _texts(out)
    nothing = closing_of(CELL, undecided=[str(decided.obligation) for decided in BOTH.decided])
    assert _write(nothing, out, other).removed == ()
    with pytest.raises(InputError) as raised:
        _write(BOTH, out, other)
    assert [diagnostic.slug for diagnostic in raised.value.diagnostics] == [Slug.BAD_OPTION] * 3
    wording(raised.value)
    assert _texts(out) == before
    link = tmp_path / "link.yaml"
    link.symlink_to(model_file)
    assert len(_write(nothing, out, link).removed) == 4, "it is the same model"


def test_a_directory_of_the_same_name_is_an_error(tmp_path: Path, model_file: Path, wording: Wording) -> None:
    (tmp_path / "out" / "cases" / "fails.yaml").mkdir(parents=True)
    with wording.raises(InputError):
        _write(BOTH, tmp_path / "out", model_file)


def test_the_files_of_the_suite_are_kept(tmp_path: Path, model_file: Path, wording: Wording) -> None:
    """Closing again from what it wrote must not lose it."""
    out = tmp_path / "out"
    files = tuple(_write(BOTH, out, model_file).cases.values())
    before = _texts(out)
    again = closing_of(CELL, suite=[SCANS, FAILS])
    output = _write(again, out, model_file, files)
    assert (output.cases, output.removed) == ({}, ())
    assert _texts(out).items() >= {k: v for k, v in before.items() if k.startswith("cases/")}.items()
    with wording.raises(InputError):
        _write(closing_of(CELL, [FAILS]), out, model_file, files)


def test_a_closing_with_nothing_to_write_makes_no_directory(tmp_path: Path, model_file: Path) -> None:
    names = [str(decided.obligation) for decided in BOTH.decided]
    output = _write(closing_of(CELL, undecided=names), tmp_path / "out", model_file)
    assert (output.cases, output.certificates) == ({}, {})
    assert not (tmp_path / "out").exists()


def test_a_directory_that_cannot_be_written_is_an_error(
    tmp_path: Path, model_file: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "replace", refuse)
    with wording.raises(InputError):
        _write(BOTH, tmp_path / "out", model_file)
