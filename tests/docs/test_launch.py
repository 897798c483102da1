"""The launch file of the example names files, resources and drivers that are there. ROS 2 itself need not be."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from scbm.cli.options.node_options import load_bound, read_real

ROOT = Path(__file__).parents[2]
LAUNCH = ROOT / "examples/robot_in_the_air/ros2/cell.launch.py"


@pytest.fixture
def commands(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The command lines that the launch file starts."""
    launch, actions = ModuleType("launch"), ModuleType("launch.actions")
    launch.LaunchDescription = list  # type: ignore[attr-defined] # stands for the one of ROS 2
    actions.ExecuteProcess = SimpleNamespace  # type: ignore[attr-defined] # the same
    monkeypatch.setitem(sys.modules, "launch", launch)
    monkeypatch.setitem(sys.modules, "launch.actions", actions)
    described = runpy.run_path(str(LAUNCH))["generate_launch_description"]()
    return [process.cmd for process in described]


def test_everything_that_it_names_is_there(commands: list[list[str]], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    controller, resources = commands
    words, model, _, bindings, _, real = controller[:3], Path(controller[3]), *controller[4:]
    assert words == ["scbm", "node", "controller"]
    loaded = load_bound(model, Path(bindings))
    assert read_real([real], loaded) == (real,)
    assert resources[:4] == ["scbm", "node", "resources", str(model)]
    assert sorted([real, *resources[4:]]) == sorted(resource.name for resource in loaded.resources)
