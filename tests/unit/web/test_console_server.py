"""The server of a console: what it refuses, its headers, and what it saves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from msgspec.json import decode

from scbm.files import load_model, read_case
from scbm.testing import Tester
from scbm.web.console_server import ASSETS, MAX_BODY
from support.consoles import CELL, PORT, ConsoleClient, near_console

if TYPE_CHECKING:
    from support.wording import Wording

TEXT = "case: a\nmodel: elsewhere.yaml\ngoal: gripped\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cell.yaml").write_text(CELL, encoding="utf-8")
    return tmp_path


@pytest.fixture
def client(folder: Path) -> ConsoleClient:
    return near_console(folder / "cell.yaml", folder / "cases")


@pytest.mark.parametrize("path", ASSETS)
def test_the_page_loads_nothing_from_elsewhere(client: ConsoleClient, path: str) -> None:
    response = client.http.get(f"/{path}")
    assert response.status_code == 200
    policy = response.headers["content-security-policy"].split("; ")
    assert policy == [
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "connect-src 'self'",
        "img-src data:",
        "frame-ancestors 'none'",
    ]
    assert "https:" not in response.text.replace("https://www.w3.org", "")


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"X-Scbm-Token": "wrong"}, 403),
        ({"X-Scbm-Token": ""}, 403),
        ({"Host": "evil.example"}, 403),
        ({"Host": f"127.0.0.1:{PORT + 1}"}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": f"http://127.0.0.1:{PORT}"}, 200),
    ],
)
def test_only_the_own_page_is_answered(client: ConsoleClient, headers: dict[str, str], status: int) -> None:
    response = client.post("facts", b"{}", **headers)
    assert response.status_code == status
    assert ("refused" in response.json()) == (status != 200)


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 400),
        (b"[]", 400),
        (b'{"text": 1}', 400),
        (b'{"text": "\xff"}', 400),
        (b'{"record": 1e99}', 400),
        (b'{"text": "' + b"a" * (MAX_BODY - 11) + b'"}', 413),
        (b'{"text": "' + b"#" * (MAX_BODY - 12) + b'"}', 200),
    ],
)
def test_a_body_that_is_no_request_is_refused(client: ConsoleClient, body: bytes, status: int) -> None:
    assert client.post("run", body).status_code == status


def test_other_paths_are_refused(client: ConsoleClient) -> None:
    assert client.http.get("/secrets").status_code == 404
    assert client.http.get("/../pyproject.toml").status_code == 404
    assert client.post("secrets").status_code == 404


def test_an_error_has_its_line(client: ConsoleClient) -> None:
    (error,) = client.ask("run", text="case: a\ngoal: nothing\n")["errors"]
    assert (error["line"], error["column"]) == (2, 7)


def test_a_saved_case_names_the_model_and_has_the_run_of_the_page(client: ConsoleClient, folder: Path) -> None:
    answer = client.ask("save", text=TEXT, name="mine", records=True)
    assert answer["path"] == str(folder / "cases" / "mine.yaml")
    text = Path(answer["path"]).read_text(encoding="utf-8")
    assert text == answer["text"]
    case = read_case(text, load_model(folder / "cell.yaml"))
    assert (case.name, case.recorded is not None) == ("mine", True)
    assert "model: ../cell.yaml" in text
    assert Tester(load_model(folder / "cell.yaml")).execute(case).verdict.passed


def test_no_file_is_replaced_that_the_page_has_not_saved(client: ConsoleClient, folder: Path, wording: Wording) -> None:
    first = client.ask("save", text=TEXT, name="mine")
    assert "refused" in client.ask("save", text=TEXT, name="mine")
    again = client.ask("save", text=f"{TEXT}limits: {{plans: 9}}\n", name="mine", known=first["known"])
    assert again["known"] != first["known"]
    (folder / "cases" / "mine.yaml").write_text("changed by hand", encoding="utf-8")
    refused = client.ask("save", text=TEXT, name="mine", known=again["known"])["refused"]
    wording(refused.replace(str(folder), "FOLDER"))


@pytest.mark.parametrize("name", ["", "../cell", "/etc/x", "a/b", ".hidden", "a\0", "größe"])
def test_a_case_is_saved_below_its_folder_only(client: ConsoleClient, folder: Path, name: str) -> None:
    assert "refused" in client.ask("save", text=TEXT, name=name)
    assert not (folder / "cases").exists()


def test_a_link_is_not_followed(client: ConsoleClient, folder: Path) -> None:
    (folder / "cases").mkdir()
    (folder / "cases" / "mine.yaml").symlink_to(folder / "cell.yaml")
    assert "refused" in client.ask("save", text=TEXT, name="mine")
    assert (folder / "cell.yaml").read_text(encoding="utf-8") == CELL


def test_a_text_with_errors_is_not_saved(client: ConsoleClient, folder: Path) -> None:
    assert "errors" in client.ask("save", text="case: a\ngoal: nothing\n", name="mine")
    assert not (folder / "cases").exists()


def test_a_fault_is_a_message(client: ConsoleClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client.worker, "digest", lambda: 1 / 0)
    response = client.post("digest")
    assert response.status_code == 500
    assert "ZeroDivisionError" in decode(response.content)["refused"]
