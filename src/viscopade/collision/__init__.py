"""The exact collision: spheres and pairs, the flow around the turning point, proven eps and tables; any contact."""

__all__ = [
    "adhesion",
    "contact",
    "curve",
    "exact",
    "exact_table",
    "limits",
    "panel_proof",
    "schemes",
    "spheres",
    "weight",
]
