"""What cannot be built is refused in one line that says why; all the rest meets its tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField, reference
from tests.support.directions import rough_patch
from tests.support.patches import DEEP, DEFAULTS, PATCH

pytestmark = pytest.mark.thorough


def refused(**arguments):
    """The one line with which a table of PATCH, or of heights=…, is refused."""
    heights = arguments.pop("heights", PATCH)
    with pytest.raises(DiffractionError) as caught:
        DiffractionTable.build(heights, **(DEFAULTS | arguments))
    assert "\n" not in str(caught.value)
    return str(caught.value)


#: 5 µm of relief at a very short wavelength: some 1e5 terms for each of 1e6 orders.
RELIEF = rough_patch((64, 64), (0.02, 0.02), 12.0).heights
LARGE = {
    "heights": HeightField(np.tile(RELIEF, (8, 8)), 0.02), "coherence_width": 10.0,
    "wavelength_range": (40.0, 830.0), "basis": "chebyshev",
}  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"heights": "scan.npy"}, "HeightField.load reads a file"),
        ({"heights": [[0.0, 1.0]]}, "HeightField.load reads a file"),
        ({"heights": DEEP, "basis": "taylor"}, "cannot reach tolerance=0.001 for heights of 1.2"),
        ({"basis": "taylor", "terms": 20}, "terms=20 of basis='taylor' leave an error of"),
        ({"taps": 2}, "cannot build the table: taps=2 leave an error of "),
        ({"terms": 1, "tolerance": 1e-5}, "with 1 term each still leave an error of"),
        (LARGE, "use a smaller or shallower patch"),
        ({"basis": "fourier"}, "basis='fourier' must be one of svd, chebyshev, taylor, auto"),
        ({"coherence": "full"}, "coherence='full' must be one of ensemble, patch"),
        ({"coherence_width": 0.0}, "coherence_width=0 must be a positive number of µm"),
        ({"coherence_width": np.nan}, "coherence_width=nan must be a positive number"),
        ({"tolerance": 1e-7}, "tolerance=1e-07 must be between 1e-6 (single precision) and 1"),
        ({"tolerance": 1.0}, "tolerance=1 must be between"),
        ({"tolerance": np.nan}, "tolerance=nan must be between"),
        ({"terms": 0}, "terms=0 must be a whole number from 1 to 400"),
        ({"terms": 401}, "terms=401 must be a whole number from 1 to 400"),
        ({"taps": 65}, "taps=65 must be a whole number from 1 to 64"),
        ({"wavelength_range": (700.0, 400.0)}, "(700.0, 400.0) must be two rising"),
        ({"wavelength_range": (0.36, 0.83)}, "in nm, between 10 and 100000"),
        ({"height_scale_max": 0.0}, "height_scale_max=0 must be a positive factor, at most 1000"),
        ({"height_scale_max": np.nan}, "height_scale_max=nan must be a positive factor"),
        ({"heights": []}, "there is no height field; give at least one"),
        ({"heights": [PATCH, PATCH], "coherence": "patch"}, "which coherence='patch' cannot"),
        ({"heights": [PATCH, PATCH], "basis": "taylor"}, "which basis='taylor' cannot"),
        ({"heights": replace(PATCH, cut_out=True), "basis": "taylor"}, "coherence='patch', or"),
        ({"heights": [PATCH, DEEP]}, "crop them to one size"),
        ({"coherence_width": 0.05}, "look-up would read"),
    ],
)
def test_bad_parameters_are_refused_in_one_line(arguments, message):
    assert message in refused(**arguments)


@pytest.mark.parametrize(
    "arguments",
    [
        {"coherence_width": 65e3},  # nm for µm
        {"coherence_width": 1e300},
        {"coherence_width": 499.0, "heights": rough_patch((24, 24), (0.02, 0.02), 0.1)},
        {"coherence_width": 1.0, "heights": rough_patch((512, 512), (0.4, 0.4), 0.4)},
        {"coherence_width": 1.0, "heights": rough_patch((2, 512), (0.1, 0.4), 0.4)},
    ],
    ids=["65000 µm", "1e300 µm", "a thousand patches", "a wide patch", "a long patch"],
)
def test_windows_that_do_not_suit_a_patch_are_refused_at_once(arguments):
    assert "coherence" in refused(**arguments, progress=lambda *_: pytest.fail("it was begun"))


def test_what_a_wide_patch_is_advised_to_do_helps():
    wide = rough_patch((256, 256), (0.4, 0.4), 0.2)
    text = refused(heights=wide, coherence_width=1.5)
    assert "crop the heights, crop=1.5" in text
    table = DiffractionTable.build(wide.treated(crop=1.5), coherence_width=1.5)
    assert not table.limited


parameters = st.fixed_dictionaries(
    {
        "coherence_width": st.floats(0.05, 5.0),
        "coherence": st.sampled_from(reference.COHERENCES),
        "basis": st.sampled_from(["auto", "svd", "chebyshev", "taylor"]),
        "tolerance": st.sampled_from([1e-5, 1e-4, 1e-3, 0.01, 0.3]),
        "terms": st.none() | st.integers(1, 40),
        "taps": st.none() | st.integers(1, 12),
        "height_scale_max": st.floats(0.1, 3.0),
        "wavelength_range": st.sampled_from([(360.0, 830.0), (500.0, 501.0), (250.0, 1000.0)]),
    }
)


@settings(max_examples=40)
@given(st.floats(0.0, 0.5), st.integers(2, 17), st.integers(2, 17), parameters)
# four functions of a series of six do not suffice, and eight are more than it has
@example(0.109375, 3, 3, {
    "coherence_width": 1.0, "coherence": "ensemble", "basis": "auto", "tolerance": 1e-5,
    "terms": None, "taps": None, "height_scale_max": 0.75, "wavelength_range": (500.0, 501.0),
})  # fmt: skip
def test_any_table_meets_its_tolerance_or_is_refused(depth, ny, nx, arguments):
    heights = np.random.default_rng(ny * nx).random((ny, nx)) * depth
    field = HeightField(heights, (0.1, 0.08))
    try:
        table = DiffractionTable.build(field, **arguments)
    except DiffractionError as error:
        assert "\n" not in str(error)
        return
    assert table.largest_error <= arguments["tolerance"]
    assert np.all(np.isfinite(table.coefficients))
    rng = np.random.default_rng(1)
    q = rng.uniform(-1.0, 1.0, (2, 500)) * table.q_limit / np.sqrt(2)
    values = table.window_sum(*q, rng.uniform(0.0, table.expansion.kappa_max, 500))
    # Σ|a|² = 1 bounds any sum of powers; |Σ a·g|² of amplitudes by as much as windows overlap
    most = max(1.0, np.prod([1 + 4 / step for step in table.grid.steps]))
    assert values.min() >= 0.0
    assert values.max() <= most * (1 + arguments["tolerance"])
