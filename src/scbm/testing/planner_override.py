"""The planner of a command line in place of the planner of a model."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.files import suggestion
from scbm.model import Diagnostic, InputError, Place, PlannerChoice, RunPlans, Slug
from scbm.planning import DEFAULT_PLANNER, DRAWN_PLANS, PLANNERS, model_planned_by, model_with_plans

if TYPE_CHECKING:
    from scbm.cases import Case
    from scbm.model import BehaviorModel


def refuse_unknown_planner(name: str | None, prefix: str) -> None:
    """Raise `InputError` if there is no planner of a name; `prefix` is that of the options, such as `--`."""
    if name is not None and name not in PLANNERS:
        remedy = suggestion(name, PLANNERS, "the planners are")
        if name == DRAWN_PLANS:
            remedy = "to draw plans from all shortest ones, declare `runs: {plans: drawn}` in the model"
        place = Place(f"{prefix}planner", 1, 1, max(1, len(name)))
        raise InputError([Diagnostic(Slug.UNKNOWN_PLANNER, f"there is no planner `{name}`", place, remedy, name)])


def override_planner(
    model: BehaviorModel, wanted: PlannerChoice, prefix: str = "--", plans: RunPlans | None = None
) -> BehaviorModel:
    """Return the model with the planner, the limits and the plans of a command line, where it names them.

    The limits in the model are for the planner that is named there, so another name begins with the defaults.

    Args:
        model: the model.
        wanted: the planner and the limits of the command line; `None` leaves them to the model.
        prefix: what the options begin with.
        plans: the plans of random cases; `None` leaves them to the model.

    Raises:
        InputError: there is no such planner, it is another program and takes no such limit, or plans are to be drawn
            from all shortest ones and it is not the canonical one.
    """
    refuse_unknown_planner(wanted.name, prefix)
    _refuse_draws(model, wanted.name, prefix, plans)
    model = model if plans is None else model_with_plans(plans, model)
    choice = model.planner
    if wanted.name is not None and wanted.name != (choice.name or DEFAULT_PLANNER):
        choice = PlannerChoice(wanted.name)
    name = choice.name or DEFAULT_PLANNER
    if PLANNERS[name].is_external and wanted.max_expanded is not None:
        raise InputError([uncounted(name, f"{prefix}max-expanded")])
    length = choice.max_length if wanted.max_length is None else wanted.max_length
    expanded = choice.max_expanded if wanted.max_expanded is None else wanted.max_expanded
    return replace(model, planner=PlannerChoice(choice.name, length, expanded))


def _refuse_draws(model: BehaviorModel, planner: str | None, prefix: str, plans: RunPlans | None) -> None:
    """Raise `InputError` if plans are to be drawn from all shortest ones under a planner that knows no lengths.

    Args:
        model: the model.
        planner: the planner of the command line; `None` leaves it to the model.
        prefix: what the options begin with.
        plans: the plans of the command line; `None` leaves them to the model.
    """
    name = planner or model.planner.name or DEFAULT_PLANNER
    if name == DEFAULT_PLANNER or (plans or model.runs.plans) is not RunPlans.DRAWN:
        return
    where = "" if planner is not None else ", which the model names"
    message = f"plans are drawn from shortest ones with the planner `{DEFAULT_PLANNER}` alone, not with `{name}`{where}"
    option = "planner" if plans is None else "plans"
    remedy = f"add `{prefix}planner {DEFAULT_PLANNER}`" if planner is None else "leave out one of the two options"
    if plans is None:
        message = f"the model declares `plans: drawn`, and {message}"
        remedy = f"leave out `{prefix}planner`" + (", or add `--plans canonical`" if prefix == "--" else "")
    raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(f"{prefix}{option}"), remedy)])


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
    recorded = model_planned_by(case.recorded.planner, model)
    own = replace(model.planner, name=model.planner.name or DEFAULT_PLANNER)
    if recorded.planner != own:
        options = f" --planner {own.name}{options}"
    is_drawn_otherwise = recorded.runs != model.runs and case.origin is not None and " --plans " not in options
    return f"{options} --plans {model.runs.plans}" if is_drawn_otherwise else options


def uncounted(name: str, option: str) -> Diagnostic:
    """Return the error about a limit that another program would ignore."""
    message = f"the planner `{name}` is another program, which takes no such limit"
    remedy = "leave it out; such planners have a limit of wall time"
    return Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy)
