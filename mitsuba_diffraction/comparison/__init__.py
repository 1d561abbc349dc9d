"""How far a realtime picture is from the path-traced one of the same scene."""
