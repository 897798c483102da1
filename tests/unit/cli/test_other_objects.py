"""`test --store`, `combine` and `report` with a lifted model under several lists of objects (decision 55)."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from scbm.store import read_history
from support.wording import Wording, diagnostic_heads, paragraphs

if TYPE_CHECKING:
    from conftest import Ran

    Scbm = Callable[..., Ran]

TEXT = """behavior_model: doors
types: {door: [d1], side: [left]}
variables:
  open[door]: {domain: bool, initial: false}
operations:
  open_it[d in door]: {pre: {g: open.d == false}, post: {g: true, a: [open.d <- true]}}
goals:
  entered: open.d1 == true
"""
GROWN = TEXT.replace("[d1]", "[d1, d2]").replace("open.d1 == true", "open.d1 == false")
UNITED = "for door: [d1, d2] alone 0.00 %, 0 of 5; united with 1 case for door: [d1]"
LIFTED = "Lifted: 40.00 %, 2 of 5"


@pytest.fixture
def store(tmp_path: Path, scbm: Scbm) -> Path:
    """Return a store with a case that opens a door, and after a change of the doors one that does nothing."""
    (tmp_path / "doors.yaml").write_text(TEXT)
    path = tmp_path / "cov.db"
    assert scbm("test", tmp_path / "doors.yaml", "--cases", 1, "--store", path).code == 0
    (tmp_path / "doors.yaml").write_text(GROWN)
    ran = scbm("test", tmp_path / "doors.yaml", "--cases", 1, "--store", path)
    assert ran.code == 0
    lines = [line.strip() for line in ran.out.splitlines()]
    assert lines[-3].endswith("cov.db: 1 case in all, 0.00 %")
    assert lines[-2].startswith(f"{LIFTED}: ")
    assert lines[-1] == UNITED
    return path


def test_a_first_run_with_these_objects_says_so(store: Path, scbm: Scbm, wording: Wording) -> None:
    (store.parent / "doors.yaml").write_text(GROWN.replace("[d1, d2]", "[d1, d2, d3]"))
    ran = scbm("test", store.parent / "doors.yaml", "--cases", 1, "--store", store)
    assert ran.code == 0
    wording(paragraphs(ran.out, "Since the last run", "Lifted: "))


def _lifted(ran: Ran) -> Any:  # noqa: ANN401 - as `json.loads`
    return json.loads(ran.out)["lifted"]


def test_a_report_says_from_which_objects_the_lifted_figure_comes(store: Path, scbm: Scbm, wording: Wording) -> None:
    for option in ([], ["--missing"]):
        out = scbm("report", store, *option).out
        assert "SCBM-IAS: 0.00 %" in out
        (lifted,) = paragraphs(out, LIFTED)
        assert lifted.endswith(UNITED)
        wording(lifted)
    lifted = _lifted(scbm("report", store, "--json"))
    assert (lifted["visited"], lifted["alone"]) == (2, {"visited": 0, "of": 5, "percent": 0.0})
    assert lifted["united_with"] == [{"objects": {"door": ["d1"], "side": ["left"]}, "cases": 1}]
    elsewhere = [each["name"] for each in lifted["obligations"] if each["visited_elsewhere"]]
    assert elsewhere == ["open_it/executing", "open_it/completed", "open_it/queued"]


def test_every_format_says_it(store: Path, scbm: Scbm, tmp_path: Path) -> None:
    files = {name: tmp_path / name for name in ("markdown", "html", "junit", "cobertura", "badge")}
    assert scbm("report", store, *(word for name, path in files.items() for word in (f"--{name}", path))).code == 0
    texts = {name: path.read_text() for name, path in files.items()}
    assert UNITED.replace("[", "\\[").replace("]", "\\]") in texts["markdown"]
    assert f"Lifted {UNITED}." in texts["html"]
    assert f'name="lifted_from" value="{UNITED}"' in texts["junit"]
    assert f"<!-- {LIFTED}; {UNITED} -->" in texts["cobertura"]
    assert "40.00 % lifted" in texts["badge"]


def test_a_threshold_of_a_report_is_about_all_objects_and_that_of_a_test_about_its_run(
    store: Path, scbm: Scbm, wording: Wording
) -> None:
    assert scbm("report", store, "--fail-under", "lifted=40").code == 0
    ran = scbm("report", store, "--fail-under", "lifted=41")
    assert (ran.code, UNITED in ran.err) == (1, True)
    wording(ran.err)
    ran = scbm("test", store.parent / "doors.yaml", "--cases", 1, "--store", store, "--fail-under", "lifted=1")
    assert ran.code == 1
    wording(ran.err)


def test_combined_stores_say_it_too(tmp_path: Path, scbm: Scbm, wording: Wording) -> None:
    model, stores = tmp_path / "doors.yaml", [tmp_path / "1.db", tmp_path / "2.db"]
    for text, store in zip((TEXT, GROWN), stores, strict=True):
        model.write_text(text)
        assert scbm("test", model, "--cases", 1, "--store", store).code == 0
    ran = scbm("combine", *stores, "-o", tmp_path / "all.db")
    assert ran.code == 0
    lines = ran.out.splitlines()
    wording(lines[0])
    assert lines[-1].strip() == UNITED
    data = scbm("combine", *stores, "-o", tmp_path / "all.db", "--json")
    assert _lifted(data)["united_with"] == _lifted(scbm("report", tmp_path / "all.db", "--json"))["united_with"]


@pytest.mark.slow
def test_proofs_and_results_of_mutants_count_for_their_own_objects(store: Path, scbm: Scbm) -> None:
    model = store.parent / "doors.yaml"
    closed = store.parent / "closed"
    assert scbm("close", model, "--out", closed).code == 0
    certified = ["--certificates", closed, "--store", store]
    assert scbm("test", model, "--cases", 1, *certified).code == 0
    assert scbm("mutate", model, "--cases", 1, "--store", store).code == 0
    counts = _lifted(scbm("report", store, "--json"))["counts"]
    assert (counts["covered"], counts["uncoverable"]) == (2, 3)
    assert len(read_history(store).certificates) == 2
    model.write_text(TEXT)
    assert scbm("test", model, "--cases", 1, "--store", store).code == 0
    history = read_history(store)
    assert (history.certificates, history.mutations) == ((), ())
    assert _lifted(scbm("report", store, "--json"))["counts"]["uncoverable"] == 0
    combined = store.parent / "all.db"
    assert scbm("combine", store, "-o", combined).code == 0
    model.write_text(GROWN)
    assert scbm("test", model, "--cases", 1, "--store", combined).code == 0
    history = read_history(combined)
    assert (len(history.certificates), len(history.mutations)) == (2, 1)


def test_mutants_under_other_objects_do_not_change_the_current_model(store: Path, scbm: Scbm) -> None:
    model = store.parent / "doors.yaml"
    model.write_text(TEXT)
    assert scbm("mutate", model, "--cases", 1, "--store", store).code == 0
    assert UNITED in scbm("report", store).out
    assert read_history(store).mutations == ()


def test_a_waiver_for_all_instances_is_named_once_also_in_a_report_of_the_store(
    tmp_path: Path, scbm: Scbm, wording: Wording
) -> None:
    model, waivers, store = tmp_path / "doors.yaml", tmp_path / "waivers.yaml", tmp_path / "cov.db"
    model.write_text(TEXT.replace("[d1]", "[d1, d2]").replace("open.d1 == true", "open.d1 == true && open.d2 == true"))
    words = "reason: no reason, author: Ada, date: 2026-11-20"
    waivers.write_text(
        "waivers_of: doors\nwaivers:\n"
        f"  - {{obligation: open_it/executing, {words}}}\n"
        f"  - {{obligation: 'open_it[d in door]/failed', where: d == d1 && d == d2, {words}}}\n"
        f"  - {{obligation: open_it/queued, {words}, expires: 2026-11-20}}\n"
    )
    for verb in (("test", model, "--cases", 1, "--waivers", waivers, "--store", store), ("report", store)):
        wording(paragraphs(scbm(*verb).out, "Waived by", "Expired"))
    ran = scbm("report", store, "--waivers", waivers)
    assert f"{waivers}:4:18: warning[no-instance]" in diagnostic_heads(ran.err)
    assert ran.err.count("already") == 2
    wording(ran.err)
