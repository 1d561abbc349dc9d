"""Textures of solved orders against the table, and surfaces that cannot be exported."""

from __future__ import annotations

import json

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, OrderTable
from mitsuba_diffraction.osl.solved import MOST_BYTES, interpolation_error
from mitsuba_diffraction.osl.spectrum import NODES, drawn_spectrum
from mitsuba_diffraction.shading.orders import pack_orders
from tests.support.orders import thin_grating

TABLE = thin_grating()


def test_error_of_the_textures_is_measured():
    mean, worst = interpolation_error(TABLE, pack_orders(TABLE, MOST_BYTES)).values()
    assert 0.0 < mean < worst < 0.01


def test_mean_of_the_spectrum_is_white():
    wavelengths, by_space = drawn_spectrum()
    u = np.linspace(0.0, 1.0, NODES)
    for colours in by_space.values():
        assert colours.mean(axis=1).min() > 0.0  # Cycles draws by it
        # linear between nodes, as the shader interpolates
        assert np.trapezoid(colours, u, axis=0) == pytest.approx(1.0, abs=1e-6)
    assert np.all(np.diff(wavelengths) > 0)


def test_document_names_files_and_sockets(tmp_path, some_variant):
    bsdf = mi.load_dict(md.bsdf_dict(TABLE, coherence_width=30, orientation=20))
    exported = md.osl.export(bsdf, tmp_path / "new" / "folder", "cd")
    document = json.loads(exported.document.read_text(encoding="utf-8"))
    values = {item["identifier"]: item["default"] for item in document["inputs"]}
    assert (values["CoherenceWidth"], values["Rotation"]) == (30.0, 20.0)
    source = exported.shader.read_text(encoding="utf-8")
    assert all(f" {name} = " in source for name in values)
    for name in (document["shader"], *document["textures"].values()):
        assert (exported.document.parent / name).is_file()
    assert not [path for path in exported.document.parent.iterdir() if path.name.startswith(".")]


def test_folder_is_no_part_of_what_is_written(tmp_path, some_variant):
    folder = tmp_path / 'z", float Evil = 1, string Q = "'
    exported = md.osl.export(mi.load_dict(md.bsdf_dict(OrderTable.mirror(1.0))), folder, "cd")
    for file in (exported.shader, exported.document):
        text = file.read_text(encoding="utf-8")
        assert "Evil" not in text
        assert str(tmp_path) not in text
    assert 'string OrdersFile = "cd_orders.exr"' in exported.shader.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "name", ["", "1cd", "a b", "../cd", "if", "while", "md_lobe", "PERIOD", "mix", "Wavelengths"]
)
def test_name_must_be_that_of_a_shader(tmp_path, some_variant, name):
    with pytest.raises(DiffractionError, match="name="):
        md.osl.export(mi.load_dict(md.bsdf_dict(OrderTable.mirror(1.0))), tmp_path, name)


def test_folder_that_is_a_file_is_refused(tmp_path, some_variant):
    (tmp_path / "taken").write_text("")
    with pytest.raises(DiffractionError, match="taken"):
        md.osl.export(mi.load_dict(md.bsdf_dict(OrderTable.mirror(1.0))), tmp_path / "taken")
