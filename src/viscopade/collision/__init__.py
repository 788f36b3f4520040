"""One collision, exactly: spheres and pairs, the flow around the turning point, proven digits, the table's proof."""

__all__ = [
    "exact",
    "panel_proof",
    "spheres",
]
