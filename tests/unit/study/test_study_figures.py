"""The figures, decisions, files, report and plots of the study, for small kill matrices made by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

pytestmark = pytest.mark.peer
pytest.importorskip("scipy")
pytest.importorskip("matplotlib")

import run  # noqa: E402 - only where scipy and matplotlib are installed
from hypotheses import HYPOTHESES, RIVALS, Decision, decisions  # noqa: E402
from kill_matrix import CaseFacts, KillMatrix, MutantRow  # noqa: E402
from matrix_files import path_of, read_matrix, write_matrix  # noqa: E402
from model_figures import ModelFigures, model_figures  # noqa: E402
from plots import write_plots  # noqa: E402
from predictors import PREDICTORS, SCBM_IAS  # noqa: E402
from study_report import StudyResults, report  # noqa: E402
from subjects import CONTROL, GENERATED, WRITTEN  # noqa: E402

from support.wording import Wording  # noqa: E402

OBLIGATIONS = tuple(f"op{number}/{state}" for number in range(8) for state in ("failed", "completed"))
CASES, CLOSED = 40, 2


def matrix(seed: int, group: str = WRITTEN) -> KillMatrix:
    """Return a kill matrix in which a case finds a mutant if it visits the obligation of that mutant."""
    random = Random(seed)
    visits = [sum(1 << random.randrange(16) for _ in range(2)) & 0xFFFF for _ in range(CASES)] + [0xFF, 0xFF00]
    facts = tuple(CaseFacts(random.randint(1, 9), each, random.randrange(8), each**2, each**3) for each in visits)
    finds = [sum(1 << number for number, each in enumerate(visits) if each >> bit & 1) for bit in range(16)]
    rows = [MutantRow(f"m{bit}", "guard-drop", (each, 0, 0, each)) for bit, each in enumerate(finds)]
    cleaned = MutantRow("clean-up", "clean-up-drop", (finds[0], 0, finds[0], finds[0]))
    return KillMatrix(
        f"model-{seed}",
        group,
        f"{seed:064x}",
        OBLIGATIONS,
        8,
        facts[:CASES],
        facts[CASES:],
        (*rows, cleaned),
        3,
        50,
        1.5,
    )


def figures(seed: int, group: str = WRITTEN) -> ModelFigures:
    return model_figures(matrix(seed, group), 10)


MODELS = tuple(figures(seed, WRITTEN if seed % 2 else GENERATED) for seed in range(4))


def decided(models: tuple[ModelFigures, ...]) -> dict[str, Decision]:
    return {decision.hypothesis.name: decision for decision in decisions(models, 200)}


def test_coverage_that_decides_what_is_found_predicts_it() -> None:
    for model in MODELS:
        assert model.tau is not None
        assert model.tau > 0.85
        assert set(model.by_cases) == set(model.by_requests) >= set(PREDICTORS)


def test_shares_are_of_what_the_pool_shows() -> None:
    model = MODELS[1]
    shown = [row for row in model.matrix.mutants if row.found[0] & ((1 << CASES) - 1)]
    assert (model.shares[0], model.shares[3]) == (1, 1)
    assert model.shares[2] == pytest.approx(1 / len(shown))
    assert model.clean_up_shares == pytest.approx((1, 0, 1, 1))
    assert model.closed == 1  # both closed cases together visit everything


def test_weights_of_operators_change_the_shares_of_oracles() -> None:
    kept = matrix(1)
    shown = [row for row in kept.mutants if row.found[0] & ((1 << CASES) - 1)]
    one, weighted = (model_figures(kept, 10, "", {"guard-drop": weight, "clean-up-drop": 1.0}) for weight in (1.0, 3.0))
    assert one.weighted_shares == pytest.approx(one.shares)
    assert weighted.shares == pytest.approx(one.shares)
    assert weighted.weighted_shares[2] == pytest.approx(1 / (3 * (len(shown) - 1) + 1))
    assert weighted.clean_up_parts == pytest.approx((1 / 17, 1 / (3 * 16 + 1)))
    assert model_figures(kept, 10).weighted_shares == (None,) * 4


def test_chosen_and_completed_suites_find_more() -> None:
    for model in MODELS:
        assert model.chosen is not None
        assert model.completed is not None
        assert min(model.chosen, model.completed) > 0.7
        assert model.found["completed"] == pytest.approx([1.0] * 5)


def test_a_hypothesis_needs_its_thresholds_and_its_p_value(wording: Wording) -> None:
    strong = decided(MODELS)
    assert [name for name, decision in strong.items() if not decision.missed] == ["H1", "H2", "H4", "H5", "H6", "H7"]
    weak = tuple(replace(model, chosen=0.6, shares=(1.0, 0.5, 0.5, 0.7)) for model in MODELS)
    assert decided(weak)["H4"].missed == ("the median is 0.60",)
    missed = decided(weak)["H7"].missed
    wording(missed[:2])
    assert "corrected p-value" in missed[2]


def test_coverage_has_to_be_better_than_each_rival(wording: Wording) -> None:
    low = dict.fromkeys(PREDICTORS, (0.2,) * 5) | {SCBM_IAS: (0.9,) * 5}

    def against(**taus: tuple[float | None, ...]) -> Decision:
        by_requests = low | {RIVALS[3]: taus["rival"]}
        return decided(tuple(replace(model, by_cases=low, by_requests=by_requests) for model in MODELS))["H3"]

    assert against(rival=(0.2,) * 5).missed == ()
    equal = against(rival=(0.9,) * 5)
    assert equal.weakest[0].startswith(f"{RIVALS[3]}, ")
    (few,) = against(rival=(None,) * 5).missed
    wording((equal.weakest[0], equal.missed[0], few))


def test_files_keep_kill_matrices_and_have_the_same_bytes(tmp_path: Path) -> None:
    kept = replace(matrix(1), left="it has only 5 mutants that are not equivalent")
    paths = [path_of(name, tmp_path) for name in ("one", "two")]
    for path in paths:
        write_matrix(kept, path)
    assert read_matrix(paths[0]) == kept
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_the_report_has_each_hypothesis_and_each_model(wording: Wording) -> None:
    left = replace(matrix(9), left="a random case takes more than 2 s")
    text = report(StudyResults((*MODELS, figures(7, CONTROL)), (left,), 10, 200))
    assert [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| H") and "p (" not in line][
        :7
    ] == [hypothesis.name for hypothesis in HYPOTHESES]
    wording(line for line in text.splitlines() if line.startswith(("- `model-9`", "## ")))
    for model in MODELS:
        assert f"| {model.matrix.name} | {model.matrix.group} | 8 | 16 | 40 | 2 | 17 | 3 | 50 |" in text
        assert model.matrix.digest in text


def test_plots_have_the_same_bytes_and_no_date(tmp_path: Path) -> None:
    folders = [tmp_path / "one", tmp_path / "two"]
    for folder in folders:
        folder.mkdir()
        write_plots(MODELS, 200, folder)
    for name in ("tau.svg", "found.svg", "oracles.svg"):
        first, second = ((folder / name).read_bytes() for folder in folders)
        assert first == second
        assert b"<dc:date>" not in first


def test_a_second_run_reads_what_the_first_one_wrote(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("espresso_machine", "generated-2")
    run.run(names, tmp_path, 1, smoke=True)
    first = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert set(first) == {*(f"{name}.json.gz" for name in names), "report.md", "tau.svg", "found.svg", "oracles.svg"}
    monkeypatch.setattr(run, "kill_matrix", None)  # workers are forks, so they would fail to run a model
    run.run(names, tmp_path, 1, smoke=True)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == first


def test_a_model_that_has_changed_is_named(tmp_path: Path, capfd: pytest.CaptureFixture[str], wording: Wording) -> None:
    write_matrix(replace(matrix(1), name="generated-2"), path_of("generated-2", tmp_path))
    run.run(("generated-2",), tmp_path, 1, smoke=True)
    wording(line for line in capfd.readouterr().out.splitlines() if line.startswith("generated-2: "))
