"""Predicates, actions, requirements and states in texts of their own: what they mean, and where they are wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from scbm.files import Scope, Where, parse_action, parse_predicate, parse_requirement, parse_state, parse_value
from scbm.model import (
    Add,
    AfterAlways,
    Always,
    And,
    Assign,
    Before,
    Constant,
    Domain,
    Equal,
    Implies,
    InputError,
    LeadsTo,
    Member,
    Never,
    Not,
    NotEqual,
    Or,
    Order,
    Reference,
    Relation,
    Slug,
    StateSpace,
    Truth,
    Variable,
)
from scbm.model.variables import resource_variables, runner_variables
from support.models import scan_cell
from support.wording import Wording

if TYPE_CHECKING:
    from scbm.model import Action, Diagnostic, Predicate
    from scbm.model.requirements import RequirementForm

WORLD = (
    Variable("a", Domain.boolean(), False, (False,)),
    Variable("b", Domain.boolean(), False, (False,)),
    Variable("c", Domain.boolean(), False, (False,)),
    Variable("at", Domain.symbols("home", "agv", "box"), "home", ("home",)),
    Variable("was_at", Domain.symbols("box", "shelf"), "box", ("box",)),
    Variable("n", Domain.integers(0, 5), 0, (0,)),
    Variable("m", Domain.integers(-2, 9), 0, (0,)),
    Variable("far", Domain.integers(20, 30), 20, (20,)),
    *resource_variables("arm"),
)
SCOPE = Scope.over((*WORLD, *runner_variables(["go", "stop"])))
SPACE = StateSpace(WORLD)

A, B, C = (Equal(Reference(name), Constant(True)) for name in "abc")


def predicate(text: str, where: Where = Where.GUARD) -> Predicate:
    return parse_predicate(text, SCOPE, where)


def action(text: str, where: Where = Where.AUTOMATIC) -> Action:
    return parse_action(text, SCOPE, where)


def requirement(text: str) -> RequirementForm:
    return parse_requirement(text, SCOPE)


def predicate_faults(text: str, where: Where = Where.GUARD) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        parse_predicate(text, SCOPE, where, "--goal")
    return raised.value.diagnostics


def action_faults(text: str, where: Where = Where.AUTOMATIC) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        parse_action(text, SCOPE, where, "--set")
    return raised.value.diagnostics


def under(text: str, diagnostic: Diagnostic) -> str:
    """What the caret of a diagnostic underlines."""
    begin = diagnostic.place.column - 1
    return text[begin : begin + diagnostic.place.length]


# predicates


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("a == true", A),
        ("true == a", Equal(Constant(True), Reference("a"))),
        ("a != b", NotEqual(Reference("a"), Reference("b"))),
        ("at == home", Equal(Reference("at"), Constant("home"))),
        ("m == -2", Equal(Reference("m"), Constant(-2))),
        ("m==-0", Equal(Reference("m"), Constant(0))),
        ("m == -00000000000000000000000000002", Equal(Reference("m"), Constant(-2))),
        ("n == 05", Equal(Reference("n"), Constant(5))),
        ("n<m", Order(Reference("n"), Relation.LESS, Reference("m"))),
        ("n <= 3", Order(Reference("n"), Relation.AT_MOST, Constant(3))),
        ("3 > n", Order(Constant(3), Relation.GREATER, Reference("n"))),
        ("n >= far", Order(Reference("n"), Relation.AT_LEAST, Reference("far"))),
        ("at in {home, box}", Member(Reference("at"), (Constant("home"), Constant("box")))),
        ("n in{0,1}", Member(Reference("n"), (Constant(0), Constant(1)))),
        ("true", Truth(True)),
        ("!false", Not(Truth(False))),
        ("at == was_at", Equal(Reference("at"), Reference("was_at"))),
        ("go.state == stop.state", Equal(Reference("go.state"), Reference("stop.state"))),
        ("current.name == go", Equal(Reference("current.name"), Constant("go"))),
        ("arm_req_state == succeeded", Equal(Reference("arm_req_state"), Constant("succeeded"))),
    ],
)
def test_an_atom_is_a_comparison_a_membership_or_a_truth_value(text: str, meaning: Predicate) -> None:
    assert predicate(text) == meaning


def test_true_is_not_one() -> None:
    assert predicate("a == true") != Equal(Reference("a"), Constant(1))


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("!a == true", Not(A)),
        ("! a == true && b == true", And((Not(A), B))),
        ("!!a == true", Not(Not(A))),
        ("!(a == true && b == true)", Not(And((A, B)))),
        ("!at in {home}", Not(Member(Reference("at"), (Constant("home"),)))),
    ],
)
def test_not_takes_a_whole_comparison(text: str, meaning: Predicate) -> None:
    assert predicate(text) == meaning


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("a == true && b == true && c == true", And((A, B, C))),
        ("a == true || b == true || c == true", Or((A, B, C))),
        ("a == true || b == true && c == true", Or((A, And((B, C))))),
        ("a == true && b == true || c == true", Or((And((A, B)), C))),
        ("(a == true || b == true) && c == true", And((Or((A, B)), C))),
        ("a == true && (b == true && c == true)", And((A, And((B, C))))),
        ("a == true || b == true -> c == true", Implies(Or((A, B)), C)),
        ("a == true -> b == true && c == true", Implies(A, And((B, C)))),
        ("a == true -> b == true || c == true", Implies(A, Or((B, C)))),
        ("a == true -> b == true -> c == true", Implies(A, Implies(B, C))),
        ("(a == true -> b == true) -> c == true", Implies(Implies(A, B), C)),
        ("!a == true -> b == true", Implies(Not(A), B)),
        ("((a == true))", A),
    ],
)
def test_and_binds_tighter_than_or_and_or_than_implies_which_groups_to_the_right(text: str, meaning: Predicate) -> None:
    assert predicate(text) == meaning


def test_line_ends_and_tabs_are_blanks() -> None:
    assert predicate(" a == true\n\t&&\r\n b ==\ftrue ") == And((A, B))


@pytest.mark.parametrize(
    ("text", "slug", "place"),
    [
        ("x == true", Slug.UNKNOWN_VARIABLE, "x"),
        ("a == true && at == hme", Slug.VALUE_OUTSIDE_DOMAIN, "hme"),
        ("at in {home, shelf}", Slug.VALUE_OUTSIDE_DOMAIN, "shelf"),
        ("n == 6", Slug.VALUE_OUTSIDE_DOMAIN, "6"),
        ("6 >= n", Slug.VALUE_OUTSIDE_DOMAIN, "6"),
        ("n == 99999999999999999999999999", Slug.VALUE_OUTSIDE_DOMAIN, "99999999999999999999999999"),
        ("a == yes", Slug.UNKNOWN_NAME, "yes"),
        ("a == 1", Slug.DIFFERENT_KINDS, "1"),
        ("true == n", Slug.DIFFERENT_KINDS, "true"),
        ("b == true || a == n", Slug.DIFFERENT_KINDS, "a == n"),
        ("at == far || a == true", Slug.DIFFERENT_KINDS, "at == far"),
        ("n != far", Slug.DISJOINT_DOMAINS, "n != far"),
        ("was_at == arm_req_state", Slug.DISJOINT_DOMAINS, "was_at == arm_req_state"),
        ("(at < home)", Slug.ORDER_NEEDS_INTEGERS, "at < home"),
        ("n in {0, m}", Slug.PREDICATE_SYNTAX, "m"),
        ("home == home", Slug.COMPARES_NO_VARIABLE, "home == home"),
        ("1 == 1 && a == true", Slug.COMPARES_NO_VARIABLE, "1 == 1"),
        ("!a", Slug.NOT_A_PREDICATE, "a"),
        ("home", Slug.NOT_A_PREDICATE, "home"),
        ("at in {home, agv, home}", Slug.DUPLICATE_VALUE, "home"),
        ("a = true", Slug.PREDICATE_SYNTAX, "="),
        ("a == true && ", Slug.PREDICATE_SYNTAX, "&"),
        ("(a == true", Slug.PREDICATE_SYNTAX, "("),
        ("at in {home", Slug.PREDICATE_SYNTAX, "{"),
        ("at in {}", Slug.PREDICATE_SYNTAX, "at in {}"),
        ("a == true)", Slug.PREDICATE_SYNTAX, ")"),
        ("a == true ; b == true", Slug.PREDICATE_SYNTAX, ";"),
        ("a == true b == true", Slug.PREDICATE_SYNTAX, "b"),
        ("a == true and b == true", Slug.PREDICATE_SYNTAX, "and"),
        ("not a == true", Slug.PREDICATE_SYNTAX, "not"),
        ("", Slug.PREDICATE_SYNTAX, ""),
        ("!" * 61 + "a == true", Slug.TOO_DEEP, "!!a == true"),
    ],
)
def test_a_wrong_predicate_is_underlined_where_it_is_wrong(text: str, slug: Slug, place: str) -> None:
    (diagnostic,) = predicate_faults(text)
    assert (diagnostic.slug, under(text, diagnostic)) == (slug, place)
    assert diagnostic.place.file == "--goal"


def test_the_second_of_two_equal_members_is_underlined() -> None:
    (diagnostic,) = predicate_faults("at in {home, agv, home}")
    assert diagnostic.place.column == 19


def test_all_that_is_wrong_is_reported_from_left_to_right() -> None:
    text = "x == true && (at == hme -> !n) || a == 1"
    found = predicate_faults(text)
    assert [under(text, diagnostic) for diagnostic in found] == ["x", "hme", "n", "1"]


def test_a_place_in_a_text_of_several_lines_counts_on_one(wording: Wording) -> None:
    text = "a == true\n  && x == true"
    (diagnostic,) = predicate_faults(text)
    assert (str(diagnostic.place), diagnostic.slug) == ("--goal:1:16", Slug.UNKNOWN_VARIABLE)
    assert str(diagnostic).splitlines()[1:3] == ["    a == true   && x == true", "                   ^"]
    wording(diagnostic)


def test_goals_and_initial_states_do_not_read_the_runner_and_get_no_hints_to_it() -> None:
    (diagnostic,) = predicate_faults("go.state == initial", Where.WORLD)
    assert diagnostic.slug is Slug.RUNNER_VARIABLE
    (diagnostic,) = predicate_faults("go.stat == initial", Where.WORLD)
    assert "go.state" not in str(diagnostic)
    (diagnostic,) = predicate_faults("go.stat == initial", Where.GUARD)
    assert "`go.state`" in (diagnostic.remedy or "")


@pytest.mark.parametrize(
    "text",
    [
        "a = true",
        "a <- true",
        "n => 3",
        "n =< 3",
        "n <> 3",
        "n ≤ 3",
        "a == true AND b == true",
        "a == true | b == true",
        "a == 'true'",
        "n == 1.5",
        "n in {1..3}",
        "at == ag-v",
        "if a == true then b == true",
        "never a == true",
        "n * 2 == 2",
        "n in_use == 2",
        "n + n in {2}",
        "elapsed > 5 s",
        "elapsed > 5",
        "-n == 2",
        "n - a == 2",
        "n + at == 2",
        "a == true)",
        "a == true,",
        "at in (home)",
        "a == True",
        "a == off",
        "a == 0",
        "True",
        "aa",
        "n",
        "n == 7",
        "at == Agv",
        "at == table",
        "at == was_ta",
        "xx == home",
    ],
)
def test_the_remedy_says_what_to_write(text: str, wording: Wording) -> None:
    (diagnostic,) = predicate_faults(text)
    wording(f"{text}\n    = {diagnostic.remedy}")


# actions


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("a <- true", Assign("a", Constant(True))),
        ("a<-b", Assign("a", Reference("b"))),
        ("at <- home", Assign("at", Constant("home"))),
        ("at <- was_at", Assign("at", Reference("was_at"))),
        ("m <- -2", Assign("m", Constant(-2))),
        ("m<--2", Assign("m", Constant(-2))),
        ("n <- m", Assign("n", Reference("m"))),
        ("n += 1", Add("n", 1)),
        ("n -= 5", Add("n", -5)),
        ("n += 01", Add("n", 1)),
        ("arm_req_state <- initial", Assign("arm_req_state", Constant("initial"))),
        ("go.state <- failed", Assign("go.state", Constant("failed"))),
        ("current.state <- failed", Assign("current.state", Constant("failed"))),
        ("plan.state <- aborted", Assign("plan.state", Constant("aborted"))),
    ],
)
def test_an_action_assigns_a_value_or_a_variable_or_counts(text: str, meaning: Action) -> None:
    assert action(text) == meaning


@pytest.mark.parametrize(
    ("text", "slug", "place"),
    [
        ("x <- true", Slug.UNKNOWN_VARIABLE, "x"),
        ("a <- x", Slug.UNKNOWN_NAME, "x"),
        ("a <- 1", Slug.DIFFERENT_KINDS, "1"),
        ("a <- n", Slug.DIFFERENT_KINDS, "n"),
        ("at <- shelf", Slug.VALUE_OUTSIDE_DOMAIN, "shelf"),
        ("n <- 6", Slug.VALUE_OUTSIDE_DOMAIN, "6"),
        ("n <- far", Slug.NEVER_FITS, "far"),
        ("at <- arm_req_state", Slug.NEVER_FITS, "arm_req_state"),
        ("n += 6", Slug.NEVER_FITS, "n += 6"),
        ("n -= 99999999999999999999", Slug.VALUE_OUTSIDE_DOMAIN, "99999999999999999999"),
        ("n += 0", Slug.NOT_A_COUNTER, "n += 0"),
        ("n += -1", Slug.NOT_A_COUNTER, "n += -1"),
        ("at += 1", Slug.NOT_A_COUNTER, "at += 1"),
        ("current.name <- go", Slug.NOT_ASSIGNABLE, "current.name"),
        ("go.state <- completed", Slug.NOT_ASSIGNABLE, "completed"),
        ("plan.state <- go.state", Slug.NOT_ASSIGNABLE, "go.state"),
        ("a = true", Slug.ACTION_SYNTAX, "="),
        ("a", Slug.ACTION_SYNTAX, "a"),
        ("a <- true && b", Slug.ACTION_SYNTAX, "&&"),
        ("", Slug.ACTION_SYNTAX, ""),
    ],
)
def test_a_wrong_action_is_underlined_where_it_is_wrong(text: str, slug: Slug, place: str) -> None:
    (diagnostic,) = action_faults(text)
    assert (diagnostic.slug, under(text, diagnostic)) == (slug, place)
    assert diagnostic.place.file == "--set"


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("go.state <- failed", Where.PLANNED),
        ("go.state <- failed", Where.RUNNING),
        ("current.state <- failed", Where.RUNNING),
        ("plan.state <- aborted", Where.PLANNED),
    ],
)
def test_what_may_be_assigned_depends_on_where_the_action_stands(text: str, where: Where) -> None:
    (diagnostic,) = action_faults(text, where)
    assert diagnostic.slug is Slug.NOT_ASSIGNABLE
    assert str(action(text, Where.AUTOMATIC)) == text


def test_an_operation_may_abort_the_plan_where_the_planner_does_not_look() -> None:
    assert action("plan.state <- aborted", Where.RUNNING) == Assign("plan.state", Constant("aborted"))


@pytest.mark.parametrize(
    "text",
    [
        "a == true",
        "a := true",
        "a -> true",
        "n++",
        "n <- n * 2",
        "n <- -n",
        "n <- (n + 1",
        "n <- min(n",
        "n <- n-x",
        'at <- "home"',
        "a <-",
        "n += m",
    ],
)
def test_the_remedy_of_a_wrong_action_says_what_to_write(text: str, wording: Wording) -> None:
    (diagnostic,) = action_faults(text)
    wording(f"{text}\n    = {diagnostic.remedy}")


# requirements


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("always a == true", Always(A)),
        ("never a == true -> b == true", Never(Implies(A, B))),
        ("a == true leads to b == true", LeadsTo(A, B)),
        ("a == true leads  to b == true within 1.5 s", LeadsTo(A, B, 1_500_000_000)),
        ("a == true leads to n == 1 within 10ms", LeadsTo(A, Equal(Reference("n"), Constant(1)), 10_000_000)),
        ("a == true before b == true", Before(A, B)),
        ("after a == true always b == true until c == true", AfterAlways(A, B, C)),
        ("always(a == true)", Always(A)),
        ("always !go.state == executing", Always(Not(Equal(Reference("go.state"), Constant("executing"))))),
    ],
)
def test_a_requirement_has_one_of_five_forms(text: str, meaning: RequirementForm) -> None:
    assert requirement(text) == meaning


@pytest.mark.parametrize(
    ("text", "slug", "place"),
    [
        ("a == true", Slug.REQUIREMENT_SYNTAX, "e"),
        ("Always a == true", Slug.REQUIREMENT_SYNTAX, "Always"),
        ("alwaysa == true", Slug.REQUIREMENT_SYNTAX, "e"),
        ("a == true leadsto b == true", Slug.REQUIREMENT_SYNTAX, "leadsto"),
        ("a == true leads_to b == true", Slug.REQUIREMENT_SYNTAX, "leads_to"),
        ("a == true leads to b == true within 10", Slug.REQUIREMENT_SYNTAX, "10"),
        ("a == true leads to b == true within 10 parsecs", Slug.BAD_DURATION, "10 parsecs"),
        ("a == true before b == true within 10 s", Slug.REQUIREMENT_SYNTAX, "within"),
        ("after a == true always b == true", Slug.REQUIREMENT_SYNTAX, "e"),
        ("always a", Slug.NOT_A_PREDICATE, "a"),
        ("never x == true", Slug.UNKNOWN_VARIABLE, "x"),
    ],
)
def test_a_wrong_requirement_is_underlined_where_it_is_wrong(text: str, slug: Slug, place: str) -> None:
    with pytest.raises(InputError) as raised:
        requirement(text)
    (diagnostic,) = raised.value.diagnostics
    assert (diagnostic.slug, under(text, diagnostic)) == (slug, place)


def test_all_parts_of_a_wrong_requirement_are_reported() -> None:
    with pytest.raises(InputError) as raised:
        requirement("after x == true always y == true until z == true")
    assert [diagnostic.place.column for diagnostic in raised.value.diagnostics] == [7, 24, 40]


def test_words_of_requirements_can_stand_in_names() -> None:
    scope = Scope.over([Variable(name, Domain.boolean(), False, (False,)) for name in ("to", "inner", "always_on")])
    sentence = parse_requirement("to == true leads to inner == always_on", scope)
    assert str(sentence) == "to == true leads to inner == always_on"


# values and states


def test_a_value_is_written_as_it_is_shown() -> None:
    assert parse_value("true", Domain.boolean()) is True
    assert parse_value("-2", Domain.integers(-2, 2)) == -2
    assert parse_value("agv", Domain.symbols("home", "agv")) == "agv"
    assert parse_value("1", Domain.boolean()) is None
    assert parse_value("3", Domain.integers(-2, 2)) is None


def test_a_state_is_nominal_where_nothing_is_declared() -> None:
    state = parse_state(" at = agv ,n=3,", SPACE)
    assert (state["at"], state["n"], state["a"], state["far"]) == ("agv", 3, False, 20)


def test_all_that_is_wrong_with_a_state_is_reported() -> None:
    text = "att=agv, n=9, m, a=true, a=false, at=hme"
    with pytest.raises(InputError) as raised:
        parse_state(text, SPACE, "--state")
    found = [(diagnostic.slug, under(text, diagnostic)) for diagnostic in raised.value.diagnostics]
    assert found == [
        (Slug.UNKNOWN_VARIABLE, "att"),
        (Slug.VALUE_OUTSIDE_DOMAIN, "9"),
        (Slug.BAD_OPTION, "m"),
        (Slug.ASSIGNED_TWICE, "a"),
        (Slug.VALUE_OUTSIDE_DOMAIN, "hme"),
    ]


def test_a_predicate_in_place_of_a_requirement_hints_at_always() -> None:
    with pytest.raises(InputError) as wrong:
        parse_requirement("light == green", Scope.of(scan_cell()))
    assert "write `always light == green`" in (wrong.value.diagnostics[0].remedy or "")
