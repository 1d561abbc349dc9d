"""A few random cases of each kind, those that failed once, and combinations that make no light.

`make fuzz KIND=energy ROUNDS=2000` tries more of these.
"""

from __future__ import annotations

import pytest

from tests.fuzz.__main__ import KINDS, run_case

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
    for number in range(KINDS[kind].round):
        run_case(kind, 1, number)


@pytest.mark.parametrize(("kind", "seed", "number"), FOUND)
def test_what_failed_once_passes(some_variant, kind, seed, number):
    run_case(kind, seed, number)


#: Cases that take longest. Every two of variant, material, layer, window, scales, model, shadowing
#: and light beneath that meet in one of them meet in another case, but sheets in colours: 17 s.
LONG = {
    0, 2, 3, 20, 27, 29, 41, 43, 47, 51, 53, 58, 60, 62, 64, 65, 80, 83, 90, 91, 93, 105,
    115, 119, 129, 130, 135, 144, 149, 153, 155, 161, 162, 167, 168, 172, 181, 187, 192,
    196, 200, 209, 211, 212, 218, 230, 232, 233, 234, 255, 260, 262, 264, 288,
}  # fmt: skip
#: 200 combinations; others among them are refused at once.
CASES = sorted(set(range(297)) - LONG)


@pytest.mark.thorough
@pytest.mark.parametrize("block", range(50))
def test_no_combination_makes_light(some_variant, block):
    """200 combinations of surface, material, layers, scales, windows, variants and directions."""
    for number in CASES[block::50]:
        run_case("energy", 52, number)
