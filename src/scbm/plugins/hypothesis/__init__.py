"""Hypothesis strategies for the test cases of a model.

All of them shrink towards the simplest case: the nominal state, the first goal, success, no injection, a perfect
network. They draw only cases that a case file can express.
"""

try:
    import hypothesis as _hypothesis  # noqa: F401 - only whether it is there
except ModuleNotFoundError as _missing:
    if _missing.name != "hypothesis":
        raise
    raise ImportError("scbm.plugins.hypothesis needs Hypothesis: pip install 'scbm[testing]'") from None

from scbm.plugins.hypothesis.case_strategies import cases, goals, initial_states, injections, networks, outcomes

__all__ = ["cases", "goals", "initial_states", "injections", "networks", "outcomes"]
