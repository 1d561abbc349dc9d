"""A small picture on workers: a dozen passes of two samples, and a client that does nothing."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from mitsuba_diffraction import cluster
from mitsuba_diffraction.cluster import FrameRequest, FrameSequence
from mitsuba_diffraction.scene import Stop, set_variant

VARIANT = "llvm_ad_rgb"
SPP = 24
REQUEST = FrameRequest({}, SPP, 3)


def silent(*_):
    """Take progress, and show nothing."""


def rendered(client, scene, **more):
    """The picture, from workers with one Dr.Jit thread."""
    arguments = {"spp": SPP, "seed": 3, "variant": VARIANT, "threads": 1, **more}
    return np.array(cluster.render(scene, client=client, **arguments).bitmap)


def film(client, scene, keep, frames=(REQUEST,)):
    """The film of one frame, or of these."""
    set_variant(VARIANT)
    return FrameSequence(client, scene, frames, VARIANT, keep=keep, threads=1)


def picture_of(job, progress=silent):
    """The picture of a film of one frame."""
    (result,) = job.render(Stop(), progress)
    assert result.spp == SPP
    return np.array(result.bitmap)


class Recorder:
    """A client of so many workers, which are given nothing, or work in this process.

    most : how many calls were under way at once.
    """

    status = "running"

    def __init__(self, count=1, **about):
        self.names, self.about = ["one", *range(1, count)], {"nthreads": 1, **about}
        self.under_way = self.most = self.given = 0

    def wait_for_workers(self, *_, **__):
        pass

    def run(self, *_, **__):
        return dict.fromkeys(self.names)

    def cancel(self, _):
        pass

    def scheduler_info(self, **_):
        return {"workers": dict.fromkeys(self.names, self.about)}

    def submit(self, work, *arguments, pure, priority):
        self.under_way += 1
        self.given += 1
        self.most = max(self.most, self.under_way)
        return SimpleNamespace(result=lambda: self.done(work, arguments), done=lambda: True)

    def done(self, work, arguments):
        self.under_way -= 1
        return work(*arguments)


def passes_of_picture(scene):
    """All passes of the picture, as one task."""
    return film(Recorder(), scene, scene.parent).frames[0]
