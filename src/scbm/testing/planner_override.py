"""The planner of a command line in place of the planner of a model."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.files import suggestion
from scbm.model import Diagnostic, InputError, Place, PlannerChoice, Slug
from scbm.planning import DEFAULT_PLANNER, PLANNERS, model_planned_by

if TYPE_CHECKING:
    from scbm.cases import Case
    from scbm.model import BehaviorModel


def refuse_unknown_planner(name: str | None, prefix: str) -> None:
    """Raise `InputError` if there is no planner of a name; `prefix` is that of the options, such as `--`."""
    if name is not None and name not in PLANNERS:
        remedy = suggestion(name, PLANNERS, "the planners are")
        place = Place(f"{prefix}planner", 1, 1, max(1, len(name)))
        raise InputError([Diagnostic(Slug.UNKNOWN_PLANNER, f"there is no planner `{name}`", place, remedy, name)])


def override_planner(model: BehaviorModel, wanted: PlannerChoice, prefix: str = "--") -> BehaviorModel:
    """Return the model with the planner and the limits of a command line, where it names them.

    The limits in the model are for the planner that is named there, so another name begins with the defaults.

    Args:
        model: the model.
        wanted: the planner and the limits of the command line; `None` leaves them to the model.
        prefix: what the options begin with.

    Raises:
        InputError: there is no such planner, or it is another program and takes no such limit.
    """
    refuse_unknown_planner(wanted.name, prefix)
    choice = model.planner
    if wanted.name is not None and wanted.name != (choice.name or DEFAULT_PLANNER):
        choice = PlannerChoice(wanted.name)
    name = choice.name or DEFAULT_PLANNER
    if PLANNERS[name].is_external and wanted.max_expanded is not None:
        raise InputError([uncounted(name, f"{prefix}max-expanded")])
    length = choice.max_length if wanted.max_length is None else wanted.max_length
    expanded = choice.max_expanded if wanted.max_expanded is None else wanted.max_expanded
    return replace(model, planner=PlannerChoice(choice.name, length, expanded))


def planner_of_replay(case: Case, model: BehaviorModel, options: str) -> str:
    """Return the options for the planner with which `scbm replay` runs a written case as a campaign ran it.

    A replay takes a recorded planner where no option names another one, and recorded plans in any case.

    Args:
        case: the case.
        model: the model of the campaign, with the planner of its command line.
        options: the options of that command line, each with a leading blank.
    """
    if case.plans:
        return ""
    if case.recorded is None or " --planner " in options:
        return options
    is_other = model_planned_by(case.recorded.planner, model).planner != model.planner
    return f" --planner {model.planner.name or DEFAULT_PLANNER}{options}" if is_other else options


def uncounted(name: str, option: str) -> Diagnostic:
    """Return the error about a limit that another program would ignore."""
    message = f"the planner `{name}` is another program, which takes no such limit"
    remedy = "leave it out; such planners have a limit of wall time"
    return Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy)
