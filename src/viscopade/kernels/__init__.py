"""Proven kernels: formulas with certificates and rounding bounds, the registry of ready kernels, their code."""

__all__ = [
    "catalogue",
    "certificate",
    "enclosure",
    "expressions",
    "kernel",
    "machine",
    "names",
    "native",
    "prove_lacunary",
    "prove_rational",
    "registry",
    "registry_arrays",
    "requests",
    "toolchain",
    "truth",
    "v_star",
]
