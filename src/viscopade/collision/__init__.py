"""The exact collision: spheres and pairs, the flow around the turning point, proven digits of eps, proven tables."""

__all__ = [
    "curve",
    "exact",
    "law_panels",
    "panel_proof",
    "spheres",
]
