"""A few random cases of each kind, and those that failed once."""

from __future__ import annotations

import pytest

from tests.fuzz.__main__ import KINDS, ROUND, run_case

pytestmark = pytest.mark.usefixtures("fine")

#: (kind, seed, case): what `python -m tests.fuzz` has found.
FOUND = [
    # elongated patches, whose look-ups ended in an error of Dr.Jit's loops
    ("surfaces", 1, 21),
    ("surfaces", 2, 12),
    # two intervals of κ: the last of one was looked up as the first of the next, and refused
    ("surfaces", 4711, 32),
    ("surfaces", 4711, 48),
    # nine directions away from order 0, and next to no light in any of them
    ("surfaces", 4711, 2),
    # PLY files that are no UTF-8, or whose lists have infinitely many corners
    ("texts", 1, 732),
    ("texts", 1, 746),
    # a plan with infinite numbers; a scene that is no UTF-8; heights without a name, but warnings
    ("texts", 5, 42),
    ("scenes", 5, 174),
    ("documents", 5, 218),
    # weak orders have a cusp at an interface's critical angle; a stack beyond 89.5°
    ("energy", 1130, 399),
    ("energy", 1130, 161),
]


@pytest.mark.parametrize("kind", KINDS)
def test_random_cases_pass(kind, some_variant):
    for number in range(ROUND[kind]):
        run_case(kind, 1, number)


@pytest.mark.parametrize(("kind", "seed", "number"), FOUND)
def test_what_failed_once_passes(some_variant, kind, seed, number):
    run_case(kind, seed, number)
