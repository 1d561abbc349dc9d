"""Surfaces from their BRDF or colours, by gradients of the BRDF with respect to the heights.

A phase screen exp(iκh) has the orders a_j(κ). The BRDF of a pair of directions, averaged over all
positions of the window (see `reference`), is

    f = factor · 4π²σ⁴ Σ_j≠0 |a_j|² exp(−σ²|q − q_j|²) + |a_0|² f_flat,

with the BRDF f_flat of a flat patch.

A loss L of many such f changes with the heights by the adjoint of the DFT, one more DFT per κ:

    ∂L/∂h(r) = −(2κ/N) Im[exp(iκh(r)) · conj Σ_j (∂L/∂|a_j|²) a_j exp(−i q_j·r)],

for N pixels. L-BFGS-B (Byrd, Lu, Nocedal and Zhu 1995) minimises the loss. The heights h, their
shifts, h + constant, and −h(−r), the patch turned by 180° and upside down, have the same BRDF.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft, ndimage, optimize

from .. import reference
from ..arrays import Real
from ..errors import DiffractionError, counted
from ..heights.field import HeightField, check_pixel_count
from ..heights.lengths import PixelSize
from ..optics import colour
from ..optics.geometry import diffraction_coordinates, kirchhoff_factor, sigma_of, wavenumber
from ..reference.arguments import directions_of, index_of
from ..reference.fresnel import reflectance

#: Loss of BRDFs (n,): returns its value and its derivatives (n,).
Loss = Callable[[Real], tuple[float, Real]]

#: Wavelengths that represent the spectrum, nm.
WAVELENGTHS = tuple(float(x) for x in range(400, 701, 20))

_ALL = slice(None)
_AT_ONCE = 2**20  # pixels of the screens that `Views.brdf` evaluates at a time, 40 MB


class Views:
    """Pairs of directions and wavelengths in which patches of one size are evaluated.

    Parameters
    ----------
    patch : HeightField of that size; its heights are not used.
    wi, wo, wavelength, coherence_width, eta, k : as in `reference.brdf` with
        `coherence="ensemble"` and `model="kirchhoff"`; n pairs in all. A gradient requires some 50
        bytes for each pixel and pair.

    Raises a DiffractionError as `reference.brdf` does.
    """

    def __init__(
        self,
        patch: HeightField,
        wi: ArrayLike,
        wo: ArrayLike,
        wavelength: ArrayLike,
        *,
        coherence_width: float,
        eta: ArrayLike | None = None,
        k: ArrayLike = 0.0,
    ) -> None:
        self._flat = _flat_brdf(wi, wo, wavelength, coherence_width, eta, k)
        sigma, light = sigma_of(coherence_width), directions_of(wi, wo, wavelength)
        u, v, w = diffraction_coordinates(light.wi, light.wo)
        wave = wavenumber(light.wavelength)
        self.shape, self.pixel_size = patch.shape, patch.pixel_size
        self.kappa, alpha, beta = wave * w, wave * u, wave * v
        self._factor = kirchhoff_factor(*light, sigma) * 4 * np.pi**2 * sigma**4
        index = index_of(eta, k, light.wavelength, None)
        if index is not None:
            self._factor *= reflectance(0.5 * np.sqrt(u**2 + v**2 + w**2), index)
        self._window_x, self._window_y = (
            np.exp(-((sigma * (q[:, None] - 2 * np.pi * fft.fftfreq(n, pixel))) ** 2))
            for q, n, pixel in zip((alpha, beta), self.shape[::-1], self.pixel_size, strict=True)
        )

    def __len__(self) -> int:
        return len(self._flat)

    def brdf(self, heights: ArrayLike) -> Real:
        """Return the BRDF (n,) of heights (ny, nx) in µm, 1/sr."""
        size = max(1, _AT_ONCE // (self.shape[0] * self.shape[1]))
        parts = [slice(start, start + size) for start in range(0, len(self), size)]
        values = [self._brdf(fft.ifft2(self._screens(heights, part)), part) for part in parts]
        return np.concatenate([np.empty(0), *values])

    def loss(self, heights: ArrayLike, loss: Loss) -> tuple[float, Real]:
        """Return a loss of the BRDF and its gradient (ny, nx), per µm of height at each pixel."""
        screens = self._screens(heights)
        orders = fft.ifft2(screens)
        value, derivatives = loss(self._brdf(orders))
        weights = (self._factor * derivatives)[:, None] * self._window_y
        zeroth = self._flat * derivatives * orders[:, 0, 0]
        orders *= np.einsum("ny,nx->nyx", weights, self._window_x)
        orders[:, 0, 0] = zeroth
        adjoint = fft.fft2(orders, overwrite_x=True)
        imaginary = screens.imag * adjoint.real - screens.real * adjoint.imag
        return value, -2.0 / screens[0].size * np.einsum("n,nyx->yx", self.kappa, imaginary)

    def _screens(self, heights: ArrayLike, part: slice = _ALL) -> NDArray[np.complex128]:
        """Return the phase screens exp(iκh) of some pairs, (n, ny, nx)."""
        h = np.asarray(heights, np.float64)
        if h.shape != self.shape:
            raise DiffractionError(f"heights have shape {h.shape}, these views {self.shape}")
        return np.asarray(np.exp(1j * self.kappa[part, None, None] * h))

    def _brdf(self, orders: NDArray[np.complex128], part: slice = _ALL) -> Real:
        """Return the BRDF (n,) of some pairs from the amplitudes of the orders (n, ny, nx)."""
        powers = orders.real**2 + orders.imag**2
        zeroth = self._flat[part] * powers[:, 0, 0]
        powers[:, 0, 0] = 0.0
        rows = np.einsum("nyx,nx->ny", powers, self._window_x[part])
        others = self._factor[part] * np.einsum("ny,ny->n", rows, self._window_y[part])
        return np.asarray(others + zeroth)


def _flat_brdf(
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    width: float,
    eta: ArrayLike | None = None,
    k: ArrayLike = 0.0,
) -> Real:
    """Return the reference BRDF of a flat patch, a mirror's lobe; checks all arguments."""
    flat = HeightField(np.zeros((2, 2)), 1.0)
    return reference.brdf(
        flat, wi, wo, wavelength, coherence_width=width, model="kirchhoff", eta=eta, k=k
    )


def recover(
    views: Views,
    brdf: ArrayLike,
    start: HeightField,
    *,
    smoothing: float = 0.0,
    iterations: int = 1000,
) -> HeightField:
    """Find a patch with this BRDF, up to changes that leave the BRDF the same (see `aligned`).

    Minimises Σ (√f − √f_measured)². The difference of amplitudes, as in phase retrieval (Fienup
    1982), gives weight to dim directions beside the mirror direction's lobe. From a distant start,
    the result may be another local minimum: compare its `views.brdf`, and try another start.

    Raises a DiffractionError if `brdf` is not n values, finite and at least 0, the start has other
    pixels than the views, or a number is out of range.

    Parameters
    ----------
    brdf : (n,), 1/sr, measured values in the views.
    start : initial heights; not flat, where the gradient is 0.
    smoothing : µm, standard deviation of the Gaussian that filters the heights.
    iterations : largest number of steps.
    """
    measured = np.asarray(brdf, np.float64)
    if measured.shape != (len(views),) or not np.all((measured >= 0) & (measured < np.inf)):
        raise DiffractionError(
            f"brdf has shape {measured.shape}; it must be {len(views)} finite values of at least "
            "0, one for each view"
        )
    if (start.shape, start.pixel_size) != (views.shape, views.pixel_size):
        raise DiffractionError(
            f"start has {start.shape} pixels of {start.pixel_size} µm, these views "
            f"{views.shape} of {views.pixel_size} µm"
        )
    if start.range == 0.0:
        raise DiffractionError("start is flat, where the gradient is 0; give it random heights")
    if not 0.0 <= smoothing < np.inf:
        raise DiffractionError(f"smoothing={smoothing} must be at least 0 µm and finite")
    dark = 1e-9 * measured.max()  # keeps the root's derivative finite where f is 0
    target = np.sqrt(measured + dark)
    scale = 1.0 / (target @ target)

    def amplitudes(f: Real) -> tuple[float, Real]:
        """Return the squared difference of amplitudes and its derivatives with respect to f."""
        amplitude = np.sqrt(f + dark)
        difference = amplitude - target
        return float(scale * difference @ difference), scale * difference / amplitude

    heights, steps = _minimise(views, amplitudes, start.heights, smoothing, None, iterations)
    done = f"from {counted(len(views), 'view')} in {counted(steps, 'step')}"
    return start.changed(heights, f"recovered {done}")


def _minimise(
    views: Views,
    loss: Loss,
    start: Real,
    smoothing: float,
    bounds: optimize.Bounds | None,
    iterations: int,
) -> tuple[Real, int]:
    """Minimise a loss over heights smoothed by a Gaussian (µm); also return the number of steps."""
    _check_whole("iterations", iterations, 1)

    def objective(x: Real) -> tuple[float, Real]:
        """Return the loss of the smoothed heights and its gradient."""
        value, gradient = views.loss(_smooth(x.reshape(views.shape), smoothing, views), loss)
        return value, _smooth(gradient, smoothing, views).ravel()

    result = optimize.minimize(
        objective,
        start.ravel(),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": iterations, "maxfun": 2 * iterations, "maxcor": 30}
        | {"ftol": 1e-15, "gtol": 1e-12},
    )
    return _smooth(result.x.reshape(views.shape), smoothing, views), int(result.nit)


def _smooth(heights: Real, sigma: float, like: HeightField | Views) -> Real:
    """Smooth periodic heights by a Gaussian of σ in µm; the operation is its own adjoint."""
    blur = [sigma / pixel for pixel in like.pixel_size[::-1]]
    return np.asarray(ndimage.gaussian_filter(heights, blur, mode="wrap", truncate=6.0))


def _check_whole(name: str, value: int, least: int) -> None:
    """Refuse a value that is not a whole number from `least` on."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise DiffractionError(f"{name}={value} must be a whole number of at least {least}")


def aligned(field: HeightField, like: HeightField) -> HeightField:
    """Return the patch nearest to `like` of all that have the same BRDF as `field`.

    These are the shifts by whole pixels of h and of −h(−r), with any constant added.
    """
    if field.shape != like.shape or field.pixel_size != like.pixel_size:
        raise DiffractionError(
            f"{field.name} and {like.name} have different pixels; give patches of the same shape "
            "and pixel_size"
        )
    target = like.heights - like.heights.mean()
    nearest, largest = field.heights, -np.inf
    for sign in (1, -1):
        heights = sign * (field.heights - field.heights.mean())[::sign, ::sign]
        correlation = fft.ifft2(fft.fft2(target) * np.conj(fft.fft2(heights))).real
        shift = np.unravel_index(correlation.argmax(), correlation.shape)
        if correlation[shift] > largest:
            nearest, largest = np.roll(heights, shift, axis=(0, 1)), correlation[shift]
    return field.changed(nearest + like.heights.mean(), f"aligned with {like.name}")


def relief(
    wi: ArrayLike,
    wo: ArrayLike,
    colours: ArrayLike,
    *,
    pixels: int = 128,
    pixel_size: PixelSize = 0.1,
    max_height: float = 0.2,
    max_slope: float = 0.35,
    coherence_width: float = 10.0,
    wavelengths: ArrayLike = WAVELENGTHS,
    seed: int = 0,
    iterations: int = 100,
) -> HeightField:
    """Design a relief that shows m colours in m pairs of directions.

    Minimises the squared difference between `shown` and the colours, from random heights.

    Raises a DiffractionError if colours and directions differ in number, or a number is out of
    range.

    Parameters
    ----------
    wi, wo : (m, 3) or (3,), as in `reference.brdf`.
    colours : (m, 3), linear sRGB under D65 of a perfect reflector with this relief; a white
        diffuser is (1, 1, 1), and a colour may be brighter than that.
    pixels, pixel_size : pixels along each axis and their size in µm; the relief tiles the plane.
    max_height : largest difference of heights, µm.
    max_slope : largest slope along x and along y: a Gaussian of standard deviation
        max_height/(√(2π) max_slope) smooths the heights, so that they are nowhere steeper.
    coherence_width : µm; a window wider than the relief has separate lobes with dark between them.
    wavelengths : (k,), nm, evenly spaced, which represent the spectrum.
    seed : seed of the initial heights; equal arguments give equal reliefs.
    iterations : largest number of steps.
    """
    for name, value in (("max_height", max_height), ("max_slope", max_slope)):
        if not 0.0 < value < np.inf:
            raise DiffractionError(f"{name}={value} must be positive and finite")
    for name, count, least in (("pixels", pixels, 2), ("seed", seed, 0)):
        _check_whole(name, count, least)
    check_pixel_count(pixels, pixels, "relief")
    patch = HeightField(np.zeros((pixels, pixels)), pixel_size, name="relief")
    views, matrix = _colour_views(patch, wi, wo, coherence_width, wavelengths)
    target = np.asarray(colours, np.float64)
    m = len(views) // len(matrix)
    if target.shape != (m, 3) or not np.all(np.isfinite(target)) or not np.any(target):
        raise DiffractionError(
            f"colours have shape {target.shape}; they must be ({m}, 3), finite and not all 0: "
            "linear sRGB, one for each pair of directions"
        )
    scale = 1.0 / np.sum(target**2)

    def squared_difference(f: Real) -> tuple[float, Real]:
        """Return the squared difference of colours and its derivatives with respect to f."""
        difference = f.reshape(m, -1) @ matrix - target
        return float(scale * np.sum(difference**2)), (2 * scale * difference @ matrix.T).ravel()

    smoothing = max_height / (np.sqrt(2 * np.pi) * max_slope)
    noise = _smooth(np.random.default_rng(seed).normal(size=patch.shape), smoothing, patch)
    start = max_height * (noise - noise.min()) / max(np.ptp(noise), 1e-30)
    bounds = optimize.Bounds(0.0, max_height)
    heights, steps = _minimise(views, squared_difference, start, smoothing, bounds, iterations)
    return patch.changed(heights, f"designed for {m} colours in {counted(steps, 'step')}")


def shown(
    field: HeightField,
    wi: ArrayLike,
    wo: ArrayLike,
    *,
    coherence_width: float = 10.0,
    wavelengths: ArrayLike = WAVELENGTHS,
) -> Real:
    """Return the colours (m, 3) of a perfect reflector with these heights, as in `relief`."""
    views, matrix = _colour_views(field, wi, wo, coherence_width, wavelengths)
    return np.asarray(views.brdf(field.heights).reshape(-1, len(matrix)) @ matrix)


def _colour_views(
    patch: HeightField, wi: ArrayLike, wo: ArrayLike, coherence_width: float, wavelengths: ArrayLike
) -> tuple[Views, Real]:
    """Return views of m pairs at k wavelengths, and the matrix (k, 3) from BRDFs to linear sRGB."""
    nodes = np.atleast_1d(np.asarray(wavelengths, np.float64))
    steps = np.diff(nodes)
    if nodes.ndim != 1 or len(nodes) < 3 or not (steps[0] > 0 and np.allclose(steps, steps[0])):
        raise DiffractionError("wavelengths must be at least 3 in nm, ascending and evenly spaced")
    m = len(_flat_brdf(wi, wo, 550.0, coherence_width))
    pairs = (np.broadcast_to(np.asarray(w, np.float64), (m, 3)) for w in (wi, wo))
    incident, outgoing = (np.repeat(w, len(nodes), axis=0) for w in pairs)
    lights = np.tile(nodes, m)
    views = Views(patch, incident, outgoing, lights, coherence_width=coherence_width)
    # a white diffuser has f = 1/π
    return views, np.asarray(np.pi * steps[0] * colour.linear_srgb(colour.response(nodes)))
