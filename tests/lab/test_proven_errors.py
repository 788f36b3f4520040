"""Proven numbers of the exported kernels: what the headers say in words is what the kernels hold."""

import re
from functools import cache
from itertools import groupby
from pathlib import Path

import pytest

from viscopade.kernels import requests
from viscopade_lab.proven import numbers

EXPORTS = Path(__file__).parents[2] / "exports"
HEADERS = [name for name in requests.NAMES if name.endswith(".h") and name != requests.VERSION_HEADER]
KERNELS = sorted({number.kernel for number in numbers()})


@cache
def words(file):
    """The words of a header's first comment, in one line."""
    comment = (EXPORTS / file).read_text().partition("*/")[0]
    return " ".join(line.removeprefix(" *").strip() for line in comment.splitlines()) + " "


def label(kernel):
    """What a header calls a kernel: quotients go by their degrees, and the functions of full accuracy by nothing."""
    degrees = re.match(r"(?:pade|minimax)_(\d+)_(\d+)", kernel)
    return " [{}/{}] ".format(*degrees.groups()) if degrees else " " if kernel == "full" else f" {kernel} "


def file_of(kernel):
    family = {"pade": "pade", "minimax": "minimax", "halfline": "half_line", "inverse": "inverse", "full": "full"}
    kind = kernel.partition("_")[0]
    if kind in family:
        return f"viscopade_{family[kind]}.h"
    return next(name for name in HEADERS if "speed" in name and label(kernel) in words(name))


def passage(kernel):
    """What its header says of a kernel, up to the next one."""
    file = file_of(kernel)
    _, _, rest = words(file).partition(label(kernel))
    others = [rest.find(label(other) + "source:") for other in KERNELS if other != kernel and other != "full"]
    return rest[: min((place for place in others if place >= 0), default=len(rest))]


def stands(value, text):
    return re.search(rf"(?<![\d.]){re.escape(value)}(?![\d.e])", text) is not None


@pytest.mark.parametrize("kernel", KERNELS)
def test_headers_say_what_is_proven(kernel):
    """Where a header says one number for both types, it is the larger one."""
    text = passage(kernel)
    of_kernel = sorted((n for n in numbers() if n.kernel == kernel), key=lambda n: (n.quantity, n.end))
    for _, of_types in groupby(of_kernel, lambda n: (n.quantity, n.end)):
        given = list(of_types)
        for number in given:
            if number.quantity == "elsewhere":
                assert {"full": "viscopade_full.h"}.get(number.value, number.value) in text
            else:
                assert any(stands(n.value, text) for n in given if float(n.value) >= float(number.value)), number
            assert not number.end or f"v* <= {number.end}" in text


def test_every_header_has_its_kernels_numbers():
    assert {file_of(kernel) for kernel in KERNELS} == set(HEADERS)


def test_kernels_of_speed_say_what_underflow_does():
    for kernel in KERNELS:
        if kernel.startswith("lookup"):
            assert "a subnormal result is off by half of the smallest number besides" in passage(kernel)
