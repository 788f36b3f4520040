"""The certificates in exports/, checked without the package: by rational and by interval arithmetic."""

import json
from pathlib import Path

import pytest

import certificate_checker
import interval_checker
from certificate_checker import Wrong

EXPORTS = Path(__file__).parents[2] / "exports"
QUOTIENTS = ("minimax_certificates.json", "pade_certificates.json")
IN_POWERS_OF_A_ROOT = ("half_line_certificates.json", "inverse_certificates.json")
EVERY = 1009


def entries(name: str) -> list[dict]:
    return json.loads((EXPORTS / name).read_text())["certificates"]


@pytest.mark.parametrize("name", QUOTIENTS)
def test_quotients_of_polynomials(name):
    assert len(certificate_checker.check_file(EXPORTS / name)) == len(entries(name)) >= 6


@pytest.mark.parametrize("name", IN_POWERS_OF_A_ROOT)
def test_a_sample_of_kernels_in_powers_of_a_root(name):
    """The program reads the files; the records that these are made from have a larger sample, another one every day."""
    assert len(interval_checker.check_file(EXPORTS / name, EVERY)) == len(entries(name)) >= 4


@pytest.mark.slow
@pytest.mark.parametrize("name", IN_POWERS_OF_A_ROOT)
def test_kernels_in_powers_of_a_root(name):
    assert len(interval_checker.check_file(EXPORTS / name)) == len(entries(name))


@pytest.mark.parametrize("name", IN_POWERS_OF_A_ROOT)
@pytest.mark.parametrize("change", ["bound", "coefficient", "panel", "measure", "reference", "parts"])
def test_changed_certificates_are_refused(name, change):
    entry = entries(name)[0]
    if change == "bound":
        entry["bound"] = str(0.98 * float(entry["bound"]))
    elif change == "coefficient":
        entry["a"][-1] = (float.fromhex(entry["a"][-1]) * 1.002).hex()
    elif change == "panel":
        del entry["parts"][40]
    elif change == "measure":
        entry["measure"] = "none"
    elif change == "reference":
        entry["reference_error"] = (2.0**-70).hex()
    else:
        entry["parts"][3][1] = 0
    every = {"bound": 3, "coefficient": 25}.get(change, 10**6)
    with pytest.raises(Wrong):
        interval_checker.Checker(entry).check(every)
