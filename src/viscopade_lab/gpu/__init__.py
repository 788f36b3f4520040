"""Measurements on a GPU; the tests run the compiler only."""
