"""MercuryDPM: the header compiled with stand-ins for the program's.

The program itself is in no package: docs/usage/simulators/mercurydpm.md says how it was compared.
"""

import shutil
import subprocess

import pytest

from tests.patience import HANGS
from tests.simulators.two_balls import FLOOR, GLASS, RUBBER, SETUP
from viscopade import Pair
from viscopade.simulators import mercurydpm
from viscopade.simulators.input_file import render

COMMAND = "viscopade simulators mercurydpm scene.toml"
COMPILER = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
SPECIES = """
#pragma once
struct HertzianBSHPViscoelasticSpecies
{
    double density = -1, modulus = -1, dissipation = -1;
    void setDensity(double value) { density = value; }
    void setEffectiveElasticModulus(double value) { modulus = value; }
    void setDissipation(double value) { dissipation = value; }
};
"""
HANDLER = """
#pragma once
#include "Species/HertzianBSHPViscoelasticSpecies.h"
#include <list>
struct SpeciesHandler
{
    std::list<HertzianBSHPViscoelasticSpecies> all, mixed;
    template <class S> S* copyAndAddObject(const S& s) { all.push_back(s); return &all.back(); }
    template <class S> S* getMixedObject(S* a, S* b) { if (a == b) throw 1; mixed.push_back({}); return &mixed.back(); }
};
"""
MAIN = """
#include "contacts.h"
#include <cstdio>
int main()
{
    SpeciesHandler handler;
    viscopade::Species species = viscopade::addSpecies(handler);
    for (const auto& list : {handler.all, handler.mixed})
        for (const auto& s : list) std::printf("%.17g %.17g %.17g\\n", s.density, s.modulus, s.dissipation);
    return NAMES ? 0 : 2;
}
"""


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
def test_the_header_compiled_with_stand_ins(tmp_path):
    (tmp_path / "Species").mkdir()
    (tmp_path / "Species" / "HertzianBSHPViscoelasticSpecies.h").write_text(SPECIES)
    (tmp_path / "SpeciesHandler.h").write_text(HANDLER)
    (tmp_path / "contacts.h").write_text(render("mercurydpm", SETUP, COMMAND))
    names = " && ".join(f"species.{name}" for name in mercurydpm.identifiers(list(SETUP.bodies)).values())
    (tmp_path / "main.cc").write_text(MAIN.replace("NAMES", names))
    flags = ("-std=c++17", "-Wall", "-Wextra", "-Werror", "-I.")
    subprocess.run([COMPILER, *flags, "main.cc", "-o", "main"], cwd=tmp_path, check=True, timeout=HANGS)
    output = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout
    rows = [tuple(map(float, line.split())) for line in output.splitlines()]
    glass, rubber, mixed = Pair(GLASS, GLASS), Pair(RUBBER, RUBBER), SETUP.contacts[1].pair
    wall = FLOOR.plane_strain_modulus / 2
    wanted = [
        (2500, glass.E_eff, glass.A),
        (None, wall, FLOOR.dissipative_constant),
        (1100, rubber.E_eff, rubber.A),
        (-1, mixed.E_eff, mixed.A),
    ]
    for row, (density, modulus, dissipation) in zip(rows, wanted, strict=True):
        assert row[1:] == pytest.approx((modulus, dissipation), rel=1e-11, abs=0)
        assert density is None or row[0] == pytest.approx(density)
    # The program's own mean of the moduli is Hertz's, that of A is not ours.
    assert 2 / (1 / rows[1][1] + 1 / rows[2][1]) == pytest.approx(mixed.E_eff, rel=1e-11)
    assert abs(2 / (1 / rows[1][2] + 1 / rows[2][2]) / mixed.A - 1) > 0.1


def test_names():
    assert mercurydpm.identifiers(["a b", "2"]) == {"a b": "a_b_species", "2": "_2_species"}
    assert mercurydpm.identifiers(["glaß"]) == {"glaß": "gla__species"}
    with pytest.raises(ValueError, match=r"bodies 'a b' and 'a-b' get the same C\+\+ name: expected names that differ"):
        mercurydpm.identifiers(["a b", "a-b"])
    with pytest.raises(ValueError, match=r"bodies '2' and '_2'"):
        mercurydpm.identifiers(["2", "_2"])
