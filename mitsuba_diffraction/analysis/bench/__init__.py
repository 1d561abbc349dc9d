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
saved           BSDFs of saved tables, with the package's look-up and with that of the thesis
measured_file   a file for Mitsuba's `measured`
contenders      BSDFs to compare, the bare gathers and the thesis' look-up among them
evaluation      `eval`, `sample` and `pdf` of all of them
rendering       pictures of the snake
variance        noise of the sampling, beside that of the cosine
colours         RGB variants beside spectral ones
history         two runs side by side
scenes          what is rendered
"""
