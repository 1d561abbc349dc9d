"""Measurements of speed and memory, one file each; `mitsuba-diffraction bench` prints them.

Contents
--------
plan            how much is measured: in full, or quickly
run             all of them, part by part
machine         what the figures depend on besides the code
figures         rows with goals, as text and as plain data
timing          rounds through all contenders, so that background load affects all alike
build           tables, each built in a process of its own, whose memory is measured
build_child     that process
thesis_lookup   the look-up of the thesis, an image a term
saved           BSDFs of saved tables
measured_file   a file for Mitsuba's `measured`
contenders      BSDFs to compare, the bare gathers and the thesis' look-up among them
evaluation      `eval`, `sample` and `pdf` of all of them
rendering       whole pictures, the snake's among them
variance        noise of the sampling, beside that of the cosine
colours         RGB variants beside spectral ones
scaling         costs over terms, patches, samples and pixels
history         two runs side by side
scenes          what is rendered
"""
