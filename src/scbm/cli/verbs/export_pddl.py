"""`scbm export pddl`: writes the planning part of a model as PDDL."""

from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.options.option_values import read_goal, read_state
from scbm.cli.options.verb_options import Goals, Model, StateValues
from scbm.cli.output.terminal import results
from scbm.files import FileWriter, load_model
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.planning.pddl_export import PddlDomain

_OWN = "; exported by scbm "
"""The beginning of each file of an export; a later export replaces only files that begin so."""


def command(
    model: Model,
    *,
    goal: Goals = None,
    state: StateValues = None,
    out: Annotated[Path, typer.Option("--out", metavar="DIRECTORY", help="Where the files are written.")] = Path(
        "pddl"
    ),
) -> int:
    """Write the planning part of a model as PDDL: a domain, and a problem for each goal."""
    writer = FileWriter(model=model)
    writer.refuse_outputs({}, {"--out": [out]})
    loaded = load_model(model)
    goals = loaded.goals if goal is None else (read_goal(goal, loaded),)
    if not goals:
        message, remedy = "the model has no goals", "write one: `--goal PREDICATE`"
        raise InputError([Diagnostic(Slug.NO_GOALS, message, Place(str(model)), remedy)])
    start = read_state(state or [], loaded)
    domain = PddlDomain(loaded, [predicate for _, predicate in goals])
    texts = {out / "domain.pddl": domain.text}
    for number, (name, predicate) in enumerate(goals, start=1):
        known = name if loaded.goal(name) is not None else f"goal-{number}"
        file = "domain-problem" if known.lower() == "domain" else known  # no goal has a hyphen in its name
        texts[out / f"{file}.pddl"] = domain.problem(known, start, predicate)
    first_line = f"{_OWN}from the model {loaded.name}\n"
    writer.write_all({path: first_line + text for path, text in texts.items()}, overwrite=False, own=_OWN)
    for path in texts:
        results().line(str(path))
    return 0
