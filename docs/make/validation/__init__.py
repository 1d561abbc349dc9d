"""Comparison of the model with rigorous solutions, closed forms and statistics.

Users of the package do not need it. `python -m docs.make.validation` writes the pages from the
solutions in data/; `python -m docs.make.validation.solve` computes these, with the extra
`validation`.

Contents
--------
cases            a surface in a light and media: gratings, materials
patches          surfaces in two dimensions, in any plane of incidence
solutions        orders of cases, and their files
integral         rigorous solver of gratings: boundary integrals
coupled_wave     rigorous solver of gratings: coupled waves in layers
crossed          rigorous solver in two dimensions: coupled waves in layers
rayleigh         rigorous solver in two dimensions: Rayleigh's expansion
coated           gratings under a coat
filmed           gratings under a film
solve            all solutions of data/, computed by one command
model            order efficiencies by the package
compare          deviations of the package, or of another solver, from solutions
agreement        two solvers beside each other
models           deviations of Kirchhoff, small slope and their blend
transmitted      transmitted orders of gratings, and R + T of surfaces
goals            goals of the default, and deviations beside them
limits           slopes at which the package warns
closed_forms     ideal gratings
roughness        random surfaces of known mean diffraction
orders           tables of solved orders, beside solvers that did not make them
published        solvers beside printed efficiencies
light            light as solvers of the package have it, and orders by these
scans            hues of gratings and crops of a rough surface, through windows
tapers           width of lobes against colours, for tapers of these windows
statistics       checks with random surfaces, and windows at random places
pages            writers of docs/validation.md and docs/validation/
"""
