"""The optional extension `viscopade._native` (native/), which is built at installation if there is a C compiler.

Whatever it computes, Python or NumPy computes without it, more slowly and with the same bits. The environment variable
VISCOPADE_BACKEND, read once, asks for one of the two.
"""

from os import environ
from typing import Any

BACKENDS = ("compiled", "numpy")
VARIABLE = "VISCOPADE_BACKEND"


def load_extension(backend_name: str | None) -> Any:
    """Return the extension, a module; None if Python and NumPy are to compute.

    Parameters
    ----------
    backend_name : str, optional
        "compiled" or "numpy"; by default (and if empty) the compiled one if there is one.

    Raises
    ------
    ValueError
        If there is no such backend.
    ImportError
        If the compiled one is asked for and was not built.
    """
    if backend_name not in (*BACKENDS, "", None):
        raise ValueError(f"{VARIABLE} is {backend_name!r}: expected {' or '.join(BACKENDS)}")
    if backend_name == "numpy":
        return None
    # Without a name the extension is used if it is there; a missing one is an error only if it is asked for.
    try:
        from viscopade import _native
    except ImportError as error:
        if backend_name:
            raise ImportError(
                f"{VARIABLE} is {backend_name!r}, but the extension could not be loaded ({error}): was there a C "
                "compiler when viscopade was installed? Expected numpy, too"
            ) from error
        return None
    return _native


extension = load_extension(environ.get(VARIABLE))


def backend() -> str:
    """Return the backend: "compiled" or "numpy"."""
    return "numpy" if extension is None else "compiled"
