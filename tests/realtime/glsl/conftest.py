"""OpenGL for tests, and tables small enough to be built in a second."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField
from mitsuba_diffraction.realtime.glsl.context import Bindings, compile_program, headless_context
from mitsuba_diffraction.realtime.glsl.texels import Packed, Texture


@pytest.fixture(scope="session")
def gl() -> Iterator[Any]:
    """A moderngl context; Mesa's software rasteriser where there is no graphics card."""
    pytest.importorskip("moderngl")
    try:
        context = headless_context()
    except DiffractionError as error:
        pytest.skip(str(error))
    yield context
    context.release()


@pytest.fixture(scope="session")
def patch() -> HeightField:
    """8 µm of a rough, asymmetric surface, 0.16 µm deep."""
    rng = np.random.default_rng(3)
    noise = np.fft.fft2(rng.normal(size=(96, 96)))
    q = 2 * np.pi * np.fft.fftfreq(96, 8 / 96)
    smooth = np.exp(-0.05 * (4 * q**2 + q[:, None] ** 2))
    heights = np.fft.ifft2(noise * smooth).real
    heights += 0.5 * heights**2 / heights.std()
    return HeightField((heights - heights.min()) * (0.16 / np.ptp(heights)), 8 / 96, name="rough")


@pytest.fixture(scope="session")
def table(patch: HeightField) -> DiffractionTable:
    """Its table of powers, for a window a little narrower than the patch."""
    return DiffractionTable.build(patch, coherence_width=6.5, second_order=True)


@pytest.fixture(scope="session")
def table_file(table: DiffractionTable, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rough patch's table."""
    file = tmp_path_factory.mktemp("table") / "rough.exr"
    table.save(file)
    return file


def probed(gl: Any, method: str, packed: Packed, places: NDArray[Any]) -> NDArray[np.float64]:
    """A method's colours (n, 3) at places (n, 4): u, v, z and the cosine at the half vector."""
    picture = np.ascontiguousarray(places[None], np.float32)
    parts = packed | Packed(
        (Texture("places", picture),), {"light_colour": np.ones((4, 3), np.float32)}
    )
    program = compile_program(gl, method, parts.definitions, vertex="whole.vert", main="probe.frag")
    bindings = Bindings(gl, parts)
    target = gl.texture((len(places), 1), 4, dtype="f4")
    frame = gl.framebuffer([target])
    frame.use()
    bindings.use(program)
    gl.vertex_array(program, []).render(vertices=3)
    result = np.frombuffer(target.read(), np.float32).reshape(-1, 4)[:, :3].astype(float)
    for thing in (bindings, frame, target, program):
        thing.release()
    return result
