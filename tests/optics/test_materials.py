"""Names and numbers of materials, and the published indices of tissues."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.optics.materials import (
    TISSUES,
    index_at_sodium,
    lets_light_through,
    material_named,
)


@pytest.mark.parametrize(
    ("name", "wavelengths", "published"),
    [
        # tables of the papers, three decimals
        ("chitin", [400.0, 500.0, 600.0], [1.572, 1.552, 1.541]),
        ("keratin", [400.0, 500.0, 600.0], [1.569, 1.556, 1.548]),
        # IAPWS R9-97 at 20 °C, 0.1 MPa and sodium's D line, and at 404.7 nm
        ("water", [404.66, 589.26], [1.3428, 1.3330]),
        ("sio2", [404.66, 587.56], [1.46962, 1.45846]),  # table 1 of the paper
        ("mgf2", [589.3], [1.3777]),
    ],
)
def test_indices_are_as_published(name, wavelengths, published):
    assert TISSUES[name].index(wavelengths).real == pytest.approx(published, abs=6e-4)


def test_indices_between_nodes_are_linear():
    for tissue in TISSUES.values():
        lam = tissue.nodes[:-1] + 2.5
        between = np.interp(lam, tissue.nodes, tissue.index(tissue.nodes).real)
        assert between == pytest.approx(tissue.index(lam).real, abs=1e-4)


@pytest.mark.parametrize(
    ("text", "material", "clear"),
    [
        ("Keratin", "keratin", True), ("melanin", "melanin", False), ("gold", "Au", False),
        ("Al", "Al", False), ("none", "none", False), ("1.56", 1.56, True),
        ("1.56+0.05i", 1.56 + 0.05j, False), ("0.65 + 5.6j", 0.65 + 5.6j, False),
        (1.5, 1.5, True),
    ],
)  # fmt: skip
def test_one_vocabulary_of_names_and_numbers(text, material, clear):
    assert material_named(text) == material
    assert lets_light_through(text) == clear


@given(st.text(max_size=12))
def test_texts_are_a_material_or_refused_in_one_line(text):
    try:
        material = material_named(text)
    except DiffractionError as error:
        assert "\n" not in str(error)
    else:
        assert isinstance(material, str) or material.real > 0.0


def test_a_medium_is_a_number_and_clear():
    assert index_at_sodium("water", "coat_ior") == pytest.approx(1.3334, abs=1e-4)
    assert index_at_sodium("1.4", "coat_ior") == 1.4
    assert index_at_sodium("bk7", "coat_ior") == "bk7"
    for absorbing in ("melanin", "1.5+0.1i"):
        with pytest.raises(DiffractionError, match="absorbs"):
            index_at_sodium(absorbing, "coat_ior")
