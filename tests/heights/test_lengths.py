"""Whatever a maker of patches is given, it makes one or says in a line why not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.heights.gratings import cd, dvd, elaphe_like, xenopeltis_like

ALL = ("extent", "pixels", "seed", "depth", "irregularity")
anything = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=4),
    st.lists(st.floats(), max_size=3), st.just(np.zeros(2)),
)  # fmt: skip


@pytest.mark.parametrize(
    ("makers", "names", "extent"),
    [
        ((elaphe_like, xenopeltis_like), (*ALL, "bending", "roughness", "dirt"), 3.0),
        ((cd, dvd), (*ALL, "track_pitch"), 5.0),
    ],
    ids=["scales", "discs"],
)
@given(data=st.data(), value=anything)
def test_any_value_works_or_is_one_clear_line(makers, names, extent, data, value):
    make, name = data.draw(st.sampled_from(makers)), data.draw(st.sampled_from(names))
    arguments = {"extent": extent, "pixels": 16, name: value}
    if name == "pixels" and isinstance(value, int) and value > 64:
        return  # allowed, and slow
    try:
        make(**arguments)
    except DiffractionError as error:
        text = str(error)
        assert "\n" not in text
        assert text.startswith(f"{make.__name__}: {name}:")
        assert "got" in text
