"""How far the model can be trusted: rigorous solutions, closed forms and statistics beside it.

Not needed to use the package. `python -m docs.make.validation report` writes
docs/validation.md from the solutions that come with the package; `solve` makes those anew, which
needs the extra `validation`.

Contents
--------
cases            which gratings, lights and materials
integral         a rigorous solver: boundary integrals
coupled_wave     another: coupled waves in layers
solve            solutions of all cases, by both
solutions        files of solutions
second           the two solvers beside each other
patches          surfaces in two dimensions, in any plane of incidence
rayleigh         a rigorous solver for them: Rayleigh's expansion
crossed          another: coupled waves in layers
patch_solutions  solutions of all of them
coated           solutions of gratings under a coat
filmed           solutions of gratings under a film
passed           orders that go through a dielectric, and R + T of the recipes
spread           where light goes that is spread there
model            what the package says of the same surfaces
compare          how far apart they are
second_order     what the second order in slope would bring
factored         what it brings the default as a factor
limits           up to which slopes that is little
closed_forms     ideal gratings
roughness        random surfaces of known mean diffraction
statistics       checks with them, and windows at random places
page             the page as a whole
models           its section on Kirchhoff, small slope and their blend
goals            what was asked of the default model, and what misses it
patch_sections   its section on two dimensions
sections         its other sections
plots            its pictures
markdown         its tables and numbers
"""
