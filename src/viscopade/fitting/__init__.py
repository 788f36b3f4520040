"""Damping from measured data: points, laws fitted to them, the verdict, and a scene with the result."""

__all__ = [
    "bounces",
    "contacts",
    "damping",
    "empirical",
    "flight",
    "forms",
    "likelihood",
    "neglected_effects",
    "points",
    "read",
    "scene_text",
    "verdict",
]
