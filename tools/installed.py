"""Checks an installed viscopade: run with its Python, as `python tools/installed.py`, in any folder.

cibuildwheel runs this file for every wheel, and the tests for the wheel of this machine. It needs no compiler, and only
what the wheel itself depends on. A first argument `numpy` says that the extension need not be there.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import viscopade as vp
from viscopade.collision import exact

CHECKOUT = Path(__file__).resolve().parents[1]


def printed(*words: str) -> str:
    """Return the output of a viscopade command, started in an empty folder."""
    with tempfile.TemporaryDirectory() as folder:
        words = (sys.executable, "-m", "viscopade", *words)
        return subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True, encoding="utf-8").stdout


def main() -> None:
    """Compare the installed package with the exact function and with the files that its commands make."""
    place = Path(vp.__file__).resolve()
    assert not place.is_relative_to(CHECKOUT / "src"), f"{place} is a checkout: it is to be installed first"
    assert vp.backend() == "compiled" or "numpy" in sys.argv[1:], "the wheel has no extension"
    for speed, beta in ((1e-6, 1.307), (0.1, 1.307), (2.0, 0.3)):
        true = float(exact.collision(beta=repr(beta), speed=repr(speed)).epsilon)
        assert abs(vp.restitution(speed, beta) - true) <= 1e-15 * true

    headers = Path(vp.get_include())
    assert headers.is_relative_to(place.parent)
    assert printed("--include-dir") == f"{headers}\n"
    for name, words in (("viscopade_pade.h", ("c",)), ("viscopade_version.h", ("version-header",))):
        assert printed("export", *words) == (headers / name).read_text(encoding="utf-8")
    assert (Path(printed("--cmake-dir").strip()) / "viscopade-config.cmake").is_file()
    assert f"Version: {vp.__version__}\n" in (place.parent / "share/pkgconfig/viscopade.pc").read_text(encoding="utf-8")
    assert "speed table" in printed("scene", "--example", "ice_rings", "--no-check")
    print(
        f"viscopade {vp.__version__}, Python {sys.version.split()[0]}, {sys.platform}, {vp.backend()}: as it should be"
    )


if __name__ == "__main__":
    main()
