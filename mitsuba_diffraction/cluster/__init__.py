"""Many processes and machines, on Dask: frames and groups of passes are its tasks.

Contents
--------
connect  to workers that are started here, or to a running cluster: `md.cluster.connect`
render   a scene, on workers: `md.cluster.render`
build    the table of a wide scan, its windows on workers: `md.cluster.build`
frames   frames after frames, each from tasks that workers do in any order
tasks    what a worker does, and what it gives back
files    a scene with the files that it names, and copies of them where they are missing
kept     sums of passes on disk, until their picture is written
each     independent jobs, here or on workers, as they are done or in their order
workers  starts workers here, or finds those of a running cluster, and refuses those of no use
"""

from .build import build
from .render import render
from .workers import connect

__all__ = ["build", "connect", "render"]
