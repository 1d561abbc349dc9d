"""Variants of Mitsuba, which of them run here, and BSDFs evaluated in any of them."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import Array
from tests.support.lanes import interaction, vectors

#: The variants that the plugin supports; the second needs a GPU.
VARIANTS = ("llvm_ad_spectral", "cuda_ad_spectral")


def obstacle(variant: str) -> str | None:
    """Why a variant does not run on this machine, or None if it does."""
    if variant not in mi.variants():
        return f"this Mitsuba has no variant {variant}"
    backends = {"cuda": dr.JitBackend.CUDA, "llvm": dr.JitBackend.LLVM}
    backend = backends.get(variant.partition("_")[0])
    if backend is None or dr.has_backend(backend):
        return None
    return f"{variant}: Dr.Jit finds no device for it"


def use(*variants: str) -> str:
    """Set the first of some variants that runs here and return it; skip the test if none does."""
    name = next((name for name in variants if obstacle(name) is None), None)
    if name is None:
        pytest.skip("; ".join(filter(None, map(obstacle, variants))))
    mi.set_variant(name)
    return name


#: All that this package supports and this Mitsuba has.
ALL = [name for name in mi.variants() if name.startswith(("scalar", "llvm", "cuda"))]

#: Of each backend, way of colour and polarisation some: for what is tried with many surfaces.
SOME = [
    name
    for name in (
        "scalar_spectral_polarized", "llvm_ad_mono", "llvm_ad_rgb", "scalar_rgb",
        "llvm_ad_mono_polarized", "cuda_ad_spectral",
    )
    if name in ALL
]  # fmt: skip


def evaluate(
    bsdf: Any,
    wi: Array,
    wo: Array,
    samples: Array,
    wavelengths: Array,
    component: int | None = None,
) -> list[Array]:
    """Value (n, channels), pdf, value again, pdf again; then sampled wo, pdf, weight."""
    context = mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), component)

    def once(si: Any, wo: Any, one: Any, two: Any) -> list[Array]:
        together = bsdf.eval_pdf(context, si, wo)
        sample, weight = bsdf.sample(context, si, one, two)
        parts = [
            mi.unpolarized_spectrum(bsdf.eval(context, si, wo)),
            bsdf.pdf(context, si, wo),
            mi.unpolarized_spectrum(together[0]),
            together[1],
            sample.wo,
            sample.pdf,
            mi.unpolarized_spectrum(weight),
        ]
        dr.eval(parts)  # one kernel instead of six, all of which would hold most of the model
        return [np.array(part, float).T for part in parts]

    if dr.is_jit_v(mi.Float):
        two = mi.Point2f(samples[:, 1:].T)
        return once(interaction(wi, wavelengths), vectors(wo), mi.Float(samples[:, 0]), two)
    rows = [
        once(
            interaction(wi[n], wavelengths[n]),
            vectors(wo[n]),
            float(samples[n, 0]),
            mi.Point2f(samples[n, 1:].tolist()),
        )
        for n in range(len(wi))
    ]
    return [np.array(column) for column in zip(*rows, strict=True)]
