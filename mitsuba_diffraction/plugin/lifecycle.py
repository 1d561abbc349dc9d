"""Life cycle that all BSDFs of this package share: made, asked, changed, frozen and shown."""

from __future__ import annotations

import functools
import operator
import weakref
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import drjit as dr
import mitsuba as mi

from .parameter_changes import (
    Changeable,
    Changing,
    arrays_within,
    check_parameters,
    marks,
    take_changes,
)
from .types import (
    BSDF,
    Callback,
    Context,
    Float,
    Interaction,
    Mask,
    Properties,
    Sample,
    Spectrum,
    Vector3f,
)

#: Component of a context that asks for all of them.
ALL_COMPONENTS = 0xFFFFFFFF


class PluginBSDF(mi.BSDF):
    """BSDF of this package: answers, parameters and their changes.

    Attributes
    ----------
    title : name in `to_string`.
    parameters : everything that `traverse` exposes, in that order.
    mix : the mix that it is part of, as a weak reference, or None.
    """

    title: str

    def __init__(self, props: Properties) -> None:
        super().__init__(props)
        self.parameters: list[Changeable] = []
        self.mix: weakref.ref[Any] | None = None

    def ready(self) -> None:
        """Declare the components, check all parameters and derive what follows from them."""
        components = self.components()
        self.m_components = components  # at once: reading it makes a copy
        self.m_flags = functools.reduce(operator.or_, components)
        check_parameters([self])
        self.derive()

    def components(self) -> list[int]:
        """Return the flags of each component."""
        raise NotImplementedError

    # ------------------------------------------------------------------ answers

    def answers(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask, kinds: str
    ) -> Sequence[Any]:
        """Return the answers of these kinds: "v"alue f |cosθo|, "d"ensity of `sample`, or "vd"."""
        raise NotImplementedError

    def eval(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Spectrum:
        """Return f |cosθo| per wavelength, as the context's mode of transport has it."""
        return mi.Spectrum(self.answers(ctx, si, wo, active, "v")[0])

    def pdf(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Float:
        """Return the density of `sample` per solid angle."""
        return self.answers(ctx, si, wo, active, "d")[0]

    def eval_pdf(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True
    ) -> tuple[Spectrum, Float]:
        """Return `eval` and `pdf` at once."""
        value, density = self.answers(ctx, si, wo, active, "vd")
        return mi.Spectrum(value), density

    # ------------------------------------------------------------------ changes of parameters

    def traverse(self, callback: Callback) -> None:
        """Expose the parameters that may change without another table."""
        for parameter in self.parameters:
            parameter.traverse(callback)

    def parameters_changed(self, keys: list[str]) -> None:
        """Accept all changes, or reject all.

        Raises a DiffractionError if a parameter is out of bounds, as a height_scale that the table
        does not serve. All parameters then have their last values.
        """
        mix = self.mix and self.mix()
        take_changes(self, (mix or self).together)

    @property
    def together(self) -> list[Changing]:
        """BSDFs whose changes are refused together."""
        return [self]

    def refusals(self) -> Iterator[str | None]:
        """See `Changing.refusals`."""
        yield None

    def derive(self) -> None:
        """See `Changing.derive`."""
        raise NotImplementedError

    def freeze(self, holders: Iterable[Any], *constants: object) -> None:
        """Tell `dr.freeze` all arrays, and constants for which kernels are others.

        holders : objects that hold arrays.
        """
        self._for_freezing = arrays_within(*holders) + marks(*constants)

    # ------------------------------------------------------------------ for people

    def shown(self) -> Mapping[str, Any]:
        """Return all parameters as `to_string` shows them."""
        raise NotImplementedError

    def to_string(self) -> str:
        """Describe all parameters, for people."""
        lines = "".join(f"  {name} = {value},\n" for name, value in self.shown().items())
        return f"{self.title}[\n{lines}]"


def ask(
    bsdf: BSDF, ctx: Context, si: Interaction, wo: Vector3f, active: Mask, kinds: str
) -> Sequence[Any]:
    """Return the answers of any BSDF; see `PluginBSDF.answers`."""
    method = {"v": bsdf.eval, "d": bsdf.pdf, "vd": bsdf.eval_pdf}[kinds]
    answers = method(ctx, si, wo, active)
    return answers if kinds == "vd" else [answers]


def both_sides(transmission: int = 0) -> list[int]:
    """Return the flags of reflection and transmission of light from either side.

    transmission : further flags of light that goes through.
    """
    flags = mi.BSDFFlags
    sides = flags.FrontSide | flags.BackSide | flags.Anisotropic
    return [flags.GlossyReflection | sides, flags.GlossyTransmission | sides | transmission]


def asked_sides(ctx: Context) -> tuple[bool, bool]:
    """Return whether a context asks for reflection, and for transmission (`both_sides`)."""
    kinds = mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission
    reflection, transmission = (ctx.is_enabled(kind, n) for n, kind in enumerate(kinds))
    return reflection, transmission


def sample_of(wo: Vector3f, density: Float, passed: Mask, eta: Float) -> Sample:
    """Return the record of a direction of either side.

    passed : whether light goes through; eta : of `mi.BSDFSample3f`.
    """
    result = dr.zeros(mi.BSDFSample3f)
    result.wo, result.pdf, result.eta = wo, density, eta
    kinds = mi.BSDFFlags.GlossyReflection, mi.BSDFFlags.GlossyTransmission
    result.sampled_type = dr.select(passed, mi.UInt32(+kinds[1]), mi.UInt32(+kinds[0]))
    result.sampled_component = dr.select(passed, mi.UInt32(1), mi.UInt32(0))
    return result
