"""Proven kernels: formulas with certificates and rounding bounds, the registry of ready kernels, their code."""

__all__ = [
    "certificate",
    "enclosure",
    "expressions",
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
