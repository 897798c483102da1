"""Finds the verb, runs it, and turns what goes wrong into one place, one message and one exit code."""

from __future__ import annotations

import os
import sys
import traceback
from functools import wraps
from importlib import import_module
from io import TextIOWrapper
from typing import TYPE_CHECKING

import typer
import typer.core

import scbm
from scbm.cli.options.registry_options import with_registry_options
from scbm.cli.output.exit_codes import GOOD, INTERRUPTED, OWN_FAULT, WRONG_INPUT
from scbm.model import Diagnostic, InputError, Place, ScbmError, Slug

if TYPE_CHECKING:
    from collections.abc import Callable

VERBS: dict[str, str] = {
    "check": "scbm.cli.check",
    "plan": "scbm.cli.plan",
    "run": "scbm.cli.run",
    "test": "scbm.cli.test",
    "close": "scbm.cli.close",
    "explain": "scbm.cli.explain",
    "replay": "scbm.cli.replay",
    "trace": "scbm.cli.trace",
    "combine": "scbm.cli.combine",
    "report": "scbm.cli.report",
    "schema": "scbm.cli.schema",
    "node controller": "scbm.cli.node_controller",
    "node resources": "scbm.cli.node_resources",
    "node tester": "scbm.cli.node_tester",
}
"""The module of each verb, in the order of the help. Its function `command` returns an exit code."""

_GROUPS = {"node": "A controller, resources or a tester as a process of its own."}

_HELP = "Plan, run, test and cover behavior models of automation systems (SCBM-IAS)."


def main() -> None:
    """`scbm`: exits with 0 good, 1 the tests failed, 2 the input is wrong, 3 a fault of scbm itself."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a terminal or a file that is not UTF-8 gets `?` for what it lacks
            stream.reconfigure(errors="replace")
    try:
        sys.exit(_flushed(_run(sys.argv[1:])))
    except ScbmError as error:
        _show(error)
        sys.exit(_flushed(WRONG_INPUT))
    except OSError as error:
        sys.stderr.write(f"scbm: cannot write the output: {(error.strerror or str(error)).lower()}\n")
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(WRONG_INPUT)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except Exception:  # noqa: BLE001 - the last line of defence, which tells apart our faults from theirs
        traceback.print_exc()
        message = "scbm: this is a fault of scbm, not of your input. Please report it with the lines above.\n"
        sys.stderr.write(message)
        sys.exit(OWN_FAULT)


def _flushed(code: int) -> int:
    """The exit code, when all that is printed is with who reads it, or they have stopped reading."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return code


def _run(arguments: list[str]) -> int:
    """Runs the command line, which ends by `SystemExit`, and gives its exit code."""
    try:
        _application(arguments)(prog_name="scbm")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else GOOD
    return GOOD


def _application(arguments: list[str]) -> typer.Typer:
    """The command line with the verb that is asked for, or with all of them: loading one is faster."""
    application = typer.Typer(
        help=_HELP, no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None
    )
    application.callback(help=_HELP)(_common)
    groups = {name: typer.Typer(help=words, no_args_is_help=True) for name, words in _GROUPS.items()}
    asked = [verb for verb in VERBS if arguments[: len(verb.split())] == verb.split()]
    for verb in asked or VERBS:
        group, _, name = verb.rpartition(" ")
        command = with_registry_options(import_module(VERBS[verb]).command)
        (groups[group] if group else application).command(name)(_exiting(command))
    for name, group_application in groups.items():
        if not asked or asked[0].startswith(f"{name} "):
            application.add_typer(group_application, name=name)
    if asked:
        _refuse_repeated(typer.main.get_command(application), asked[0].split(), arguments)
    return application


def _refuse_repeated(command: object, verb: list[str], arguments: list[str]) -> None:
    """Raises `InputError` for options with one value that are given twice: else the last is taken without a word."""
    for word in verb:
        assert isinstance(command, typer.core.TyperGroup)  # noqa: S101 - it has options of its own, so it is no command
        command = command.commands[word]
    assert isinstance(command, typer.core.TyperCommand)  # noqa: S101 - verbs are commands
    options = [p for p in command.params if isinstance(p, typer.core.TyperOption)]
    given = arguments[len(verb) :]
    before = given[: given.index("--")] if "--" in given else given
    words = [word.partition("=")[0] for word in before]
    wrong = [
        Diagnostic(Slug.BAD_OPTION, "this is given more than once", Place(option.opts[0]))
        for option in options
        if not option.multiple and not option.is_flag and sum(word in option.opts for word in words) > 1
    ]
    if wrong:
        raise InputError(wrong)


def _show_version(asked: bool) -> None:  # noqa: FBT001 - typer gives the value of an option so
    if asked:
        sys.stdout.write(f"scbm {scbm.__version__}\n")
        raise typer.Exit(GOOD)


def _common(
    *,
    version: bool = typer.Option(
        False, "--version", help="Show the version and exit.", is_eager=True, callback=_show_version
    ),
) -> None:
    """The options that belong to no verb."""


def _exiting(command: Callable[..., int]) -> Callable[..., None]:
    """The command with its result as the exit code of the process."""

    @wraps(command)
    def call(*args: object, **options: object) -> None:
        raise typer.Exit(command(*args, **options))

    return call


def _show(error: ScbmError) -> None:
    from scbm.cli.output.terminal import errors  # noqa: PLC0415 - rich, which a good run may not need

    errors().diagnostics(error.diagnostics)
