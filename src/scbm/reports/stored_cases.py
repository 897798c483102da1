"""Properties of stored cases for reports: causes of failures, commands that reproduce cases, and where cases ran.

Similar failures are grouped into one cause with all of its cases. The command for a case that ran over nodes is that
of its whole run. Reports distinguish cases in simulation from cases over nodes, and name the real resources.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.model import FIRST_PLANNER, PlannerIdentity, format_duration
from scbm.model.visible_text import counted, shell_word, shown_path
from scbm.planning import DRAWN_PLANS
from scbm.store import Written
from scbm.testing import MAX_SHRUNK, FailureKind
from scbm.testing.random_cases import MOST_GOALS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.store import History, Recipe, SmallestCase, StoredCase, StoredRun
    from scbm.testing import Failure


class Cause(Struct, frozen=True):
    """A cause of failures.

    Attributes:
        failure: the failure of the first case.
        case: the first case.
        messages: the labels of all cases with this cause, in the order of the store, each with its message.
        smallest: the smallest case that fails for this cause; `None` if none is stored.
    """

    failure: Failure
    case: StoredCase
    messages: tuple[tuple[str, str], ...]
    smallest: SmallestCase | None

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels of all cases with this cause."""
        return tuple(label for label, _ in self.messages)


def causes_of(history: History) -> tuple[Cause, ...]:
    """Return all causes, in the order of their first cases.

    Failures have the same cause if their kind and subject are equal. For goals that were not reached the goals must be
    equal too, and for requirements of a command line their sentences. Each unmet expectation is a cause of its own.
    """
    found: dict[tuple[str, ...], tuple[Failure, dict[str, str], list[StoredCase]]] = {}
    for label, case in zip(history.labels, history.cases, strict=True):
        for failure in case.verdict.failures:
            key = (failure.kind.value, failure.subject, _scope(failure, case, label))
            _, messages, cases = found.setdefault(key, (failure, {}, []))
            messages.setdefault(label, failure.message)
            cases.append(case)
    return tuple(
        Cause(failure, cases[0], tuple(messages.items()), _smallest(failure, cases))
        for failure, messages, cases in found.values()
    )


def _smallest(failure: Failure, cases: Sequence[StoredCase]) -> SmallestCase | None:
    """Return the smallest case that is stored with one of the cases that fail for a cause."""
    alike = (each for case in cases for each in case.smallest if each.subject == failure.subject)
    return next((each for each in alike if each.kind is failure.kind), None)


def smallest_by_label(history: History) -> dict[str, tuple[SmallestCase, ...]]:
    """Return the smallest cases that fail as a failed case does, by the labels of the cases that have any."""
    found: dict[str, tuple[SmallestCase, ...]] = {}
    for cause in causes_of(history):
        if cause.smallest is not None:
            found |= {label: (*found.get(label, ()), cause.smallest) for label in cause.labels}
    return found


def smallest_lines(smallest: SmallestCase | None) -> Iterator[str]:
    """Yield the file and the size of a smallest case, then what matters in it; nothing for `None`."""
    if smallest is not None:
        yield f"smallest: {smallest.sizes}{f'; {smallest.path}' if smallest.path else ''}"
        yield from (f"it matters: {choice}" for choice in smallest.what_matters)


def replay_command(smallest: SmallestCase) -> str:
    """Return the command that runs a smallest case again; empty if it has no file."""
    return f"scbm replay {shown_path(smallest.path)}" if smallest.path else ""


def why_no_smallest(stored: StoredCase, runs: Sequence[StoredRun]) -> str:
    """Return why no smallest case of a failed case is stored, one sentence."""
    if stored.is_over_nodes:
        return "Cases that ran over nodes are not made smaller."
    if "--no-shrink" in runs[stored.run].command.split():
        return "Its run had the option `--no-shrink`, so no smaller case was sought."
    if all(failure.kind in (FailureKind.EXPECTATION, FailureKind.IMPOSSIBLE) for failure in stored.verdict.failures):
        return "What it expects belongs to this case alone, so no smaller case was sought."
    return f"Its run sought none: it was interrupted, or had more than {MAX_SHRUNK} other failures."


def asked_for(failure: Failure, recipe: Recipe) -> str:
    """Return the sentence of a violated requirement of the command line; its name, `required_1`, says nothing."""
    return dict(recipe.requirements).get(failure.subject, "")


def _scope(failure: Failure, case: StoredCase, label: str) -> str:
    """Return what must be equal besides kind and subject."""
    if failure.kind is FailureKind.EXPECTATION:
        return label
    if failure.kind is FailureKind.REQUIREMENT:
        return asked_for(failure, case.recipe)
    return case.goal if failure.kind is FailureKind.NOT_REACHED else ""


def again(stored: StoredCase, model_file: str, runs: Sequence[StoredRun]) -> str:
    """Return the command line that runs a case again; empty for a case that cannot be run again.

    Such a case is of an earlier version of the model, or was lost with a node. A case over nodes has the command of its
    whole run, whose outcome may differ.

    Args:
        stored: the case.
        model_file: the path of the model file.
        runs: the runs of its history.
    """
    if not stored.is_shown_again:
        return ""
    if stored.is_over_nodes:
        return runs[stored.run].command
    recipe, run = stored.recipe, runs[stored.run]
    if isinstance(recipe, Written) and recipe.is_of_test:
        return f"pytest {shown_path(recipe.path)}{_planner_options(run, '--scbm-')}"
    if isinstance(recipe, Written):
        options = "" if _PLANS.search(recipe.text) else _planner_options(run, more=recipe.text)  # it needs no planner
        return f"scbm replay {shown_path(recipe.path)} --model {shown_path(model_file)}{options}{_added(recipe)}"
    network = f" --network {shell_word(recipe.network)}" if recipe.network else ""
    network += " --inputs drawn" if recipe.moves_inputs else ""
    default = 1 if _declares(run.source.text, _SINGLE) else MOST_GOALS
    network += "" if recipe.goals == default else f" --goals {recipe.goals}"
    options = f"{network}{_planner_options(run)}{_added(recipe)}"
    return f"scbm run {shown_path(model_file)} --seed {recipe.seed} --case {recipe.number}{options}"


_DRAWN = re.compile(r"""\bplans["']?\s*:\s*["']?drawn\b""")
"""Found in the text of a model that declares drawn plans."""

_SINGLE = re.compile(r"""\bgoals["']?\s*:\s*["']?single\b""")
"""Found in the text of a model whose runs have one goal each."""

_PLANS = re.compile(r"^plans\b", re.MULTILINE)
"""Found in the text of a case with recorded answers of a planner."""


@lru_cache(16)
def _declares(text: str, pattern: re.Pattern[str]) -> bool:
    """Return whether the text of a model has a pattern; all cases of a run ask the same."""
    return pattern.search(text) is not None


def _planner_options(run: StoredRun, prefix: str = "--", more: str = "") -> str:
    """Return the options for the planner of a run, each with a leading blank.

    The default planner without limits needs no options where the model file says nothing about a planner, nor does the
    text `more` of a case.
    """
    planner = PlannerIdentity.parse(run.planner)
    is_drawn, declares = planner.name == DRAWN_PLANS, _declares(run.source.text, _DRAWN)
    plans = [("plans", DRAWN_PLANS if is_drawn else FIRST_PLANNER.name)] if is_drawn != declares else []
    planner = replace(planner, name=FIRST_PLANNER.name) if is_drawn else planner
    if planner.words == FIRST_PLANNER.name and "planner" not in run.source.text + more:
        options = plans
    else:
        limits = [(name.replace("_", "-"), str(limit)) for name, limit in planner.limits.items()]
        options = [("planner", planner.name), *limits, *plans]
    return "".join(
        f" {prefix}{option} {shell_word(value)}" for option, value in options if prefix == "--" or option != "plans"
    )


def again_words(stored: StoredCase) -> str:
    """Return the words before the command of a case."""
    return "again, with its whole run" if stored.is_over_nodes else "again"


def _added(recipe: Recipe) -> str:
    """Return the options that the command line added to the case, each with a leading blank."""
    limit = [] if recipe.time_limit_ns is None else [("--time-limit", format_duration(recipe.time_limit_ns))]
    options = [*limit, *(("--require", sentence) for _, sentence in recipe.requirements)]
    return "".join(f" {option} {shell_word(value)}" for option, value in options)


_MAX_PLACES = 5


def place_of(case: StoredCase, history: History) -> str:
    """Return where a case ran with its real resources, as `over DDS domain 0; real: scan`; empty for simulation."""
    if case.recipe.real is None:
        return ""
    real = f"real: {', '.join(case.recipe.real)}" if case.recipe.real else "all resources simulated"
    return f"{history.where(case)}; {real}"


def sort_of_place(case: StoredCase) -> str:
    """Return the kind of place of a case, without its DDS domain."""
    if case.recipe.real is None:
        return "in simulation"
    return f"over nodes, real: {', '.join(case.recipe.real)}" if case.recipe.real else "over nodes"


def durations(history: History) -> str:
    """Return the total time of the runs: `12.30 s simulated, 5.60 s over nodes`."""
    over_nodes = sum(case.is_over_nodes for case in history.cases)
    is_simulated = over_nodes < len(history.cases) or not over_nodes
    parts = [f"{(history.ended_ns - history.over_nodes_ns) / 1e9:.2f} s simulated"] if is_simulated else []
    parts += [f"{history.over_nodes_ns / 1e9:.2f} s over nodes"] if over_nodes else []
    return ", ".join(parts)


def place_counts(history: History) -> Iterator[str]:
    """Yield the number of cases for each place over nodes; nothing if all cases were simulated."""
    counts: dict[str, int] = {}
    for case in history.cases:
        place = place_of(case, history)
        counts[place] = counts.get(place, 0) + 1
    counts.pop("", None)
    for place, count in list(counts.items())[:_MAX_PLACES]:
        yield f"{counted(count, 'case')} {place}"
    if len(counts) > _MAX_PLACES:
        yield f"{sum(list(counts.values())[_MAX_PLACES:])} more at {len(counts) - _MAX_PLACES} other places"
