"""Rendering and building on many processes and machines, with Dask.

Contents
--------
connect  to workers that are started here, or to a running cluster: `md.cluster.connect`
render   a scene on workers: `md.cluster.render`
build    the table of a wide scan on workers, window by window: `md.cluster.build`
frames   frames of a scene: what workers render, and how their sums become pictures
groups   groups of passes on workers: rendered as tasks, added up, and stored here
kept     sums stored on disk until their picture is written
calls    calls under way on workers, given out again where files or the scheduler were lost
tasks    the work and the result of a task; the files of a scene, copied where they are missing
jobs     independent jobs: scans and gratings as they finish, windows in order
workers  workers started here or found on a cluster; unsuitable ones are refused
"""

from .frames import FrameRequest, FrameSequence, render
from .jobs import build
from .workers import connect

__all__ = [
    "FrameRequest", "FrameSequence", "build", "connect", "jobs", "render", "tasks", "workers",
]  # fmt: skip
