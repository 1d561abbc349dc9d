"""Orders of periodic profiles by rigorous solvers, for the BSDF `diffraction_orders`.

Contents
--------
accuracy    error of a table, measured at random directions and wavelengths
beam        `solve_beam`: orders of some directions of light alone, of an echelle
block       `solve_block`: a face of a block, in light from outside and from within
crossed     `solve_crossed`: orders of crossed gratings
orders      `solve_orders`: from a profile and a material to a table
measured    `read_orders`: from efficiencies that were solved or measured elsewhere
measured_crossed  the same of crossed gratings
efficiencies  files of efficiencies, CSV and NetCDF, and their conventions
listing     `list_orders`: a table's efficiencies as such a file
profiles    one period of the grooves as a polygon; generators and a reader
grating_index  refractive index over wavelength, by name or number
structure   films on a profile, slices beneath it, and the substrate
films       their reader and checks
stations    sets of directions with one system matrix
integral    solver: boundary integral method
chandezon   solver: coordinates that follow slopes
coupled     solver: coupled waves, for dielectrics
resolution  choice of the solver's resolution, by convergence
nodes       choice of the numbers of nodes
samples     checks of lights' orders, interpolation between lights, errors of a table
sheet       the sum of reflections in a thin sheet with a flat lower side
jobs        stations solved in processes, and stored until the table is written
recipes     recipes with `method = "solved"`
"""
