"""The straightforward way to h_k: a joint Taylor expansion in time and in kappa, in plain mpmath.

Nothing here is shared with `viscopade.theory.series`: no turning point, no time reversal, no end series, no FLINT and
no balls. It is both the rival that the benchmark times and the independent route that the tests compare with.

With x = s^2 and dt = 2 s dtheta the scaled equation of motion (eq:equationOfMotionNatUnit) becomes polynomial,

    ds/dtheta = u,    du/dtheta = -2 s^4 - 2 kappa s^2 u,    s(0) = 0, u(0) = 1,

where u = dx/dt. Contact ends where x'' = 0 (eq:tEndAdvanced), that is s^2 + kappa u = 0, and eps = -u there.
Every quantity is a truncated power series in kappa = v*^2; the end of contact is then a series in v* = sqrt(kappa).
"""

from __future__ import annotations

from mpmath import mp, mpf

Series = list[mpf]  # coefficients of kappa^0 … kappa^N
Taylor = list[Series]  # coefficients in theta


def _convolve_kappa(a: Series, b: Series, size: int) -> Series:
    """Product of two series in kappa, truncated."""
    return [mp.fdot(a[: n + 1], b[n::-1]) for n in range(size)]


def _product_coefficient(a: Taylor, b: Taylor, j: int, size: int) -> Series:
    """Coefficient theta^j of a*b, a series in kappa."""
    total = [mpf(0)] * size
    for i in range(j + 1):
        total = [x + y for x, y in zip(total, _convolve_kappa(a[i], b[j - i], size), strict=True)]
    return total


def taylor_coefficients(s: Series, u: Series, terms: int) -> tuple[Taylor, Taylor]:
    """Taylor coefficients in theta of the solution that starts at (s, u)."""
    size = len(s)
    ss, uu = [s], [u]
    w: Taylor = []  # s^2
    for j in range(terms):
        w.append(_product_coefficient(ss, ss, j, size))
        s4 = _product_coefficient(w, w, j, size)
        wu = _product_coefficient(w, uu, j, size)
        ss.append([x / (j + 1) for x in uu[j]])
        uu.append([-2 * (s4[n] + (wu[n - 1] if n else 0)) / (j + 1) for n in range(size)])
    return ss, uu


def _evaluate(coefficients: Taylor, h: mpf) -> Series:
    value = [mpf(0)] * len(coefficients[0])
    for c in reversed(coefficients):
        value = [x * h + y for x, y in zip(value, c, strict=True)]
    return value


def _contact_time(digits: int) -> mpf:
    """Return theta at which the elastic collision (kappa = 0) ends: twice the integral of ds / sqrt(1 - 4/5 s^5)."""
    a, b = mpf(1) / 5, mpf(1) / 2
    return 2 * (mpf(5) / 4) ** a * mp.beta(a, b) / 5


def _substitute(coefficients: Taylor, phi: Series, order: int) -> Series:
    """sum_{j,n} c[j][n] kappa^n phi^j as a series in v* (phi is a series in v*, kappa = v*^2)."""
    total = [mpf(0)] * (order + 1)
    power = [mpf(1)] + [mpf(0)] * order
    for c in coefficients[: order + 1]:
        in_v_star = [mpf(0)] * (order + 1)
        for n, x in enumerate(c):
            if 2 * n <= order:
                in_v_star[2 * n] = x
        total = [x + y for x, y in zip(total, _convolve_kappa(in_v_star, power, order + 1), strict=True)]
        power = _convolve_kappa(power, phi, order + 1)
    return total


def coefficients(order: int, digits: int, ratio: float = 0.15) -> list[mpf]:
    """h_0 … h_order, without proof, by Taylor steps in theta whose terms shrink about like `ratio`^j."""
    guard = 10 + order // 2
    with mp.workdps(digits + guard):
        size = order // 2 + 1
        s = [mpf(0)] * size
        u = [mpf(1)] + [mpf(0)] * (size - 1)
        end = _contact_time(digits)
        steps = max(2, int(mp.ceil(end / (1.2 * ratio))))
        terms = int((digits + guard) / -mp.log10(ratio)) + 2
        for _ in range(steps):
            ss, uu = taylor_coefficients(s, u, terms)
            s, u = _evaluate(ss, end / steps), _evaluate(uu, end / steps)
        ss, uu = taylor_coefficients(s, u, order + 2)
        # End of contact: s(phi)^2 + kappa u(phi) = 0 near phi = 0, where s = O(phi) and so phi = O(v*).
        # s = +v* sqrt(-u): each sweep fixes at least one more order of phi in v*.
        phi = [mpf(0)] * (order + 1)
        for _ in range(order + 1):
            speed = [-x for x in _substitute(uu, phi, order)]
            root = _square_root(speed)
            excess = _substitute(ss, phi, order)
            target = [mpf(0), *root[:order]]
            phi = [p + (e - t) for p, e, t in zip(phi, excess, target, strict=True)]
        return [-x for x in _substitute(uu, phi, order)]


def _square_root(a: Series) -> Series:
    """Square root of a power series with positive constant term."""
    root = [mp.sqrt(a[0])]
    for n in range(1, len(a)):
        inner = mp.fsum(root[i] * root[n - i] for i in range(1, n))
        root.append((a[n] - inner) / (2 * root[0]))
    return root
