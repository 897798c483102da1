"""The options that choose a planner and limit its searches. They override `planner:` of the model."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

from msgspec import Struct
from msgspec.structs import replace

from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.registry_options import KnownName, OptionGroup
from scbm.files import parse_duration
from scbm.model import BehaviorModel, InputError, PlannerChoice, RunPlans, Slug
from scbm.model.visible_text import shell_word
from scbm.planning import DEFAULT_PLANNER, PLANNERS, PlanLimits
from scbm.testing.planner_override import override_planner, uncounted

if TYPE_CHECKING:
    from collections.abc import Sequence

PlannerName = Annotated[
    str | None,
    KnownName(
        lambda: PLANNERS,
        HelpSection.PLANNER.option(
            "--planner", help=f"The planner: {{names}}. [that of the model, or {DEFAULT_PLANNER}]"
        ),
    ),
]
MaxLength = Annotated[
    int | None,
    HelpSection.PLANNER.option(
        "--max-length", metavar="N", min=0, help="Maximum number of operations in a plan. [1000]"
    ),
]
MaxExpanded = Annotated[
    int | None,
    HelpSection.PLANNER.option(
        "--max-expanded", metavar="N", min=1, help="Maximum number of expanded states. [1000000]"
    ),
]
MaxTime = Annotated[
    str | None,
    HelpSection.PLANNER.option("--max-time", metavar="DURATION", help="Maximum wall time of a search. [none]"),
]
MaxMemory = Annotated[
    str | None,
    HelpSection.PLANNER.option("--max-memory", metavar="SIZE", help="Maximum memory of the process, `2 GiB`. [none]"),
]

Plans = Annotated[
    str | None,
    KnownName(
        lambda: RUN_PLANS,
        HelpSection.PLANNER.option(
            "--plans",
            help="The plans of random cases: {names}; `drawn` are from all shortest ones. "
            "[those of the model, or canonical]",
        ),
    ),
]
RUN_PLANS = tuple(plans.value for plans in RunPlans)
"""The plans that random cases can have."""

_SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([kMGT]i?)?B", re.ASCII)
_FACTORS = {None: 1} | {
    f"{prefix}{binary}": (1024 if binary else 1000) ** power
    for power, prefix in enumerate("kMGT", start=1)
    for binary in ("", "i")
}


class PlannerOptions(Struct, frozen=True):
    """The planner, its limits and the plans of a command line; `None` where an option is absent."""

    name: str | None = None
    max_length: int | None = None
    max_expanded: int | None = None
    max_time: str | None = None
    max_memory: str | None = None
    plans: str | None = None

    def applied(self, model: BehaviorModel) -> BehaviorModel:
        """Return the model with the planner of the command line. Raise `InputError` for options that do not fit."""
        wanted = PlannerChoice(self.name, self.max_length, self.max_expanded)
        chosen = override_planner(model, wanted, plans=self._run_plans())
        name = chosen.planner.name or DEFAULT_PLANNER
        if PLANNERS[name].is_external and self.max_memory is not None:
            raise InputError([uncounted(name, "--max-memory")])
        return chosen

    def limits(self, model: BehaviorModel) -> PlanLimits:
        """Return the limits of a model to which these options are applied, with those of time and memory."""
        return replace(PlanLimits.of(model), time_ns=self._time_ns(), memory_bytes=self._memory_bytes())

    @property
    def text(self) -> str:
        """The options as they are repeated on a command line, with a blank before each."""
        return "".join(f" {word}" for word in map(shell_word, self.words))

    @property
    def words(self) -> Sequence[str]:
        """The options, each followed by its value."""
        options = (
            ("--planner", self.name),
            ("--max-length", self.max_length),
            ("--max-expanded", self.max_expanded),
            ("--max-time", self.max_time),
            ("--max-memory", self.max_memory),
            ("--plans", self.plans),
        )
        return [word for option, value in options if value is not None for word in (option, str(value))]

    def _run_plans(self) -> RunPlans | None:
        if self.plans is None or self.plans in RUN_PLANS:
            return None if self.plans is None else RunPlans(self.plans)
        message, remedy = f"`{self.plans}` is not a set of plans that runs can have", "write `canonical` or `drawn`"
        raise option_error("--plans", message, remedy, self.plans)

    def _time_ns(self) -> int | None:
        if self.max_time is None:
            return None
        time_ns = parse_duration(self.max_time)
        if time_ns:
            return time_ns
        message, remedy = f"`{self.max_time}` is not a duration to search for", "write a number and a unit: `10 s`"
        raise option_error("--max-time", message, remedy, self.max_time, Slug.BAD_DURATION)

    def _memory_bytes(self) -> int | None:
        if self.max_memory is None:
            return None
        match = _SIZE.fullmatch(self.max_memory.strip())
        size = 0 if match is None else int(float(match[1]) * _FACTORS[match[2]])
        if size:
            return size
        message, remedy = f"`{self.max_memory}` is not an amount of memory", "write a number and a unit: `2 GiB`"
        raise option_error("--max-memory", message, remedy, self.max_memory)


NO_PLANNER_OPTIONS = PlannerOptions()
"""A command line that leaves the planner to the model."""


def _run_planner(
    *, planner: PlannerName = None, max_length: MaxLength = None, max_expanded: MaxExpanded = None, plans: Plans = None
) -> PlannerOptions:
    return PlannerOptions(planner, max_length, max_expanded, plans=plans)


RunPlanner = Annotated[PlannerOptions, OptionGroup(_run_planner)]
"""The options of verbs that run cases."""
