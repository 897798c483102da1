"""`scbm import pddl`: writes a model for a domain and a problem of PDDL."""

from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.option_errors import option_error
from scbm.cli.output.terminal import errors, results
from scbm.files import FileWriter, read_file, read_model
from scbm.files.file_writer import has_text
from scbm.model import InputError
from scbm.pddl import PddlImportOptions, PddlText, imported_model, read_pddl
from scbm.pddl.pddl_text import merged_errors


def command(
    domain: Annotated[Path, typer.Argument(help="The file with the domain.", show_default=False), Reads("the domain")],
    problem: Annotated[
        Path, typer.Argument(help="The file with the problem.", show_default=False), Reads("the problem")
    ],
    *,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="MODEL", help="The model file to write.")] = Path(
        "model.yaml"
    ),
    group: Annotated[
        list[str] | None,
        typer.Option(
            "--group",
            metavar="PREDICATE[.PARAM]",
            help="A parameter whose values exclude each other; the last one if it is left out.",
        ),
    ] = None,
    resource: Annotated[
        list[str] | None,
        typer.Option("--resource", metavar="PARAM", help="The parameter, or its type, that names the resource."),
    ] = None,
    arguments: Annotated[
        bool, typer.Option("--arguments", help="Requests carry the arguments of their action, not only its name.")
    ] = False,
    number_range: Annotated[
        list[str] | None,
        typer.Option("--range", metavar="FUNCTION=LOW..HIGH", help="The values of a numeric function."),
    ] = None,
) -> int:
    """Write a model for a domain and a problem of PDDL, with its types, predicates and actions."""
    writer = FileWriter()
    writer.refuse_outputs({"--out": out})
    domain_text, problem_text = (PddlText(str(path), read_file(path)) for path in (domain, problem))
    options = PddlImportOptions(tuple(group or ()), tuple(resource or ()), tuple(number_range or ()), arguments)
    made = imported_model(read_pddl(domain_text, problem_text), domain_text, problem_text, options)
    try:
        read_model(made.text, str(out))
    except InputError as error:  # no file has this text yet
        raise InputError(merged_errors(map(made.at_origin, error.diagnostics))) from None
    if out.is_file() and not has_text(out, made.text):
        message = f"{out} exists already, with other content, which may be finished by hand"
        raise option_error("--out", message, "name another file, or remove this one first")
    writer.write("--out", out, made.text.encode())
    errors().diagnostics(made.warnings)
    results().line(str(out))
    return 0
