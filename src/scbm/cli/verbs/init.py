"""`scbm init`: a new folder with a model, cases, tests for pytest and a CI job, which pass all commands."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from msgspec import Struct

import scbm
from scbm.cli.options.option_errors import option_error
from scbm.cli.output.terminal import results
from scbm.files import FileWriter, read_file
from scbm.model.visible_text import shell_word


class ExampleCell(Struct, frozen=True):
    """One example.

    Attributes:
        model: its model file in the folder of examples.
        goal: a goal of the model that a run reaches.
        obligation: an obligation of the model, for `scbm explain` in the README of a project.
        about: what the cell is, for the help and the README.
        cases: the folder of its cases beside the model.
    """

    model: str
    goal: str
    obligation: str
    about: str
    cases: str = "cases"


EXAMPLES: dict[str, ExampleCell] = {
    "gripper": ExampleCell(
        "gripper/cell.yaml", "loaded", "grip/failed", "a robot with a gripper that loads a machine; the smallest one"
    ),
    "sorting": ExampleCell(
        "sorting_belt/cell.yaml", "sorted", "look/failed", "a belt, a gate, and a camera that may see nothing"
    ),
    "packml": ExampleCell(
        "packml/cell.yaml",
        "pallet_full",
        "packer.produce/failed",
        "a packaging machine by ISA-TR88 (PackML) with an emergency stop, of parts",
    ),
    "agv": ExampleCell(
        "agv_line/cell.yaml",
        "delivered",
        "pick/failed",
        "an AGV with orders that fail, a protective field and a lost position",
    ),
    "cnc": ExampleCell(
        "dual_cnc/lifted.yaml",
        "pallet_finished",
        "finish_cut/failed",
        "two CNC machines and a robot, with stop, light curtain and recovery",
        cases="lifted_cases",
    ),
    "paper": ExampleCell(
        "robot_in_the_air/handshakes.yaml",
        "item_a_scanned",
        "scanner_scan_item_a/timedout",
        "the robot on a gantry of the paper about SCBM-IAS, repaired",
    ),
    "delivery": ExampleCell(
        "delivery/cell.yaml",
        "goal",
        "pick/failed",
        "two robots that carry crates through a warehouse, imported from PDDL",
    ),
}
"""The examples by name, in the order of the help."""


def examples_folder() -> Path:
    """Return the folder of the examples: in the package if it was installed, else in the checkout."""
    package = Path(scbm.__file__).parent
    installed = package / "examples"
    return installed if installed.is_dir() else package.parents[1] / "examples"


ExampleName = StrEnum("ExampleName", list(EXAMPLES))  # type: ignore[misc] # mypy knows no members of such an enum

_FIRST = ExampleName("gripper")

_HELP = "The example to copy: " + "; ".join(f"{name}, {cell.about}" for name, cell in EXAMPLES.items()) + "."


def command(
    folder: Annotated[
        Path | None, typer.Argument(metavar="NAME", help="The folder. [the name of the example]", show_default=False)
    ] = None,
    *,
    example: Annotated[ExampleName, typer.Option("--example", help=_HELP)] = _FIRST,
) -> int:
    """Write a new folder with a model, cases, tests for pytest and a CI job, to start from."""
    into = Path(example) if folder is None else folder
    _refuse_used(into)
    files = {into / name: text for name, text in project_files(EXAMPLES[example]).items()}
    FileWriter().write_all(files, overwrite=False)
    lines = results()
    for path in files:
        lines.line(str(path))
    lines.line("")
    lines.line("Next:")
    lines.line(f"  cd {shell_word(str(into))}")
    for line in _commands(EXAMPLES[example]):
        lines.line(f"  {line}")
    return 0


def project_files(cell: ExampleCell) -> dict[str, str]:
    """Return the text of each file of a new project, by its path in the folder.

    Comments of a model that name its file, such as in a command, name `model.yaml` instead.
    """
    model = examples_folder() / cell.model
    cases = sorted((model.parent / cell.cases).glob("*.yaml"))
    files = {"model.yaml": read_file(model).replace(model.name, "model.yaml")}
    files |= {f"cases/{case.name}": _MODEL_LINE.sub("model: ../model.yaml", read_file(case)) for case in cases}
    commands = "".join(f"    {line}\n" for line in _commands(cell))
    return files | {
        "test_model.py": _TESTS,
        ".github/workflows/scbm.yaml": _WORKFLOW,
        "README.md": _README.format(
            about=cell.about, commands=commands, obligation=cell.obligation, case=cases[0].name
        ),
    }


_MODEL_LINE = re.compile(r"^model: .*$", re.MULTILINE)


def _commands(cell: ExampleCell) -> tuple[str, ...]:
    return (
        "scbm check model.yaml",
        f"scbm run model.yaml --goal {cell.goal}",
        "scbm test model.yaml cases --cases 20 --seed 1",
        "scbm close model.yaml --out closed",
    )


def _refuse_used(folder: Path) -> None:
    """Raise `InputError` if the folder is a file, or has something in it."""
    if folder.is_dir() and not any(folder.iterdir()):
        return
    if folder.exists():
        what = "the folder is not empty" if folder.is_dir() else "this is a file"
        remedy = "name another folder: `scbm init NAME`"
        raise option_error(str(folder), what, remedy)


_TESTS = '''\
"""Random cases of the model. `pytest` runs them, and the case files in `cases`, and reports their coverage together.

This needs pytest: `pip install pytest`.
"""

import pytest


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_cases_pass(scbm_model, seed):
    scbm_model("model.yaml").check_random(seed=seed, cases=20)
'''

_WORKFLOW = """\
# For GitHub, if this folder is a repository. Other systems run the same commands.
name: scbm
on: [push, pull_request]
env:
  SCBM: ""  # FILL IN where pip gets scbm from: a path such as ./tools/scbm, or an address such as git+https://…
jobs:
  test:
    runs-on: ubuntu-latest
    steps:
      - uses: actions/checkout@v4
      - uses: actions/setup-python@v5
        with: {python-version: "3.12"}
      - run: test -n "$SCBM" || { echo "fill in SCBM in .github/workflows/scbm.yaml"; exit 1; }
      - run: pip install "$SCBM" pytest
      - run: scbm check --strict model.yaml
      - run: scbm test model.yaml cases --cases 1000 --seed 1 --store coverage.db
      - run: pytest
      - if: always()
        run: scbm report coverage.db --markdown "$GITHUB_STEP_SUMMARY" --html report.html --junit junit.xml
      - if: always()
        uses: actions/upload-artifact@v4
        with: {name: scbm, path: report.html}
"""

_README = """\
# A behavior model

The example: {about}. Change it into your own cell.

| file | has |
| --- | --- |
| `model.yaml` | variables, resources, operations, automatic transitions, goals, requirements |
| `cases/` | test cases: which requests fail or are late, and what is expected then |
| `test_model.py` | random cases as tests of pytest |
| `.github/workflows/scbm.yaml` | a CI job; fill in the marked line: where `scbm` comes from |

Begin with these commands:

{commands}
`scbm test` reports which parts of the model the cases have exercised: its obligations. `scbm close` generates the
missing cases, or proves that there are none. Other commands:

| command | result |
| --- | --- |
| `scbm show model.yaml --expanded` | the model written out: all that `request`, parts and objects stand for |
| `scbm replay cases/{case}` | the run of one case |
| `scbm explain model.yaml {obligation}` | a run that covers this obligation, or why there is none |
| `scbm mutate model.yaml cases --store mutants.db` | which changes of the model the cases would not notice |
| `pytest` | the cases and random cases as tests; needs `pip install pytest` |
| `scbm schema > scbm.schema.json` | a schema, with which editors complete keys |

`scbm mutate` takes up to some minutes. After Ctrl-C the same command goes on where it was.
"""
