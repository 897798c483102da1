"""How sums are read and written: signs of numbers, blanks, brackets, and `min` as a function or a name."""

from __future__ import annotations

import pytest

from scbm.files import parse_action, parse_predicate
from scbm.files.language.scope import Scope
from scbm.model import Assign, Constant, Domain, Extreme, ExtremeKind, Reference, Sum, Variable

SCOPE = Scope.over(Variable(name, Domain.integers(-9, 9), 0, (0,)) for name in ("a", "b", "c", "min", "max"))
A, B, C, MIN = map(Reference, ("a", "b", "c", "min"))


@pytest.mark.parametrize(
    ("text", "meaning", "written"),
    [
        ("a-1", Sum(((1, A), (-1, Constant(1)))), "a - 1"),
        ("a -1", Sum(((1, A), (-1, Constant(1)))), "a - 1"),
        ("a - 1", Sum(((1, A), (-1, Constant(1)))), "a - 1"),
        ("a--1", Sum(((1, A), (-1, Constant(-1)))), "a - -1"),
        ("a + -1", Sum(((1, A), (1, Constant(-1)))), "a + -1"),
        ("-1+a", Sum(((1, Constant(-1)), (1, A))), "-1 + a"),
        ("-1", Constant(-1), "-1"),
        ("2 - 3", Constant(-1), "-1"),
        ("a-b-c", Sum(((1, A), (-1, B), (-1, C))), "a - b - c"),
        ("a - (b - c)", Sum(((1, A), (-1, Sum(((1, B), (-1, C)))))), "a - (b - c)"),
        ("(a - b) - c", Sum(((1, A), (-1, B), (-1, C))), "a - b - c"),
        ("a + (b - 1)", Sum(((1, A), (1, B), (-1, Constant(1)))), "a + b - 1"),
        ("a - (1 + 2)", Sum(((1, A), (-1, Constant(3)))), "a - 3"),
        ("(a) + 1", Sum(((1, A), (1, Constant(1)))), "a + 1"),
        ("((a + b))", Sum(((1, A), (1, B))), "a + b"),
        ("(-1)", Constant(-1), "-1"),
        ("((b))", B, "b"),
        ("a - (b)", Sum(((1, A), (-1, B))), "a - b"),
        ("a - ((b - (c)))", Sum(((1, A), (-1, Sum(((1, B), (-1, C)))))), "a - (b - c)"),
        ("(min((a), (b + 1)))", Extreme(ExtremeKind.LEAST, (A, Sum(((1, B), (1, Constant(1)))))), "min(a, b + 1)"),
        ("min(a,b , 3)", Extreme(ExtremeKind.LEAST, (A, B, Constant(3))), "min(a, b, 3)"),
        ("max (a + 1, -2)", Extreme(ExtremeKind.GREATEST, (Sum(((1, A), (1, Constant(1)))), Constant(-2))), None),
        ("min(1, 2)", Constant(1), "1"),
        ("min", MIN, "min"),
        ("min-min(min, a)", Sum(((1, MIN), (-1, Extreme(ExtremeKind.LEAST, (MIN, A))))), "min - min(min, a)"),
    ],
)
def test_a_sum_is_read_and_written(text: str, meaning: object, written: str | None) -> None:
    action = parse_action(f"c<-{text}", SCOPE)
    assert action == Assign("c", meaning)  # type: ignore[arg-type]
    if written is not None:
        assert str(action) == f"c <- {written}"
    assert parse_action(str(action), SCOPE) == action


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("a<-1", "a < -1"),
        ("a==b->b-1==c", "a == b -> b - 1 == c"),
        ("(a+b)<=c", "a + b <= c"),
        ("(a + b <= c)", "a + b <= c"),
        ("(a) + 1 == 2", "a + 1 == 2"),
        ("((a+b)) == 2", "a + b == 2"),
        ("(a) == (b)", "a == b"),
        ("((a) < ((b))) && (true)", "a < b && true"),
        ("((a) + 1 == 2 || (((b)) == 1)) && !(((c) - (1)) > 0)", "(a + 1 == 2 || b == 1) && !(c - 1 > 0)"),
        ("(((true)))", "true"),
        ("!a+b==c&&a-1>-1", "!(a + b == c) && a - 1 > -1"),
        ("1 == max(a, b)", "1 == max(a, b)"),
    ],
)
def test_a_comparison_of_sums_is_read_and_written(text: str, written: str) -> None:
    assert str(parse_predicate(text, SCOPE)) == written
