"""Proven kernels: a formula with its certificate and its bound of rounding, the registry of ready ones, their text."""

__all__ = [
    "certificate",
    "expressions",
    "names",
    "prove_lacunary",
    "prove_rational",
    "registry",
    "registry_arrays",
    "requests",
    "rounding",
    "toolchain",
    "v_star",
]
