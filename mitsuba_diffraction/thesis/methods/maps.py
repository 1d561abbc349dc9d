"""Maps by the evaluators of `methods`, in NumPy: for comparison with what the renderer sees."""

from __future__ import annotations

import numpy as np

from ...analysis.maps import hemisphere
from ...analysis.maps.light import Bands, Light
from ...analysis.maps.result import BrdfMap
from ...optics.geometry import wavenumber
from ...progress import Progress
from ...tables.build.spectrum import NEAR
from .gain import Gain
from .method import Method


def method_map(
    method: Method,
    light: Light,
    *,
    step: float = 5.0,
    wavelength: float | None = None,
    resolution: int = 128,
    samples: int = 1,
    cosine: bool = False,
    gain: Gain | None = None,
    progress: Progress | None = None,
) -> BrdfMap:
    """A method's BRDF for one light direction, over the whole hemisphere of view directions.

    Parameters
    ----------
    method : sums over its own wavelengths, under D65.
    light : direction to the light.
    step : nm, of the method, for the caption.
    wavelength : nm: a map of f at one wavelength instead of colours.
    resolution : pixels along each axis.
    samples : directions in a pixel. The wavelengths are the same for all of them, unlike in
        `brdf_map`: what a step leaves out of the spectrum shows.
    cosine : map f·cosθo instead of f.
    gain : map the thesis' relative reflectance with this gain factor instead of f.
    progress : called as progress(done, total, text).

    Raises
    ------
    DiffractionError
        If a parameter is out of range, or the method has no such value.
    """
    hemisphere.check_resolution(resolution)
    hemisphere.check_samples(samples)
    bands = Bands.of(method.wavelength_range, step, wavelength)
    rows, columns = np.nonzero(hemisphere.inside(resolution))
    low, size = hemisphere.corners(resolution), 2.0 / resolution
    pattern = hemisphere.sub_samples(samples)
    components = 3 if wavelength is None else 1
    coverage = np.zeros((resolution, resolution), np.float32)
    values = np.zeros((resolution, resolution, components), np.float32)
    x = (low[columns][:, None] + pattern[:, 0] * size).ravel()
    y = (low[rows][:, None] + pattern[:, 1] * size).ravel()
    height = 1.0 - x * x - y * y
    above = height > 0.0
    views = np.stack([x, y, np.sqrt(np.maximum(height, 0.0))], axis=-1)[above]
    lights = np.broadcast_to(light.direction, views.shape)
    if wavelength is None:
        found = method.xyz(lights, views, gain=gain, progress=progress)
    elif gain is None:
        found = method.brdf(lights, views, wavelength)[:, None]
    else:
        found = method.relative(lights, views, wavelength, gain)[:, None]
    if cosine:
        found = found * views[:, 2:]
    every = np.zeros((x.size, components))
    every[above] = found
    coverage[rows, columns] = above.reshape(-1, samples).mean(axis=1)
    values[rows, columns] = every.reshape(-1, samples, components).mean(axis=1)
    return BrdfMap(
        light=light,
        bands=bands,
        coverage=coverage,
        xyz=values if wavelength is None else None,
        spectrum=None if wavelength is None else np.moveaxis(values, -1, 0),
        cosine=cosine,
        illuminant="D65",
        samples=samples,
        lobe=NEAR / (method.sigma * float(wavenumber(bands.high))),
    )
