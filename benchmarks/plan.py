"""Planning the goals of the example from the nominal state, beside the slow reference planner of the tests."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.files import load_model
from scbm.planning import Planner, Solved

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import BehaviorModel, Predicate

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from support.reference import canonical_plan  # noqa: E402 - it lives with the tests


def best_ms(function: Callable[[], object], rounds: int) -> float:
    """The shortest of some calls, in milliseconds."""
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return 1_000 * min(times)


def figures(model: BehaviorModel, warm: Planner, goal: Predicate) -> str:
    """What planning one goal takes."""
    start = model.nominal_state
    answer = warm.plan(start, goal)
    length = len(answer.plan) if isinstance(answer, Solved) else 0
    warm_ms = best_ms(lambda: warm.plan(start, goal), 200)
    cold_ms = best_ms(lambda: Planner(model).plan(start, goal), 20)
    slow_ms = best_ms(lambda: canonical_plan(model, start, goal, 100), 1)
    times = f"warm {warm_ms:.3f} ms, cold {cold_ms:.2f} ms, reference {slow_ms:.0f} ms ({slow_ms / warm_ms:,.0f}x)"
    return f"{length:>2} operations, {answer.expanded:>3} expanded: {times}"


def main() -> None:
    """Prints a line for each goal."""
    for name in ("before", "after"):
        model = load_model(ROOT / "examples" / "robot_in_the_air" / f"{name}.yaml")
        warm = Planner(model)
        for goal_name, goal in model.goals:
            print(f"{name}.yaml {goal_name:<32} {figures(model, warm, goal)}")


if __name__ == "__main__":
    main()
