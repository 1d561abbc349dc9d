"""Orders of periodic profiles by rigorous solvers, for the BSDF `diffraction_orders`.

Contents
--------
orders      `solve_orders`: from a profile and a material to a table
directions  the same of some directions of light alone, as of an echelle
crossed     solver: coupled waves of crossed gratings
settings    settings of a solution, and estimates of its stages
accuracy    error of a table, measured at random directions and wavelengths
profiles    one period of the grooves as a polygon; generators and a reader
grating_index  refractive index over wavelength, by name or number, or of a file
films       films on a profile, slices beneath it, and the substrate; their reader and checks
stations    sets of directions with one system matrix
integral    solver: boundary integral method
chandezon   solver: coordinates that follow slopes
coupled     solver: coupled waves, for dielectrics
resolution  choice of the solver's resolution, by convergence
nodes       stations at the nodes of bands, and of single lights
sheet       the sum of reflections in a thin sheet with a flat lower side
jobs        stations solved in processes, and stored until the table is written
recipes     recipes with `method = "solved"`
"""

from .chandezon import Chandezon
from .coupled import CoupledWaves
from .crossed import CrossedWaves
from .films import read_layers
from .grating_index import material_of
from .integral import IntegralSolver
from .recipes import SolvedRecipe
from .settings import Settings
from .sheet import sheet_efficiencies
from .stations import CrossedStation, Grating, Solver, Station

__all__ = [
    "Chandezon", "CoupledWaves", "CrossedStation", "CrossedWaves", "Grating", "IntegralSolver",
    "Settings", "SolvedRecipe", "Solver", "Station", "accuracy", "films", "grating_index",
    "jobs", "material_of", "orders", "profiles", "read_layers", "recipes", "settings",
    "sheet_efficiencies",
]  # fmt: skip
