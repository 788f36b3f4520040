"""Compare the figures in docs/figures with those of the last commit: `python -m tools.same_figures`.

Their texts must be equal, and their numbers up to 0.001 points: the processor's vector instructions decide the last
digits of a simulated gas.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

FOLDER = Path("docs/figures")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
CLOSE = 1e-3


def same(one: str, other: str) -> bool:
    """Return whether two pictures have the same text and nearly the same numbers."""
    if NUMBER.sub("", one) != NUMBER.sub("", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(abs(float(a) - float(b)) <= CLOSE for a, b in pairs)


def committed(name: str) -> str:
    """Return a file of the last commit."""
    return subprocess.run(["git", "show", f"HEAD:{name}"], capture_output=True, text=True, check=True).stdout


def main() -> None:
    """Name the figures that differ; exit status 1 if there are any."""
    listed = subprocess.run(["git", "ls-files", f"{FOLDER}/*.svg"], capture_output=True, text=True, check=True).stdout
    names = {*listed.split(), *(str(path) for path in FOLDER.glob("*.svg"))}
    different = [
        name
        for name in sorted(names)
        if name not in listed.split() or not Path(name).exists() or not same(committed(name), Path(name).read_text())
    ]
    if different:
        sys.exit(f"figures that are not as committed: {', '.join(different)}")


if __name__ == "__main__":
    main()
