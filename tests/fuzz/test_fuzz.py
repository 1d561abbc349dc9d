"""A few random cases of each kind, and those that failed once."""

from __future__ import annotations

import pytest

from tests.fuzz.__main__ import KINDS, run_case

#: How many of each kind take about a second together.
FEW = {"tables": 60, "heights": 60, "texts": 30, "commands": 20, "surfaces": 3}

#: (kind, seed, case): what `python -m tests.fuzz` has found.
FOUND: list[tuple[str, int, int]] = []


@pytest.mark.parametrize("kind", KINDS)
def test_random_cases_pass(kind, some_variant):
    for number in range(FEW[kind]):
        run_case(kind, 1, number)


@pytest.mark.parametrize(("kind", "seed", "number"), FOUND)
def test_what_failed_once_passes(some_variant, kind, seed, number):
    run_case(kind, seed, number)
