"""Random combinations that must not make light; `make fuzz KIND=energy ROUNDS=2000` tries more."""

from __future__ import annotations

import pytest

from tests.fuzz.__main__ import run_case

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("fine", "some_variant")]


@pytest.mark.parametrize("block", range(50))
def test_no_combination_makes_light(block):
    """200 combinations of surface, material, layers, scales, windows, variants and directions."""
    for number in range(4 * block, 4 * block + 4):
        run_case("energy", 52, number)
