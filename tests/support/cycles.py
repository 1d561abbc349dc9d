"""A plane under a sky, rendered by Cycles with an exported material; runs Blender."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.osl import Exported
from tests.support.blender import PLANE, result_of
from tests.support.directions import Array

_CODE = f"""{PLANE}
import math
folder = Path(folder)
document = json.loads((folder / document).read_text(encoding="utf-8"))
shader = compiled(folder / document["shader"])
result = []
for degrees in tilts:
    scene, material, script = with_script(shader, document["output"], pixels, samples)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    tree = material.node_tree
    for item in document["inputs"]:
        name = item["identifier"]
        kind = "Vector" if item["kind"] == "normal" else item["kind"].capitalize()
        socket = script.inputs.new(f"NodeSocket{{kind}}", item["label"], identifier=name)
        value = values.get(name, item["default"])
        if name in document["textures"]:
            value = str(folder / document["textures"][name])
        if item["kind"] == "color":
            value = [*value, 1.0]
        if value is not None:
            socket.default_value = value
        if name == "Tangent":
            tangent = tree.nodes.new("ShaderNodeTangent")
            tangent.direction_type = "UV_MAP"
            tree.links.new(tangent.outputs[0], socket)
    bpy.ops.mesh.primitive_plane_add(size=1000)
    bpy.context.object.data.materials.append(material)
    world = scene.world = bpy.data.worlds.new("sky")
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    background = nodes.new("ShaderNodeBackground")
    place = nodes.new("ShaderNodeTexCoord")
    along, add, power = nodes.new("ShaderNodeVectorMath"), *map(nodes.new, 2 * ["ShaderNodeMath"])
    along.operation, along.inputs[1].default_value = "DOT_PRODUCT", sky[:3]
    add.inputs[1].default_value = sky[3]
    links.new(place.outputs["Generated"], along.inputs[0])
    links.new(along.outputs["Value"], add.inputs[0])
    power.operation, power.inputs[1].default_value = "MULTIPLY", 1.0
    for n in range(sky[4]):
        links.new(add.outputs[0], power.inputs[n])
    links.new(power.outputs[0], background.inputs["Color"])
    sink = nodes.new("ShaderNodeOutputWorld")
    links.new(background.outputs[0], sink.inputs["Surface"])
    tilt = math.radians(degrees)
    # the camera looks from x, and sees nothing but the plane up to 89.9°
    place = (40 * math.sin(tilt), 0, 40 * math.cos(tilt))
    light = seen(scene, folder / "picture.exr", location=place, rotation=(0, tilt, 0))[:, :3]
    spread = light.std(axis=0) / len(light) ** 0.5
    result.append([light.mean(axis=0).tolist(), spread.tolist()])
"""


#: Radiance 1.
WHITE = (0.0, 0.0, 0.0, 1.0, 1)


class Seen(NamedTuple):
    """Radiance of a plane in linear RGB, (tilts, 3): mean over pixels, and its standard error."""

    mean: Array
    error: Array


def plane_seen(
    exported: Exported,
    tilts: list[float],
    sky: tuple[float, float, float, float, int] = WHITE,
    samples: int = 96,
    pixels: int = 12,
    **values: object,
) -> Seen:
    """Render a plane whose patch has x along the world's, seen from some angles towards x.

    tilts : degrees from the normal.
    sky : (a, b, c, d, n) of the radiance (a x + b y + c z + d)ⁿ of a direction; n is 1 or 2.
    values : of sockets, by identifier.
    """
    folder = Path(exported.document).parent
    light = result_of(
        _CODE, folder, folder=str(folder), document=exported.document.name, tilts=tilts, sky=sky,
        samples=samples, pixels=pixels, values=values,
    )  # fmt: skip
    mean, error = np.moveaxis(np.array(light), 1, 0)
    return Seen(mean, error)
