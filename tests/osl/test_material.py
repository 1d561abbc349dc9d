"""Exported materials in .blend files, and pictures of Cycles beside Mitsuba's. Needs Blender."""

from __future__ import annotations

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from tests.support import ROOT
from tests.support.blender import blender, result_of, run_in_blender
from tests.support.orders import thin_grating

pytestmark = pytest.mark.thorough

WIDTH = 12.0  # µm: wide lobes, which need few samples
_ADDED = """
import bpy
bpy.ops.wm.open_mainfile(filepath=file)
scene, material = bpy.context.scene, bpy.data.materials["grating"]
group = next(n for n in material.node_tree.nodes if n.type == "GROUP")
script = next(n for n in group.node_tree.nodes if n.type == "SCRIPT")
tips = {s.name: s.description for s in group.node_tree.interface.items_tree if s.in_out == "INPUT"}
result = {
    "engine": scene.render.engine,
    "osl": scene.cycles.shading_system,
    "users": [o.name for o in bpy.data.objects if o.type == "MESH" and material.name in
              [slot.name for slot in o.material_slots]],
    "inputs": {s.name: list(s.default_value) if s.type in ("RGBA", "VECTOR") else s.default_value
               for s in group.inputs},
    "tips": tips,
    "linked": [link.to_socket.name for link in material.node_tree.links],
    "files": [s.default_value for s in script.inputs if "Texture" in s.name],
}
"""

_IN_FILE = """
import bpy
bpy.ops.wm.open_mainfile(filepath=file)
group = next(n for n in bpy.data.materials["card"].node_tree.nodes if n.type == "GROUP")
result = {
    "spaces": {g.name: [n.inputs["Working Space"].default_value for n in g.nodes
                        if n.type == "SCRIPT"] for g in bpy.data.node_groups},
    "cube": bpy.data.objects["Cube"].active_material.name,
    "linked": sorted(s.name for s in group.inputs if s.is_linked),
}
"""


_INSTALLED = """
import os
os.environ["BLENDER_USER_RESOURCES"] = home
import bpy
bpy.ops.extensions.package_install_files(filepath=file, repo="user_default", enable_on_install=True)
before = sorted(m.name for m in bpy.data.materials)
bpy.ops.material.diffraction_look(look="grating")
added = bpy.context.object.active_material.name
bpy.ops.material.diffraction_assets()
folder = [entry.path for entry in bpy.context.preferences.filepaths.asset_libraries
          if entry.name == "Diffraction"]
library = os.path.join(folder[0], "looks.blend")
with bpy.data.libraries.load(library, assets_only=True) as (there, _):
    assets = list(there.materials)
result = {"before": before, "added": added, "assets": assets,
          "after": sorted(m.name for m in bpy.data.materials)}
"""


@pytest.fixture(autouse=True)
def _blender(some_variant):
    blender()


@pytest.fixture(scope="module")
def grating():
    return thin_grating()


def exported(source, folder, name, **parameters):
    bsdf = md.bsdf_dict(source, coherence_width=WIDTH, **parameters)
    md.osl.export(mi.load_dict(bsdf), folder, name)
    return bsdf


def test_script_adds_a_material_with_labelled_inputs(tmp_path, grating):
    folder, file = tmp_path / "exported", tmp_path / "made.blend"
    exported(grating, folder, "grating")
    script = folder / "blender_material.py"
    done = run_in_blender(script, "--object", "Cube", "--output", file)
    assert done.returncode == 0, done.stderr
    added = result_of(_ADDED, tmp_path, file=str(file))
    assert (added["engine"], added["osl"], added["users"]) == ("CYCLES", True, ["Cube"])
    assert added["inputs"]["Coherence Width (µm)"] == WIDTH
    assert added["inputs"]["Rotation (°)"] == 0.0
    assert all(added["tips"][name] for name in added["inputs"])
    assert sorted(added["linked"]) == ["Surface", "Tangent"]
    assert added["files"] == [str(path.resolve()) for path in folder.glob("*.exr")]


def test_materials_are_added_to_a_file_in_its_working_space(tmp_path, grating):
    folder, file = tmp_path / "exported", tmp_path / "made.blend"
    exported(grating, folder, "grating")
    script = folder / "blender_material.py"
    assert run_in_blender(script, "--object", "Cube", "--output", file).returncode == 0
    picture = ROOT / "scenes" / "textures" / "hologram_orientation.exr"
    done = run_in_blender(
        script, "--blend", file, "--name", "card", "--working-space", "Linear Rec.2020",
        "--orientation", picture, "--output", file,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = result_of(_IN_FILE, tmp_path, file=str(file))
    # both materials are there, each with a group of its own, in the file's working space
    assert found["spaces"] == {"card": ["Linear Rec.2020"], "grating": ["Linear Rec.2020"]}
    assert found["cube"] == "grating"
    assert found["linked"] == ["Rotation (°)", "Tangent"]


_SCENE = """
import bpy
mesh = bpy.data.meshes["Cube"]
mesh.materials.clear()
for name in ("skin", "eyes"):
    mesh.materials.append(bpy.data.materials.new(name))
bpy.context.collection.objects.link(bpy.data.objects.new("Twin", mesh))
bpy.ops.wm.save_as_mainfile(filepath=file)
result = True
"""

_SLOTS = """
import bpy
bpy.ops.wm.open_mainfile(filepath=file)
result = {name: [slot.material.name for slot in bpy.data.objects[name].material_slots]
          for name in ("Cube", "Twin")}
"""


def test_a_slot_of_a_copy_gets_the_material_and_nothing_else_changes(tmp_path, grating):
    file, copy = tmp_path / "snake.blend", tmp_path / "snake_diffraction.blend"
    result_of(_SCENE, tmp_path, file=str(file))
    before = file.read_bytes()
    exported(grating, tmp_path / "exported", "grating")
    script = tmp_path / "exported" / "blender_material.py"
    done = run_in_blender(script, "--blend", file, "--object", "Cube")
    assert done.returncode != 0
    assert "1 skin, 2 eyes" in done.stderr
    assert not copy.exists()
    done = run_in_blender(script, "--blend", file, "--object", "Cube", "--slot", "eyes")
    assert done.returncode == 0, done.stderr
    assert str(copy) in done.stdout
    assert file.read_bytes() == before
    slots = result_of(_SLOTS, tmp_path, file=str(copy))
    assert slots == {"Cube": ["skin", "grating"], "Twin": ["skin", "eyes"]}
    again = run_in_blender(script, "--blend", file, "--object", "Cube", "--slot", "1")
    assert again.returncode != 0
    assert "is there already" in again.stderr


@pytest.mark.parametrize("content", [None, b"no file of Blender"])
def test_a_file_that_cannot_be_opened_is_one_line(tmp_path, grating, content):
    exported(grating, tmp_path / "exported", "grating")
    file = tmp_path / "scene.blend"
    if content is not None:
        file.write_bytes(content)
    done = run_in_blender(tmp_path / "exported" / "blender_material.py", "--blend", file)
    assert done.returncode != 0
    assert f"cannot open '{file}'" in done.stderr
    assert "Traceback" not in done.stderr


def test_blender_installs_the_addon_and_has_assets(tmp_path, grating):
    exported(grating, tmp_path / "exported", "grating")
    file, home = tmp_path / "looks.zip", tmp_path / "home"
    md.osl.make_addon({"grating": tmp_path / "exported"}, file)
    home.mkdir()
    found = result_of(_INSTALLED, tmp_path, file=str(file), home=str(home))
    assert found["added"] == "grating"
    assert found["assets"] == ["grating"]
    # the open file has the material that was added, and none of the library's
    assert found["after"] == sorted([*found["before"], "grating"])


def test_unknown_object_is_one_line(tmp_path, grating):
    exported(grating, tmp_path, "grating")
    output = tmp_path / "out.blend"
    done = run_in_blender(tmp_path / "blender_material.py", "--object", "Ring", "--output", output)
    assert not output.exists()
    assert done.returncode != 0
    assert "no mesh object 'Ring'; the file has Cube" in done.stderr
    assert "Traceback" not in done.stderr
