"""Blender as a separate program: a Python with bpy, or an executable of Blender itself."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from docs.make.blender.program import blender_command
from mitsuba_diffraction import DiffractionError

#: Seconds after which a program counts as stuck.
TIMEOUT = 300.0

#: Python of Blender's: a plane whose surface is a script of OSL, and what a camera above it sees.
PLANE = """
import bpy, _cycles, numpy as np
from pathlib import Path

def compiled(source):
    file = source.with_suffix(".oso")
    assert _cycles.osl_compile(str(source), str(file)), "no OSL"
    return file

def with_script(shader, output, pixels, samples):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.shading_system = "CPU", True
    scene.cycles.samples, scene.cycles.use_denoising = samples, False
    scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = pixels
    material = bpy.data.materials.new("surface")
    tree = material.node_tree
    tree.nodes.clear()
    script = tree.nodes.new("ShaderNodeScript")
    script.mode, script.filepath = "EXTERNAL", str(shader)
    bsdf = script.outputs.new("NodeSocketShader", output)
    end = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(bsdf, end.inputs["Surface"])
    return scene, material, script

def seen(scene, file, **camera):
    bpy.ops.object.camera_add(**camera)
    scene.camera = bpy.context.object
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 1.0
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(file)
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(scene.render.filepath)
    picture.colorspace_settings.name = "Non-Color"
    return np.array(picture.pixels[:]).reshape(-1, 4)
"""


def blender() -> list[str]:
    """Command that runs a script in Blender, without the script's name; skips without Blender."""
    try:
        return blender_command()
    except DiffractionError as error:
        pytest.skip(str(error))


def run_in_blender(
    script: Path, *arguments: str | os.PathLike[str]
) -> subprocess.CompletedProcess[str]:
    """Run a script in Blender; `sys.argv` of the script ends with the arguments, as text."""
    command = blender()
    between = ["--"] if "--python" in command else []
    return subprocess.run(
        [*command, str(script), *between, *map(str, arguments)],
        capture_output=True, text=True, errors="replace", timeout=TIMEOUT, check=False,
    )  # fmt: skip


def result_of(code: str, folder: Path, /, **values: Any) -> Any:
    """Run code in Blender, and return what it leaves in `result`, as JSON types.

    values : variables of the code, JSON types.
    """
    script, output = folder / "script.py", folder / "result.json"
    head = f"import json\nglobals().update(json.loads({json.dumps(values)!r}))\n"
    tail = f"\nopen({str(output)!r}, 'w').write(json.dumps(result))\n"
    script.write_text(head + code + tail, encoding="utf-8")
    output.unlink(missing_ok=True)
    done = run_in_blender(script)
    assert output.exists(), done.stdout + done.stderr
    return json.loads(output.read_text())
