"""docs/table-format.md: its reader finds the orders of our tables, ours reads what it writes."""

from __future__ import annotations

import contextlib
import io
import json
import re

import mitsuba as mi
import numpy as np
import pytest
from scipy.special import jv

from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.tables.table import FORMAT_VERSION
from tests.support import ROOT
from tests.support.table_files import KINDS, PATCH, document_in, small_table

PAGE = (ROOT / "docs" / "table-format.md").read_text("utf-8")
WRITER, READER = re.findall(r"^```python\n(.*?)^```$", PAGE, re.M | re.S)


@pytest.fixture(scope="module")
def examples(tmp_path_factory):
    """What the page's blocks define and print, and the table that the first writes."""
    folder = tmp_path_factory.mktemp("examples")
    names: dict = {}
    printed = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
        exec(WRITER, names)
        exec(READER, names)
    return names, printed.getvalue(), folder / "sinusoid.exr"


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "windows"])
def test_the_page_s_reader_finds_the_orders_of_our_tables(examples, tmp_path, kind):
    power = examples[0]["power"]
    file = tmp_path / "table.exr"
    table = small_table(kind)
    table.save(file)
    orders = np.array([(x, y) for x in (-1, 0, 1) for y in (-2, -1, 0, 1, 2)])
    far = np.any(orders != 0, axis=1)
    for kappa in (0.4 * table.expansion.kappa_max, table.expansion.kappa_max):
        # the definition: a_j is the mean of exp(iκh) exp(iq_j·r)
        whole = np.abs(np.fft.ifft2(np.exp(1j * kappa * PATCH.heights))) ** 2
        exact, mirrored = (whole[sign * orders[:, 1], sign * orders[:, 0]] for sign in (1, -1))
        found = np.array([power(str(file), x, y, kappa) for x, y in orders.tolist()])
        # what a table's tolerance means: Σ |error| / Σ exact, of order 0 and of all others
        allowed = table.tolerance * (whole.sum() - whole[0, 0])
        assert np.abs(found - exact)[far].sum() < allowed
        assert np.abs(found - exact)[~far].sum() < table.tolerance * whole[0, 0]
        # the patch is not symmetric: an axis turned round would be seen
        assert np.abs(mirrored - exact).sum() > 3 * allowed


@pytest.mark.parametrize("tolerance", [1e-3, 1e-2])
def test_the_page_s_rules_of_a_look_up_are_ours(examples, tmp_path, tolerance):
    power, file = examples[0]["power"], str(tmp_path / "table.exr")
    table = DiffractionTable.build(PATCH, coherence_width=1.8, tolerance=tolerance)
    table.save(file)
    document = document_in(file)
    grid, spacing = document["grid"], np.array(document["spacing"])
    taps, steps = np.array(grid["taps"]), np.array(grid["steps"])
    assert tolerance < 1e-2 or any(taps % 2)  # odd and even numbers of taps have their own rule
    kappa = 30.0
    for position in (np.array([0.3, -1.6]), np.array([5.7, 2.2])):
        even, odd = np.floor(position) + 1 - taps / 2, np.floor(position + 0.5) - (taps - 1) / 2
        first = np.where(taps % 2 == 0, even, odd).astype(int)
        read = {(0, 0)}
        for row in range(taps[1]):
            trim = grid["trims"][row] if grid["trims"] else 0
            read |= {(first[0] + column, first[1] + row) for column in range(trim, taps[0] - trim)}
        total = sum(
            power(file, x, y, kappa) * np.exp(-np.sum((steps * (position - (x, y))) ** 2))
            for x, y in read
        )
        # rounding only: the same coefficients, in double precision on either side
        assert table.window_sum(*(position * spacing), kappa) == pytest.approx(total, rel=1e-9)


def test_our_reader_finds_what_the_page_s_writer_wrote(examples):
    names, printed, file = examples
    table = DiffractionTable.load(file)
    rng = np.random.default_rng(1)
    q = rng.uniform(-30.0, 30.0, (2, 200)) * np.array([[1.0], [0.1]])
    kappa = rng.uniform(0.01, names["kappa_max"], 200)
    orders = np.arange(-20, 21)[:, None]
    lobes = np.exp(-(table.sigma**2) * ((q[0] - orders * names["spacing"]) ** 2 + q[1] ** 2))
    exact = np.sum(jv(orders, 0.5 * names["depth"] * kappa) ** 2 * lobes, axis=0)
    # two taps leave out erfc(π) = 1e-5 of a lobe; single floats
    np.testing.assert_allclose(table.window_sum(*q, kappa), exact, atol=1e-4)
    assert table.summary()["source"]["name"] == "sinusoid"
    assert float(printed) == pytest.approx(jv(1, 0.5 * names["depth"] * 25.0) ** 2, rel=1e-5)


def test_the_plugin_takes_what_the_page_s_writer_wrote(examples, some_variant):
    plugin = {"type": "diffraction", "filename": str(examples[2]), "energy_conserving": False}
    assert "chebyshev power" in str(mi.load_dict(plugin))


def test_the_page_describes_every_field(tmp_path):
    file = tmp_path / "table.exr"
    small_table("limited").save(file)
    document = document_in(file)
    own = PAGE.split("## Tables of solved orders")[0]
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", own, re.M)
    described = set(re.findall(r"\w+", " ".join(rows)))
    fields = {*document, *document["expansion"], *document["grid"]}
    assert fields | {"window_width", "taper_width"} == described  # of scans alone
    assert re.search(rf"^\| `version` \| {FORMAT_VERSION}\b", PAGE, re.M)
    assert json.dumps(document["version"]) == str(FORMAT_VERSION)
