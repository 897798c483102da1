"""Compiled models that commands of one process share: each model object is compiled once, and packed once for plans.

A program and a planner are functions of their model. What they keep for later calls changes no answer.
"""

from __future__ import annotations

from collections import OrderedDict

import pytest

from scbm.model import BehaviorModel
from scbm.planning.planner import Planner
from scbm.planning.planners import DEFAULT_PLANNER, PLANNERS
from scbm.running.program import Program

_COMPILED = 50
"""Maximum number of models that stay compiled: programs keep the steps of their runs, which takes memory."""

_PROGRAMS: OrderedDict[int, Program] = OrderedDict()
"""By the identity of the model, which the program keeps alive: `share_models` returns one object for each text."""

_PLANNERS: OrderedDict[tuple[int, int], Planner] = OrderedDict()
"""By the identities of the model and of the entry of `PLANNERS`, which the planner keeps alive."""


def share_programs(patch: pytest.MonkeyPatch) -> None:
    """Let the commands of a test reuse the programs and planners of earlier ones."""
    patch.setattr("scbm.running.simulation.simulator.Program", _program)
    patch.setattr(Planner, "of", staticmethod(_planner))


def _program(model: BehaviorModel) -> Program:
    """Return the program of a model."""
    program = _PROGRAMS.pop(id(model), None) or Program(model)
    _PROGRAMS[id(model)] = program
    if len(_PROGRAMS) > _COMPILED:
        _PROGRAMS.popitem(last=False)
    return program


def _planner(model: BehaviorModel) -> Planner:
    """Return the planner that a model names, or the default one."""
    name = model.planner.name or DEFAULT_PLANNER
    key = id(model), id(PLANNERS[name])
    planner = _PLANNERS.pop(key, None) or Planner(model, name)
    _PLANNERS[key] = planner
    if len(_PLANNERS) > _COMPILED:
        _PLANNERS.popitem(last=False)
    return planner
