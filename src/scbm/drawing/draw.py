"""`scbm draw`: a picture of a model, or of the plan to a goal, colored by what the tests did."""

from pathlib import Path
from typing import Annotated

import typer
from msgspec.structs import replace

from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import OptionReader, option_error
from scbm.cli.options.option_values import read_goal
from scbm.cli.options.status_options import Certificates, history_of_model, read_evidence, stored_evidence
from scbm.cli.options.verb_options import Model
from scbm.cli.output.terminal import errors, results
from scbm.drawing.automata import ModelAutomata
from scbm.drawing.edge_statuses import EdgeStatuses
from scbm.drawing.model_picture import automata_picture, plan_picture
from scbm.drawing.named_parts import named_automata
from scbm.files import load_model
from scbm.model import BehaviorModel
from scbm.model.visible_text import shell_word, shown_path
from scbm.planning import PlanLimits, Planner, Solved
from scbm.running.search_guard import plan_guarded

Names = Annotated[
    list[str] | None,
    typer.Argument(metavar="NAME...", help="Variables, operations, transitions, resources.", show_default=False),
]


def command(
    model: Model,
    names: Names = None,
    *,
    svg: Annotated[bool, HelpSection.OUTPUT.option("--svg", help="Print SVG; this is the default.")] = False,
    html: Annotated[bool, HelpSection.OUTPUT.option("--html", help="Print a page for a browser.")] = False,
    mermaid: Annotated[bool, HelpSection.OUTPUT.option("--mermaid", help="Print Markdown for Mermaid.")] = False,
    store: Annotated[
        Path | None,
        HelpSection.VERDICTS.option("--store", metavar="FILE", help="Color what the cases of a store visited."),
        Reads("the store"),
    ] = None,
    certificates: Certificates = None,
    goal: Annotated[str | None, HelpSection.CASES.option("--goal", help="Draw the plan to this goal instead.")] = None,
) -> int:
    """Draw what changes each variable of a model, or the plan to a goal, colored by what the tests did."""
    forms = [form for form, is_given in (("svg", svg), ("html", html), ("mermaid", mermaid)) if is_given]
    if len(forms) > 1:
        raise option_error(f"--{forms[1]}", f"--{forms[0]} is given, too", "leave out one of the two")
    if names and goal is not None:
        raise option_error("--goal", "the picture of a plan shows its operations", "leave out the names")
    loaded = load_model(model)
    automata, reader = ModelAutomata.of(loaded), OptionReader()
    statuses = reader.read(lambda: _statuses(loaded, model, store, certificates), EdgeStatuses())
    if goal is None:
        chosen = reader.last(lambda: named_automata(automata, names or ()))
        picture = automata_picture(automata, chosen, statuses)
    else:
        name, predicate = reader.last(lambda: read_goal(goal, loaded))
        answer = plan_guarded(Planner.of(loaded), loaded.nominal_state, predicate, PlanLimits.of(loaded))
        if not isinstance(answer, Solved):
            why = f"scbm plan {shown_path(str(model))} --goal {shell_word(goal)}"
            errors().prose(f"There is no plan to draw; `{why}` shows why.")
            return 1
        picture = plan_picture(automata, name, answer.plan, statuses)
    shown = picture.html() if html else picture.mermaid if mermaid else picture.svg()
    results().line(shown.removesuffix("\n"))
    return 0


def _statuses(model: BehaviorModel, file: Path, store: Path | None, certificates: list[Path] | None) -> EdgeStatuses:
    """Return the statuses of a store, or of certificates alone; a certificate counts only if it holds.

    Raises:
        InputError: the store is of another model, or a file is no store or no certificate.
    """
    if store is None:
        if not certificates:
            return EdgeStatuses()
        return EdgeStatuses.of_evidence(model, read_evidence(model, file, certificates, None)[0])
    history = history_of_model(store, model)
    evidence = stored_evidence(history, certificates, None, ())
    if evidence is not None:
        history = replace(history, decided=evidence.statuses(history.coverage, history.forced))
    return EdgeStatuses.of_store(history)
