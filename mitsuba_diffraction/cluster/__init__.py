"""Many processes and machines, on Dask: frames and groups of passes are its tasks.

Contents
--------
connect  to workers that are started here, or to a running cluster: `md.cluster.connect`
render   a scene, on workers: `md.cluster.render`
build    the table of a wide scan, its windows on workers: `md.cluster.build`
frames   frames after frames, each from tasks that workers do in any order; sums kept on disk
tasks    what a worker does and gives back; the files of a scene, copied where they are missing
jobs     independent jobs, here or on workers, as they are done or in their order
workers  starts workers here, or finds those of a running cluster, and refuses those of no use
"""

from .frames import render
from .jobs import build
from .workers import connect

__all__ = ["build", "connect", "render"]
