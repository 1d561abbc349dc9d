"""Comparison of the model with rigorous solutions, closed forms and statistics.

Users of the package do not need it. `python -m docs.make.validation` writes the pages from the
solutions in data/; `python -m docs.make.validation.solve` computes these, with the extra
`validation`.

Contents
--------
cases            gratings, lights and materials
integral         rigorous solver: boundary integrals
coupled_wave     rigorous solver: coupled waves in layers
solve            all solutions of data/, computed by one command
solutions        files of solutions
agreement        the two solvers beside each other
patches          surfaces in two dimensions, in any plane of incidence
rayleigh         rigorous solver in two dimensions: Rayleigh's expansion
crossed          rigorous solver in two dimensions: coupled waves in layers
patch_solutions  solutions in two dimensions
coated           solutions of gratings under a coat
filmed           solutions of gratings under a film
transmitted      transmitted orders of gratings, and R + T of surfaces
model            order efficiencies by the package
compare          deviations of the package from solutions of gratings
models           deviations of Kirchhoff, small slope and their blend
goals            goals of the default, and deviations beside them
limits           slopes at which the package warns
cells            deviations in two dimensions
closed_forms     ideal gratings
roughness        random surfaces of known mean diffraction
orders           tables of solved orders, beside solvers that did not make them
published        solvers beside printed efficiencies
light            light on a grating, and its orders by a solver of the package
scans            hues of gratings and crops of a rough surface, through windows
tapers           width of lobes against colours, for tapers of these windows
statistics       checks with random surfaces, and windows at random places
pages            writers of docs/validation.md and docs/validation/
"""
