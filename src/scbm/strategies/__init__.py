"""Hypothesis strategies for the test cases of a model.

All of them shrink towards what is plain: the nominal state, the first goal, success, nothing injected, a perfect
network. All of them draw only what a case file may say.
"""

try:
    import hypothesis as _hypothesis  # noqa: F401 - only whether it is there
except ModuleNotFoundError as _missing:
    if _missing.name != "hypothesis":
        raise
    raise ImportError("scbm.strategies needs Hypothesis: pip install 'scbm[testing]'") from None

from scbm.strategies.cases import cases
from scbm.strategies.goals import goals
from scbm.strategies.initial_states import initial_states
from scbm.strategies.injections import injections
from scbm.strategies.networks import networks
from scbm.strategies.outcomes import outcomes

__all__ = ["cases", "goals", "initial_states", "injections", "networks", "outcomes"]
