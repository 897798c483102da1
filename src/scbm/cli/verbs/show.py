"""`scbm show`: the size of a model as it is written and as it is expanded, and the expanded model itself."""

from typing import Annotated, Any

import typer

from scbm.cases.coverage import Obligations
from scbm.cli.options.verb_options import Json, Model
from scbm.cli.output.terminal import results, write_json
from scbm.files import count_entries, digest_of, read_file, read_model, write_model
from scbm.model import BehaviorModel

FORMAT_VERSION = 1


def command(
    model: Model,
    *,
    expanded: Annotated[
        bool, typer.Option("--expanded", help="Print the model with its objects, parts and short forms written out.")
    ] = False,
    json: Json = False,
) -> int:
    """Show the size of a model, or the model with everything written out."""
    text = read_file(model)
    loaded = read_model(text, str(model))
    written_out = write_model(loaded)
    if json:
        data = _size(text, loaded, written_out, str(model))
        write_json({"format_version": FORMAT_VERSION, **data, **({"text": written_out} if expanded else {})})
    elif expanded:
        results().line(written_out.removesuffix("\n"))
    else:
        _print(_size(text, loaded, written_out, str(model)))
    return 0


def _size(text: str, model: BehaviorModel, written_out: str, file: str) -> dict[str, Any]:
    """Return the numbers of entries and lines, as the files have them and after the expansion."""
    written = count_entries(text, file)
    sections = {
        "variables": model.variables,
        "resources": model.resources,
        "operations": model.operations,
        "automatic_transitions": model.automatic_transitions,
        "environment": model.environment,
        "goals": model.goals,
        "requirements": model.requirements,
    }
    return {
        "file": file,
        "model": model.name,
        "digest": digest_of(model),
        "obligations": Obligations.of(model).counted.bit_count(),
        "files": written["files"],
        "lines": {"written": written["lines"], "expanded": len(written_out.splitlines())},
        "sections": {name: {"written": written[name], "expanded": len(entries)} for name, entries in sections.items()},
        "origins": [
            {"section": origin.section, "name": origin.name, "lifted": origin.lifted} for origin in model.origins
        ],
    }


def _print(size: dict[str, Any]) -> None:
    out = results()
    out.line(f"{size['model']}: {size['obligations']} obligations of SCBM-IAS")
    out.line(f"  {'':23}{'written':>9}{'expanded':>10}")
    for name, counts in {**size["sections"], "lines": size["lines"]}.items():
        if any(counts.values()):
            out.line(f"  {name.replace('_', ' '):23}{counts['written']:9,}{counts['expanded']:10,}")
    if size["files"] > 1:
        out.line(f"  written in {size['files']} files, those of parts and included files among them")
    out.line(f"  digest {size['digest']}")
