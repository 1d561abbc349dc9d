"""Recipes of solved orders: what they may hold, and what takes them."""

from __future__ import annotations

import json
import tempfile
import warnings
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.orders.solve.recipes import SolvedRecipe

RECIPE = {
    "method": '"solved"', "profile": '"blazed"', "material": '"Al"', "superstrate": "1.5",
    "wavelengths": "[400, 700]", "tolerance": "0.02", "solver": '"coupled"', "resolution": "20",
    "output": '"groove.nc"', "layers": '[["SiO2", 0.1], ["2.3", 0.05]]',
    "beneath": '[["Al2O3", 0.1], [0.1, ["2.3", 0.1, 0.4]]]', "substrate": '"Al"', "block": "true",
}  # fmt: skip
ARGUMENTS = {"period": "1.2", "depth": "0.2", "direction": '"ascending"'}
#: TOML of values that hardly fit.
VALUES = st.one_of(
    st.integers(-5, 10**12).map(str), st.floats(allow_nan=True).map(str), st.just("true"),
    st.text("abc./é ", max_size=8).map(json.dumps), st.just("[]"), st.just("[1, 2, 3]"),
    st.just('["a", 1]'), st.just("{a = 1}"), st.just('"lamellar"'), st.just('"x.csv"'),
)  # fmt: skip


def text_of(recipe, arguments):
    lines = [f"{key} = {value}" for key, value in recipe.items()]
    return "\n".join([*lines, "[arguments]", *(f"{k} = {v}" for k, v in arguments.items())])


def test_a_recipe_is_read(tmp_path):
    file = tmp_path / "groove.toml"
    file.write_text(text_of(RECIPE, ARGUMENTS))
    recipe = SolvedRecipe.load(file)
    assert (recipe.profile.period, recipe.superstrate) == (1.2, 1.5)
    assert recipe.layers == (("SiO2", 0.1), ("2.3", 0.05))
    assert recipe.beneath == (("Al2O3", 0.1), (0.1, ["2.3", 0.1, 0.4]))
    assert recipe.settings.wavelengths == (400.0, 700.0)
    assert recipe.block
    assert recipe.output == tmp_path / "groove.nc"


def test_without_a_profile_slices_end_in_a_flat_surface(tmp_path):
    file = tmp_path / "ridges.toml"
    (tmp_path / "stack.toml").write_text('layers = [[0.1, ["chitin", 0.1, 0.3]]]')
    content = {"method": '"solved"', "material": '"melanin"', "beneath": '"stack.toml"'}
    file.write_text(text_of(content, {"period": "0.8"}))
    recipe = SolvedRecipe.load(file)
    assert (recipe.profile.period, recipe.profile.depth) == (0.8, 0.0)
    assert recipe.beneath == ((0.1, ["chitin", 0.1, 0.3]),)


@settings(max_examples=80, deadline=None)
@given(key=st.sampled_from(sorted({*RECIPE, *ARGUMENTS, "thin", "duty", "kind"})), value=VALUES)
def test_any_value_is_taken_or_refused_in_one_line(key, value):
    arguments = {**ARGUMENTS, key: value} if key in ("duty", *ARGUMENTS) else ARGUMENTS
    recipe = RECIPE if arguments is not ARGUMENTS else {**RECIPE, key: value}
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        file = Path(folder, "groove.toml")
        file.write_text(text_of(recipe, arguments), "utf-8")
        try:
            loaded = SolvedRecipe.load(file)
        except DiffractionError as error:
            assert "\n" not in str(error)
        else:
            assert loaded.output.suffix == ".nc"
