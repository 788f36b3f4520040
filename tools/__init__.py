"""Makers of the data files in src/viscopade/data."""
