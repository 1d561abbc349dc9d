"""Materials of glTF files by their names, in files that trimesh writes."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.load import load_scene
from mitsuba_diffraction.scene.orientation.mesh_files import load_mesh
from mitsuba_diffraction.scene.stage import STUDIO
from mitsuba_diffraction.scene.surfaces import own_id
from tests.support.logos import RED, write_boxes
from tests.support.orders import thin_grating


@pytest.fixture
def boxes(tmp_path: Path) -> dict[str, str]:
    """Parameters of the studio with the mesh, without most of its light."""
    mi.set_variant("llvm_ad_spectral")
    write_boxes(tmp_path / "boxes.glb")
    thin_grating(0.6, counts=(2, 2, 1)).save(tmp_path / "orders.nc")
    return {"mesh": str(tmp_path / "boxes.glb"), "material:Cap": str(tmp_path / "orders.nc")}


def loaded(values: dict[str, str]) -> tuple[dict[str, mi.Shape], list[str]]:
    lines: list[str] = []
    scene = load_scene(STUDIO, values, say=lines.append)
    return {own_id(shape.id()): shape for shape in scene.shapes()}, lines


def test_a_surface_is_put_on_one_material_and_others_stay_as_the_file_has_them(boxes):
    shapes, lines = loaded(boxes | {"others": "own"})
    assert "mesh" not in shapes
    cap, body = shapes["Cap"], shapes["Body"]
    assert "DiffractionOrders[" in str(cap.bsdf())
    assert "vertex_orientation" in str(cap.bsdf())
    assert "Diffraction" not in str(body.bsdf())
    assert len(lines) == 1
    assert lines[0].startswith("Cap: orders.nc on 1 shape (Cap)")
    # both keep their places in the whole, which stands on the floor
    assert cap.face_count() == body.face_count() == 12
    low, high = (body.bbox().min.z, body.bbox().max.z)
    assert low == pytest.approx(0.0, abs=1e-5)
    assert cap.bbox().min.z == pytest.approx(high)
    sides = [shape.bbox().extents().x for shape in (cap, body)]
    assert sides[0] / sides[1] == pytest.approx(0.5, rel=1e-5)


def test_a_material_of_the_file_keeps_colour_metal_and_roughness(boxes):
    write_boxes(Path(boxes["mesh"]))
    values = {"mesh": boxes["mesh"], "material:Body": boxes["material:Cap"], "others": "own"}
    shapes, _ = loaded(values)
    parameters = {k.rpartition("brdf_0.")[2]: v for k, v in mi.traverse(shapes["Cap"]).items()}
    assert np.ravel(parameters["metallic.value"]) == pytest.approx(0.75)
    assert np.ravel(parameters["roughness.value"]) == pytest.approx(0.25)
    mi.set_variant("scalar_rgb")
    shapes, _ = loaded(values)
    parameters = {k.rpartition("brdf_0.")[2]: v for k, v in mi.traverse(shapes["Cap"]).items()}
    np.testing.assert_allclose(np.ravel(parameters["base_color.value"]), RED, atol=2e-3)


def test_by_default_other_materials_have_the_surface_of_the_whole(boxes):
    shapes, lines = loaded(boxes | {"material:surface": "preset:cd"})
    assert "DiffractionOrders[" in str(shapes["mesh"].bsdf())
    assert shapes["mesh"].face_count() == shapes["Cap"].face_count() == 12
    assert [line.partition(";")[0] for line in lines] == [
        "Cap: orders.nc on 1 shape (Cap)", "surface: cd on 1 shape (mesh)"
    ]  # fmt: skip


def test_an_unknown_name_is_answered_with_the_materials(boxes):
    boxes["material:Lid"] = boxes.pop("material:Cap")
    with pytest.raises(DiffractionError, match=r"'Lid', .* its meshes are Body, Cap$"):
        loaded(boxes | {"others": "own"})


def test_materials_of_an_obj_file_are_named_as_not_supported(tmp_path):
    mi.set_variant("scalar_rgb")
    faces = ["usemtl Red paint", "f 1 2 3", "usemtl Blue", "f 1 2 4", "usemtl Blue"]
    lines = ["mtllib a.mtl", "v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1", *faces]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    with pytest.warns(md.DiffractionWarning, match=r"not supported \(Red paint, Blue\)"):
        assert len(load_mesh(tmp_path / "a.obj").faces) == 2


def test_what_a_material_of_the_file_loses_is_said(boxes, tmp_path, recwarn):
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.load_scene(boxes["mesh"])
    for geometry in scene.geometry.values():
        if geometry.visual.material.name == "Body":
            geometry.visual.material.emissiveFactor = [1.0, 0.5, 0.0]
    scene.export(boxes["mesh"])
    loaded(boxes | {"others": "own"})
    (warning,) = [str(w.message) for w in recwarn if "without its" in str(w.message)]
    assert warning.startswith("material 'Body' of '")
    assert warning.endswith("is shown without its emissiveFactor")
