"""Simulated seconds per wall second of one core, for campaigns of the example, and where the time goes.

Planning, tracing, judging and measuring are included, as in `scbm test`; loading the model is not. The paper's
campaign ran on real time, so the figure is also how many times faster a campaign is here.
"""

from __future__ import annotations

import cProfile
import pstats
import time
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.files import load_model
from scbm.testing import Campaign, RandomCases, Tester

if TYPE_CHECKING:
    from scbm.model import BehaviorModel

ROOT = Path(__file__).parent.parent
CASES = 500
ROUNDS = 5
LEAST_SHARE = 0.005


def campaign(model: BehaviorModel, seed: int) -> tuple[float, float]:
    """Simulated and wall seconds of one campaign, with a tester that knows nothing yet."""
    begin = time.perf_counter()
    tester = Tester(model)
    result = Campaign.of(tester.model, tester.results(RandomCases(model).first(CASES, seed)))
    return result.simulated_ns / 1e9, time.perf_counter() - begin


def packages(model: BehaviorModel) -> dict[str, float]:
    """The share of each package in the time of a campaign; the profiler makes small functions look larger."""
    profile = cProfile.Profile()
    profile.runcall(campaign, model, 0)
    spent: dict[str, float] = {}
    for (file, _, _), (_, _, own, _, _) in pstats.Stats(profile).stats.items():  # type: ignore[attr-defined]
        parts = Path(file).parts
        package = parts[-2] if parts[-3:-2] == ("scbm",) else "Python itself"
        spent[package] = spent.get(package, 0.0) + own
    whole = sum(spent.values())
    return {package: share / whole for package, share in sorted(spent.items(), key=lambda item: -item[1])}


def main() -> None:
    """Prints the figures."""
    for name in ("before", "after"):
        model = load_model(ROOT / "examples" / "robot_in_the_air" / f"{name}.yaml")
        ratios = [simulated / wall for simulated, wall in (campaign(model, seed) for seed in range(ROUNDS))]
        print(f"{name}.yaml: {max(ratios):,.0f} simulated seconds per second (best of {ROUNDS},", end=" ")
        print(f"worst {min(ratios):,.0f}; {CASES} cases each)")
        print(
            "  "
            + ", ".join(f"{package} {share:.0%}" for package, share in packages(model).items() if share > LEAST_SHARE)
        )


if __name__ == "__main__":
    main()
