"""Diffracting looks in Blender: a panel that adds them, and materials in the asset browser.

Made by mitsuba_diffraction, which packs this file as an add-on, with the exported looks beside it.
Needs Blender 5.0 or newer alone.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

from . import blender_material

try:
    import bpy
except ModuleNotFoundError:  # outside of Blender nothing is registered
    bpy = None

HERE = Path(__file__).parent
#: Name of the asset library in Blender's preferences.
LIBRARY = "Diffraction"


def looks() -> list[str]:
    """Return the names of all exported looks."""
    return sorted(folder.name for folder in (HERE / "looks").iterdir() if folder.is_dir())


def library() -> Path:
    """Return the folder of the asset library, which an update of the add-on keeps."""
    try:
        return Path(bpy.utils.extension_path_user(__package__, path="assets", create=True))
    except ValueError:  # not installed as an extension
        return HERE / "assets"


def make_library() -> Path:
    """Write all looks as assets into the library, and enter the library in the preferences.

    The open file stays as it is: looks that it lacks are removed again.
    """
    folder = library()
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "looks.blend"
    before = {block.as_pointer() for blocks in _blocks() for block in blocks}
    materials = set()
    users = {look: bpy.data.materials.get(look) for look in looks()}
    for look, own in users.items():
        if own is not None:
            own.name = f"{look} of the file"  # the asset has the name for a moment
        material = blender_material.add_material(
            HERE / "looks" / look, name=f"asset {look}", shared=HERE / "textures"
        )
        material.name = look
        material.asset_mark()
        material.asset_data.description = "Diffraction: Cycles with Open Shading Language"
        materials.add(material)
    bpy.data.libraries.write(str(file), materials, fake_user=True, path_remap="ABSOLUTE")
    for blocks in _blocks():
        for block in [b for b in blocks if b.as_pointer() not in before]:
            blocks.remove(block)
    for look, own in users.items():
        if own is not None:
            own.name = look
    known = bpy.context.preferences.filepaths.asset_libraries
    if all(Path(entry.path) != folder for entry in known):
        known.new(name=LIBRARY, directory=str(folder))
    return file


def _blocks() -> tuple[Any, Any]:
    return bpy.data.materials, bpy.data.node_groups


@functools.cache
def classes() -> tuple[Any, ...]:
    """Return the operators and the panel, of classes that exist in Blender alone."""

    class MATERIAL_OT_diffraction_look(bpy.types.Operator):
        """Give the active object a diffracting material."""

        bl_idname, bl_label = "material.diffraction_look", "Add Diffracting Material"
        bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - as Blender reads it

        look: bpy.props.EnumProperty(name="Look", items=[(n, n, "") for n in looks()])  # type: ignore
        tangent: bpy.props.EnumProperty(  # type: ignore
            name="Direction",
            items=[
                ("uv", "Along u", "x axis of the patch along the first texture coordinate"),
                ("radial-z", "Around z", "for discs, with Rotation −90°"),
            ],
        )

        def execute(self, context: Any) -> set[str]:
            """Add the material, to the active mesh if there is one."""
            try:
                material = blender_material.add_material(
                    HERE / "looks" / self.look, name=self.look, tangent=self.tangent,
                    shared=HERE / "textures",
                )  # fmt: skip
            except blender_material.MaterialError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            target = context.object
            if target is not None and target.type == "MESH":
                target.active_material = material
            else:
                material.use_fake_user = True
            return {"FINISHED"}

    class MATERIAL_OT_diffraction_assets(bpy.types.Operator):
        """Write all looks into an asset library."""

        bl_idname, bl_label = "material.diffraction_assets", "Make Asset Library"

        def execute(self, context: Any) -> set[str]:
            """Write the library."""
            try:
                file = make_library()
            except (blender_material.MaterialError, OSError, RuntimeError) as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            self.report({"INFO"}, f"{len(looks())} materials in {file}")
            return {"FINISHED"}

    class MATERIAL_PT_diffraction(bpy.types.Panel):
        """Panel among the properties of a material."""

        bl_label, bl_space_type, bl_region_type = "Diffraction", "PROPERTIES", "WINDOW"
        bl_context = "material"

        def draw(self, context: Any) -> None:
            """Draw the two buttons."""
            self.layout.operator_menu_enum(MATERIAL_OT_diffraction_look.bl_idname, "look")
            self.layout.operator(MATERIAL_OT_diffraction_assets.bl_idname)

    return MATERIAL_OT_diffraction_look, MATERIAL_OT_diffraction_assets, MATERIAL_PT_diffraction


def register() -> None:
    """Register the panel and its operators; Blender calls this when the add-on is enabled."""
    for cls in classes():
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Undo `register`."""
    for cls in reversed(classes()):
        bpy.utils.unregister_class(cls)
