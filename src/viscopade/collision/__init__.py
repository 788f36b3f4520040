"""The exact collision: spheres and pairs, the flow around the turning point, proven eps and tables; time steps."""

__all__ = [
    "curve",
    "exact",
    "limits",
    "panel_proof",
    "spheres",
    "steps",
    "tsuji",
]
