# %% [markdown]
# # 14. Both ends to any order: expansions for $v_\ast \to 0$ and $v_\ast \to \infty$
#
# `viscopade_lab.asymptotics` gives $\varepsilon$, $x_\text{max}$ and $\tau_c$ as asymptotic expansions to any order. It
# is independent of the exact function, so it can check it. Its recursions are derived here.
#
# For $v_\ast \to \infty$, `10_large_v_star.py` has three terms, by matched expansions with integrals in closed form.
# For any order it is simpler to expand a constant of the motion and the time, as functions on the plane, instead of the
# orbit: their equations are linear, and only rational numbers remain to be matched. For $v_\ast \to 0$ there is the
# perturbation series of derivation 3, also for the time.

# %%
from itertools import pairwise

import sympy as sp
from mpmath import mp, quad

from viscopade.arithmetic.balls import to_mpf, working
from viscopade.collision import exact
from viscopade.theory import symbolic
from viscopade.theory.series import series
from viscopade_lab.asymptotics import (
    elastic,
    elastic_in_closed_form,
    near_turning_point,
    turning_point_series,
    viscous,
    way_in,
)

z, g, C = sp.symbols("z g C", positive=True)
s, ell, t, n, p = sp.symbols("sigma l t n p")
x = sp.Symbol("x", positive=True)


def rational(c):
    return sp.Rational(int(c.p), int(c.q))


def polynomial(p, variable):
    return sum(rational(c) * variable**i for i, c in enumerate(p.coeffs()))


# %% [markdown]
# ## $v_\ast \to \infty$: near the turning point
#
# The flow is $z' = g$, $g' = z^2 (g - z^2)$, $dT = -2 z d\theta$, where the prime is $d/d\theta$ (`09_singularity.py`).
# With $g = z^2 (1 - \sigma)$ the turning point is $\sigma = 1$, the end of contact, $g = z^2$, is $\sigma = 0$, and
# loading has $\sigma > 1$. We expand for large $z$.

# %%
z_rate = g.subs(g, z**2 * (1 - s))
s_of_g = 1 - g / z**2
s_rate = sp.expand((s_of_g.diff(z) * g + s_of_g.diff(g) * z**2 * (g - z**2)).subs(g, z**2 * (1 - s)))
print("z' =", z_rate, "  sigma' =", sp.factor(s_rate))
assert sp.expand(s_rate - z**2 * s - 2 * z * (1 - s) ** 2) == 0


def along(function, log_rate=0):
    """d/dtheta of a function of z, sigma, and of l whose derivative is given."""
    return function.diff(z) * z_rate + function.diff(s) * s_rate + function.diff(ell) * log_rate


# %% [markdown]
# A constant of the motion is $\Lambda = 6 \ln z - z - \sigma + \ln \sigma + q_1(\sigma)/z + q_2(\sigma)/z^2 + \dots$,
# with
#
# $$\sigma q_1' = -6 (1-\sigma) - \frac{2 (1-\sigma)^3}{\sigma}, \qquad
# \sigma q_{n+1}' = -2 (1-\sigma)^2 q_n' + n (1-\sigma) q_n.$$
#
# These are Laurent polynomials if the constant in $q_n$ is chosen so that $q_{n+1}'$ has no $1/\sigma$.

# %%
q_prev, q_next = sp.Function("q_n")(s), sp.Function("q_m")(s)
first = sp.expand(along(6 * sp.log(z) - z - s + sp.log(s) + q_next / z))
assert sp.simplify(first.coeff(z, 2)) == 0
assert sp.simplify(first.coeff(z, 1) - s * q_next.diff(s) - 6 * (1 - s) - 2 * (1 - s) ** 3 / s) == 0
step = sp.expand(sp.expand(along(z**-n * q_prev + z ** (-n - 1) * q_next)) * z ** (n - 1))
step = sp.expand(sp.powsimp(step)).coeff(z, 0)
assert sp.expand(step - s * q_next.diff(s) - 2 * (1 - s) ** 2 * q_prev.diff(s) + n * (1 - s) * q_prev) == 0

ORDER = 4
q = []
right = sp.expand(-6 * (1 - s) - 2 * (1 - s) ** 3 / s)
for k in range(1, ORDER + 1):
    assert right.coeff(s, 0) == 0  # no logarithm
    q_k = sp.integrate(sp.expand(right / s), s) + n
    right = sp.expand(-2 * (1 - s) ** 2 * q_k.diff(s) + k * (1 - s) * q_k)
    (constant,) = sp.solve(right.coeff(s, 0), n)
    q.append(q_k.subs(n, constant))
    right = sp.expand(right.subs(n, constant))
near = near_turning_point(ORDER)
assert all(sp.expand(q_k - sum(rational(c) * s**i for i, c in near.q[k].items())) == 0 for k, q_k in enumerate(q, 1))
print("q_1 =", q[0], "  q_2 =", q[1])

# %% [markdown]
# At the turning point $\Lambda = 6 \ln Z - Z - 1 + \sum q_n(1)/Z^n$. At the end $\sigma = 0$ it is singular, but
# $J = \sigma \exp(\sum q_n/z^n)$ is regular: its coefficients are polynomials, $-Q_n(-\sigma)$ of derivation 10.

# %%
J = [s]
for m in range(1, ORDER + 1):  # m e_m = sum k q_k e_(m-k) for the exponential e_0 + e_1 t + …
    J.append(sp.expand(sum(k * q_k * J[m - k] for k, q_k in enumerate(q[:m], 1)) / m))
assert all(sp.denom(sp.together(J_k)).is_number for J_k in J)
assert sp.expand(J[1] - (s**3 - 2 * s + 2)) == 0
at_end = sp.expand(sp.series(sp.log(sum(J[k + 1].subs(s, 0) / 2 * t**k for k in range(ORDER))), t, 0, ORDER).removeO())
print("at the end ln J = ln 2 - ln z_e +", at_end, "  t = 1/z_e")
assert [at_end.coeff(t, k) for k in range(1, ORDER)] == [rational(c) for c in near.end[1:ORDER]]
assert [q_k.subs(s, 1) for q_k in q] == [rational(c) for c in near.turning[1:]]

# %% [markdown]
# The time is $T = \sum z^{-n} R_n(\sigma, l)$, $l = \ln J = \Lambda - 6 \ln z + z + \sigma$, whose derivative is a
# polynomial.
#
# $$\left(\sigma \frac{d}{d\sigma} + \frac{d}{dl}\right) R_n = (n-1) (1-\sigma) R_{n-1}
# - 2 (1-\sigma)^2 \frac{dR_{n-1}}{d\sigma}
# + 2 (1-\sigma) (2+\sigma) \frac{dR_{n-1}}{dl},$$
#
# with $R_1 = -2 l$, has polynomial solutions: it is triangular in powers of $\sigma$, and an integral over $l$ at
# $\sigma = 0$.

# %%
log_rate = sp.expand(along(-6 * sp.log(z) + z + s))
assert sp.expand(log_rate - z**2 + 2 * z * (1 - s) * (2 + s)) == 0
R = [sum(polynomial(R_nk, s) * ell**k for k, R_nk in enumerate(R_n)) for R_n in near.time]
T_rate = sp.expand(along(sum(R_n * z**-k for k, R_n in enumerate(R)), log_rate))
assert R[0] == 0
assert R[1] == -2 * ell
assert sp.expand(T_rate.coeff(z, 1) + 2) == 0
assert all(sp.expand(T_rate.coeff(z, power)) == 0 for power in (2, *range(0, 2 - ORDER, -1)))
print("R_2 =", R[2])

# %% [markdown]
# ## Loading
#
# Far from the turning point $g$ is nearly $(z^3 - C^3)/3$ with a constant $C$: at the start, $z = 0$,
# $C^3 = -3 g = 12 w = W^3$. So let $C(z, g) = (z^3 - 3 g)^{1/3}$ everywhere. Along the orbit $dC/dz = z^4/(g C^2)$, and
# $dT/dz = -2 z/g$. With $x = 1 - z/C$ and $L = \ln(C x)$ we look for
#
# $$\Lambda = -C + 6 \ln C + \sum C^{1-n} x^{1-n} f_n(x, L), \qquad
# T = \sum C^{-n} x^{1-n} f_n(x, L), \qquad n = 1, 2, \dots$$
#
# With $p = 1$ or 0, $\theta = x \frac{d}{dx} + \frac{d}{dL}$ and $D = (1-x)^4/(1 - x + x^2/3)$,
#
# $$\frac{d}{dz} [C^{p-n} x^{1-n} f] = -C^{p-n-1} x^{-n} (\theta + 1 - n) f
# - C^{p-n-2} x^{-n-1} D \left((\theta + 1 - n) f - (1-p) x f - x^2 \frac{df}{dx}\right).$$

# %%
f = sp.Function("f")(x, ell)
g_of_C = (z**3 - C**3) / 3
C_slope = z**4 / (g_of_C * C**2)
assert sp.simplify(((z**3 - 3 * g).diff(z) + (z**3 - 3 * g).diff(g) * (z**2 - z**4 / g)) - 3 * z**4 / g) == 0
D = (1 - x) ** 4 / (1 - x + x**2 / 3)
x_of_z = 1 - z / C
log_of_z = sp.log(C - z)


def slope_along(power_of_C, function):
    """d/dz of C^power function(x, L) along the orbit, as a function of C, x, L."""
    total = 0
    for variable, weight in ((z, 1), (C, C_slope)):
        inner = function.diff(x) * x_of_z.diff(variable) + function.diff(ell) * log_of_z.diff(variable)
        total += weight * (C**power_of_C * inner + (C**power_of_C).diff(variable) * function)
    return total.subs(z, C * (1 - x))


theta = x * f.diff(x) + f.diff(ell) + (1 - n) * f
expected = -(C ** (p - n - 1)) * x**-n * theta
expected -= C ** (p - n - 2) * x ** (-n - 1) * D * (theta - (1 - p) * x * f - x**2 * f.diff(x))
unit = C ** (p - n - 1) * x**-n
assert sp.simplify(sp.powsimp(sp.expand(slope_along(p - n, x ** (1 - n) * f) / unit - expected / unit))) == 0

# %% [markdown]
# The sum of the orders $C^{p-n-1}$ must be 0 for $\Lambda$, $-2 z/g$ for $T$. $-C$ and $6 \ln C$ contribute to $n = 1$
# and $n = 2$:
#
# $$(\theta + 1 - n) f_n = r_n, \qquad r_n = s_n - D \left(r_{n-1} - (1-p) x f_{n-1} - x^2 \frac{df_{n-1}}{dx}\right),$$
#
# with the sources $s_1 = D$ and $s_2 = -6 x D$ for $\Lambda$, and $s_1 = -2 (1-x)/(1 - x + x^2/3)$ for $T$.

# %%
assert sp.simplify((slope_along(1, sp.Integer(-1)) - D / x / C).subs(C, 1)) == 0
assert sp.simplify((C_slope * 6 / C).subs(z, C * (1 - x)) * C**2 * x**2 + 6 * x * D) == 0
T_source = (-2 * z / g_of_C).subs(z, C * (1 - x))
assert sp.simplify(T_source * C**2 * x - 2 * (1 - x) / (1 - x + x**2 / 3)) == 0

# %% [markdown]
# The powers of $x$ determine the coefficients one by one, except for that of $x^{n-1}$ without $L$, which is free. The
# only singularities are those of $1 - x + x^2/3$, at $\lvert x \rvert = \sqrt{3}$: the series converge at the start,
# $x = 1$, where $L = \ln C = \ln W$. (Derivation 10 has these sums in closed form, for $n = 1, 2$.)
#
# The expansions near the turning point determine the free coefficient, of $C^{p-n} (C x)^0$: put $z = C (1-x)$ and
# $\sigma = 1 + \omega h(x)$, $\omega = C x$, and expand in $1/C$ at fixed large $\omega$. For $\Lambda$ and $n = 2$:

# %%
omega, c = sp.symbols("omega c", positive=True)  # c = 1/C
h = (1 - x + x**2 / 3) / (1 - x) ** 2
assert sp.simplify(s_of_g.subs(g, g_of_C).subs(z, C * (1 - x)) - 1 - C * x * h) == 0
inside = {z: (1 - omega * c) / c, s: 1 + omega * h.subs(x, omega * c)}
log_J = (sp.log(s) + q[0] / z).subs(inside, simultaneous=True)
log_J = sp.expand(sp.series(log_J, c, 0, 2).removeO())
constant_1 = sp.series(log_J.coeff(c, 1), omega, sp.oo, 2).removeO()
match_2 = sp.expand(sp.expand(constant_1).coeff(omega, 0))
print("the free coefficient in f_2 of Lambda:", match_2)


# %% [markdown]
# $f_2$ by hand: $f_1 = L + F(x) - 1$ with $x F' = D - 1$. The sums at $x = 1$, and the time's first one, must be those
# of derivation 10: with $\lambda$, $A$ and $B$ from there, $\lambda + A - 1$, $1 + B - 7 A$, and
# $-2 (\lambda + A + \frac{3}{2})$.

# %%
TERMS = 60
D_j = sp.Poly(sp.series(D, x, 0, TERMS).removeO(), x).all_coeffs()[::-1]
F_j = [0, *(D_j[j] / j for j in range(1, TERMS))]
inner = [D_j[j] - (j - 1) * F_j[j - 1] + (6 if j == 1 else 0) if j else D_j[0] for j in range(TERMS)]
right_2 = [-sum(D_j[i] * inner[j - i] for i in range(j + 1)) for j in range(TERMS)]
assert right_2[1] == 0  # no logarithm in f_2
by_hand = sum(match_2 if j == 1 else right_2[j] / (j - 1) for j in range(TERMS))

A = sp.log(3) / 2 - sp.pi / (2 * sp.sqrt(3)) - sp.Rational(3, 2)
B = sp.Rational(7, 2) * (sp.log(3) + sp.pi / sp.sqrt(3)) - sp.Rational(93, 4)
lam = sp.Symbol("lambda")
assert abs(sp.N(by_hand - (1 + B - 7 * A), 30)) < 1e-12  # 3^(-TERMS/2)


def same(computed, formula):
    """Assert that a polynomial in balls has the coefficients of a formula in lambda."""
    wanted = sp.Poly(formula, lam).all_coeffs()[::-1]
    found = [to_mpf(ball) for ball in computed.coeffs()]
    with mp.workdps(40):
        expected = [mp.mpf(sp.N(coefficient, 40)) for coefficient in wanted]
        assert len(found) == len(expected)
        assert all(abs(a - b) < mp.mpf(10) ** -28 for a, b in zip(found, expected, strict=True))


constant, time = way_in(3, 30)
same(constant[0], lam + A - 1)
same(constant[1], 1 + B - 7 * A)
same(time[0], -2 * (lam + A + sp.Rational(3, 2)))

# %% [markdown]
# ## $v_\ast \to \infty$: the results
#
# $\Lambda$ is the same at the start, at the turning point and at the end. In $y = Z/W$, and in $y = z_e/W$, with
# $u = 1/W$,
#
# $$y = 1 + u \left(6 \ln y + \ln J - \sigma - \sum u^{n-1} f_n(1)\right),$$
#
# which gains one order in every iteration. Then $\varepsilon = 3 u (z_e/W)^2$, $x_\text{max} = Z^2/(4 v_\ast^8)$ and
# $\tau_c = v_\ast^2 T$, $v_\ast^{10} = w = W^3/12$. The first terms are those of derivation 10:

# %%
S, U = 2 * lam + A - 1 - sp.log(2), -10 * lam + 2 * A - B + 5 * sp.log(2) + 5
large = viscous(3, 30)
same(large["epsilon"].polynomials[1], sp.expand(-2 * S))
same(large["epsilon"].polynomials[2], sp.expand(S**2 + 2 * U))
same(large["x_max"].polynomials[1], -2 * (lam + A))
same(large["x_max"].polynomials[2], sp.expand((lam + A) ** 2 + 2 * (A - 6 * lam - B)))
same(large["tau_c"].polynomials[0], 2 * (2 * lam + A + sp.Rational(3, 2) - sp.log(2)))
W = sp.Symbol("W", positive=True)
assert sp.simplify((W**3 / 12) ** sp.Rational(1, 3) * 12 ** sp.Rational(1, 3) - W) == 0

# %% [markdown]
# The first omitted terms: powers of the logarithm in the coefficients of $W^{-n}$, and the factors of the highest
# power. For $\varepsilon$ and $x_\text{max}$ the power is one less from $n = 3$ on; the error of three terms is of
# order $\lambda^2/W^3$.

# %%
for name, expansion in viscous(6, 30).items():
    powers = [p.degree() for p in expansion.polynomials]
    factors = [mp.nstr(to_mpf(p.coeffs()[-1]), 6) for p in expansion.polynomials]
    print(name, "to 1/W^6: lambda to the powers", *powers, " with the factors", *factors)
    assert powers == {"epsilon": [0, 1, 2, 2, 3, 4, 5], "x_max": [0, 1, 2, 2, 3, 4, 5]}.get(
        name, list(range(powers[0], powers[0] + 7))
    )


def quotients(name, expansion, at, digits):
    """(exact - sum of the first n terms)/(first omitted term) for n = 1, 2, …."""
    collision = exact.collision(at, digits)
    with working(200):
        terms = expansion.terms(collision.v_star)
        value, total, found = collision.balls()[name], 0, []
        for term, omitted in pairwise(terms):
            total += term
            found.append(float(((value - total) / omitted).mid()))
        return found


for name in ("epsilon", "x_max", "tau_c"):
    for at in ("100", "1000"):
        found = quotients(name, large[name], at, 45)
        print(name, f"at v* = {at}, difference over first omitted term, less 1:", *(f"{q - 1:.1e}" for q in found))
        assert all(abs(value - 1) < 1e-3 for value in found)

# %% [markdown]
# ## $v_\ast \to 0$: the duration
#
# In the units of the turning point (derivation 3) $x = x_\text{max} r^2$,
# $\lvert \dot{x} \rvert = \sqrt{4/5} x_\text{max}^{5/4} g$, so
# $d\tau = dx/\lvert \dot{x} \rvert = \sqrt{5} x_\text{max}^{-1/4} r dr/g$. Loading takes $D(K) = \int_0^1 r dr/g$,
# unloading $D(-K)$ up to $r = 0$, but contact ends earlier. In the units of the end (derivation 5,
# $r = \sqrt{K U H} p$, $g = U H k(p)$) the difference is $K \int_0^1 p dp/k$:
#
# $$\tau_c = \sqrt{5} x_\text{max}^{-1/4} (D(K) + D(-K) - K R(\mu)), \qquad R = \int_0^1 \frac{p dp}{k}, \qquad
# \mu = \frac{4}{5} v_\ast^5 \sqrt{\varepsilon}.$$

# %%
r, X, K, Um, H, P = sp.symbols("r X K U H p", positive=True)
G, k = sp.Function("g")(r), sp.Function("k")(P)
rate = sp.simplify((X * r**2).diff(r) / (sp.sqrt(sp.Rational(4, 5)) * X ** sp.Rational(5, 4) * G))
assert sp.simplify(rate - sp.sqrt(5) * X ** sp.Rational(-1, 4) * r / G) == 0
r_p = sp.sqrt(K * Um * H) * P
assert sp.simplify(r_p * r_p.diff(P) / (Um * H * k) - K * P / k) == 0

# %% [markdown]
# With $y = 1 - r$, $g_n = y^{(n+1)/2} f_n(y)$, $f_n$ analytic for $\lvert y \rvert < 2 \sin(\pi/5) = 1.17\dots$: so
# $G_n$ and $D_n$ are sums of Taylor coefficients at $y = 1$. With $e_n$ the coefficients of $1/f$,
# $2 f_0 f_n = p_n - \sum_{0 < i < n} f_i f_{n-i}$, and $D_n = \int y^{(n-1)/2} r e_n dy$; the factors in the integrals
# are

# %%
y, N = sp.symbols("y n", positive=True)
c_j, j = sp.symbols("c_j j", positive=True)
work = sp.integrate(5 * c_j * y ** (N / 2 + j), (y, 0, y))  # of g_(n-1) r^2, with c_j from f_(n-1) r^2
assert sp.simplify(work - 10 * c_j / (N + 2 + 2 * j) * y ** (N / 2 + 1 + j)) == 0
ends, times = turning_point_series(4, 30)
with mp.workdps(30):
    closed_G = [
        1,
        *(mp.mpf(sp.N(f(), 40)) for f in (symbolic.g_1_at_0, symbolic.g_2_at_0, symbolic.g_3_at_0)),
    ]
    assert all(abs(to_mpf(G_n) - c) < mp.mpf(10) ** -28 for G_n, c in zip(ends, closed_G, strict=False))
    assert abs(to_mpf(times[0]) - mp.beta(mp.mpf(2) / 5, mp.mpf(1) / 2) / 5) < mp.mpf(10) ** -28

# %% [markdown]
# $D_1$ and $D_2$ by quadrature, $2 g_0 g_1 = P_1$, $2 g_0 g_2 = P_2 - g_1^2$, $P_n = 5 \int_r^1 g_{n-1} s^2 ds$ ($P_1$
# is an incomplete Beta function); $D_1 = -\int r g_1/g_0^2$, $D_2 = \int r (g_1^2/g_0^3 - g_2/g_0^2)$, with
# $r = 1 - q^2$ to remove the root at $r = 1$:

# %%


def g_0(r):
    return mp.sqrt(1 - r**5)


def g_1(r):
    return mp.betainc(mp.mpf(3) / 5, mp.mpf(3) / 2, r**5, 1) / (2 * g_0(r))


def in_root(function, r=0):
    """The integral of function from r to 1."""
    return quad(lambda q: function(1 - q**2) * 2 * q, [0, mp.sqrt(1 - r)], method="gauss-legendre", maxdegree=4)


def second(r):
    g_2 = (5 * in_root(lambda s: g_1(s) * s**2, r) - g_1(r) ** 2) / (2 * g_0(r))
    return r * (g_1(r) ** 2 / g_0(r) ** 3 - g_2 / g_0(r) ** 2)


with mp.workdps(15):
    by_quadrature = [in_root(lambda r: -r * g_1(r) / g_0(r) ** 2), in_root(second)]
    print("D_1, D_2 =", *(mp.nstr(to_mpf(D_n), 15) for D_n in times[1:3]), " by quadrature", *by_quadrature)
    assert all(abs(a - to_mpf(b)) < 1e-9 for a, b in zip(by_quadrature, times[1:3], strict=True))

# %% [markdown]
# $K$ follows from $\kappa = (5/4)^{2/5} K V(K)^{1/5}$ by reversion, and $x_\text{max} = (5/4)^{2/5} V(K)^{-4/5}$. The
# first terms, with $\lambda_1 = 2 (4/5)^{2/5} G_1$ and $D_0 = B(2/5, 1/2)/5$, and those of the inverse
# $v_\ast(\varepsilon)$, are:

# %%
kappa, G_1, D_0, root = sp.symbols("kappa G_1 D_0 root", positive=True)  # root = (1 - eps)^(1/2)
scale = sp.Rational(5, 4) ** sp.Rational(2, 5)
depth = scale * (1 - sp.Rational(4, 5) * G_1 * kappa / scale)
duration = sp.sqrt(5) * depth ** sp.Rational(-1, 4) * (2 * D_0 - kappa / scale / 2)
duration = sp.series(duration, kappa, 0, 2).removeO()
lambda_1, v = sp.symbols("lambda_1 v", positive=True)
loss = lambda_1 * v**2 - sp.Rational(3, 5) * lambda_1**2 * v**4 - sp.Rational(4, 15) * v**5  # 1 - eps: h_2, h_4, h_5
inverse = (
    root
    / sp.sqrt(lambda_1)
    * (1 + sp.Rational(3, 10) * root**2 + sp.Rational(2, 15) * lambda_1 ** sp.Rational(-5, 2) * root**3)
)
back = sp.expand(loss.subs(v, inverse))
assert [sp.simplify(back.coeff(root, power)) for power in (2, 3, 4, 5)] == [1, 0, 0, 0]
values = {
    G_1: symbolic.g_1_at_0(),
    D_0: sp.beta(sp.Rational(2, 5), sp.Rational(1, 2)) / 5,
    lambda_1: symbolic.lambda_1(),
}
wanted = {
    "one_minus_epsilon": [loss.coeff(v, power) for power in (2, 4, 5)],
    "x_max": [sp.expand(depth).coeff(kappa, power) for power in (0, 1)],
    "tau_c": [sp.expand(duration).coeff(kappa, power) for power in (0, 1)],
}
small, closed = elastic(6, 30), elastic_in_closed_form(30)
for name, formulas in wanted.items():
    for i, formula in enumerate(formulas):
        number = mp.mpf(sp.N(formula.subs(values), 40))
        for expansion in (small, closed):
            assert abs(to_mpf(expansion[name].coefficients[i][1]) / number - 1) < mp.mpf(10) ** -14

# %% [markdown]
# The other coefficients are compared with the series (derivations 6 and 7), and with numbers, as above:

# %%
h_k = series(12, 30).h
with working(200):
    assert all((c + h_k[power]).contains(0) for power, c in small["one_minus_epsilon"].coefficients)
for name in ("one_minus_epsilon", "x_max", "tau_c"):
    found = quotients(name, small[name], "1e-4", 55)
    print(name, "at v* = 1e-4, difference over first omitted term, less 1:", *(f"{q - 1:.1e}" for q in found))
    assert all(abs(value - 1) < 5e-3 for value in found)

# %%
print("derived: expansions to any order at both ends, by a constant of the motion and by the turning point's series")
