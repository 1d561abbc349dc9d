"""Random combinations that must not make light; `make fuzz KIND=energy ROUNDS=2000` tries more."""

from __future__ import annotations

import pytest

from tests.fuzz.__main__ import run_case

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("fine", "some_variant")]


#: Cases that take 8 to 30 s each, two fifths of the time of all together; others have their
#: variant, material, layers, window and scales: a patch as the window of a metal with layers or a
#: mirror, and of a spectral sheet; sheets in colours and in a spectrum; both scales of sheets;
#: stretched interfaces; spectral layers over a pigment; a texture that stretches a mirror.
LONG = {27, 29, 41, 47, 135, 153, 167, 168, 172, 200}
CASES = sorted(set(range(210)) - LONG)


@pytest.mark.parametrize("block", range(50))
def test_no_combination_makes_light(block):
    """200 combinations of surface, material, layers, scales, windows, variants and directions."""
    for number in CASES[block::50]:
        run_case("energy", 52, number)
