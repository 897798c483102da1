"""How a command starts: Ctrl-C at any moment, and what is imported for which command line."""

from __future__ import annotations

import gc
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from conftest import Ran
from scbm.cases import Case
from scbm.cli.main import _is_interruption
from scbm.cli.verb_registry import VERBS
from scbm.files import digest_of, load_model
from scbm.testing.event_logs.event_log import write_event_log
from support.capturing import captured
from support.profiles import share

ROOT = Path(__file__).parents[3]
BEFORE = "examples/robot_in_the_air/before.yaml"


MODULES = ("signal", "scbm.testing", "typer", "scbm.model", "lark", "ruamel.yaml", "typer._click.core")
"""`signal` is imported before the command line handles Ctrl-C itself."""


def _imported_module(line: str) -> str:
    """Return the module that a line of `-X importtime` names, or nothing for another line."""
    return line.rpartition("|")[2].strip() if line.startswith("import time:") else ""


@pytest.mark.longer
@pytest.mark.parametrize("module", MODULES[: share(len(MODULES), least=2)])
def test_ctrl_c_while_a_module_is_imported_ends_with_130_and_without_a_word(module: str) -> None:
    """The interpreter prints the name of each module that it has imported, so the test waits for no time to pass."""
    command = [sys.executable, "-X", "importtime", "-m", "scbm", "test", BEFORE, "--cases", "100000"]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, restore_signals=True
    ) as process:
        assert process.stderr is not None
        assert any(_imported_module(line) == module for line in process.stderr)
        process.send_signal(signal.SIGINT)
        rest = [line for line in process.stderr if not line.startswith("import time:")]
        assert (process.wait(), rest) == (130, [])


@pytest.mark.slow
@pytest.mark.parametrize(("verb", "code"), [("controller", 0), ("resources", 0), ("tester", 130)])
def test_a_node_that_sigterm_ends_while_it_starts_has_the_exit_code_that_it_has_later(verb: str, code: int) -> None:
    """The pipe is small, so the node waits for its reader before it has imported everything."""
    command = [sys.executable, "-X", "importtime", "-m", "scbm", "node", verb, BEFORE]
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, pipesize=4096) as process:
        assert process.stderr is not None
        assert any(_imported_module(line) == "typer" for line in process.stderr)
        process.send_signal(signal.SIGTERM)
        rest = [line for line in process.stderr if not line.startswith("import time:")]
        assert (process.wait(), rest) == (code, [])


def test_an_import_that_ctrl_c_turned_into_another_error_counts_as_ctrl_c() -> None:
    error = ImportError("failed to import")
    error.__context__ = KeyboardInterrupt()
    assert _is_interruption(error)
    assert not _is_interruption(ImportError("missing"))


def _imported(*arguments: str) -> set[str]:
    """The modules that a command line imports."""
    command = [sys.executable, "-X", "importtime", "-m", "scbm", *arguments]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return {_imported_module(line) for line in done.stderr.splitlines()}


def test_the_version_needs_no_other_package() -> None:
    assert not _imported("--version") & {"typer", "rich", "pydantic", "numpy", "lark", "scbm.model"}


UNUSED = {
    "pydantic",
    "numpy",
    "jinja2",
    "asyncio",
    "sqlite3",
    "scbm.files.expansion.object_stage",
    "scbm.files.expansion.parts",
    "scbm.planning.searches.dense_search",
    "scbm.planning.searches.informed_search",
}
"""What commands do not need for a small model without parts and objects."""


@pytest.mark.longer
@pytest.mark.parametrize(
    ("arguments", "unused"),
    [
        (
            ("check", BEFORE),
            {*UNUSED, "scbm.files.codec.case_keys", "scbm.testing.tester", "scbm.proofcheck.runs_check"},
        ),
        pytest.param(
            ("test", BEFORE, "--cases", "2"),
            {
                *UNUSED,
                "multiprocessing",
                "scbm.closing.certificate_files",
                "scbm.closing.closer",
                "scbm.nodes",
                "scbm.proofcheck.runs_check",
                "scbm.mutation",
            },
            marks=pytest.mark.slow,
        ),
        pytest.param(
            ("close", BEFORE),
            {
                *UNUSED,
                "scbm.closing.closing_json",
                "scbm.closing.requirements.requirement_closer",
                "scbm.files.codec.case_keys",
                "scbm.files.goal_editing",
                "scbm.proofcheck.runs_check",
                "scbm.mutation",
            },
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_command_imports_only_what_it_uses(arguments: tuple[str, ...], unused: set[str]) -> None:
    assert _imported(*arguments) & unused == set()


@pytest.mark.slow
def test_the_core_works_without_nodes(tmp_path: Path) -> None:
    """Cases run, models with bindings load, and a log is replayed; a run over nodes is the only use of the package."""
    model = load_model(ROOT / BEFORE)
    log, _ = captured(model, Case("delivers", *model.goals[0], model.nominal_state))
    saved = replace(log, digest=digest_of(model), model_file=None)
    (tmp_path / "run.log").write_text(write_event_log(saved, model), encoding="utf-8")
    code = "import sys; sys.modules['scbm.nodes'] = None\nfrom scbm.cli.main import main\nmain()"
    for command, expected in (
        (("check", BEFORE), 0),
        (("test", BEFORE, "--cases", "1", "--failures", str(tmp_path)), 0),
        (("replay", str(tmp_path / "run.log"), "--model", BEFORE), 0),
        (("test", BEFORE, "--cases", "1", "--transport", "loopback"), 3),
    ):
        done = subprocess.run([sys.executable, "-c", code, *command], cwd=ROOT, check=False, capture_output=True)
        assert (command, done.returncode) == (command, expected)


LATE = (
    "scbm.cases",
    "scbm.cases.coverage",
    "scbm.cases.trace",
    "scbm.proofcheck",
    "scbm.running",
    "scbm.running.simulation",
    "scbm.planning",
    "scbm.files",
    "scbm.closing",
    "scbm.closing.advice",
    "scbm.nodes",
    "scbm.reports",
    "scbm.store",
    "scbm.testing",
    "scbm.mutation",
)
"""Packages that import their names late; the ones that import most come last."""


@pytest.mark.slow
def test_packages_that_import_their_names_late_export_all_of_them() -> None:
    """In a process of its own, as other tests have imported everything."""
    code = f"from importlib import import_module; packages = [import_module(name) for name in {LATE}]\n"
    code += "for p in packages: print(p.__name__, len([getattr(p, name) for name in p.__all__]) == len(p.__all__) > 0)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stdout.splitlines() == [f"{name} True" for name in LATE]


def test_garbage_is_collected_only_while_a_verb_works(
    scbm: Callable[..., Ran], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[bool] = []

    def run_verb(_: list[str], begin: Callable[[], None]) -> int:
        seen.append(gc.isenabled())
        begin()
        seen.append(gc.isenabled())
        return 0

    monkeypatch.setattr("scbm.cli.application.run_verb", run_verb)
    assert scbm("check").code == 0
    assert seen == [False, True]


def test_no_garbage_is_collected_at_the_end_of_a_process() -> None:
    code = "import atexit, gc\natexit.register(lambda: print(gc.get_freeze_count() > 0))\n"
    code += "from scbm.cli.main import main\nmain()"
    command = [sys.executable, "-c", code, "--version"]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    assert done.stdout.splitlines()[1:] == ["True"]


def test_the_help_shows_whole_sentences(scbm: Callable[..., Ran]) -> None:
    commands = scbm("--help").out.partition("Commands:\n")[2].partition("\n\n")[0]
    sentences = re.split(r"\n  (?=\S)", commands.rstrip())
    assert len(sentences) == len({verb.split()[0] for verb in VERBS})
    assert [sentence for sentence in sentences if not re.search(r"[^.]\.$", sentence)] == []


@pytest.mark.longer
@pytest.mark.parametrize(
    ("command", "code", "shown"),
    [
        (f"check {BEFORE} >&-", 0, ""),
        ("--version >&-", 0, ""),
        (f"test {BEFORE} --cases 1 --json >&-", 0, ""),
        ("check missing.yaml 2>&-", 2, ""),
        ("check missing.yaml >&- 2>&-", 2, ""),
        ("check missing.yaml >&-", 2, "missing.yaml"),
    ],
)
def test_a_stream_that_is_closed_is_written_to_nowhere(command: str, code: int, shown: str) -> None:
    shell = ["sh", "-c", f"exec {sys.executable} -m scbm {command}"]
    done = subprocess.run(shell, cwd=ROOT, check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr[: len(shown)]) == (code, "", shown)
