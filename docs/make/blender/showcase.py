"""Build the example .blend, a disc, a foil and a snake's scale on plinths, in Blender's Python.

    python showcase.py DISC FOIL SCALE --output showcase.blend [--picture FILE] [--samples N]

DISC, FOIL and SCALE are folders of `mitsuba-diffraction export-osl`. Prints the seconds of the
render. Imports nothing of the package: bpy and the exported blender_material.py alone.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).parent))  # which a blender executable leaves out
from inside import camera, exported, place, render

#: Distance between the plinths.
_STEP = 2.6


def main() -> None:
    """Build, save and render as the command line says."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folders", type=Path, nargs=3)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--size", type=int, nargs=2, default=(480, 320))
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    options = parser.parse_args(words)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.set_working_color_space(working_space="Linear Rec.2020")
    disc, foil, scale = (
        exported(str(folder), tangent)
        for folder, tangent in zip(options.folders, ("radial-z", "uv", "uv"), strict=True)
    )
    inputs(disc)["Rotation (°)"].default_value = -90.0
    inputs(scale)["Pigment"].default_value = (0.05, 0.03, 0.02, 1)
    for material in (disc, foil, scale):  # wide lobes, with less noise than those of sunlight
        inputs(material)["Coherence Width (µm)"].default_value = 20.0
    room()
    bpy.ops.mesh.primitive_cylinder_add(vertices=256, radius=1.15, depth=0.02)
    tilted = bpy.context.object
    tilted.location, tilted.rotation_euler = (-_STEP, 0.2, 1.28), (math.radians(62), 0, 0.2)
    tilted.data.materials.append(disc)
    hole(tilted)
    for x, material in ((0.0, foil), (_STEP, scale)):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, location=(x, 0, 1.4))
        bpy.ops.object.shade_smooth()
        bpy.context.object.rotation_euler = (0, math.radians(90), 0)
        bpy.context.object.data.materials.append(material)
    lights()
    scene = bpy.context.scene
    scene.cycles.samples = options.samples
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces = 3, 1
    scene.render.resolution_x, scene.render.resolution_y = options.size
    scene.camera = camera((0, -12.5, 4.6), (0, 0, 1.15), 36)
    if options.picture:
        scene.render.filepath = str(options.picture.resolve())
        render()
    bpy.ops.wm.save_as_mainfile(filepath=str(options.output.resolve()), compress=True)


def inputs(material: Any) -> Any:
    """Return the inputs of a material's node group."""
    return next(node for node in material.node_tree.nodes if node.type == "GROUP").inputs


def plain(name: str, colour: tuple[float, float, float]) -> Any:
    """Return a diffuse material."""
    material = bpy.data.materials.new(name)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.remove(nodes["Principled BSDF"])
    shader = nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*colour, 1)
    links.new(shader.outputs[0], nodes["Material Output"].inputs["Surface"])
    return material


def room() -> None:
    """Add a floor and three plinths."""
    floor = plain("floor", (0.11, 0.11, 0.12))
    bpy.ops.mesh.primitive_plane_add(size=60)
    bpy.context.object.data.materials.append(floor)
    plinth = plain("plinth", (0.02, 0.02, 0.022))
    for x in (-_STEP, 0.0, _STEP):
        bpy.ops.mesh.primitive_cylinder_add(
            vertices=96, radius=0.85, depth=0.4, location=(x, 0, 0.2)
        )
        bpy.context.object.data.materials.append(plinth)


def hole(disc: Any) -> None:
    """Add the clear hub of a disc: a dark ring on both faces."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=96, radius=0.4, depth=0.024)
    hub = bpy.context.object
    hub.location, hub.rotation_euler = disc.location, disc.rotation_euler
    hub.data.materials.append(plain("hub", (0.2, 0.2, 0.21)))
    bpy.ops.mesh.primitive_cylinder_add(vertices=96, radius=0.14, depth=0.028)
    centre = bpy.context.object
    centre.location, centre.rotation_euler = disc.location, disc.rotation_euler
    centre.data.materials.append(plain("centre", (0.01, 0.01, 0.01)))


def lights() -> None:
    """Add a small bright lamp, a soft one, and a dim room."""
    world = bpy.data.worlds.new("room")
    bpy.context.scene.world = world
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.1, 0.11, 0.13, 1)
    for name, position, size, power in (
        ("lamp", (-3.5, -6.0, 7.5), 1.0, 900.0),
        ("soft", (5.0, 2.0, 5.5), 3.5, 900.0),
    ):
        lamp = bpy.data.lights.new(name, "AREA")
        lamp.shape, lamp.size, lamp.energy = "DISK", size, power
        place(bpy.data.objects.new(name, lamp), position, (0, 0, 1))


if __name__ == "__main__":
    main()
