"""Why `non_blocking` does not judge a case (semantics 7.12)."""

from __future__ import annotations

from enum import StrEnum


class Unjudged(StrEnum):
    """The reason why `non_blocking` does not judge a case (semantics 7.12)."""

    NO_RUN = "no_run"
    """The case was lost, or lists an impossible change. Then no requirement is checked."""
    SINGLE_GOALS = "single_goals"
    DRAWN_PLANS = "drawn_plans"
    EXTERNAL_PLANNER = "external_planner"
    OTHER_GOALS = "other_goals"
    FORCE = "force"
    LIMIT = "limit"
    LIVELOCK = "livelock"
    TOO_LONG = "too_long"

    @property
    def words(self) -> str:
        """The reason behind "as"."""
        return _UNJUDGED_WORDS[self]


_UNJUDGED_WORDS = {
    Unjudged.NO_RUN: "the run was lost or is impossible",
    Unjudged.SINGLE_GOALS: "each run has one goal",
    Unjudged.DRAWN_PLANS: "plans are drawn",
    Unjudged.EXTERNAL_PLANNER: "another program makes the plans",
    Unjudged.OTHER_GOALS: "a goal is none of the model",
    Unjudged.FORCE: "the state was forced",
    Unjudged.LIMIT: "a limit ended the first run",
    Unjudged.LIVELOCK: "automatic transitions repeat without end",
    Unjudged.TOO_LONG: "too many situations can follow",
}
