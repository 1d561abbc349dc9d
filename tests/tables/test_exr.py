"""Tables on disk: bits come back, damage is refused, docs/table-format.md's reader agrees."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import os
import re
import tracemalloc
from pathlib import Path

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
from scipy.special import jv

from mitsuba_diffraction import DiffractionError, DiffractionTable
from mitsuba_diffraction.tables.exr import write_channels
from mitsuba_diffraction.tables.table import FORMAT_VERSION
from tests.support import ROOT
from tests.support.table_files import KINDS, PATCH, Contents, document_in, small_table

#: Bytes: ten times what any takes, and a thousandth of what the damaged ones claim.
MUCH = 1e6


@pytest.fixture(scope="module", params=KINDS)
def table(request):
    """A small table of each kind."""
    return small_table(request.param)


@pytest.fixture(scope="module")
def whole():
    return small_table("power, half")


@pytest.fixture
def saved(whole, tmp_path):
    """A file with a table, to be damaged."""
    whole.save(tmp_path / "table.exr")
    return tmp_path / "table.exr"


def refused(file):
    """The one line with which a file is refused."""
    tracemalloc.start()
    try:
        with pytest.raises(DiffractionError) as caught:
            DiffractionTable.load(file)
        assert tracemalloc.get_traced_memory()[1] < MUCH
    finally:
        tracemalloc.stop()
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)
    return str(caught.value)


def test_a_table_comes_back_bit_by_bit(table, tmp_path):
    table.save(tmp_path / "table.exr")
    loaded = DiffractionTable.load(tmp_path / "table.exr")
    for field in dataclasses.fields(DiffractionTable):
        before, after = getattr(table, field.name), getattr(loaded, field.name)
        if isinstance(before, np.ndarray):
            assert before.dtype == after.dtype
            assert before.tobytes() == np.ascontiguousarray(after).tobytes()
        elif field.name != "roughness":  # of arrays, which the digest compares
            assert json.dumps(before, default=repr) == json.dumps(after, default=repr), field.name
    assert loaded.digest() == table.digest()
    assert np.array_equal(table.expansion.functions, loaded.expansion.functions)
    assert json.dumps(loaded.summary()) == json.dumps(table.summary())


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no.exr", "does not exist"),
        (".", "is a folder"),
        ("bytes.exr", "cannot read '{}' as EXR"),
        ("text.exr", "cannot read '{}' as EXR"),
        ("picture.exr", "is an EXR image but no table; make a table with"),
    ],
)
def test_what_is_no_table(tmp_path, name, message):
    (tmp_path / "bytes.exr").write_bytes(bytes(400))
    (tmp_path / "text.exr").write_text("PNG is not EXR")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    picture = OpenEXR.File(header, {"RGB": np.ones((4, 4, 3), np.float32)})
    picture.write(str(tmp_path / "picture.exr"))
    assert message.format(tmp_path / name) in refused(tmp_path / name)


@pytest.mark.parametrize("version", [1, 2, None, "3"])
def test_a_table_of_another_version(saved, version):
    contents = Contents(saved)
    contents.document["version"] = version
    contents.write(saved)
    text = refused(saved)
    assert (
        f"is a table of format version {version!r}, this program reads version {FORMAT_VERSION}"
        in text
    )
    assert "; build it again with the command 'precompute'" in text


DAMAGE = {
    "no grid": lambda d: d.pop("grid"),
    "no order 0": lambda d: d.pop("order_0"),
    "no spacing": lambda d: d.pop("spacing"),
    "order 0 too small": lambda d: d.update(order_0=[[[1.0]]]),
    "order 0 no number": lambda d: d.update(order_0="many"),
    "more terms than channels": lambda d: d["expansion"].update(terms=9),
    "no interval": lambda d: d["expansion"].update(intervals=0),
    "unknown basis": lambda d: d["expansion"].update(basis="fourier"),
    "unknown kind": lambda d: d["expansion"].update(kind="phase"),
    "unknown entry": lambda d: d["expansion"].update(phase=1),
    "another size": lambda d: d["grid"].update(last=[3, 3]),
    "no expansion": lambda d: d.update(expansion=None),
    "a list for a grid": lambda d: d.update(grid=[1, 2]),
    # what would read outside or fill memory
    "a thousand taps": lambda d: d["grid"].update(taps=[4, 1000]),
    "negative trims": lambda d: d["grid"].update(trims=[-1] * d["grid"]["taps"][1]),
    "many orders": lambda d: d["grid"].update(last=[5000, 5000]),
    "many intervals": lambda d: d["expansion"].update(intervals=1 << 40),
    "many terms": lambda d: d["expansion"].update(terms=10**9),
    "scale 0": lambda d: d.update(scale=0.0),
    "spacing 0": lambda d: d.update(spacing=[0.0, 1.0]),
    "a bright order 0": lambda d: d.update(order_0=[[[1e30]]]),
    "a wide window": lambda d: d.update(coherence_width=1e300),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_table_whose_description_is_damaged(saved, damage):
    contents = Contents(saved)
    DAMAGE[damage](contents.document)
    contents.write(saved)
    assert f"'{saved}' is a damaged table (" in refused(saved)


def test_a_small_file_that_claims_gigabytes_is_refused_before_they_are_taken(saved):
    contents, last = Contents(saved), [1100, 1100]
    contents.document["grid"]["last"] = last
    shape = (2 * last[1] + 1, 2 * last[0] + 1)
    contents.channels = dict.fromkeys(contents.channels, np.zeros(shape, np.float16))
    contents.write(saved)
    assert saved.stat().st_size < 5e5
    refused(saved)


@pytest.mark.parametrize("text", [b"}", b"[" * 3000, b"9" * 6000], ids=["}", "nests", "digits"])
def test_a_description_that_is_no_json(saved, text):
    content = saved.read_bytes()
    at = content.index(b'{"version"')
    assert at + len(text) < len(content) - 1000
    saved.write_bytes(content[:at] + text + content[at + len(text) :])
    assert len(refused(saved)) < 500


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_table_whose_coefficients_are_no_powers(saved, value):
    contents = Contents(saved)
    next(iter(contents.channels.values()))[3, 4] = value
    contents.write(saved)
    assert f"'{saved}' is a damaged table (" in refused(saved)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("table.png", r"file name must end with \.exr"),
        ("nowhere/table.exr", "No such file or directory; choose a "),
        ("folder.exr", "it is a folder; name a file in it"),
    ],
)
def test_what_cannot_be_written_is_refused_and_leaves_nothing(whole, tmp_path, name, message):
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(DiffractionError, match=message):
        whole.save(tmp_path / name)
    assert os.listdir(tmp_path) == ["folder.exr"]


def test_a_writer_that_loses_the_error_of_a_full_disk_is_found_out(tmp_path, monkeypatch):
    """OpenEXR closes its file without a word where the last buffer does not fit."""
    target = tmp_path / "a.exr"
    target.write_text("before")

    class Losing(OpenEXR.File):
        def write(self, name: str) -> None:
            Path(name).touch()

    monkeypatch.setattr(OpenEXR, "File", Losing)
    with pytest.raises(DiffractionError, match="is the disk full"):
        write_channels(target, {"Y": np.ones((2, 2), np.float32)})
    assert target.read_text() == "before"
    assert os.listdir(tmp_path) == ["a.exr"]


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
