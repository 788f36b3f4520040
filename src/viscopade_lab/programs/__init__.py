"""Collisions in real simulators, compared with the exact eps."""
