"""The curve along which a snake lies: coiled on the ground, each loop laid on the ones before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.optimize import brentq

from mitsuba_diffraction.errors import DiffractionError

from .anatomy import Anatomy

Floats = NDArray[np.float64]

TINY = 1e-9  # cm; the width of both ends is zero
NODES = 900  # over the whole length: a node every millimetre of a one-metre snake


def coil(anatomy: Anatomy, coils: float, squeeze: float = 0.82, heading: float = -75.0) -> Floats:
    """Nodes of a resting snake's spine from snout to tail tip, shape (NODES, 3), z up, in cm.

    The body is laid down like a rope, tail first: a spiral wound inwards whose loops lie `squeeze`
    body widths apart, so that each leans on the one outside it, and at last the neck, which
    leaves the innermost loop in a bend and brings the head out over the coil.

    Parameters
    ----------
    anatomy : gives the length and the cross-sections.
    coils : number of turns of the spiral.
    squeeze : distance of neighbouring loops seen from above, in body widths.
    heading : direction in which the head points, degrees from +x towards +y.

    Raises
    ------
    DiffractionError
        If the snake is too short for so many turns.
    """
    for name, value, low, high in (("coils", coils, 0.5, 20), ("squeeze", squeeze, 0.6, 3)):
        if not low <= value <= high:
            raise DiffractionError(f"snake: {name} = {value:g} is outside {low:g} to {high:g}")
    if not np.isfinite(heading):
        raise DiffractionError(f"snake: heading = {heading:g} is no angle in degrees")
    width = 2 * anatomy.girth_radius
    pitch = squeeze * width
    smallest = 1.2 * width  # tighter, and the inside of the bend would fold onto itself

    def excess(inner: float) -> float:
        return _length(_plan(inner, pitch, coils, heading, width)) - anatomy.length

    if excess(smallest) > 0:
        raise DiffractionError(
            f"snake: coils = {coils:g} do not fit a length of {anatomy.length:g} cm and a width "
            f"of {width:g} cm; ask for fewer turns or a longer or thinner snake"
        )
    inner = brentq(excess, smallest, anatomy.length, xtol=1e-6)
    plan = _resample(_plan(inner, pitch, coils, heading, width), NODES)
    heights = _lay(plan, anatomy)
    return _resample(np.column_stack([plan, heights]), NODES)[::-1]


def _plan(inner: float, pitch: float, coils: float, heading: float, width: float) -> Floats:
    """The curve seen from above, from tail tip to snout, shape (n, 2)."""
    towards = np.radians(heading)
    # the spiral ends where a bend of about 150 degrees brings the neck round to its heading
    end = towards - np.radians(150)
    turn = np.linspace(0, 2 * np.pi * coils, 720)  # angle left behind, from the tail on
    radius = inner + pitch * (turn[-1] - turn) / (2 * np.pi)
    radius += 1.1 * width * np.exp(-turn / 0.45)  # the tail tip points away from the coil
    angle = end + turn - turn[-1]
    spiral = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])

    start, leaving = spiral[-1], spiral[-1] - spiral[-2]
    leaving = leaving / np.linalg.norm(leaving)
    outwards = np.array([np.cos(towards), np.sin(towards)])
    # the head rests on the outer loop
    goal = outwards * (inner + 0.9 * pitch * min(coils, 2.0))
    reach = 1.4 * float(np.linalg.norm(goal - start))
    neck = CubicHermiteSpline(
        [0.0, 1.0], np.stack([start, goal]), np.stack([leaving * reach, outwards * reach])
    )(np.linspace(0, 1, 240))
    return np.concatenate([spiral, neck[1:]])


def _lay(plan: Floats, anatomy: Anatomy) -> Floats:
    """Height of the spine over the ground when each piece lies on the ground or on earlier ones."""
    arc = np.linspace(0, anatomy.length, len(plan))
    wide, above, below = anatomy.profile(anatomy.length - arc)  # the plan runs from tail to snout
    # a bend lifts the body before and after the place where it lies on something
    reach = round(1.0 * anatomy.girth_radius / arc[1])
    raw, heights = below.copy(), below.copy()
    for i in range(len(plan)):
        # neighbours along the body touch anyway
        earlier = slice(0, max(0, i - round(6 * wide[i] / arc[1])))
        distance = np.linalg.norm(plan[earlier] - plan[i], axis=1)
        apart = distance / (wide[earlier] + wide[i] + TINY)
        touching = apart < 1
        if touching.any():
            gap = (above[earlier] + below[i]) * np.sqrt(1 - np.minimum(apart, 1) ** 2)
            raw[i] = max(raw[i], (heights[earlier] + gap)[touching].max())
        if i % reach == 0:  # what lies already bends smoothly before more is laid on it
            heights[: i + 1] = _stiff(raw[: i + 1], reach)
    return _stiff(raw, reach)


def _stiff(heights: Floats, reach: int) -> Floats:
    """A smooth curve nowhere below `heights` by more than its own ripple."""
    if reach < 2:
        return heights
    raised = maximum_filter1d(heights, 2 * reach + 1, mode="nearest")
    return gaussian_filter1d(raised, reach / 2.2, mode="nearest")


def _length(curve: Floats) -> float:
    return float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum())


def _resample(curve: Floats, count: int) -> Floats:
    """Points at equal distances along the curve."""
    steps = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    arc = np.concatenate([[0], np.cumsum(steps)])
    return CubicSpline(arc, curve)(np.linspace(0, arc[-1], count))
