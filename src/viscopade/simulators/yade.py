"""YADE: the viscoelastic law in versions after 2023.02a; a constant eps in 2023.02a and before.

Read in `pkg/dem/HertzMindlin.cpp` of YADE, `Ip2_FrictMat_FrictMat_MindlinPhys::go` and
`Law2_ScGeom_MindlinPhys_Mindlin::go`, with u the overlap and v_n the speed of compression:

    F = kno u^(3/2) + c v_n, clipped at 0 (without adhesion), kno = 4/3 E_eff sqrt(R_eff), kn = 3/2 kno sqrt(u).

In all versions: c = 2 betan sqrt(m_eff kn). This is `viscopade.collision.tsuji` with alpha = sqrt(6) betan, a damping
ratio of zeta = sqrt(6/5) betan: eps does not depend on the speed. `betan` may be given, or `en`, from which the program
takes betan by a fit of Thornton, Cummins and Cleary for the clipped force (2023.02a; older versions use Tsuji's formula
for the end at x = 0 and are off by more). `betan` from here needs no fit.

After 2023.02a (merge request 977): with `en` and `vn` together c = A kn and A = 2/3 beta (kno/m_eff)^(-2/5), which is
eq:viscoelastic, with this package's end condition. beta = v*^2 vn^(-1/5), and v* solves [3/6](v*) = en with the paper's
printed coefficients. So `en` is not given as eps but as the value of the printed [3/6] at the exact v*: then beta is
exact. The program keeps beta, not A, for all sizes of one pair of materials.

At a wall R_eff is R/2, and at a facet 2/3 R, instead of R: `Ig2_Wall_Sphere_ScGeom` and `Ig2_Facet_Sphere_ScGeom` give
them the sphere's radius and twice that. eps does not feel it in either law, as betan and beta fix it; the duration of
contact does. m_eff is the sphere's if the other body is not dynamic.

With betan = A/2 sqrt(kn/m_eff), set for every contact at every step, c = A kn in all versions. The generated code has
that as a function to be run by the program: exact, and slow, as it is Python. At walls it uses the A that gives the
right beta with the program's R_eff.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from viscopade.arrays.double import epsilon as exact_epsilon
from viscopade.collision import tsuji
from viscopade.collision.spheres import Pair
from viscopade.generated import template
from viscopade.simulators.setup import Contact, Setup
from viscopade.simulators.stated import ConstantEpsilon, ProgramErrors, common, constant, facts, program_errors
from viscopade.theory.paper import TABLE


@dataclass(frozen=True)
class MindlinPhysParameters:
    """Parameters of `Ip2_FrictMat_FrictMat_MindlinPhys` for a contact.

    Attributes
    ----------
    constant : ConstantEpsilon
        The constant eps of `betan`, which is exact at the typical speed, and its errors.
    betan, balanced : float
        For that eps, and for the one with the smallest largest error.
    en, vn : float
        For the viscoelastic law, where the program has it.
    errors : ProgramErrors
        Of that law: none for the pair itself, some for other sizes.
    """

    constant: ConstantEpsilon
    betan: float
    balanced: float
    en: float
    vn: float
    errors: ProgramErrors


def betan(epsilon: float) -> float:
    """Return the `betan` that gives the wanted eps, > 0 and <= 1.

    Examples
    --------
    >>> f"{betan(0.9):.6f} {betan(0.3):.6f}"
    '0.031280 0.453915'
    """
    return math.sqrt(5 / 6) * tsuji.damping_ratio(epsilon)


def printed_pade(v_star: float) -> float:
    """Return [3/6] at v* with the coefficients as printed in the paper, which the program solves for v*."""
    a, b = (sum(Fraction(c) * Fraction(v_star) ** i for i, c in enumerate(row)) for row in TABLE[3, 6])
    return float(a / b)


def mindlin_phys_parameters(contact: Contact) -> MindlinPhysParameters:
    """Return the parameters for a contact."""
    found = constant(contact)
    pair = contact.pair

    def same_beta(size: Pair, speed: float) -> float:
        return exact_epsilon(pair.v_star(speed)) if size is not pair else size.epsilon(speed)

    return MindlinPhysParameters(
        found,
        betan(found.epsilon),
        betan(found.balanced),
        printed_pade(pair.v_star(contact.typical)),
        contact.typical,
        program_errors(same_beta, contact),
    )


def render(setup: Setup, command: str) -> str:
    """Return Python code for YADE that makes the materials and the functor for the contacts.

    Parameters
    ----------
    setup : Setup
        Bodies become materials, contacts the pairs of them that may meet.
    command : str
        What the first line says it was made with.

    Raises
    ------
    ValueError
        If a name or the title is not one printable line.
    """
    return template(__name__, "yade.py.jinja").render(
        **common(setup, command),
        contacts=[
            (contact, facts(contact, setup.units), mindlin_phys_parameters(contact)) for contact in setup.contacts
        ],
    )
