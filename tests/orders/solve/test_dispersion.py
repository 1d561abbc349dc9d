"""Indices of files, beside published values."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.optics.materials import TISSUES
from mitsuba_diffraction.orders.solve.grating_index import material_of

#: N-BK7 as in Schott's data sheet: Sellmeier's coefficients, nd = 1.51680.
CATALOGUE = """CC a catalogue
NM F2 2 0 1.62004 36.37
CD 1.34533359 0.00997743871 0.209073176 0.0470450767 0.937357162 111.886764 0 0 0 0
LD 0.32 2.5
NM N-BK7 2 517642.251 1.516800 64.17
CD 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653 0 0 0 0
LD 0.3 2.5
"""
SILICA = """REFERENCES: "Malitson 1965"
DATA:
  - type: formula 1
    wavelength_range: 0.21 6.7
    coefficients: 0 0.6961663 0.0684043 0.4079426 0.1162414 0.8974794 9.896161
"""
GOLD = """DATA:
  - type: tabulated nk
    data: |
        0.5 0.97 1.87
        0.6 0.25 2.98
        2.0 0.53 12.6
"""


def index(file, wavelength, suffix=""):
    return material_of(f"{file}{suffix}", (wavelength, wavelength)).index(wavelength)


def test_a_glass_of_a_catalogue_has_its_index_at_the_d_line(tmp_path):
    file = tmp_path / "schott.agf"
    for encoding in ("utf-8", "utf-16"):
        file.write_text(CATALOGUE, encoding)
        assert index(file, 587.5618, ":N-BK7") == pytest.approx(1.51680, abs=1e-5)
        assert index(file, 587.5618, ":f2") == pytest.approx(1.62004, abs=1e-5)
    assert index(file, 2325.42, ":N-BK7") == pytest.approx(1.48921, abs=1e-5)


def test_the_last_of_a_catalogue_s_terms_counts(tmp_path):
    file = tmp_path / "a.agf"
    # formula, its number of terms a λ²/(λ² − b), of which the last has a = 1.25 and b = 0
    for formula, terms in ((2, 3), (6, 4), (11, 5)):
        file.write_text(f"NM A {formula} 0 0 0\nCD {'0 0 ' * (terms - 1)}1.25 0\nLD 0.3 1\n")
        assert index(file, 500.0, ":A") == pytest.approx(1.5)


def test_formulas_and_tables_of_yaml_are_read(tmp_path):
    (tmp_path / "sio2.yml").write_text(SILICA)
    (tmp_path / "au.yaml").write_text(GOLD)
    for lam in (250.0, 550.0, 2500.0):
        expected = TISSUES["sio2"].index(np.array([lam]))
        np.testing.assert_allclose(index(tmp_path / "sio2.yml", lam), expected[0], rtol=1e-6)
    assert index(tmp_path / "au.yaml", 550.0) == pytest.approx(0.61 + 2.425j)


@pytest.mark.parametrize(
    "text",
    ["wl,n\n0.5,0.97\n0.6,0.25\n\nwl,k\n0.5,1.87\n0.6,2.98\n",
     "wavelength (nm);n;k\n500;0,97;1,87\n600;0,25;2,98\n",
     "wl,n,k\n0.6,0.25,2.98\n0.5,0.97,1.87\n"],
)  # fmt: skip
def test_csv_has_n_and_k_in_one_table_or_in_two(text, tmp_path):
    (tmp_path / "au.csv").write_text(text)
    assert index(tmp_path / "au.csv", 550.0) == pytest.approx(0.61 + 2.425j)
