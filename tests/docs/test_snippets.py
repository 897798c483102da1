"""What README.md, the pages below docs and the sections of messages show is true: commands are run, models are loaded.

- A block marked `console` holds commands (`$ scbm …`, `$ pytest …`, `$ cat …`, `$ diff …`) and behind each what it
  prints. A line `...` stands for any lines; `# exit code N` behind the output says how the command ends, if not with 0.
  Blanks at the end of a line do not count, as editors take them away; nor does how long pytest took.
- A block marked `yaml` that begins with `# model: NAME` is a model, and must load.
- The commands of a page find the models of the page as `NAME.yaml`, and its other YAML and Python blocks that begin
  with `# file: PATH` under that path; of blocks of one name the last one above the command counts.

Commands run in a directory of their own, in which everything of the repository's root is linked but its configuration.
So what they write is gone afterwards, and pytest runs as it does for users. `scbm` runs in the process of the tests,
but for commands of README.md and those that start nodes: starting Python takes longer than most commands.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

from scbm.cli import main
from scbm.files import read_model
from support.shared_programs import share_programs

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", ROOT / "src/scbm/cli/messages.md", *sorted((ROOT / "docs").rglob("*.md")))

PROGRAMS = {
    "scbm": [sys.executable, "-m", "scbm"],
    "pytest": [sys.executable, "-m", "pytest", "-p", "no:cacheprovider"],
    "cat": ["cat"],
    "diff": ["diff"],
    "python": [sys.executable],
}
MAX_SECONDS = 600
ENVIRONMENT = {"COLUMNS": "80", "LC_ALL": "C", "NO_COLOR": "1", "PYTHONUTF8": "1", "TERM": "dumb"}
CHANGE_OUTPUT = ("FORCE_COLOR", "PY_COLORS", "CI", "BUILD_NUMBER", "PYTEST_ADDOPTS")

FENCE = re.compile(r"```(\S*)(?: .*)?")
FILE = re.compile(r"# file: (\S+)")
MODEL = re.compile(r"# model: (\S+)")
DURATION = re.compile(r"(?<= in )\d+\.\d\ds\b.*")
PROGRESS = re.compile(r"scbm: .* \(\d+ (s|min)\)")
"""What a command does, every ten seconds: on a slow machine only."""
EXIT_CODE = re.compile(r"# exit code (\d+)")


@dataclass(frozen=True)
class Block:
    """A fenced block: its lines, and the line of the page that it begins in."""

    page: Path
    number: int
    language: str
    lines: tuple[str, ...]

    @property
    def first(self) -> str:
        return self.lines[0] if self.lines else ""

    @property
    def text(self) -> str:
        return "".join(f"{line}\n" for line in self.lines)

    @property
    def has_nodes(self) -> bool:
        """Whether commands start nodes as processes."""
        return any("--transport dds" in line or line.startswith("$ scbm node") for line in self.lines)

    @property
    def is_slow(self) -> bool:
        """Whether commands run pytest, close or mutate a model, or explain or test the large example."""
        large = tuple(f"$ scbm {verb} examples/dual_cnc/" for verb in ("explain", "test"))
        return any(line.startswith(("$ pytest", "$ scbm close", "$ scbm mutate", *large)) for line in self.lines)

    @property
    def is_process(self) -> bool:
        """Whether commands run as processes."""
        return self.page.name == "README.md" or self.has_nodes

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.number}"


@dataclass(frozen=True)
class Command:
    """A line that begins with `$ `, and the output below it."""

    line: str
    expected: tuple[str, ...]
    exit_code: int

    @property
    def words(self) -> tuple[str, ...]:
        return tuple(shlex.split(self.line.removeprefix("$ ")))


def read_blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page, in order."""
    blocks: list[Block] = []
    opened: tuple[int, str] | None = None
    lines: list[str] = []
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), start=1):
        fence = FENCE.fullmatch(line)
        if opened is None:
            opened, lines = (None if fence is None else (number, fence[1])), []
        elif fence is not None:
            blocks.append(Block(page, *opened, tuple(lines)))
            opened = None
        else:
            lines.append(line)
    assert opened is None, f"{page}:{opened}: this block is not closed"
    return blocks


def read_commands(block: Block) -> list[Command]:
    """The commands of a console block with the outputs below them."""
    starts = [index for index, line in enumerate(block.lines) if line.startswith("$ ")]
    assert starts[:1] == [0], f"{block}: a console block begins with a command"
    return [_command(block.lines[start:end]) for start, end in zip(starts, [*starts[1:], None], strict=True)]


def _command(lines: tuple[str, ...]) -> Command:
    exit_code = EXIT_CODE.fullmatch(lines[-1])
    expected = lines[1:] if exit_code is None else lines[1:-1]
    return Command(
        lines[0],
        tuple(map(str.rstrip, expected)),
        0 if exit_code is None else int(exit_code[1]),
    )


def furnish(directory: Path, block: Block) -> None:
    """Links what the repository has into a directory, and writes the files of the page above the block there."""
    for entry in ROOT.iterdir():
        if not entry.name.startswith(".") and entry.name != "pyproject.toml":
            (directory / entry.name).symlink_to(entry)
    above = takewhile(lambda other: other.number < block.number, read_blocks(block.page))
    last = {name: other for other in above if (name := file_name(other)) is not None}  # of blocks of one name
    for name, other in last.items():
        path = directory / name
        path.parent.mkdir(parents=True, exist_ok=True)
        is_ours = not path.is_symlink() and path.parent.resolve().is_relative_to(directory.resolve())
        assert is_ours, f"{other}: the repository has a file of this name"
        path.write_text(other.text, encoding="utf-8")


def file_name(block: Block) -> str | None:
    """The name under which the commands of the page find a block."""
    if block.language not in ("yaml", "python", "text"):
        return None
    model, file = MODEL.fullmatch(block.first), FILE.fullmatch(block.first)
    if model is not None:
        return f"{model[1]}.yaml"
    return None if file is None else file[1]


def run(words: tuple[str, ...], directory: Path, *, is_process: bool) -> tuple[list[str], int]:
    """Return what a command prints to both streams, without blanks at the end of lines, and its exit code."""
    assert words[0] in PROGRAMS, f"`{words[0]}` is none of {', '.join(PROGRAMS)}"
    run_it = run_here if words[0] == "scbm" and not is_process else run_process
    text, code = run_it(words, directory)
    lines = [line.rstrip() for line in text.splitlines() if not PROGRESS.fullmatch(line)]
    return [DURATION.sub("0.12s", line) for line in lines] if words[0] == "pytest" else lines, code


def run_process(words: tuple[str, ...], directory: Path) -> tuple[str, int]:
    """Run a command as a process."""
    environment = {key: value for key, value in os.environ.items() if key not in CHANGE_OUTPUT}
    done = subprocess.run(
        [*PROGRAMS[words[0]], *words[1:]],
        cwd=directory,
        env=environment | ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        timeout=MAX_SECONDS,
        check=False,
    )
    return done.stdout, done.returncode


def run_here(words: tuple[str, ...], directory: Path) -> tuple[str, int]:
    """Run a command line of scbm in this process."""
    printed = io.BytesIO()
    stream = io.TextIOWrapper(printed, encoding="utf-8", write_through=True)
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(stream), redirect_stderr(stream):
        for name in CHANGE_OUTPUT:
            patch.delenv(name, raising=False)
        for name, value in ENVIRONMENT.items():
            patch.setenv(name, value)
        share_programs(patch)
        patch.chdir(directory)
        patch.setattr("sys.argv", list(words))
        with pytest.raises(SystemExit) as exited:
            main()
    code = exited.value.code
    return printed.getvalue().decode(), code if isinstance(code, int) else 0


def matches(expected: tuple[str, ...], printed: list[str]) -> bool:
    """Whether lines are as expected, where `...` stands for any lines."""
    pattern = "".join("(?:.*\n)*" if line == "..." else re.escape(f"{line}\n") for line in expected)
    return re.fullmatch(pattern, "".join(f"{line}\n" for line in printed)) is not None


BLOCKS = [block for page in PAGES for block in read_blocks(page)]
CONSOLE = [block for block in BLOCKS if block.language == "console"]
MODELS = [block for block in BLOCKS if block.language == "yaml" and MODEL.fullmatch(block.first)]


def found_again(block: Block) -> Block:
    """The block where it stands now that blocks above it may have been written anew."""
    position = [other.number for other in BLOCKS if other.page == block.page].index(block.number)
    return read_blocks(block.page)[position]


def write_anew(block: Block, commands: list[Command], directory: Path) -> None:
    """Puts what the commands print today into the page, but where `...` leaves something out."""
    lines: list[str] = []
    for command in commands:
        printed, exit_code = run(command.words, directory, is_process=block.is_process)
        lines += [command.line, *(command.expected if "..." in command.expected else printed)]
        lines += [f"# exit code {exit_code}"] * bool(exit_code)
    page = block.page.read_text(encoding="utf-8").splitlines()
    page[block.number : block.number + len(block.lines)] = lines
    block.page.write_text("".join(f"{line}\n" for line in page), encoding="utf-8")


def marked(block: Block) -> ParameterSet:
    """Return a block as a parameter, with the mark of its tier."""
    marks = [pytest.mark.dds] * block.has_nodes + [pytest.mark.slow] * block.is_slow
    return pytest.param(block, marks=marks, id=str(block))


@pytest.mark.usefixtures("shared_closings")
@pytest.mark.parametrize("block", [marked(block) for block in CONSOLE])
def test_commands_print_what_the_page_says(block: Block, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    update = request.config.getoption("--update-golden")
    if update:
        block = found_again(block)
    furnish(tmp_path, block)
    commands = read_commands(block)
    if update:
        write_anew(block, commands, tmp_path)
        return
    for command in commands:
        printed, exit_code = run(command.words, tmp_path, is_process=block.is_process)
        if "..." in command.expected:
            assert matches(command.expected, printed), "\n".join(printed)
        else:
            assert printed == list(command.expected)
        assert exit_code == command.exit_code


@pytest.mark.parametrize("block", MODELS, ids=str)
def test_models_of_a_page_load(block: Block, tmp_path: Path) -> None:
    furnish(tmp_path, read_blocks(block.page)[-1])
    model = read_model(block.text, str(tmp_path / "model.yaml"))
    assert f"# model: {model.name}" == block.first


def test_three_dots_stand_for_any_lines() -> None:
    assert matches(("a", "...", "c"), ["a", "c"])
    assert matches(("a", "...", "c"), ["a", "b", "b", "c"])
    assert not matches(("a", "...", "c"), ["a", "b"])
    assert not matches(("a", "...", "c"), ["b", "a", "c"])
    assert not matches(("a.", "..."), ["ab"])
