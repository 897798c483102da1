"""What acts on a terminal or turns a line around acts in no report: names, paths and reasons show it as an escape."""

from __future__ import annotations

import json
import os
import re
import subprocess
import zlib
from base64 import b64decode
from collections.abc import Callable
from pathlib import Path
from shutil import which

import pytest

from conftest import Ran
from scbm.model.visible_text import ACTING, escaped, escaped_data, in_one_line, printable, shell_word
from scbm.reports.formats import FORMATS
from support.models import SCAN_CELL

ROOT = Path(__file__).parents[3]
Scbm = Callable[..., Ran]
CLEAR, TURNED = "\x1b[2J", "\u202egnp\u202c"
CASE = """case: "turned"
goal: item_a_scanned
requirements: {never_home: never robot_at == home}
"""
WAIVERS = """waivers_of: robot_in_the_air
waivers:
  - {obligation: robot_move_to_home/completed, reason: "not \u202eyet", author: "A\u2066da", date: 2026-11-20}
"""


@pytest.fixture
def store(scbm: Scbm, tmp_path: Path) -> Path:
    """A store of a model and a case with waivers: paths and reasons have such characters."""
    folder = tmp_path / f"dir{CLEAR}{TURNED}"
    folder.mkdir()
    model, case, waivers = (folder / f"{name}{TURNED}.yaml" for name in ("model", "case", "waivers"))
    model.write_text((ROOT / "examples/robot_in_the_air/before.yaml").read_text() + f"# {TURNED}\n", encoding="utf-8")
    case.write_text(CASE, encoding="utf-8")
    waivers.write_text(WAIVERS, encoding="utf-8")
    store = tmp_path / "cov.db"
    ran: Ran = scbm(
        "test", model, case, "--cases", 2, "--store", store, "--failures", tmp_path / "failing", "--waivers", waivers
    )
    assert ran.code == 1
    assert ACTING.search(ran.out + ran.err) is None
    return store


def strings(data: object) -> list[str]:
    """Return all texts in data from JSON, with those in compressed blocks."""
    if isinstance(data, str):
        try:
            return [data, *strings(json.loads(zlib.decompress(b64decode(data, validate=True))))]
        except (ValueError, zlib.error):
            return [data]
    if isinstance(data, dict):
        return [*strings(list(data)), *strings(list(data.values()))]
    return [text for each in data for text in strings(each)] if isinstance(data, list) else []


@pytest.mark.longer
def test_no_format_has_characters_that_act(scbm: Scbm, store: Path, tmp_path: Path) -> None:
    written = {name: tmp_path / name for name in FORMATS}
    options = [part for name, path in written.items() for part in (f"--{name}", path)]
    ran = scbm("report", store, *options)
    assert ran.code == 0, ran.err
    for name, path in written.items():
        text = path.read_text(encoding="utf-8")
        assert ACTING.search(text) is None, name
        data = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', text, re.DOTALL)
        shown = strings([json.loads(each) for each in data or ([text] if name == "sarif" else [])])
        assert [each for each in shown if ACTING.search(each)] == [], name
        escapes = ("case\\u202egnp", "model\\xe2\\x80\\xaegnp")  # the second one in commands
        found = any(each in text + "".join(shown) for each in escapes)
        assert name not in ("html", "junit", "markdown") or found, name


@pytest.mark.longer
def test_the_pages_of_mutants_have_none_either(scbm: Scbm, store: Path, tmp_path: Path) -> None:
    page, sarif = tmp_path / "page", tmp_path / "sarif"
    (model,) = store.parent.glob("dir*/model*")
    few = ("--operators", "deadline-none", "--no-equivalence")
    ran = scbm("mutate", model, "--cases", 2, *few, "--html", page, "--sarif", sarif)
    assert ran.code == 0, ran.err
    assert ACTING.search(page.read_text() + sarif.read_text() + ran.out + ran.err) is None
    assert [text for text in strings(json.loads(sarif.read_text())) if ACTING.search(text)] == []


def test_line_ends_and_tabs_act_only_within_a_line() -> None:
    text = "a\tb\r\nc\nd\re\x85"
    assert escaped(text) == "a\tb\r\nc\nd\\re\\x85"
    assert in_one_line(text) == "a\tb\\r\\nc\\nd\\re\\x85"
    assert printable(f"{text}\u200bü") == "a\\tb\\r\\nc\\nd\\re\\x85\\u200bü"
    assert escaped_data({"a\x00": [("\ud800\uffff", 1, None, True, "ü 模😀")]}) == {
        "a\\x00": [["\\ud800\\uffff", 1, None, True, "ü 模😀"]]
    }


@pytest.mark.skipif(which("bash") is None, reason="bash is not installed")
@pytest.mark.parametrize(
    "name",
    ["plain", "", "two words", "it's", "a\nb\tc", "\x1b[2J\\x'41", "\u202egnp\u202c", "ä\u00a0ö", "\udcff\udcc3.yaml"],
)
def test_a_word_of_a_command_is_what_bash_makes_of_it(name: str) -> None:
    word = shell_word(name)
    assert word.isprintable()
    echoed = subprocess.run(["bash", "-c", f"printf %s {word}"], capture_output=True, check=True).stdout  # noqa: S607 - bash of the system
    assert os.fsdecode(echoed) == name


def test_commands_about_a_file_whose_name_cannot_be_shown_can_be_copied(scbm: Scbm, tmp_path: Path) -> None:
    path = tmp_path / f"mo\ndel{CLEAR}.yaml"
    path.write_text(SCAN_CELL, encoding="utf-8")
    for arguments in (("close", path), ("test", path, "--cases", 3)):
        out = scbm(*arguments).out
        assert f"{tmp_path}/mo\\x0adel\\x1b[2J.yaml" in out
        assert all("$'" in line for line in out.splitlines() if "mo\\x0adel" in line and "scbm " in line)
