"""`scbm console`: a page on this computer in which each click is a line of a test case."""

import os
import secrets
import socket
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec.structs import replace

from scbm.cases import Case
from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import OptionReader, option_error
from scbm.cli.options.status_options import history_of_model
from scbm.cli.options.verb_options import Model
from scbm.cli.output.terminal import results
from scbm.files import FileWriter, load_model, open_case, read_file, real_path, write_case
from scbm.model import BehaviorModel, Diagnostic, InputError, Place, Slug
from scbm.testing import RandomCases, Tester

_HOST = "127.0.0.1"


def command(  # noqa: PLR0913 - one parameter for each argument and option
    model: Model,
    case: Annotated[
        Path | None,
        typer.Argument(metavar="CASE", help="A case file to begin with.", show_default=False),
        Reads("the case"),
    ] = None,
    *,
    seed: Annotated[
        int | None, HelpSection.CASES.option("--seed", help="Begin with a random case of this seed. [1]")
    ] = None,
    number: Annotated[
        int | None, HelpSection.CASES.option("--case", metavar="N", min=1, help="Begin with this random case. [1]")
    ] = None,
    store: Annotated[
        Path | None,
        HelpSection.VERDICTS.option("--store", metavar="FILE", help="Mark what the cases of a store visited."),
        Reads("the store"),
    ] = None,
    save: Annotated[
        Path | None,
        HelpSection.OUTPUT.option("--save", metavar="DIR", help="Where cases are saved. [cases beside the model]"),
    ] = None,
    port: Annotated[
        int, HelpSection.RUNNING.option("--port", min=0, max=65_535, help="The port; 0 takes a free one.")
    ] = 0,
) -> int:
    """Open a page to run a model step by step: each click is a line of a test case."""
    server = _server()
    loaded, options = load_model(model), OptionReader()
    folder = save or model.parent / "cases"
    options.read(lambda: FileWriter(model=model).refuse_outputs({}, {"--save": [folder]}), None)
    stored: tuple[str, ...] = options.read(lambda: _stored(store, loaded), ())
    drawn = None if seed is None and number is None else (1 if seed is None else seed, number or 1)
    text = options.last(lambda: _text(loaded, model, folder, case, drawn))
    with _bound(port) as listener:
        from scbm.web.case_saver import CaseSaver  # noqa: PLC0415 - after the check of the extra
        from scbm.web.console_server import Console, console_app  # noqa: PLC0415 - needs the extra
        from scbm.web.model_worker import ModelWorker  # noqa: PLC0415 - with the server
        from scbm.web.obligation_search import ObligationSearches  # noqa: PLC0415 - with the server

        token, (_, free) = secrets.token_urlsafe(24), listener.getsockname()
        beginning = {"text": text, "stored": stored, "has_store": store is not None, "folder": str(folder)}
        console = Console(ModelWorker(model), CaseSaver(folder, model), ObligationSearches(model), token, beginning)
        app = console_app(console, free)
        results().line(f"Open http://{_HOST}:{free}/#{token}")
        results().line("Ctrl-C ends the console.")
        sys.stdout.flush()
        config = server.Config(app, log_level="critical", lifespan="on", ws="none", timeout_graceful_shutdown=1)
        with suppress(KeyboardInterrupt):  # which the server raises again once it has ended
            server.Server(config).run([listener])
    return 0


def _server() -> Any:  # noqa: ANN401 - a library that is optional
    """Return uvicorn. Raise `InputError` without the extra."""
    try:
        import_module("starlette")
        return import_module("uvicorn")
    except ModuleNotFoundError:
        message = "the console needs Starlette and uvicorn, which are not installed"
        raise InputError(
            [Diagnostic(Slug.CONSOLE_MISSING, message, Place("scbm console"), "run `pip install 'scbm[web]'`")]
        ) from None


def _bound(port: int) -> socket.socket:
    """Return a socket that listens at a port of this computer. Raise `InputError` if the port is taken."""
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((_HOST, port))
    except OSError as error:
        listener.close()
        reason = (error.strerror or str(error)).lower()
        raise option_error("--port", f"cannot listen at port {port}: {reason}", "leave it out: any free port") from None
    return listener


def _stored(store: Path | None, model: BehaviorModel) -> tuple[str, ...]:
    """Return the names of the obligations that the cases of a store visited. Raise `InputError` for another model."""
    if store is None:
        return ()
    history = history_of_model(store, model)
    return history.obligations.names(history.coverage.visited)


def _text(model: BehaviorModel, file: Path, folder: Path, case: Path | None, drawn: tuple[int, int] | None) -> str:
    """Return the text of the first case: of a file, of a random case with all that it drew, or a nominal one.

    Args:
        model: the model.
        file: its file.
        folder: where cases are saved.
        case: a case file, if one is given.
        drawn: the seed and the number of a random case, if they are given.
    """
    shown = Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    if case is not None:
        if drawn is not None:
            raise option_error("--case", "a case file is given, too", "leave out one of them")
        return _text_of_file(model, file, case, shown)
    if drawn is not None:
        return write_case(_closed(RandomCases(model, str(file)).case(*drawn), model), model, shown)
    if not model.goals:
        raise option_error("MODEL", "this model has no goal to begin with", "name a case file, or add `goals:`")
    goal, predicate = model.goals[0]
    return write_case(Case("my_case", goal, predicate, model.nominal_state), model, shown)


def _text_of_file(model: BehaviorModel, file: Path, case: Path, shown: str) -> str:
    """Return the text of a case file; one that draws is closed, so that no click draws anything anew."""
    document = open_case(case)
    named = document.model_path
    if named is not None and real_path(named) != real_path(file):
        message, remedy = (
            f"this case is for the model {named}",
            "name this model instead, or change `model:` in the case",
        )
        raise InputError([Diagnostic(Slug.CONTRADICTION, message, Place(str(case)), remedy)])
    read = document.read(model)
    if read.origin is None:
        return read_file(case)
    return write_case(_closed(read, model), model, shown)


def _closed(case: Case, model: BehaviorModel) -> Case:
    """Return the case with all that its run drew, which draws nothing more, whatever a click changes."""
    return replace(Tester(model).execute(case).closed_case, origin=None)
