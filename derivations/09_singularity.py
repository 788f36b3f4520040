# %% [markdown]
# # 9. The radius of convergence, and the singularity that limits it
#
# The paper says that the series $\varepsilon = 1 + \sum h_k v_\ast^k$ (its Eq. 7) "diverges for any finite
# truncation", which is true of every polynomial. The infinite series converges for
# $\lvert v_\ast \rvert < R = 1.0470243122\dots$ The limit is a pair of logarithmic branch points at
# $v_\ast = R e^{\pm 0.4288846\dots \pi i}$, where $\varepsilon$ becomes infinite. The positive real axis is free of
# singularities.
#
# Two independent ways give this number: the equation of motion in complex time, and the coefficients $h_k$ and $H_j$.

# %%
from itertools import pairwise

import numpy as np
import sympy as sp
from flint import acb, arb, arb_mat, arb_series, fmpq
from mpmath import findroot, mp

from viscopade.arithmetic.balls import bits_for, to_mpf, working
from viscopade.theory import equation
from viscopade.theory.series import end_series, series

# %% [markdown]
# ## All collisions are orbits of one flow without any parameter
#
# So far the impact speed was the unit of speed, and the damping $\kappa = v_\ast^2$ the parameter. Now the damping is
# the unit: $x = X/\kappa^4$, $\tau = \kappa T$. Then $\kappa$ disappears from the equation and the impact speed becomes
# $w = v_\ast^{10}$. (That is why $v_\ast^{10}$ is proportional to the impact speed $v$.)
#
# With $z = 2 \sqrt{X}$, $g = -4 dX/dT$ and a time $\sigma$ that runs backwards, $dT = -2 z d\sigma$, the equation
# becomes
#
# $$z' = g, \qquad g' = z^2 (g - z^2).$$

# %%
scaled = equation.scaled_equation()
z, g, kappa, w = sp.symbols("z g kappa w", positive=True)
length, time = kappa**-4, kappa
X, X_rate = z**2 / 4, -g / 4
flow = {z: g, g: z**2 * (g - z**2)}


def along(f):
    """df/dT along the flow."""
    return sum(f.diff(v) * rate for v, rate in flow.items()) / (-2 * z)


assert sp.simplify(along(X) - X_rate) == 0
x_rates = {2: length / time**2 * along(X_rate), 1: length / time * X_rate}
residual = scaled.lhs
for order in (2, 1):
    residual = residual.subs(scaled.x.diff(scaled.tau, order), x_rates[order])
residual = residual.subs(scaled.x, length * X).subs(scaled.kappa, kappa)
assert sp.simplify(residual) == 0
assert sp.simplify(length / time * w - 1).subs(w, kappa**5) == 0  # x' = 1 at the start is X' = kappa^5 = v*^10
print("z' = g, g' = z^2 (g - z^2): a collision starts at z = 0, g = -4 w, w = v*^10")

# %% [markdown]
# A collision starts at $(0, -4w)$ and goes against $\sigma$: $z$ grows until $g = 0$, where the compression is largest;
# then it shrinks with $g > 0$. The force $\ddot{X} = g'/(8z)$ vanishes at $g = z^2$: that is the end of contact, at
# $(z_e, z_e^2)$, with the speed $z_e^2/4$. If contact goes on, the orbit arrives at $z = 0$ with some $g = g_0$. So
#
# $$\varepsilon = \frac{z_e^2}{4 w} = \frac{z_e^2}{4 v_\ast^{10}}, \qquad \varepsilon_0 = \frac{g_0}{4 w}, \qquad
# \delta = \frac{4}{5} v_\ast^5 \sqrt{\varepsilon_0} = \frac{2}{5} \sqrt{g_0}.$$
#
# $\delta$, the argument of $H$ (`05_end_of_contact.py`), depends on $w$ only through the curve of the orbit.

# %%
assert sp.simplify(along(X_rate).subs(g, z**2)) == 0
v_star, g_0 = sp.symbols("v_* g_0", positive=True)
delta = sp.Rational(4, 5) * v_star**5 * sp.sqrt(g_0 / (4 * v_star**10))
assert sp.simplify(delta - sp.Rational(2, 5) * sp.sqrt(g_0)) == 0

# %% [markdown]
# ## Where $\varepsilon$ is analytic
#
# Let $w$ be complex, and follow $z_e(w)$ along a path of $w$. The flow is polynomial; so its solution is analytic in
# $\sigma$ and $w$ where it is finite, and the end of contact, the zero of $g - z^2$, moves analytically as long as the
# slope of $g - z^2$ along the orbit is not zero there. That slope is $-2 z_e^3$.
#
# Nor can $z_e(w)$ have a stationary point, or $w(z_e)$, which would be a square root's branch point. For two
# neighbouring orbits, with the displacement $(dz, dg)$, the area $g' dz - z' dg$ between them grows by
# $\exp(\int z^2 d\sigma)$, since $z^2$ is the divergence. From the section $z = 0$ (displacement $(0, -4 dw)$) to the
# curve $g = z^2$ (displacement $(dz_e, 2 z_e dz_e)$):
#
# $$\frac{dz_e}{dw} = \frac{8 w}{z_e^3} \exp\left(\int z^2 d\sigma\right) \quad \text{from start to end, never } 0.$$
#
# The same from $z = 0$ to the turning point $(z_0, 0)$: $dz_0/dw = (16 w/z_0^4) \exp(\int z^2 d\sigma)$. With $K$ or
# $k$ as the parameter of the curve this says that $d\kappa/dk$ has no zero, real or complex: there is no fold.

# %%
f = sp.Matrix([flow[z], flow[g]])
divergence = f[0].diff(z) + f[1].diff(g)
dw, dz_e, dz_0 = sp.symbols("dw dz_e dz_0")


def area(displacement, point):
    return sp.expand(displacement[0] * f[1].subs(point) - displacement[1] * f[0].subs(point))


start_area = area((0, -4 * dw), {z: 0, g: -4 * w})
assert divergence == z**2
assert sp.simplify((f[1] - 2 * z * f[0]).subs(g, z**2) + 2 * z**3) == 0
assert sp.solve(area((dz_e, 2 * z * dz_e), {g: z**2}) - start_area, dz_e) == [8 * dw * w / z**3]
assert sp.solve(area((dz_0, 0), {g: 0}) - start_area, dz_0) == [16 * dw * w / z**4]

# %% [markdown]
# On the positive real axis $\varepsilon$ is analytic. The proof: for $w > 0$ first $z$ and $g$ grow, $g$ ever faster
# than $z^4$, so $g = 0$ is reached. Then $g$ keeps growing and $z$ shrinks while $g < z^2$, so that $g = z^2$ is
# reached at $z_e > 0$. All values are finite, and the statement above applies.
#
# The only other possibility is that $z_e$ goes to infinity, or to the single fixed point $z = g = 0$, when $w$ goes to
# a finite value.

# %% [markdown]
# ## The singularity: the end of contact escapes to infinity
#
# For large $z$, $g - z^2$ must stay small compared with $z^2$ on the way to the end. The series
# $g = z^2 (1 + c_1/z + c_2/z^2 + \dots)$ solves $dg/dz = z^2 - z^4/g$; it has integer coefficients,
# $c_j = \frac{5-j}{2} [t^{j-1}] y^2$ for $y = \sum c_j t^j$. Neighbouring orbits differ from it by $u$ with
# $u' = (z^4/g^2) u = (1 - 4/z + 0/z^2 + \dots) u$:
#
# $$g = z^2 + 2z + 6 + \frac{16}{z} + \dots + C e^z z^{-4} \left(1 + O\left(\frac{1}{z^2}\right)\right)$$

# %%
TERMS = 120
c = [1]
for j in range(1, TERMS):
    c.append((5 - j) * sum(c[i] * c[j - 1 - i] for i in range(j)) // 2)
print("c_j =", c[:10])
t = sp.Symbol("t", positive=True)
y = sum(c[j] * t**j for j in range(10))
slow_equation = sp.expand(y * (2 * t * y - t**2 * y.diff(t)) - (y - 1))  # g g' = z^2 g - z^4 with g = z^2 y, t = 1/z
assert all(slow_equation.coeff(t, j) == 0 for j in range(10))
assert (1 / y**2).series(t, 0, 3).removeO() == 1 - 4 * t

# %% [markdown]
# To follow $u$ also where it is not small, we look for the first integral that begins with $C$: with $G$ for the series
# and $\rho = z^4/G^2$,
#
# $$I = \exp\left(-\int \rho dz\right) (u + b_2 u^2 + b_3 u^3 + \dots), \qquad
# u' = \frac{z^4 u}{G (G + u)} = \rho u \left(1 - \frac{u}{G} + \frac{u^2}{G^2} - \dots\right)$$
#
# and $b_n' + (n-1) \rho b_n = -\sum_{m < n} m b_m \rho (-1/G)^{n-m}$, solved by powers of $1/z$. At the end
# $u = z^2 - G = -2z - 6 - \dots$, $u^n b_n$ is of the relative order $z^{1-n}$, and there $C = I$ is

# %%
KEPT, HIGHEST_U = 6, 5


def cut(expression, order):
    """Drop the powers of t = 1/z from t^order on; negative ones are kept."""
    expression = sp.expand(expression)
    return sum(expression.coeff(t, i) * t**i for i in range(-12, order))


rho, inverse_rho = (cut((y**power).series(t, 0, KEPT).removeO(), KEPT) for power in (-2, 2))
inverse_G = t**2 * cut((1 / y).series(t, 0, KEPT).removeO(), KEPT)
b = {1: sp.Integer(1)}
for n in range(2, HIGHEST_U + 1):
    last = 2 * n - 2 + KEPT
    b[n] = sp.Integer(0)
    for _ in range(KEPT + 2):  # b_n' = -t^2 db_n/dt is of higher order
        known = -sum(m * b[m] * rho * (-inverse_G) ** (n - m) for m in range(1, n))
        b[n] = cut((known + t**2 * b[n].diff(t)) * inverse_rho / (n - 1), last)
assert rho.coeff(t, 0) == 1
assert rho.coeff(t, 1) == -4
exponential = sp.exp(sp.integrate(cut((rho - 1 + 4 * t) / t**2, 3), t)).series(t, 0, 4).removeO()
u_end = sp.expand((1 - y) / t**2)
C_end = cut(sum(b[n] * u_end**n for n in b) * exponential * t, 4)  # times z^5 e^-z
print("C =", sp.collect(C_end, t), "times z_e^5 exp(-z_e), t = 1/z_e")
assert sp.expand(C_end / -2 - (1 + t + 2 * t**2 - sp.Rational(34, 3) * t**3)) == 0

# %% [markdown]
# For $z_e \to \infty$ in the right half plane, and only there, $C$ goes to 0. The orbit with $C = 0$ is one orbit,
# $g = G(z)$: the creeping orbit. It comes from infinite compression ($\dot{X} = -X$: the elastic force balances the
# viscous one). It is the limit of ever faster collisions. Let $G_0 = G(0)$, where it arrives at $z = 0$. Because
# $g_0 - G_0$ is an analytic function of $C$,
#
# $$1 - \frac{\delta}{\delta_s} = \text{const } z_e^5 e^{-z_e} \left(1 + \frac{1}{z_e} + \frac{2}{z_e^2} - \dots\right)
# + \text{second power of this} + \dots,$$
#
# $$\delta_s = \frac{2}{5} \sqrt{G_0}, \qquad \mu = \delta \sqrt{H} = \frac{2}{5} z_e.$$
#
# So $H$ is singular at $\delta_s$. $H = \frac{4}{25} z_e^2/\delta^2$ goes to infinity there like
# $\frac{4}{25} L^2/\delta_s^2$ with $L = \ln(\text{const}/(\delta_s - \delta)) + 5 \ln L + \dots$, or
# $z_e = -5 W(-Y^{1/5}/5)$ for $z_e^5 e^{-z_e} = Y$ with Lambert's $W$ on its branch $-1$. It is a logarithmic branch
# point with infinitely many sheets, neither a pole nor a power.
#
# On the real axis $\delta_s$ is the limit of $\delta$ for $v_\ast \to \infty$, because the orbits then merge with the
# creeping orbit: $\varepsilon_0 \to \frac{1}{4} G_0/v_\ast^{10}$. If contact goes on to $x = 0$, all fast collisions
# end with the same speed. But $\delta_s$ may be reached for a complex, finite $v_\ast$ as well, and there
# $\varepsilon = z_e^2/(4 v_\ast^{10})$ becomes infinite.

# %%
Y = mp.mpf(10) ** -8
z_lambert = -5 * mp.lambertw(-(Y ** (mp.mpf(1) / 5)) / 5, -1)
assert abs(z_lambert**5 * mp.exp(-z_lambert) / Y - 1) < 1e-10

# %% [markdown]
# ## First way: the creeping orbit in complex time
#
# An orbit that ends by creeping started at $z = 0$ with $g = -4 w_s$. So let the creeping orbit start at $z = 0$,
# $g = G_0$, $\sigma = 0$, and integrate to complex $\sigma$: the singular impact speeds are $w_s = -z'(\sigma_s)/4$,
# one for each zero $\sigma_s$ of this one function $z(\sigma)$. The problem has no end of contact, no turning point and
# no parameter.
#
# For $G_0$, start at $z = 120$ with the series (there its terms become smaller than $10^{-60}$, and its error decays
# like $e^{-120}$ to $z = 0$), and integrate by Taylor series of 50 terms, with 50 digits.

# %%
DIGITS = 50
ORDER = 50


def middle(number):
    return acb(number.real.mid(), number.imag.mid())


def taylor(z, g):
    Z, G, squares, differences = [z], [g], [], []
    for n in range(ORDER):
        squares.append(sum((Z[i] * Z[n - i] for i in range(n + 1)), acb(0)))
        differences.append(G[n] - squares[n])
        Z.append(G[n] / (n + 1))
        G.append(sum((squares[i] * differences[n - i] for i in range(n + 1)), acb(0)) / (n + 1))
    return Z, G


def at(coefficients, h):
    total = acb(0)
    for coefficient in reversed(coefficients):
        total = total * h + coefficient
    return middle(total)


def safe_step(Z, G):
    """A tenth of the radius of convergence."""
    return min(0.1 * float(abs(s[-1]).mid()) ** (-1 / ORDER) if s[-1] != 0 else 1.0 for s in (Z, G))


def move(z, g, sigma):
    """Along the flow for the time sigma, on a straight path."""
    while True:
        Z, G = taylor(z, g)
        h = safe_step(Z, G)
        rest = float(abs(sigma).mid())
        if rest <= h:
            return at(Z, sigma), at(G, sigma)
        step = middle(sigma * (h / rest))
        z, g, sigma = at(Z, step), at(G, step), middle(sigma - step)


def to_zero(z, g, sigma):
    """Newton's method for z = 0, from the guess sigma; returns sigma and g there."""
    for _ in range(60):
        z_there, g_there = move(z, g, sigma)
        step = middle(z_there / g_there)
        sigma = middle(sigma - step)
        if float(abs(step).mid()) < 1e-22:  # the next step would be the square of it
            return sigma, move(z, g, sigma)[1]
    raise ArithmeticError("no zero found")


def down_to_zero(z, g):
    """From a large real z, with a guess that is good enough for the last part."""
    while float(z.real.mid()) > 0.5:
        Z, G = taylor(z, g)
        h = acb(-safe_step(Z, G))
        z, g = at(Z, h), at(G, h)
    return to_zero(z, g, middle(-z / g))


def to_mpc(number):
    return mp.mpc(to_mpf(number.real), to_mpf(number.imag))


def tenth_root(w, near):
    """The tenth root closest to `near`."""
    return min((mp.root(w, 10, n) for n in range(10)), key=lambda v: abs(v - near))


mp.dps = 40
NEAR = mp.mpc(0.23, 1.02), mp.mpc(-0.86, 0.84)  # where poles of Padé approximants cluster
with working(bits_for(DIGITS)):
    z_far = acb(TERMS)
    _, G_0 = down_to_zero(z_far, middle(z_far**2 * at(c, 1 / z_far)))
    G_0_number = to_mpf(G_0.real)
    sigma_s, g_s = to_zero(acb(0), G_0, acb(-0.06, -0.72))
    sigma_2, g_2 = to_zero(acb(0), G_0, acb(-0.2, -0.35))
v_s, v_2 = (tenth_root(-to_mpc(start) / 4, near) for start, near in zip((g_s, g_2), NEAR, strict=True))
v_i = mp.mpc(0, (G_0_number / 4) ** (mp.mpf(1) / 10))
delta_s = mp.mpf(2) / 5 * mp.sqrt(G_0_number)
print("G_0 =", mp.nstr(G_0_number, 35), "  delta_s =", mp.nstr(delta_s, 35))
print("sigma_s =", mp.nstr(to_mpc(sigma_s), 30), "  w_s =", mp.nstr(-to_mpc(g_s) / 4, 30))
for v in (v_s, v_i, v_2):
    print("v* =", mp.nstr(v, 30), "  |v*| =", mp.nstr(abs(v), 33), "  arg/pi =", mp.nstr(mp.arg(v) / mp.pi, 33))

# %% [markdown]
# A zero gives $w_s$, and $v_\ast$ is one of its ten tenth roots: we choose the one near which poles of Padé
# approximants cluster. $\sigma = 0$ is also a zero: $w = -G_0/4$, $v_\ast = \pm i (G_0/4)^{1/10}$. This is the mirror
# image of $v_\ast = \infty$ under time reversal (`06_time_reversal.py`), and already a singularity of $\varepsilon_0$.
#
# Continuation shows whether such a root is on the sheet of the collisions. On a straight line from $v_\ast = 0$ to
# $v_s$ we follow the end of contact: it goes to infinity at $v_s$. (At the mirror image $-v_s$, where $w$ is the same,
# $\delta$ is $-\delta_s$, where $H$ is finite; see below.) For small $\lvert v_\ast \rvert$ the collision is nearly
# elastic, with a known duration.


# %%
def runge_kutta(z, g, sigma, steps):
    """The flow for the time sigma; numbers or arrays."""

    def rates(z, g):
        return g, z * z * (g - z * z)

    h = sigma / steps
    for _ in range(steps):
        a_1, b_1 = rates(z, g)
        a_2, b_2 = rates(z + h / 2 * a_1, g + h / 2 * b_1)
        a_3, b_3 = rates(z + h / 2 * a_2, g + h / 2 * b_2)
        a_4, b_4 = rates(z + h * a_3, g + h * b_3)
        z, g = z + h / 6 * (a_1 + 2 * a_2 + 2 * a_3 + a_4), g + h / 6 * (b_1 + 2 * b_2 + 2 * b_3 + b_4)
    return z, g


def ends_of_contact(values):
    """z_e for neighbouring values of v*, the first of them small."""
    half = float(mp.beta(mp.mpf(1) / 5, 0.5)) * 40**0.2 / 20 / values[0] ** 6  # the elastic approach
    sigma = previous = -2 * half + 1 / (2 * values[0] ** 5)
    ends = []
    for v in values:
        sigma, previous = 2 * sigma - previous, sigma
        for _ in range(20):
            z, g = runge_kutta(0j, -4 * v**10, sigma, 150)
            step = (z * z - g) / (z * z * (g - z * z) - 2 * z * g)
            sigma += step
            if abs(step) < 1e-9 * abs(sigma):
                break
        else:
            raise ArithmeticError("the end of contact was lost")
        ends.append(z)
    return ends


distances = [*np.linspace(0.7, 0.05, 40), *np.geomspace(0.04, 1e-4, 20)]
path = [complex(v_s) * (1 - distance) for distance in distances]
ends = ends_of_contact(path)
for i in (0, 39, 49, 59):
    print(f"at (1 - {distances[i]:.1g}) v_s: z_e = {ends[i]:.4f}  eps = {ends[i] ** 2 / (4 * path[i] ** 10):.4f}")
assert abs(ends[0] ** 2 / (4 * path[0] ** 10) - 1.1085 + 0.0554j) < 1e-4  # the series' value
assert all(abs(b) > abs(a) for a, b in pairwise(ends))

# %% [markdown]
# ## The type of the singularity, in numbers
#
# Put the end of contact at $z_e = 10, 20, 40, 80$, $g = z_e^2$, go back to $z = 0$ and from there to the start, and
# compare $v_\ast$ with $v_s$. $1 - v_\ast/v_s$ should be a constant times
#
# $$z_e^5 e^{-z_e} \left(1 + \frac{1}{z_e} + \frac{2}{z_e^2} - \frac{34}{3 z_e^3}
# + O\left(\frac{1}{z_e^4}\right)\right),$$
#
# because $v_\ast$ is an analytic function of $g_0$ with a slope that is not 0.

# %%
constants = []
with working(bits_for(DIGITS)):
    for z_end in (10, 20, 40, 80):
        _, g_there = down_to_zero(acb(z_end), acb(z_end**2))
        start = to_mpc(to_zero(acb(0), g_there, sigma_s)[1])
        distance = 1 - tenth_root(-start / 4, v_s) / v_s
        shape = mp.mpf(z_end) ** 5 * mp.exp(-z_end) * sp.lambdify(t, C_end / -2, "mpmath")(mp.mpf(1) / z_end)
        constants.append(distance / shape)
        print(f"z_e = {z_end}: 1 - v*/v_s =", mp.nstr(distance, 5), "  the constant", mp.nstr(constants[-1], 8))
steps = [abs(b - a) for a, b in pairwise(constants)]
print("its changes", [mp.nstr(step, 3) for step in steps], "should become 16 times smaller")
assert 12 < steps[1] / steps[2] < 25

# %% [markdown]
# Over 30 orders of magnitude of the distance this confirms the exponential, the power 5 and the corrections:
# $\varepsilon$ grows to infinity like the square of the logarithm of the distance. A square root would have $z_e$
# finite, a pole would have $z_e^{-2}$ linear.
#
# ## Second way: the coefficients
#
# From here on we do not use the equation of motion, only the exact $H_0, \dots, H_{100}$ and the proven
# $h_0, \dots, h_{120}$.
#
# Ratios or Dlog-Padé approximants are not accurate, because a logarithm inside $L$ hardly changes from order 100 to
# order 200. But $\mu = \delta \sqrt{H(\delta)} = \frac{2}{5} z_e$ goes to infinity at $\delta_s$, so that $\delta$ as a
# function of $\mu$ goes to $\delta_s$ exponentially. Hence:
#
# 1. Invert the series $\mu(\delta)$. Padé approximants of $(\delta/\mu)^2$ in $\mu$ continue it to $\mu$ from 4 to 6.
# 2. Because $\delta_s - \delta$ is $e^{-z}$ times powers of $z$, plus its second power and so on, it is, as one
#    function of $z$, $\delta' (1 + 5/z + a_2/z^2 + \dots) + \delta'^2 (b_0 + b_1/z + \dots) + \dots$ Values at several
#    $z$ determine $\delta_s$ and the first coefficients; the result must not depend on their positions and number.
# 3. $\varepsilon_0 = \varepsilon (\delta/\mu)^2$ with $\mu = \frac{4}{5} v_\ast^5 \sqrt{\varepsilon}$ turns the series
#    of $\varepsilon$ into that of $\varepsilon_0 = \exp(\kappa L(\kappa))$, whose odd powers of $v_\ast$ must vanish.
#    $v_s$ is where $\frac{4}{5} v_\ast^5 \sqrt{\varepsilon_0} = \delta_s$.

# %%
N_END, N_SERIES = 100, 120
PADE_BITS = bits_for(400)


def pade(coefficients, m, n):
    """Numerator and denominator of [m/n], from the middles of the enclosures."""
    middles = [arb(x.mid()) for x in coefficients]
    rows = [[middles[m + i - j] if m + i >= j else arb(0) for j in range(1, n + 1)] for i in range(1, n + 1)]
    solution = arb_mat(rows).solve(arb_mat([[-middles[m + i]] for i in range(1, n + 1)]))
    bottom = [arb(1), *(arb(row[0].mid()) for row in solution.tolist())]
    top = [sum((bottom[j] * middles[i - j] for j in range(min(i, n) + 1)), arb(0)) for i in range(m + 1)]
    return [to_mpf(x) for x in top], [to_mpf(x) for x in bottom]


def value(approximant, x):
    top, bottom = (mp.polyval(coefficients[::-1], x) for coefficients in approximant)
    return top / bottom


H = end_series(N_END)
with working(PADE_BITS, N_END + 1):
    H_series = arb_series([arb(fmpq(q.numerator, q.denominator)) for q in H], N_END + 1)
    delta_of_mu = (arb_series([0, 1], N_END + 1) * H_series.sqrt()).reversion()
    k_0 = arb_series(delta_of_mu.coeffs()[1:], N_END) ** 2
    approximants = [pade(k_0.coeffs(), n, n) for n in (49, 48)]
    H_approximants = [pade(H_series.coeffs(), n, n) for n in (50, 49)]
print("k_0 =", 1, "-", mp.nstr(-to_mpf(k_0[1]), 10), "mu + …   (05_end_of_contact.py: 1 - mu/3 + …)")


def delta_and_slope(approximant, z):
    (top, top_slope), (bottom, bottom_slope) = (mp.polyval(c[::-1], 2 * z / 5, derivative=1) for c in approximant)
    root = mp.sqrt(top / bottom)
    k_0_slope = (top_slope - top / bottom * bottom_slope) / bottom
    return 2 * z / 5 * root, mp.mpf(2) / 5 * (root + 2 * z / 5 * k_0_slope / (2 * root))


def extrapolated(approximant, first, last, powers):
    """delta_s from Chebyshev points of first < z < last, with a number of unknowns for each power of delta'."""
    count = 1 + sum(powers)
    rows, right = [], []
    for i in range(count):
        z = (mp.mpf(first) + last) / 2 + (mp.mpf(last) - first) / 2 * mp.cos(mp.pi * (2 * i + 1) / (2 * count))
        delta, slope = delta_and_slope(approximant, z)
        terms = [slope**m * z ** -(j + (2 if m == 1 else 0)) for m, n in enumerate(powers, 1) for j in range(n)]
        rows.append([1, *(-term for term in terms)])
        right.append(delta + slope * (1 + 5 / z))
    return mp.lu_solve(mp.matrix(rows), mp.matrix(right))[0]


CHOICES = [(first, first + 4, powers) for first in (8, 8.5) for powers in ((7, 6, 4), (9, 6, 4), (9, 8, 4), (9, 8, 6))]
estimates = sorted(extrapolated(approximant, *choice) for choice in CHOICES for approximant in approximants)
delta_series = estimates[len(estimates) // 2]
spread = estimates[-2] - estimates[1]
print("delta_s from the H_j:", mp.nstr(delta_series, 13), " spread of the estimates", mp.nstr(spread, 2))
print("  from the flow:     ", mp.nstr(delta_s, 13), " difference", mp.nstr(delta_series - delta_s, 2))
assert abs(delta_series - delta_s) < spread < 1e-9

# %% [markdown]
# Is $\delta_s$ the nearest singularity of $H$, and the only one at this distance? All computed $H_j$ are positive, so
# the nearest one should be on the positive real axis (Pringsheim), where $H$ is analytic below $\delta_s$ (above).
# $H_j/H_{j+1}$ goes to $\delta_s$ smoothly, without the oscillations of a second one. At $-\delta_s$ Padé approximants
# give a finite $H$.

# %%
assert min(H) > 0
ratios = [mp.mpf((a / b).numerator) / (a / b).denominator for a, b in pairwise(H[10:])]
differences = [a - b for a, b in pairwise(ratios)]
assert min(differences) > 0  # monotonic,
assert all(a > b for a, b in pairwise(differences))  # and so are the differences
print("H_j/H_(j+1) at j = 99:", mp.nstr(ratios[-1], 6))
H_opposite = [value(approximant, -delta_s) for approximant in H_approximants]
print("H(-delta_s) =", mp.nstr(H_opposite[0], 20))
assert abs(H_opposite[0] - H_opposite[1]) < 1e-20

# %%
proven = series(N_SERIES, 50)
with working(bits_for(60), N_SERIES + 1):
    eps = arb_series(list(proven.h), N_SERIES + 1)
    mu_of_v = arb_series([0] * 5 + [arb(4) / 5], N_SERIES + 1) * eps.sqrt()
    log_eps0 = (eps * arb_series(k_0.coeffs()[: N_SERIES // 5 + 1], N_SERIES + 1)(mu_of_v)).log().coeffs()
    assert all(x.contains(0) for x in log_eps0[1::2])  # k_0 is an enclosure, and so is this
with working(PADE_BITS):
    log_approximants = [pade(log_eps0[2::2], n, n) for n in (29, 28)]


def log_delta_of_v(v, approximant):
    return mp.log(mp.mpf(4) / 5) + 5 * mp.log(v) + v**2 * value(approximant, v**2) / 2 - 2j * mp.pi


v_series = [findroot(lambda v, a=a: log_delta_of_v(v, a) - mp.log(delta_series), NEAR[0]) for a in log_approximants]
assert abs(v_series[0] - v_series[1]) < 1e-12
print("v_s from the series:", mp.nstr(v_series[0], 13))
print("    from the flow:  ", mp.nstr(v_s, 13), " |difference| =", mp.nstr(abs(v_series[0] - v_s), 2))
R, angle = abs(v_s), mp.arg(v_s) / mp.pi
print("R from both:", *(mp.nstr(abs(v), 12) for v in (v_series[0], v_s)))
print("arg/pi from both:", *(mp.nstr(mp.arg(v) / mp.pi, 12) for v in (v_series[0], v_s)))
assert abs(v_series[0] - v_s) < 1e-9

# %% [markdown]
# ## The pair determines the coefficients
#
# With $\varepsilon = z_e^2/(4 v_\ast^{10})$ Cauchy's formula for $h_k$ becomes, integrated by parts, an integral over
# the end of contact,
#
# $$h_k = \frac{1}{2 \pi i} \frac{1}{2 (k+10)} \int z_e v_\ast(z_e)^{-(k+10)} dz_e,$$
#
# where $z_e$ comes from $\Im z_e < 0$ and goes to $\Im z_e > 0$ round the right end of the $z_e$ plane, from one valley
# of $v_\ast^{-(k+10)}$ to the next: this is the contribution of $v_s$, and its complex conjugate is that of
# $\overline{v_s}$. With $v_\ast(z_e)$ by numerical integration along the flow it must give the proven $h_k$, except for
# the contribution of the next singularities, which is smaller by $(R/1.178)^k$. (The first term of an integration by
# parts estimates the rest beyond the ends of the path.) The leading term is Darboux's for a squared logarithm:
# $h_k \sim \Re(\text{const } v_s^{-k} (\ln k + \dots))/k$.

# %%
side = np.linspace(-1, 1, 241)
z_path = 11 - 5 * side**2 + 8j * side
g_path, z_there, h = z_path**2, z_path, -z_path / 2000
for _ in range(2000):  # dg/dz = z^2 - z^4/g, straight to z = 0
    slope_1 = z_there**2 - z_there**4 / g_path
    middle_z = z_there + h / 2
    slope_2 = middle_z**2 - middle_z**4 / (g_path + h / 2 * slope_1)
    slope_3 = middle_z**2 - middle_z**4 / (g_path + h / 2 * slope_2)
    z_there = z_there + h
    slope_4 = z_there**2 - z_there**4 / (g_path + h * slope_3)
    g_path = g_path + h / 6 * (slope_1 + 2 * slope_2 + 2 * slope_3 + slope_4)
sigma_path = np.full(z_path.shape, complex(to_mpc(sigma_s)))
for _ in range(8):
    z_start, g_start = runge_kutta(np.zeros_like(g_path), g_path, sigma_path, 400)
    sigma_path = sigma_path - z_start / g_start
assert np.max(np.abs(z_start)) < 1e-10
log_v_path = np.log(-g_start / 4 / complex(v_s) ** 10) / 10  # ln(v*/v_s)
log_v_slope = np.gradient(log_v_path, edge_order=2) / np.gradient(z_path, edge_order=2)
for k in (60, 80, 100, 120):
    n = k + 10
    integrand = z_path * np.exp(-n * log_v_path)
    integral = np.sum((integrand[1:] + integrand[:-1]) / 2 * np.diff(z_path))
    integral += integrand[-1] / (n * log_v_slope[-1]) - integrand[0] / (n * log_v_slope[0])
    share = (integral / (2j * np.pi * n) * complex(v_s) ** -n).real
    exact, size = float(proven.h[k].mid()), float(R) ** -k / k
    expected = float(R / abs(v_i)) ** k
    print(f"h_{k} = {exact:.12f}, share of the pair {share:.12f}, difference {(share - exact) / size:.0e} R^-k/k")
    assert abs(share - exact) < 20 * expected * size

# %% [markdown]
# So the series of the paper converges, for $\lvert v_\ast \rvert < R$. In impact speeds
# $R^{10} = \lvert w_s \rvert = 1.58$, which is $v = 1.58/\beta^5 = 0.415$ cm/s for the paper's ice: beyond that, more
# terms increase the error. The paper's $k_c = 20$ and 40 deviate already at 0.26 and 0.3 cm/s.
#
# Proven: $\varepsilon$ is analytic for $v_\ast > 0$, and no fold exists. Derived by formal series, and confirmed over
# 30 orders of magnitude: $v_s$ is a singularity of this type. Not proven, but visible in the coefficients: no
# singularity is nearer to 0.

# %%
beta, speed = mp.mpf("1.307"), abs(to_mpc(g_s)) / 4
print("R^10 =", mp.nstr(speed, 12), "  for ice (beta = 1.307) v =", mp.nstr(speed / beta**5, 4), "cm/s")
assert mp.almosteq(R**10, speed, 1e-30)
print(f"derived: R = {mp.nstr(R, 11)}…, arg = +-{mp.nstr(angle, 10)} pi, logarithmic branch points, eps ~ (ln)^2")
