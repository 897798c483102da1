"""The typer application, which parses and runs one verb of the command line."""

from __future__ import annotations

import os
import sys
from functools import wraps
from importlib import import_module
from typing import TYPE_CHECKING, Any

import typer
import typer.core

import scbm
from scbm.cli.exit_codes import GOOD, INTERRUPTED, WRONG_INPUT
from scbm.cli.options.help_sections import VerbCommand
from scbm.cli.verb_registry import VERBS

if TYPE_CHECKING:
    from collections.abc import Callable

    from typer._click import Context

    from scbm.cli.verb_registry import VerbEntry

_USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]
"""The class of errors of command lines, whose package depends on the version of typer."""

_GROUPS = {
    "import": "Read a model in the format of another tool.",
    "export": "Write a model in the format of another tool.",
    "node": "Run a controller, resources or a tester as a process.",
}

_HELP = "Plan, run, test and cover behavior models of automation systems (SCBM-IAS)."

_PAGE = "docs/reference/command-line.md"
_EPILOG = f"""`scbm VERB --help` shows the options of a verb, `scbm help SLUG` explains an error or a warning.

Documentation, in the source code of scbm: README.md and docs/index.md; {_PAGE} has all verbs."""


def run_verb(arguments: list[str], begin: Callable[[], None]) -> int:
    """Run one command line, print the errors of its input, and return its exit code.

    Args:
        arguments: the arguments of `scbm`.
        begin: called when everything is imported and read, just before the verb does its work.
    """
    try:
        _application(arguments, begin).main(arguments, prog_name="scbm")
    except SystemExit as end:  # this is how typer ends
        return end.code if isinstance(end.code, int) else GOOD
    except Exception as error:
        from scbm.model import ScbmError  # noqa: PLC0415 - the help needs no model

        if not isinstance(error, ScbmError):
            raise
        from scbm.cli.output.terminal import errors  # noqa: PLC0415 - a good run may not need it

        errors().diagnostics(error.diagnostics)
        return WRONG_INPUT
    return GOOD


def _application(arguments: list[str], begin: Callable[[], None]) -> typer.core.TyperGroup:
    """Return the application with the verb that the arguments name, or with all verbs, of which the help shows names.

    Only a verb that the arguments name has its options: to import all verbs takes ten times as long as the help.
    """
    application = typer.Typer(help=_HELP, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)
    application.callback(help=_HELP, epilog=_EPILOG)(_common)
    groups = {name: typer.Typer(help=words, no_args_is_help=True) for name, words in _GROUPS.items()}
    arguments = arguments or _words_to_complete()
    asked = [verb for verb in VERBS if arguments[: len(verb.split())] == verb.split()]
    for verb, entry in VERBS.items():
        if asked and verb not in asked:
            continue
        group, _, name = verb.rpartition(" ")
        add = (groups[group] if group else application).command
        epilog = f"Documentation: {_PAGE}#scbm-{verb.replace(' ', '-')}"
        command = _loaded(entry, begin) if asked else _not_loaded
        add(name, cls=_Verb, help=entry.summary, short_help=entry.summary, epilog=epilog)(command)
    for name, group_application in groups.items():
        if not asked or asked[0].startswith(f"{name} "):
            application.add_typer(group_application, name=name)
    built = typer.main.get_command(application)  # once: `Typer.__call__` would build it again
    assert isinstance(built, typer.core.TyperGroup)  # noqa: S101 - it has a callback
    if asked:
        _refuse_repeated(built, asked[0], arguments)
    return built


def _not_loaded() -> None:
    """Stand for a verb that the arguments do not name: only its name and its summary are shown."""


def _loaded(entry: VerbEntry, begin: Callable[[], None]) -> Callable[..., None]:
    """Import a verb, and return its command for typer."""
    from scbm.cli.options.registry_options import with_registry_options  # noqa: PLC0415 - the help needs none

    return _exiting(with_registry_options(import_module(entry.module).command), begin)


def _words_to_complete() -> list[str]:
    """Return the words on the command line that a shell completes: it gives them in the environment."""
    given = os.environ.get("_TYPER_COMPLETE_ARGS") or os.environ.get("COMP_WORDS", "")
    return given.split()[1:] if "_SCBM_COMPLETE" in os.environ else []


class _Verb(VerbCommand):
    """A verb that says which verbs have an option that it does not have."""

    def parse_args(self, ctx: Context, args: list[str]) -> list[str]:
        """Parse the arguments. The error for an option of another verb says which verb that is, and what to write."""
        given = list(args)
        try:
            return super().parse_args(ctx, args)
        except _USAGE_ERROR as error:
            if hasattr(error, "possibilities"):
                _name_other_verbs(error, ctx.command_path.partition(" ")[2], given)
            raise


def _name_other_verbs(error: Any, verb: str, arguments: list[str]) -> None:  # noqa: ANN401 - see `_USAGE_ERROR`
    """Let the error for an unknown option name the verbs that have it, if any, in place of similar options."""
    from scbm.cli.options.misplaced_options import misplaced_option  # noqa: PLC0415 - a good run needs none

    message = misplaced_option(error.option_name, verb, arguments, _options_by_verb())
    if message is not None:
        error.message, error.possibilities = message, ()


def _options_by_verb() -> dict[str, tuple[str, ...]]:
    """Return the names of the options of each verb, in the order of the help."""
    options = {verb: verb_options(verb) for verb in VERBS}
    return {verb: tuple(name for each in found for name in each.opts) for verb, found in options.items()}


def verb_options(verb: str) -> list[typer.core.TyperOption]:
    """Return the options of a verb, in the order of its help."""
    return _options_of(_command_of(_application(verb.split(), lambda: None), verb))


def _command_of(application: object, verb: str) -> typer.core.TyperCommand:
    """Return the command of a verb, which may be in a group."""
    command = application
    for word in verb.split():
        assert isinstance(command, typer.core.TyperGroup)  # noqa: S101 - it has options of its own, so it is no command
        command = command.commands[word]
    assert isinstance(command, typer.core.TyperCommand)  # noqa: S101 - verbs are commands
    return command


def _options_of(command: typer.core.TyperCommand) -> list[typer.core.TyperOption]:
    return [each for each in command.params if isinstance(each, typer.core.TyperOption)]


def _refuse_repeated(application: object, verb: str, arguments: list[str]) -> None:
    """Raise `InputError` for options with one value that are given twice: typer would take the last."""
    from scbm.model import Diagnostic, InputError, Place, Slug  # noqa: PLC0415 - the help needs no model

    options = _options_of(_command_of(application, verb))
    given = arguments[len(verb.split()) :]
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
    """Declare the options that belong to no verb."""


def _exiting(command: Callable[..., int], begin: Callable[[], None]) -> Callable[..., None]:
    """Return the command with its result as the exit code of the process."""
    from scbm.cli.options.command_inputs import inputs_of  # noqa: PLC0415 - the help needs neither
    from scbm.files import protecting  # noqa: PLC0415 - the same

    @wraps(command)
    def call(*args: object, **options: object) -> None:
        try:
            begin()
            with protecting(lambda: inputs_of(command, options)):
                code = command(*args, **options)
        except KeyboardInterrupt:  # typer would say `Aborted!` and end with 1
            code = INTERRUPTED
        raise typer.Exit(code)

    return call
