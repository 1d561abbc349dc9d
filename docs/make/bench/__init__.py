"""Measurements of speed and memory, printed by `python -m docs.make.bench`.

Contents
--------
figures      sizes of a run; rows with goals; two runs side by side
build        tables, each built in a process of its own, whose memory is measured
contenders   BSDFs to compare, the bare gathers and the thesis' look-up among them
evaluation   `eval`, `sample` and `pdf` of all of them; RGB variants beside spectral ones
orders       `diffraction_orders`: times of the calls, noise of a sample
survey       a survey of many scans, in one process and on workers
frames       frames of the shaders
scenes       scenes to render; noise beside sampling by the cosine
updates      one change of a parameter in an optimisation
snake        the time of whole pictures, each scene in a process of its own
"""
