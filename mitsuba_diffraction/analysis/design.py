"""Surfaces from what they are to show: gradients of the BRDF with respect to the heights.

A phase screen exp(iκh) has the orders a_j(κ), and a pair of directions sees of them, on average
over every position of the window (see `reference`),

    f = factor · 4π²σ⁴ Σ_j |a_j|² exp(−σ²|q − q_j|²).

A loss L of many such f changes with the heights by the adjoint of the DFT, one more DFT per κ:

    ∂L/∂h(r) = −(2κ/N) Im[exp(iκh(r)) · conj Σ_j (∂L/∂|a_j|²) a_j exp(−i q_j·r)],

for N pixels. L-BFGS-B (Byrd, Lu, Nocedal and Zhu 1995) does the rest. The BRDF does not tell apart
h, its shifts, h + constant, and −h(−r), the patch turned by 180° and upside down.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft, ndimage, optimize

from .. import reference
from ..errors import DiffractionError
from ..heights.field import HeightField, check_pixel_count
from ..heights.lengths import PixelSize
from ..optics import colour
from ..optics.geometry import diffraction_coordinates, sigma_of, wavenumber

Real = NDArray[np.float64]
#: A loss of BRDFs (n,): its value, and its derivative to each of them.
Loss = Callable[[Real], tuple[float, Real]]

#: What stands for the spectrum, nm.
WAVELENGTHS = tuple(float(x) for x in range(400, 701, 20))

_ALL = slice(None)
_AT_ONCE = 2**20  # pixels of all screens that a BRDF takes at once, 40 MB
_UP = (0.0, 0.0, 1.0)
_NARROW = 1e-3  # µm: under so small a σ a flat patch reflects alike in all directions


class Views:
    """Pairs of directions and wavelengths in which patches of one size are seen.

    Parameters
    ----------
    patch : HeightField, of which only the shape and the size of the pixels count.
    wi, wo, wavelength, coherence_width, eta, k : as in `reference.brdf`, whose
        `coherence="ensemble"` and `model="kirchhoff"` this is; n pairs in all. A gradient takes
        some 50 bytes for each pixel and pair.

    Raises
    ------
    DiffractionError
        As `reference.brdf`.
    """

    def __init__(
        self,
        patch: HeightField,
        wi: ArrayLike,
        wo: ArrayLike,
        wavelength: ArrayLike,
        *,
        coherence_width: float = 65.0,
        eta: ArrayLike | None = None,
        k: ArrayLike = 0.0,
    ) -> None:
        _of_mirror(_UP, _UP, 550.0, coherence_width)  # refuses a width that is none
        # all that knows no heights is the same in front of any patch and, over σ², of any window
        narrow = _of_mirror(wi, wo, wavelength, 4 * _NARROW, eta, k)
        sigma = sigma_of(coherence_width)
        u, v, w = diffraction_coordinates(wi, wo)
        wave = wavenumber(wavelength)
        self.shape, self.pixel_size = patch.shape, patch.pixel_size
        self.kappa, alpha, beta = (np.broadcast_to(wave * x, narrow.shape) for x in (w, u, v))
        self._factor = narrow * np.exp(_NARROW**2 * (alpha**2 + beta**2)) * (sigma / _NARROW) ** 2
        self._window_x, self._window_y = (
            np.exp(-((sigma * (q[:, None] - 2 * np.pi * fft.fftfreq(n, pixel))) ** 2))
            for q, n, pixel in zip((alpha, beta), self.shape[::-1], self.pixel_size, strict=True)
        )

    def __len__(self) -> int:
        return len(self._factor)

    def brdf(self, heights: ArrayLike) -> Real:
        """The BRDF in 1/sr, (n,), of heights (ny, nx) in µm."""
        size = max(1, _AT_ONCE // (self.shape[0] * self.shape[1]))
        parts = [slice(start, start + size) for start in range(0, len(self), size)]
        found = [self._seen(fft.ifft2(self._screens(heights, part)), part) for part in parts]
        return np.concatenate([np.empty(0), *found])

    def loss(self, heights: ArrayLike, of: Loss) -> tuple[float, Real]:
        """A loss of the BRDF and its gradient (ny, nx), per µm of height at each pixel."""
        screens = self._screens(heights)
        orders = fft.ifft2(screens)
        value, weights = of(self._seen(orders))
        wanted = (self._factor * weights)[:, None] * self._window_y
        orders *= np.einsum("ny,nx->nyx", wanted, self._window_x)
        adjoint = fft.fft2(orders, overwrite_x=True)
        pulled = screens.imag * adjoint.real - screens.real * adjoint.imag
        return value, -2.0 / screens[0].size * np.einsum("n,nyx->yx", self.kappa, pulled)

    def _screens(self, heights: ArrayLike, part: slice = _ALL) -> NDArray[np.complex128]:
        found = np.asarray(heights, np.float64)
        if found.shape != self.shape:
            raise DiffractionError(f"heights have shape {found.shape}, these views {self.shape}")
        return np.asarray(np.exp(1j * self.kappa[part, None, None] * found))

    def _seen(self, orders: NDArray[np.complex128], part: slice = _ALL) -> Real:
        powers = orders.real**2 + orders.imag**2
        rows = np.einsum("nyx,nx->ny", powers, self._window_x[part])
        return np.asarray(self._factor[part] * np.einsum("ny,ny->n", rows, self._window_y[part]))


def _of_mirror(
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    width: float,
    eta: ArrayLike | None = None,
    k: ArrayLike = 0.0,
) -> Real:
    """The reference's BRDF of a flat patch, which checks all arguments."""
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
    """The patch with this BRDF, up to what the BRDF does not tell (see `aligned`).

    Descends Σ (√f − √f_asked)²: amplitudes, as in phase retrieval (Fienup 1982), so that dim
    directions count beside the mirror's lobe. From a start far off it may end in another valley:
    compare `views.brdf` of what comes back, and begin elsewhere.

    Parameters
    ----------
    brdf : (n,), 1/sr, what was measured in the views.
    start : where to begin; not flat, where the gradient is 0.
    smoothing : µm, standard deviation of a Gaussian under which the patch has no detail.
    iterations : at most so many steps.

    Raises
    ------
    DiffractionError
        If `brdf` is not n values, finite and at least 0, the start does not fit the views, or a
        number is out of range.
    """
    asked = np.asarray(brdf, np.float64)
    if asked.shape != (len(views),) or not np.all((asked >= 0) & (asked < np.inf)):
        raise DiffractionError(
            f"brdf has shape {asked.shape}; it must be {len(views)} finite values of at least 0, "
            "one for each view"
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
    dark = 1e-9 * asked.max()  # keeps the root's derivative finite where there is no light
    roots = np.sqrt(asked + dark)
    scale = 1.0 / (roots @ roots)

    def amplitudes(found: Real) -> tuple[float, Real]:
        reached = np.sqrt(found + dark)
        off = reached - roots
        return float(scale * off @ off), scale * off / reached

    heights, steps = _descend(views, amplitudes, start.heights, smoothing, None, iterations)
    return start.changed(heights, f"recovered from {len(views)} views in {steps} steps")


def _descend(
    views: Views,
    of: Loss,
    start: Real,
    smoothing: float,
    bounds: optimize.Bounds | None,
    iterations: int,
) -> tuple[Real, int]:
    """Heights of a small loss, smoothed by a Gaussian (µm), and the number of steps taken."""
    _check_whole("iterations", iterations, 1)

    def objective(x: Real) -> tuple[float, Real]:
        value, gradient = views.loss(_smooth(x.reshape(views.shape), smoothing, views), of)
        return value, _smooth(gradient, smoothing, views).ravel()

    found = optimize.minimize(
        objective,
        start.ravel(),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": iterations, "maxfun": 2 * iterations, "maxcor": 30}
        | {"ftol": 1e-15, "gtol": 1e-12},
    )
    return _smooth(found.x.reshape(views.shape), smoothing, views), int(found.nit)


def _smooth(heights: Real, sigma: float, like: HeightField | Views) -> Real:
    """Under a Gaussian of so many µm; its own adjoint, since the patch tiles the plane."""
    blur = [sigma / pixel for pixel in like.pixel_size[::-1]]
    return np.asarray(ndimage.gaussian_filter(heights, blur, mode="wrap", truncate=6.0))


def _check_whole(name: str, value: int, least: int) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise DiffractionError(f"{name}={value} must be a whole number of at least {least}")


def aligned(field: HeightField, like: HeightField) -> HeightField:
    """The one nearest to `like` of all patches that have the same BRDF as `field`.

    These are its shifts by whole pixels, each with any constant added, and those of −h(−r).
    """
    if field.shape != like.shape or field.pixel_size != like.pixel_size:
        raise DiffractionError(f"{field.name} and {like.name} have not the same pixels")
    target = like.heights - like.heights.mean()
    nearest, most = field.heights, -np.inf
    for sign in (1, -1):
        heights = sign * (field.heights - field.heights.mean())[::sign, ::sign]
        alike = fft.ifft2(fft.fft2(target) * np.conj(fft.fft2(heights))).real
        shift = np.unravel_index(alike.argmax(), alike.shape)
        if alike[shift] > most:
            nearest, most = np.roll(heights, shift, axis=(0, 1)), alike[shift]
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
    """A relief that shows m given colours in m pairs of directions, as nearly as a descent comes.

    It makes the squared difference between `shown` and the colours small, from random heights.

    Parameters
    ----------
    wi, wo : (m, 3) or (3,), as in `reference.brdf`.
    colours : (m, 3), linear sRGB under D65 of a perfect reflector with this relief; a white
        diffuser is (1, 1, 1), and a colour may be brighter than that.
    pixels, pixel_size : the relief has pixels × pixels of so many µm, and tiles the plane.
    max_height : µm, from the lowest to the highest point at most.
    max_slope : along x and along y at most: heights are smoothed by a Gaussian of standard
        deviation max_height/(√(2π) max_slope), whose slopes are nowhere steeper.
    coherence_width : µm; lobes of a window wider than the relief are dots with dark between them.
    wavelengths : (k,), nm, evenly spaced, which stand for the spectrum.
    seed : of the heights at the start; equal arguments give equal reliefs.
    iterations : at most so many steps.

    Raises
    ------
    DiffractionError
        If the colours do not fit the directions, or a number is out of range.
    """
    for name, value in (("max_height", max_height), ("max_slope", max_slope)):
        if not 0.0 < value < np.inf:
            raise DiffractionError(f"{name}={value} must be positive and finite")
    for name, count, least in (("pixels", pixels, 2), ("seed", seed, 0)):
        _check_whole(name, count, least)
    check_pixel_count(pixels, pixels, "relief")
    patch = HeightField(np.zeros((pixels, pixels)), pixel_size, name="relief")
    views, matrix = _colour_views(patch, wi, wo, coherence_width, wavelengths)
    asked = np.asarray(colours, np.float64)
    m = len(views) // len(matrix)
    if asked.shape != (m, 3) or not np.all(np.isfinite(asked)) or not np.any(asked):
        raise DiffractionError(
            f"colours have shape {asked.shape}; they must be ({m}, 3), finite and not all 0: "
            "linear sRGB, one for each pair of directions"
        )
    scale = 1.0 / np.sum(asked**2)

    def difference(found: Real) -> tuple[float, Real]:
        off = found.reshape(m, -1) @ matrix - asked
        return float(scale * np.sum(off**2)), (2 * scale * off @ matrix.T).ravel()

    smoothing = max_height / (np.sqrt(2 * np.pi) * max_slope)
    noise = _smooth(np.random.default_rng(seed).normal(size=patch.shape), smoothing, patch)
    start = max_height * (noise - noise.min()) / max(np.ptp(noise), 1e-30)
    bounds = optimize.Bounds(0.0, max_height)
    heights, steps = _descend(views, difference, start, smoothing, bounds, iterations)
    return patch.changed(heights, f"designed for {m} colours in {steps} steps")


def shown(
    field: HeightField,
    wi: ArrayLike,
    wo: ArrayLike,
    *,
    coherence_width: float = 10.0,
    wavelengths: ArrayLike = WAVELENGTHS,
) -> Real:
    """Colours (m, 3) that a perfect reflector with these heights shows; arguments as `relief`."""
    views, matrix = _colour_views(field, wi, wo, coherence_width, wavelengths)
    return np.asarray(views.brdf(field.heights).reshape(-1, len(matrix)) @ matrix)


def _colour_views(
    patch: HeightField, wi: ArrayLike, wo: ArrayLike, coherence_width: float, wavelengths: ArrayLike
) -> tuple[Views, Real]:
    """Views of m pairs at k wavelengths, (m k), and the matrix (k, 3) from BRDFs to linear sRGB."""
    nodes = np.atleast_1d(np.asarray(wavelengths, np.float64))
    steps = np.diff(nodes)
    if nodes.ndim != 1 or len(nodes) < 3 or not (steps[0] > 0 and np.allclose(steps, steps[0])):
        raise DiffractionError("wavelengths must be at least 3 in nm, ascending and evenly spaced")
    m = len(_of_mirror(wi, wo, 550.0, coherence_width))
    pairs = (np.broadcast_to(np.asarray(w, np.float64), (m, 3)) for w in (wi, wo))
    incident, outgoing = (np.repeat(w, len(nodes), axis=0) for w in pairs)
    lights = np.tile(nodes, m)
    found = Views(patch, incident, outgoing, lights, coherence_width=coherence_width)
    # a white diffuser has f = 1/π
    return found, np.asarray(np.pi * steps[0] * colour.linear_srgb(colour.response(nodes)))
