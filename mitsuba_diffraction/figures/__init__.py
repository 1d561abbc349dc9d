"""Figures of the documentation; each module is a function and a program."""
