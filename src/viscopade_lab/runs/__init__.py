"""Collisions in real simulators: those of the audit, and data to fit."""
