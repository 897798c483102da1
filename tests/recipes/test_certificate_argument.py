"""An argument of certificates, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.files import digest_of, load_model
from scbm.proofcheck import Certificate, Claim, certificate, certificate_text
from support.recipe_page import followed


def write(directory: Path, *obligations: str) -> None:
    model = load_model(directory / "lamp.yaml")
    claims = tuple(Claim(obligation, "its guard is false") for obligation in obligations)
    argument = vars(certificate)["FalseGuardArgument"]()
    text = certificate_text(Certificate(model.name, digest_of(model), claims, argument), "lamp.yaml")
    (directory / "explode.json").write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("obligation", "code", "told"),
    [("automatic/explode", 0, "sound: 1 obligation"), ("switch_on/failed", 1, "claim switch_on/failed: it is not")],
)
def test_a_certificate_with_a_new_argument_is_checked(
    scbm: Callable[..., Any], tmp_path: Path, obligation: str, code: int, told: str
) -> None:
    with followed("An argument of certificates", tmp_path) as recipe:
        (command,) = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
        write(tmp_path, obligation)
        ran = scbm(*command)
        assert (ran.code, told in ran.out + ran.err) == (code, True)
    unknown = scbm(*command)
    assert (unknown.code, "bad-certificate" in unknown.err) == (2, True)
