"""Proven kernels: formulas with certificates and rounding bounds, the catalogue of ready kernels, their code."""

__all__ = [
    "catalogue",
    "certificate",
    "enclosure",
    "expressions",
    "full",
    "kernel",
    "machine",
    "native",
    "requests",
    "speed_table",
    "toolchain",
    "truth",
    "v_star",
]
