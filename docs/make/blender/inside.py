"""Build views in Blender and render them with Cycles: a program of Blender's Python.

    python inside.py jobs.json

jobs.json is a list of views with the picture to write, the samples, the seed and the working
space. Pictures are linear sRGB. Filters, clamps, denoising and adaptive samples are off, so that
pixels are means of radiance, as Mitsuba's. Imports nothing of the package: bpy alone.
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import sys
import time
from typing import Any

import bpy
from mathutils import Color, Vector

#: Largest number of reflections, as of the path tracer's depth of 3.
_BOUNCES = 2


def main() -> None:
    """Render the jobs of a file, and print the seconds of each."""
    with open(sys.argv[-1], encoding="utf-8") as file:
        jobs = json.load(file)
    for job in jobs:
        view = job["view"]
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.set_working_color_space(working_space=job["working_space"])
        scene = settings(job["samples"], job["seed"], *view["size"])
        target = shape(view["shape"])
        target.data.materials.append(material(view["surface"]))
        lights(scene, view["light"])
        scene.camera = camera(**view["camera"])
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        scene.render.image_settings.color_management = "OVERRIDE"
        scene.render.image_settings.linear_colorspace_settings.name = "Linear Rec.709"
        scene.render.filepath = job["output"]
        render()


def render() -> None:
    """Render the scene to its file, and print the seconds."""
    clock, processor = time.perf_counter(), time.process_time()
    bpy.ops.render.render(write_still=True)
    clock, processor = time.perf_counter() - clock, time.process_time() - processor
    print(f"seconds {clock:.2f} processor {processor:.2f}", flush=True)


def settings(samples: int, seed: int, width: int, height: int) -> Any:
    """Return the scene, with Cycles as a plain path tracer on the processor."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    cycles = scene.cycles
    cycles.device, cycles.shading_system = "CPU", True
    cycles.samples, cycles.seed = samples, seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = cycles.glossy_bounces = cycles.diffuse_bounces = _BOUNCES
    return scene


def shape(kind: str) -> Any:
    """Return a mesh of unit radius or half side with Mitsuba's texture coordinates."""
    if kind == "sphere":
        bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128)
        bpy.ops.object.shade_smooth()
    elif kind == "rectangle":
        bpy.ops.mesh.primitive_plane_add(size=2)
    else:
        bpy.ops.mesh.primitive_circle_add(vertices=256, fill_type="TRIFAN")
    return bpy.context.object


def material(surface: dict[str, Any]) -> Any:
    """Return a grey or a glossy material, or that of an exported folder."""
    if "folder" in surface:
        made = exported(surface["folder"], surface["tangent"])
        group = next(node for node in made.node_tree.nodes if node.type == "GROUP")
        for name, value in surface["inputs"].items():
            if isinstance(value, list):  # a colour, which nodes have in the working space
                value = [*Color(value).from_rec709_linear_to_scene_linear(), 1]
            group.inputs[name].default_value = value
        return made
    made = bpy.data.materials.new("plain")
    nodes = made.node_tree.nodes
    nodes.clear()
    if "grey" in surface:
        node = nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (*[surface["grey"]] * 3, 1)
    else:
        node = nodes.new("ShaderNodeBsdfAnisotropic")
        node.distribution = "GGX"
        node.inputs["Color"].default_value = (1, 1, 1, 1)
        node.inputs["Roughness"].default_value = math.sqrt(surface["glossy"])
    made.node_tree.links.new(node.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs[0])
    return made


def exported(folder: str, tangent: str) -> Any:
    """Return the material of an exported folder, by the script in it."""
    script = os.path.join(folder, "blender_material.py")
    spec = importlib.util.spec_from_file_location("blender_material", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.add_material(folder, tangent=tangent)


def lights(scene: Any, light: dict[str, Any]) -> None:
    """Add a lamp, or an environment map."""
    world = bpy.data.worlds.new("world")
    scene.world = world
    background = world.node_tree.nodes["Background"]
    if "file" in light:
        # as many rows as the map has; the default searches for minutes in a picture's first sample
        world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", 256
        node = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = bpy.data.images.load(light["file"])
        node.image.colorspace_settings.name = "Linear Rec.709"
        world.node_tree.links.new(node.outputs[0], background.inputs[0])
        return
    background.inputs[0].default_value = (*[light["room"]] * 3, 1)
    lamp = bpy.data.lights.new("lamp", "AREA")
    lamp.shape, lamp.size = "DISK", 2 * light["radius"]
    # a lamp of power P and area A has the radiance P / (π A)
    lamp.energy = light["radiance"] * math.pi * math.pi * light["radius"] ** 2
    place(bpy.data.objects.new("lamp", lamp), light["position"], (0, 0, 0))


def camera(position: Any, target: Any, angle: float) -> Any:
    """Return a camera at a position; angle : horizontal, degrees."""
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.angle = "HORIZONTAL", math.radians(angle)
    return place(bpy.data.objects.new("camera", lens), position, target)


def place(thing: Any, position: Any, target: Any) -> Any:
    """Add an object to the scene, with its −z axis towards a target."""
    thing.location = position
    towards = Vector(target) - Vector(position)
    thing.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(thing)
    return thing


if __name__ == "__main__":
    main()
