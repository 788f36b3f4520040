"""The coefficient of restitution in closed form, for the two values of nu that have one."""

from mpmath import mp, mpf


def nu_1(kappa: mpf) -> mpf:
    """Hunt-Crossley contacts: kappa eps = 1 - sigma, sigma = -W(-(1 + kappa) exp(-(1 + kappa)))."""
    return (1 + mp.lambertw(-(1 + kappa) * mp.exp(-1 - kappa)).real) / kappa


def nu_2(zeta: mpf, end: str) -> mpf:
    """Spring-dashpots at a damping ratio, which is below 1 for the end at x = 0."""
    w = mp.sqrt(abs(1 - zeta * zeta))
    if zeta < 1:
        return mp.exp(-zeta * (mp.pi if end == "return" else mp.pi - 2 * mp.asin(zeta)) / w)
    return mp.exp(-(zeta / w) * mp.log((zeta + w) / (zeta - w)))
