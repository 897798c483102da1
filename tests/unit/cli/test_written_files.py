"""No command destroys what it reads, and a full disk is no fault of scbm."""

import os
from collections.abc import Callable
from pathlib import Path
from shutil import copyfile

import pytest

from conftest import ROOT, Ran
from scbm.reports.formats import FORMATS
from support.limits import largest_file
from support.wording import Wording, diagnostic_heads

Scbm = Callable[..., Ran]
MODEL = ROOT / "examples/robot_in_the_air/after.yaml"
CASE = ROOT / "examples/robot_in_the_air/cases/delivery_against_all_odds.yaml"
_NAMES = ("model", "symbolic", "hard", "spelled")


@pytest.fixture
def inputs(tmp_path: Path) -> dict[str, Path]:
    """A model and a case, and other names of each."""
    model, case = tmp_path / "after.yaml", tmp_path / "case.yaml"
    copyfile(MODEL, model)
    case.write_text(CASE.read_text(encoding="utf-8").replace("../after.yaml", "after.yaml"), encoding="utf-8")
    (tmp_path / "symbolic.yaml").symlink_to(model)
    (tmp_path / "hard.yaml").hardlink_to(model)
    (tmp_path / "sub").mkdir()
    return {
        "model": model,
        "case": case,
        "symbolic": tmp_path / "symbolic.yaml",
        "hard": tmp_path / "hard.yaml",
        "spelled": tmp_path / "sub/../after.yaml",
    }


@pytest.mark.parametrize("name", _NAMES)
def test_a_trace_is_not_written_over_the_model(name: str, inputs: dict[str, Path], scbm: Scbm) -> None:
    before = inputs["model"].read_bytes()
    ran = scbm("run", inputs["model"], "--goal", "item_a_delivered", "--trace", inputs[name])
    assert (ran.code, ran.out, diagnostic_heads(ran.err)) == (2, "", ["--trace: error[bad-option]"])
    assert inputs["model"].read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "target"),
    [
        (("replay", "{case}", "--trace", "{case}"), "case"),
        (("replay", "{case}", "--trace", "{model}"), "model"),
        (("trace", "{case}", "--perfetto", "{case}"), "case"),
        (("trace", "{case}", "--mcap", "{model}"), "model"),
        (("trace", "{model}", "--case", "1", "--perfetto", "{hard}"), "model"),
        (("test", "{model}", "--cases", "1", "--store", "{symbolic}"), "model"),
        (("test", "{model}", "{case}", "--store", "{case}"), "case"),
    ],
)
def test_no_option_that_writes_destroys_an_input(
    arguments: tuple[str, ...], target: str, inputs: dict[str, Path], scbm: Scbm, wording: Wording
) -> None:
    before = inputs[target].read_bytes()
    ran = scbm(*(argument.format(**inputs) for argument in arguments))
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{arguments[-2]}: error[bad-option]"])
    wording(ran.err)
    assert inputs[target].read_bytes() == before


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "{cell}", "--goal", "open", "--trace", "{door}"),
        ("run", "{cell}", "--goal", "open", "--trace", "{lamp}"),
        ("trace", "{cell}", "--case", "1", "--perfetto", "{lamp}"),
        ("mutate", "{cell}", "--cases", "1", "--sarif", "{door}"),
        ("test", "{cell}", "--cases", "1", "--waivers", "{waivers}", "--store", "{lamp}"),
        ("test", "{cell}", "--cases", "1", "--waivers", "{waivers}", "--store", "{waivers}"),
    ],
)
def test_no_option_that_writes_destroys_a_file_that_the_model_uses(
    arguments: tuple[str, ...], tmp_path: Path, scbm: Scbm
) -> None:
    texts = {
        "cell": "behavior_model: cell\nparts: {door: {use: door.yaml}}\ngoals: {open: door.is_open == true}\n",
        "door": "part: door\ninclude: lamp.yaml\nvariables: {is_open: {domain: bool, initial: false}}\n"
        "operations: {unlock: {pre: {g: is_open == false, a: [is_open <- true]}, post: {g: 'true'}}}\n",
        "lamp": "part: lamp\nvariables: {is_lit: {domain: bool, initial: false}}\n",
        "waivers": "waivers_of: cell\nwaivers:\n"
        "- {obligation: door.unlock/failed, reason: none fails, author: A. Smith, date: 2026-01-01}\n",
    }
    paths = {name: tmp_path / f"{name}.yaml" for name in texts}
    for name, text in texts.items():
        paths[name].write_text(text, encoding="utf-8")
    assert scbm("check", paths["cell"]).code == 0
    ran = scbm(*(argument.format(**paths) for argument in arguments))
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{arguments[-2]}: error[bad-option]"])
    assert {name: path.read_text(encoding="utf-8") for name, path in paths.items()} == texts


def _fails(*_: object, **__: object) -> None:
    pytest.fail("the work began before its outputs were checked")


_UNWRITABLE: list[tuple[tuple[str, ...], list[str]]] = [
    (("close", "{model}", "--out", "{model}", "--write", "all"), ["--out"]),
    (("close", "{model}", "--out", "{taken}"), ["--out"]),
    (("test", "{model}", "--cases", "1", "--save", "{model}", "--store", "{case}"), ["--save"]),
    (("test", "{model}", "--cases", "1", "--save", "{model}/cases", "--store", "{hard}"), ["--store", "--save"]),
    (("test", "{model}", "{case}", "--transport", "loopback", "--logs", "{case}"), ["--logs"]),
    (("mutate", "{model}", "{case}", "--html", "{sub}", "--witnesses", "{case}/x"), ["--html", "--witnesses"]),
    (("run", "{model}", "--goal", "item_a_delivered", "--trace", "{missing}/t"), ["--trace"]),
    (("replay", "{case}", "--trace", "{sub}"), ["--trace"]),
    (("trace", "{case}", "--perfetto", "{sub}", "--mcap", "{missing}/t"), ["--perfetto", "--mcap"]),
]


@pytest.mark.parametrize(("arguments", "options"), _UNWRITABLE, ids=lambda each: " ".join(each[::2]))
def test_all_outputs_that_cannot_be_written_are_refused_before_the_work(
    arguments: tuple[str, ...],
    options: list[str],
    inputs: dict[str, Path],
    scbm: Scbm,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("scbm.testing.Tester.execute", _fails)
    monkeypatch.setattr("scbm.cli.verbs.close.Closer.close", _fails)
    folder = inputs["model"].parent
    (folder / "taken").mkdir()
    (folder / "taken" / "certificates").touch()
    paths = inputs | {"sub": folder / "sub", "missing": folder / "missing", "taken": folder / "taken"}
    ran = scbm(*(argument.format(**paths) for argument in arguments))
    assert (ran.code, ran.out) == (2, "")
    assert diagnostic_heads(ran.err) == [f"{option}: error[bad-option]" for option in options]
    assert not (folder / "missing").exists()


def test_all_outputs_of_a_report_that_cannot_be_written_are_refused_before_it(
    inputs: dict[str, Path], tmp_path: Path, scbm: Scbm, wording: Wording
) -> None:
    store, sub = tmp_path / "s.db", tmp_path / "sub"
    assert scbm("test", inputs["model"], "--cases", 1, "--store", store, "--failures", tmp_path / "f").code == 0
    outputs = ("--html", sub, "--lcov", tmp_path / "missing/x", "--minimize", "--save", inputs["model"])
    ran = scbm("report", store, *outputs)
    assert (ran.code, ran.out) == (2, "")
    wording(ran.err)


@pytest.mark.parametrize("option", ["--out", "--write"])
def test_what_closing_may_not_write_is_refused_before_it(
    option: str, inputs: dict[str, Path], tmp_path: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scbm.cli.verbs.close.Closer.close", _fails)
    monkeypatch.setattr("scbm.files.file_writer.os.access", lambda _, mode: mode != os.W_OK)
    ran = scbm("close", inputs["model"], option, tmp_path / "new" / "out" if option == "--out" else "all")
    assert (ran.code, ran.out, diagnostic_heads(ran.err)) == (2, "", [f"{option}: error[bad-option]"])
    assert "permission denied" in ran.err


@pytest.mark.slow
def test_a_report_is_not_written_over_the_store(inputs: dict[str, Path], tmp_path: Path, scbm: Scbm) -> None:
    store = tmp_path / "s.db"
    assert scbm("test", inputs["model"], "--cases", 1, "--store", store, "--failures", tmp_path / "f").code == 0
    before = store.read_bytes()
    for name in FORMATS:
        assert scbm("report", store, f"--{name}", store).code == 2
        assert scbm("report", store, f"--{name}", inputs["hard"]).code == 2
    assert store.read_bytes() == before


def test_saved_cases_do_not_replace_the_model_that_has_the_name_of_one(tmp_path: Path, scbm: Scbm) -> None:
    model = tmp_path / "seed-0-case-1.yaml"
    copyfile(MODEL, model)
    before = model.read_bytes()
    ran = scbm("test", model, "--cases", 1, "--save", tmp_path)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{model}: error[bad-option]"])
    assert model.read_bytes() == before


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "{model}", "--goal", "item_a_delivered", "--trace", "{out}/trace.jsonl"),
        ("trace", "{model}", "--case", "1", "--perfetto", "{out}/run.json"),
        ("test", "{model}", "--cases", "2", "--save", "{out}"),
        pytest.param(("close", "{model}", "--out", "{out}"), marks=pytest.mark.slow),
        ("test", "{model}", "--cases", "2", "--store", "{out}/store.db"),
    ],
)
def test_a_full_disk_is_a_located_error_and_leaves_nothing_cut_off(
    arguments: tuple[str, ...], inputs: dict[str, Path], tmp_path: Path, scbm: Scbm
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    with largest_file(200):
        ran = scbm(*(argument.format(out=out, **inputs) for argument in arguments))
    assert (ran.code, "Traceback" in ran.err, "error[" in ran.err) == (2, False, True)
    assert [path for path in out.rglob("*") if path.is_file()] == []


@pytest.mark.longer
@pytest.mark.parametrize("size", [0, 512, 4_096, 40_000])
@pytest.mark.parametrize(
    "arguments",
    [
        ("test", "{model}", "--cases", "9", "--store", "{out}/new.db", "--failures", "{out}"),
        pytest.param(
            ("mutate", "{model}", "--cases", "1", "--no-equivalence", "--store", "{out}/new.db"), marks=pytest.mark.slow
        ),
        ("combine", "{store}", "-o", "{out}/new.db"),
    ],
    ids=lambda each: each[0],
)
def test_a_full_disk_leaves_no_new_store_that_is_empty(
    arguments: tuple[str, ...], size: int, inputs: dict[str, Path], tmp_path: Path, scbm: Scbm
) -> None:
    store, out = tmp_path / "filled.db", tmp_path / "out"
    assert scbm("test", inputs["model"], "--cases", 1, "--store", store, "--failures", tmp_path / "f").code == 0
    out.mkdir()
    with largest_file(size):
        ran = scbm(*(argument.format(out=out, store=store, **inputs) for argument in arguments))
    assert (ran.code, "Traceback" in ran.err, "error[" in ran.err) == (2, False, True)
    assert list(out.iterdir()) == []


def test_an_export_replaces_its_own_files_alone(
    inputs: dict[str, Path], tmp_path: Path, scbm: Scbm, wording: Wording
) -> None:
    out = tmp_path / "pddl"
    export = ("export", "pddl", inputs["model"], "--out", out, "--goal")
    assert scbm(*export, "item_a_scanned").code == 0
    exported = (out / "domain.pddl").read_text(encoding="utf-8")
    (out / "domain.pddl").write_text(f"{exported.splitlines()[0]}\n(define (domain earlier))", encoding="utf-8")
    assert scbm(*export, "item_a_delivered").code == 0
    assert (out / "domain.pddl").read_text(encoding="utf-8") == exported
    (out / "domain.pddl").write_text("(define (domain written-by-hand))", encoding="utf-8")
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    ran = scbm(*export, "item_a_gripped")
    assert (ran.code, ran.out, diagnostic_heads(ran.err)) == (2, "", [f"{out / 'domain.pddl'}: error[bad-option]"])
    wording(ran.err)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
