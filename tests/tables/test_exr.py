"""Tables on disk: the same bits come back, and whatever is no table is refused in one line."""

from __future__ import annotations

import dataclasses
import json
import os
import tracemalloc
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable
from mitsuba_diffraction.tables.exr import write_channels
from mitsuba_diffraction.tables.table import FORMAT_VERSION
from tests.support.table_files import KINDS, Contents, small_table

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


# ------------------------------------------------------------------------ what is no table


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


# ------------------------------------------------------------------------ what cannot be written


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
