"""Writer of docs/validation/measured.md: measured gratings beside the model and solved orders.

Contents
--------
data        measurements with their sources and licences
grooves     groove profiles from facet angles, roughness and rounding
predict     orders of one mount by the model and by a solver
cases       measured gratings: efficiencies, printed properties, fitted grooves
shapes      effect of each imperfection of a groove on its orders
outside     height maps and pictures of another wave-optics renderer
page        parts of the page, and its figure
"""
