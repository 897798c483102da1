"""An argument of certificates, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.files import digest_of, load_model
from scbm.proofcheck import Certificate, certificate, certificate_text
from support.recipe_page import followed


def write(directory: Path, *obligations: str) -> None:
    model = load_model(directory / "lamp.yaml")
    claims = tuple(obligations)
    argument = vars(certificate)["FalseGuardArgument"]()
    text = certificate_text(Certificate(model.name, digest_of(model), claims, argument), "lamp.yaml")
    (directory / "explode.json").write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("obligation", "code"),
    [
        ("automatic/explode", 0),
        ("switch_on/failed", 1),
    ],
)
def test_a_certificate_with_a_new_argument_is_checked(
    scbm: Callable[..., Any], tmp_path: Path, obligation: str, code: int
) -> None:
    with followed("An argument of certificates", tmp_path) as recipe:
        (command,) = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
        write(tmp_path, obligation)
        ran = scbm(*command)
        assert ran.code == code
        (checked,) = json.loads(scbm(*command, "--json").out)["certificates"]
        wrong = [flaw.partition(": ")[0] for flaw in checked["flaws"]]
        assert (checked["sound"], wrong) == (code == 0, [f"claim {obligation}"] * code)
    unknown = scbm(*command)
    assert (unknown.code, "bad-certificate" in unknown.err) == (2, True)
