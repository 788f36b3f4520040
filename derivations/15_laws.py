# %% [markdown]
# # 15. Any power-law contact: one parameter for $\varepsilon$
#
# The paper's law is one member of the family
#
# $$m \ddot{\xi} + k \xi^a + c \xi^b \dot{\xi} = 0.$$
#
# This file derives the scaled equation of every member. It shows that $\varepsilon$ knows $a$ and $b$ through
# $\nu = (a+1)/(b+1)$ alone, and that derivations 03 to 08 and 11 hold for all of them with other integers in place of
# 5, 3 and 2.

# %%
from fractions import Fraction

import sympy as sp
from mpmath import mp, mpf

from viscopade.collision import exact
from viscopade.theory import symbolic
from viscopade.theory.equation import rational
from viscopade.theory.law import ENDS, law_of
from viscopade.theory.series import end_series, lambda_coefficients

a, k, c, m, v, x, y, w, K, kappa = sp.symbols("a k c m v x y w K kappa", positive=True)
b = sp.Symbol("b", nonnegative=True)
nu = (a + 1) / (b + 1)
NAMES = ("viscoelastic", "linear", "tsuji", "hunt-crossley", "kelvin-voigt:1", "3/2,0", "3/2,1", "5/4,1/4", "1,2")


def vanishes(expression):
    """Whether an expression in positive symbols is zero."""
    return sp.simplify(sp.powsimp(sp.expand_power_base(sp.powdenest(expression, force=True), force=True))) == 0


# %% [markdown]
# ## The scaled equation
#
# Lengths in units of $X$, times in units of $T$ with $X/T = v$, so that $\dot{x}(0) = 1$; the coefficient of $x^a$
# becomes 1.

# %%
T = (m / k) ** (1 / (a + 1)) * v ** ((1 - a) / (1 + a))
X = v * T
assert vanishes(sp.log(k * X**a * T**2 / (m * X)).expand(force=True))
kappa_of_v = c * X**b * T / m
wanted = (c / m) * (k / m) ** (-1 / nu) * v ** (2 / nu - 1)
assert vanishes(sp.expand(sp.expand_log(sp.log(kappa_of_v / wanted), force=True)))
print("kappa =", wanted)

# %% [markdown]
# ## One parameter
#
# As functions of $x$, with $w = \dot{x}$, the motion obeys $w dw/dx = -x^a - \kappa x^b w$. Let $Y = \alpha x^{b+1}$.

# %%
alpha = (b + 1) ** (-1 / nu)
dY_dx = alpha * (b + 1) * x**b
Y = alpha * x ** (b + 1)
elastic, viscous = x**a / dY_dx, kappa * x**b / dY_dx  # of w dw/dY = -elastic - viscous w
assert vanishes(sp.expand(sp.expand_log(sp.log(elastic / Y ** (nu - 1)), force=True)))
K_of_kappa = kappa * (b + 1) ** (1 / nu - 1)
assert vanishes(sp.expand(sp.expand_log(sp.log(viscous / K_of_kappa), force=True)))
# So w dw/dY = -Y^(nu-1) - K w, w(0) = 1: neither a nor b is left, and x'' = 0 is Y^(nu-1) + K w = 0, x = 0 is Y = 0.
print("K =", K_of_kappa)

# %% [markdown]
# ## Any monotone force
#
# Nothing above needs a power of $\xi$. Let $Y(\xi)$ rise from $Y(0) = 0$, let the elastic energy be $C Y^\nu/\nu$ and
# the damping force $c dY/dt$: $m \ddot{\xi} + C Y^{\nu-1} Y' + c Y' \dot{\xi} = 0$, where $Y' = dY/d\xi$. With
# $u = \dot{\xi} = v w$ and $Y = Y_0 y$:

# %%
C, Y_0, u, dY_dxi, N = sp.symbols("C Y_0 u dY_dxi N", positive=True)
slope_of_u = -(C * (Y_0 * y) ** (N - 1) + c * u) * dY_dxi / m  # u du/dxi
slope_of_w = slope_of_u.subs(u, v * w) / dY_dxi * Y_0 / v**2  # w dw/dy
scale, K_of_Y = (m * v**2 / C) ** (1 / N), (c / m) * (m / C) ** (1 / N) * v ** (2 / N - 1)
assert vanishes(slope_of_w.subs(Y_0, scale) + y ** (N - 1) + K_of_Y * w)
# So eps = E_nu(K) for both ends. Any monotone elastic force F fits any nu: Y is (nu U/C)^(1/nu), U the integral of F.
# nu = 2, Y = sqrt(2 U/C), makes eps independent of the speed (Feng 2026). Here nu = 3, Y = sinh(xi), and no power law:
with mp.workdps(20):
    force = lambda xi, u_: mp.cosh(xi) * (mp.sinh(xi) ** 2 + mpf("0.7") * u_)  # noqa: E731 of m = C = 1
    motion = mp.odefun(lambda _, q_: [q_[1], -force(*q_)], 0, [mpf(0), mpf(2)])
    end_time = mp.findroot(lambda t_: force(*motion(t_)), (mpf("1.4"), mpf("1.6")), solver="anderson")
    by_force = -motion(end_time)[1] / 2
    kappa_there = mpf("0.7") * mpf(2) ** (mpf(2) / 3 - 1)
    by_law = exact.collision(kappa=kappa_there, digits=20, law="2,0").mpf()["epsilon"]
    print("Y = sinh(xi), nu = 3: eps =", mp.nstr(by_force, 15), "and E_3(K) =", mp.nstr(by_law, 15))
    assert abs(by_force / by_law - 1) < mpf(10) ** -15

# %% [markdown]
# ## The turning point (derivation 03)
#
# With $Y = Y_\text{max} y$, $y = r^{n_b}$, and $w = \sqrt{2/\nu} Y_\text{max}^{\nu/2} g$, $\nu = n_a/n_b$:

# %%
n_a, n_b, K_r, Y_max, r, g = sp.symbols("n_a n_b K_r Y_max r g", positive=True)
of_nu = n_a / n_b
speed = sp.sqrt(2 / of_nu) * Y_max ** (of_nu / 2)
K_there = (
    sp.sqrt(of_nu / 2) * K_r * Y_max ** (of_nu / 2 - 1)
)  # the K of E_nu by K_r, the K of the turning point equation
# d(g^2)/dr = 2 w dw/dY (dY/dr)/speed^2
slope = -2 * ((Y_max * r**n_b) ** (of_nu - 1) + K_there * speed * g) * Y_max * n_b * r ** (n_b - 1) / speed**2
assert vanishes(
    sp.expand(sp.powsimp(sp.expand(slope + n_a * r ** (n_a - 1) + n_a * K_r * g * r ** (n_b - 1)), force=True))
)
for name in NAMES:  # `symbolic` makes it from the scaled equation of each law
    law = law_of(name)
    r_, K_, g_ = symbolic.r, symbolic.K, symbolic.g
    right = -law.n_a * r_ ** (law.n_a - 1) - law.n_a * K_ * g_ * r_ ** (law.n_b - 1)
    assert sp.expand(symbolic.turning_point_equation(law).rhs - right) == 0

# w(0) = 1 is V = g(0) = 1/speed, which gives Y_max, and kappa as a function of K_r:
V = sp.Symbol("V", positive=True)
(found,) = sp.solve(sp.Eq(sp.log(V) + sp.expand_log(sp.log(speed), force=True), 0), sp.log(Y_max))
log_kappa = sp.expand_log(sp.log(K_there), force=True).subs(sp.log(Y_max), found) - sp.log((b + 1) ** (1 / nu - 1))
n_values = {n_a: sp.Symbol("N", positive=True) * (a + 1), n_b: sp.Symbol("N", positive=True) * (b + 1)}
claimed = sp.log(((a + 1) / 2) ** (1 - 1 / nu) * K_r * V ** (2 / nu - 1))
difference = sp.expand_log(log_kappa - claimed, force=True).subs(n_values)
assert sp.simplify(sp.expand(sp.expand_log(difference, force=True))) == 0
print("kappa = ((a+1)/2)^(1-1/nu) K V(K)^(2/nu-1)")

# %% [markdown]
# ## Time reversal (derivation 06)
#
# Unloading is loading with $-K$, so $\varepsilon_0 = V(-K)/V(K)$. Put $\ln V = E + O$, even and odd.
# $\ln \varepsilon_0 = -2 O$ changes its sign with $K$. So does $\kappa \varepsilon_0^c$, if $c$ is such that
# $V(K)^{2/\nu-1} \varepsilon_0^c$ is even:

# %%
E, odd, c_ = sp.symbols("E O c", real=True)
exponent = (2 / nu - 1) * (E + odd) + c_ * (-2 * odd)
(c_found,) = sp.solve(sp.Eq(exponent.subs(odd, -odd), exponent), c_)
assert sp.simplify(c_found - (1 / nu - sp.Rational(1, 2))) == 0
print("ln eps0 is an odd function of kappa eps0^(1/nu - 1/2)")

# lambda_1 = 2 G_1/((a+1)/2)^(1-1/nu), and 2 g_0 g_1 = n_a int_r^1 g_0 s^(n_b-1) ds. With t = s^n_a, G_1 is
# B(1/nu, 3/2)/2.
for name in NAMES:
    law = law_of(name)
    with mp.workdps(30):
        nodes = [0, mpf("0.5"), 1]
        G_1 = mp.quad(lambda s: law.n_a * mp.sqrt(1 - s**law.n_a) * s ** (law.n_b - 1) / 2, nodes)  # noqa: B023
        scale = mp.mpf(law.kappa_scale[0].numerator) / law.kappa_scale[0].denominator
        power = mp.mpf(law.kappa_scale[1].numerator) / law.kappa_scale[1].denominator
        by_quadrature = 2 * G_1 / scale**power
        closed = sp.lambdify([], symbolic.lambda_1(law), "mpmath")()
        proven = lambda_coefficients(1, 20, law)[0]
        assert abs(closed / by_quadrature - 1) < mpf(10) ** -12
        assert abs(mp.mpf(proven.mid().str(25, radius=False)) / closed - 1) < mpf(10) ** -19
assert symbolic.lambda_1("linear") == sp.pi / 2
assert symbolic.lambda_1("hunt-crossley") == sp.Rational(2, 3)

# %% [markdown]
# ## Delayed recovery (derivation 05)
#
# For $\nu > 1$ the force vanishes before $Y = 0$. Near the end of unloading, with $U = V(-K)$, $g = U h$ and
# $r = (K U)^{1/d} s$, $d = n_a - n_b$, every term of the turning point equation has one factor, $\delta$:

# %%
U, s, h = sp.symbols("U s h", positive=True)
d = n_a - n_b
r_of_s = (K_r * U) ** (1 / d) * s
in_s = (-n_a * r_of_s ** (n_a - 1) + n_a * K_r * U * h * r_of_s ** (n_b - 1)) * (K_r * U) ** (1 / d) / U**2
delta = (K_r * U) ** (n_a / d) / U**2
wanted = delta * n_a * (-(s ** (n_a - 1)) + h * s ** (n_b - 1))
for numbers in ((5, 3), (2, 1), (3, 2), (5, 2), (5, 4), (9, 5)):
    values = dict(zip((n_a, n_b), numbers, strict=True))
    assert sp.simplify(sp.expand(sp.powsimp(sp.expand((in_s - wanted).subs(values)), force=True))) == 0
# The force vanishes at s^d = h. In kappa and eps0, delta = 2/(a+1) kappa^(n_a/d) eps0^((2 n_b - n_a)/d):
log_delta = sp.expand_log(sp.log(delta), force=True)
log_k = sp.expand_log(sp.log(kappa / (((a + 1) / 2) ** (1 - 1 / nu) * V ** (2 / nu - 1))), force=True)
log_delta = log_delta.subs(sp.log(K_r), log_k).subs(n_values)
claimed = sp.log(2 / (a + 1)) + nu / (nu - 1) * sp.log(kappa) + (2 - nu) / (nu - 1) * (sp.log(U) - sp.log(V))
assert sp.simplify(sp.expand_log(log_delta - claimed, force=True)) == 0

# With mu = (nu/2) delta and p = s^n_b it is h h' = -mu (p^(nu-1) - h). To first order h = 1 + mu (p - p^nu/nu), the end
# is p = 1, and H_nu = 1 + (1 - 1/nu) mu + ….
p, n = sp.symbols("p n", positive=True)
first = sp.integrate(1 - p ** (n - 1), (p, 0, p))
assert sp.simplify(first - (p - p**n / n)) == 0
assert sp.simplify(first.subs(p, 1) - (1 - 1 / n)) == 0
for name in NAMES:
    law = law_of(name)
    H = end_series(8, law)
    assert symbolic.delayed_recovery_series(8, law) == H
    if law.delayed:
        assert H[1] == (1 - 1 / law.nu) * law.nu / 2

# eps = eps0 H(delta) and eps0 in integer powers of kappa: all in powers of v* = kappa^(1/d).
for name in NAMES:
    law = law_of(name)
    print(f"{name:16} nu = {law.nu!s:4} v* = kappa^(1/{law.d}), h_k to v*^{2 * law.n_a}:", end=" ")
    print([j for j in range(2 * law.n_a + 1) if symbolic.h_polynomial(j, law) != 0])

# %% [markdown]
# ## Large $\kappa$
#
# Force end, $\nu > 1$: loading is $w = 1 - K Y$ but for little, so $Y_\text{max} \to 1/K$. In unloading
# $w = Y^{\nu-1}/K$ at once, and there the force vanishes: $\varepsilon = Y_\text{max}^{\nu-1}/K$.

# %%
limit = sp.powsimp((1 / K) ** (n - 1) / K, force=True)
assert sp.simplify(limit - K**-n) == 0
# To which end does the slow motion w = Y^(nu-1)/K lead? It needs no inertia as long as w dw/dY is below Y^(nu-1):
slow = y ** (n - 1) / K
ratio = sp.powsimp(sp.simplify(slow * slow.diff(y) / y ** (n - 1)), force=True)
assert sp.simplify(ratio - (n - 1) * y ** (n - 2) / K**2) == 0
# For nu > 2 the ratio vanishes with Y: the bodies creep towards Y = 0 and do not arrive. For nu < 2 it grows. Inertia
# takes over at Y ~ K^(-2/(2-nu)), where w ~ K Y, and carries the bodies through Y = 0. So the end x = 0 exists for any
# kappa, with eps ~ K^(-nu/(2-nu)). Only for nu >= 2 is there a critical kappa.
at_turnover = K ** (-2 / (2 - n))
assert sp.simplify(sp.expand(sp.expand_log(sp.log(ratio.subs(y, at_turnover) / (n - 1)), force=True))) == 0
assert sp.simplify(sp.expand(sp.expand_log(sp.log(K * at_turnover / K ** (-n / (2 - n))), force=True))) == 0
law = law_of("3/2,1/2", "return")
values = [mp.mpf(exact.collision(kappa=kappa_, digits=15, law=law).decimals()["epsilon"]) for kappa_ in (20, 40)]
print("nu = 5/3, end at x = 0, kappa = 20 and 40: eps =", *(mp.nstr(value, 8) for value in values))
print("their ratio", mp.nstr(values[0] / values[1], 8), "tends to 2^5")
assert abs(values[0] / values[1] / 32 - 1) < mpf(10) ** -6

# %% [markdown]
# ## The flow (derivation 11)
#
# With $r = (x/x_\text{max})^{1/m}$, where $m$ makes $n_a = m (a+1)$ and $n_b = m (b+1)$ whole, $p = g/\sqrt{n_a}$ and
# $k = \sqrt{n_a} K$. The ends $F$ and $P$ give all that `viscopade.collision.exact` computes:

# %%
F, k_, M = sp.symbols("F k_ M", positive=True)
N_a = M * (a + 1)
log_kappa = sp.log(((a + 1) / 2) ** (1 - 1 / nu) * (k_ / sp.sqrt(N_a)) * (sp.sqrt(N_a) * F) ** (2 / nu - 1))
claimed = sp.log((2 * M) ** (1 / nu - 1) * k_ * F ** (2 / nu - 1))
assert sp.simplify(sp.expand(sp.expand_log(log_kappa - claimed, force=True))) == 0
# g = |x'|/(sqrt(2/(a+1)) x_max^((a+1)/2)) and |x'| = 1 at r = 0, where g = sqrt(N_a) F:
x_max = (2 * M * F**2) ** (-1 / (a + 1))
assert (
    sp.simplify(
        sp.expand(sp.expand_log(sp.log(sp.sqrt(2 / (a + 1)) * x_max ** ((a + 1) / 2) * sp.sqrt(N_a) * F), force=True))
    )
    == 0
)
# dtau = dx/|x'|, |x'| = p/F, x = x_max r^M, |dr| = 2 p ds: dtau = 2 M F x_max r^(M-1) ds.
P = sp.Symbol("P", positive=True)
assert sp.simplify(sp.diff(x_max * r**M, r) * 2 * P / (P / F) - 2 * M * F * x_max * r ** (M - 1)) == 0
# u' = 2 p and d(p^2)/du = r^(n_a-1) + k p r^(n_b-1) make p' = r^(n_a-1) + k p r^(n_b-1): the turning point equation.
print("kappa = (2m)^(1/nu-1) k F^(2/nu-1), x_max = (2 m F^2)^(-1/(a+1)), tau_c = 2 m F x_max T")

# %% [markdown]
# ## Closed forms
#
# $\nu = 1$: $w dw/dY = -(1 + K w)$. From first contact to the turning point, and from there to $Y = 0$ with
# $\lvert w \rvert = q$:

# %%
q = sp.Symbol("q", positive=True)
depth_in = sp.integrate(w / (1 + K * w), (w, 0, 1))
depth_out = sp.integrate(q / (1 - K * q), q)
eps = sp.Symbol("epsilon", positive=True)
depth_out = -(q / K) - sp.log(1 - K * q) / K**2  # the integral from 0, for K q < 1
assert sp.simplify(depth_out.diff(q) - q / (1 - K * q)) == 0
assert depth_out.subs(q, 0) == 0
balance = sp.simplify((depth_in - depth_out.subs(q, eps)) * K**2)
assert sp.simplify(sp.expand_log(balance - (K * (1 + eps) - sp.log(1 + K) + sp.log(1 - K * eps)), force=True)) == 0
# So ln((1+K)/(1 - K eps)) = K (1 + eps): sigma = 1 - K eps obeys -sigma e^-sigma = -(1 + K) e^-(1+K), Lambert's W.
with mp.workdps(40):
    for number in ("0.1", "1", "12"):
        K_ = mpf(number)
        sigma = -mp.lambertw(-(1 + K_) * mp.exp(-(1 + K_))).real
        ours = exact.collision(kappa=number, digits=30, law="hunt-crossley:1").mpf()["epsilon"]
        assert abs(ours * K_ / (1 - sigma) - 1) < mpf(10) ** -28

# nu = 2: w dw/dY = -Y - K w is the damped oscillator, K = 2 zeta, of derivation 12.
with mp.workdps(40):
    for end in ENDS:
        for number in ("0.1", "1", "1.9"):
            zeta = mpf(number) / 2
            angle = mp.pi if end == "return" else mp.pi - 2 * mp.asin(zeta)
            ours = exact.collision(kappa=number, digits=30, law=law_of("linear", end)).mpf()["epsilon"]
            assert abs(ours / mp.exp(-zeta * angle / mp.sqrt(1 - zeta**2)) - 1) < mpf(10) ** -28

# Two laws of one nu, at kappas of one K: the same eps, to every digit.
pairs = [("viscoelastic", "2/3,0"), ("tsuji", "linear"), ("kelvin-voigt:1", "1/2,0")]
for one, other in pairs:
    first_law, second_law = law_of(one), law_of(other)
    power = rational(1 - 1 / first_law.nu)
    ratio = (rational(second_law.damping + 1) / rational(first_law.damping + 1)) ** power
    with mp.workdps(40):
        there = mpf("1.3") * mp.mpf(ratio.evalf(40))
        found = [
            exact.collision(kappa="1.3", digits=25, law=first_law).mpf()["epsilon"],
            exact.collision(kappa=there, digits=25, law=second_law).mpf()["epsilon"],
        ]
        assert abs(found[0] / found[1] - 1) < mpf(10) ** -24
assert law_of("kelvin-voigt:2").nu == Fraction(5, 3)

print("derived: the scaled equation, the collapse onto nu, and the chain from the turning point to eps for any law")
