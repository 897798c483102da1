"""How a console begins: its first text, and what is refused before anything is served."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from msgspec.json import decode
from starlette.testclient import TestClient

from scbm.files import load_model, read_case
from scbm.testing import RandomCases, Tester
from support.consoles import CELL
from support.wording import diagnostic_heads

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Ran
    from support.wording import Wording

    Scbm = Callable[..., Ran]


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "cell.yaml"
    path.write_text(CELL, encoding="utf-8")
    return path


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What the pages of served consoles begin with."""
    found: list[dict[str, Any]] = []

    def serve(server: Any, sockets: list[socket.socket]) -> None:  # noqa: ANN401 - a server of uvicorn
        port = sockets[0].getsockname()[1]
        client = TestClient(server.config.app, base_url=f"http://127.0.0.1:{port}")
        found.append(decode(client.post("/begin", content=b"{}", headers={"X-Scbm-Token": "token"}).content))
        raise KeyboardInterrupt

    monkeypatch.setattr("uvicorn.Server.run", serve)
    monkeypatch.setattr("secrets.token_urlsafe", lambda _: "token")
    return found


def test_the_first_case_is_nominal_and_ctrl_c_is_no_failure(
    scbm: Scbm, model: Path, begun: list[dict[str, Any]]
) -> None:
    ran = scbm("console", model)
    assert ran.code == 0
    assert ran.out.startswith("Open http://127.0.0.1:")
    assert begun[0]["text"] == "case: my_case\nmodel: ../cell.yaml\ngoal: gripped\n"


def test_a_case_file_is_kept_as_it_is(scbm: Scbm, model: Path, begun: list[dict[str, Any]]) -> None:
    text = "# mine\ncase: mine\nmodel: cell.yaml\ngoal: gripped\n"
    (model.parent / "mine.yaml").write_text(text, encoding="utf-8")
    assert scbm("console", model, model.parent / "mine.yaml").code == 0
    assert begun[0]["text"] == text


@pytest.mark.parametrize("from_file", [False, True])
def test_a_random_case_is_closed(scbm: Scbm, model: Path, begun: list[dict[str, Any]], *, from_file: bool) -> None:
    loaded = load_model(model)
    drawn = Tester(loaded).execute(RandomCases(loaded).case(3, 2))
    if from_file:
        text = f"case: x\ngoal: {drawn.case.predicate}\ndrawn: {{seed: 3, case: 2}}\n"
        (model.parent / "x.yaml").write_text(text, encoding="utf-8")
    arguments = [model.parent / "x.yaml"] if from_file else ["--seed", 3, "--case", 2]
    assert scbm("console", model, *arguments).code == 0
    case = read_case(begun[0]["text"], loaded)
    assert case.origin is None
    if not from_file:
        assert Tester(loaded).execute(case).digest == drawn.digest


def test_the_page_knows_what_a_store_has(scbm: Scbm, model: Path, begun: list[dict[str, Any]]) -> None:
    store = model.parent / "cov.db"
    assert scbm("test", model, "--cases", 2, "--store", store, "--no-shrink").code in (0, 1)
    assert scbm("console", model, "--store", store).code == 0
    assert begun[0]["has_store"]
    assert "grip/executing" in begun[0]["stored"]


def test_wrong_input_is_refused(scbm: Scbm, model: Path, begun: list[dict[str, Any]]) -> None:
    (model.parent / "other.yaml").write_text("case: a\nmodel: ../elsewhere.yaml\ngoal: gripped\n", encoding="utf-8")
    (model.parent / "broken.yaml").write_bytes(b"case: \xff\n")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        wrong = [
            (model.parent / "other.yaml",),
            (model.parent / "broken.yaml",),
            (model.parent / "other.yaml", "--seed", 1),
            ("--port", taken.getsockname()[1]),
            ("--store", model.parent / "none.db"),
        ]
        ran = [scbm("console", model, *arguments) for arguments in wrong]
    assert [each.code for each in ran] == [2] * len(wrong)
    heads = [head.rpartition("/")[2] for each in ran for head in diagnostic_heads(each.err)]
    assert heads == [
        "other.yaml: error[contradiction]",
        "--case: error[bad-option]",
        "--port: error[bad-option]",
        "none.db: error[file-missing]",
    ]
    assert not begun


def test_without_the_extra_one_sentence_names_it(
    scbm: Scbm, model: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "uvicorn", None)
    wording(scbm("console", model).err)
