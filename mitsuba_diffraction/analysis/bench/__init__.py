"""Measurements of speed and memory, one file each; `mitsuba-diffraction bench` prints them.

Contents
--------
run             all of them, part by part
machine         what the figures depend on besides the code
figures         how much is measured; rows with goals as text and data; two runs side by side
build           tables, each built in a process of its own, whose memory is measured
build_child     that process
contenders      BSDFs to compare, the bare gathers and the thesis' look-up among them, and timing
evaluation      `eval`, `sample` and `pdf` of all of them
variance        noise of the sampling, beside that of the cosine, and the time of whole pictures
colours         RGB variants beside spectral ones
scenes          what is rendered
"""
