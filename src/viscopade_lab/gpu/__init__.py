"""Measurements on a GPU; nothing of it runs in the tests but the compiler."""
