"""Proven kernels: formulas with certificates and rounding bounds, the catalogue of ready kernels, their code."""

__all__ = [
    "arithmetic",
    "bound",
    "catalogue",
    "certificate",
    "compact",
    "expressions",
    "formulas",
    "full",
    "kernel",
    "machine",
    "native",
    "quotient",
    "requests",
    "speed_table",
    "truth",
    "v_star",
]
