# %% [markdown]
# # 5. The end of contact: a universal rational series
#
# Contact ends where the force vanishes, $\ddot{x} = 0$ (the paper's Eq. 6), before $x = 0$ is reached. The difference
# between $\varepsilon$ there and $\varepsilon_0$ at $x = 0$ depends on only one number, and its series has rational
# coefficients: $\varepsilon = \varepsilon_0 H(\frac{4}{5} v_\ast^5 \sqrt{\varepsilon_0})$. $H$ is computed in two ways.

# %%
from fractions import Fraction

import sympy as sp
from mpmath import findroot, mp, odefun
from sympy.polys.ring_series import rs_pow, rs_trunc

from viscopade.theory import equation, symbolic
from viscopade.theory.series import end_series

g, r, K = symbolic.g, symbolic.r, symbolic.K
U, V = sp.symbols("U V", positive=True)  # V(-K) and V(K)
delta, mu, s, p, q = sp.symbols("delta mu s p q", positive=True)
h = sp.Function("h")
k = sp.Function("k")

# %% [markdown]
# ## Units of the end
#
# On the way out $g \to U$ at $r = 0$, and the viscous force is comparable with the elastic one where $r^4 = K g r^2$.
# Hence $g = U h(s)$, $r = \sqrt{K U} s$ with $h(0) = 1$.

# %%
Kp = sp.Symbol("K", positive=True)
unloading = symbolic.turning_point_equation().rhs.subs(K, -Kp)
scale_r = sp.sqrt(Kp * U)
slope = unloading.subs(g, U * h(s)).subs(r, scale_r * s) * scale_r / U**2  # d(h^2)/ds
delta_of_K = Kp ** sp.Rational(5, 2) * sp.sqrt(U)
assert sp.simplify(slope - delta_of_K * (-5 * s**4 + 5 * h(s) * s**2)) == 0
print("d(h^2)/ds = 5 delta (h s^2 - s^4), delta =", delta_of_K)

# %% [markdown]
# Integrated:
#
# $$h^2 = 1 - \delta s^5 + 5 \delta \int_0^s h q^2 dq.$$
#
# This is a regular initial value problem; with $h = \sum \delta^j h_j(s)$, every $h_j$ is a polynomial.
#
# The force vanishes where $x^{3/2} = -\kappa \dot{x} \sqrt{x}$, that is $x = \kappa \lvert \dot{x} \rvert$. In the
# present units:

# %%
scaled = equation.scaled_equation()
x_max, kappa = sp.symbols("x_max kappa", positive=True)
S = sp.sqrt(sp.Rational(4, 5)) * x_max ** sp.Rational(5, 4)
X, speed = sp.symbols("X w", positive=True)
force = scaled.lhs.subs(scaled.x.diff(scaled.tau, 2), 0).subs(scaled.x.diff(scaled.tau), -speed)
force = force.subs(scaled.x, X).subs(scaled.kappa, kappa)
(x_end,) = sp.solve(force, X)
assert x_end == kappa * speed
kappa_of_K = sp.sqrt(sp.Rational(5, 4)) * Kp * x_max ** sp.Rational(-1, 4)
end = (x_max * r**2 - x_end.subs(speed, S * U * h(s))).subs(kappa, kappa_of_K).subs(r, scale_r * s)
assert sp.simplify(end / (x_max * Kp * U) - (s**2 - h(s))) == 0
print("contact ends where s^2 = h; there eps/eps0 = h = H(delta)")

# %% [markdown]
# The speed there is $S U H$, and $\varepsilon_0 = S U$: $\varepsilon = \varepsilon_0 H(\delta)$. With
# $\kappa = (5/4)^{2/5} K V^{1/5}$ and $\varepsilon_0 = U/V$, $\delta$ is known from $v_\ast = \sqrt{\kappa}$ and
# $\varepsilon_0$:

# %%
kappa_of_V = sp.Rational(5, 4) ** sp.Rational(2, 5) * Kp * V ** sp.Rational(1, 5)
delta_of_kappa = sp.Rational(4, 5) * sp.sqrt(kappa) ** 5 * sp.sqrt(U / V)
assert sp.simplify(delta_of_kappa.subs(kappa, kappa_of_V) / delta_of_K) == 1
print("delta =", delta_of_kappa.subs(U, V * sp.Symbol("eps0")), " with kappa = v*^2")

# %% [markdown]
# ## First way: the polynomials $h_j(s)$, then the end
#
# $H = h(\sqrt{H})$. At order $\delta^n$ only $H_0, \dots, H_{n-1}$ enter the right side, since $h_0 = 1$. Plain SymPy:

# %%
ORDER = 5
h_j = [sp.Integer(1)]
for j in range(1, ORDER + 1):
    right = sp.integrate(5 * h_j[j - 1] * s**2, s) - (s**5 if j == 1 else 0)
    h_j.append(sp.expand((right - sum(h_j[i] * h_j[j - i] for i in range(1, j))) / 2))
print("h_1 =", h_j[1], "  h_2 =", h_j[2])

_, d = sp.ring("delta", sp.QQ)
H = d**0
for n in range(1, ORDER + 1):
    terms = [(j, m, c) for j in range(1, n + 1) for (m,), c in sp.Poly(h_j[j], s).terms()]
    # s^m = H^(m/2) is needed to one order less, because its factor is delta^j.
    H = 1 + rs_trunc(sum(c * d**j * rs_pow(H, sp.Rational(m, 2), d, n) for j, m, c in terms), d, n + 1)
first = [H.coeff(d**n) for n in range(ORDER + 1)]
print("H =", H)
assert [Fraction(int(c.numerator), int(c.denominator)) for c in first] == list(symbolic.delayed_recovery_series(ORDER))

# %% [markdown]
# ## Second way: in units of the end itself
#
# Let $s = \sqrt{H} p$, $h = H k(p)$, $\mu = \delta \sqrt{H}$. The end is now at $p = 1$, $k = 1$, and $h = 1$ at
# $s = 0$ (that is $x = 0$) becomes $k(0) = 1/H$. The differential equation keeps its form with $\mu$ for $\delta$;
# integrated from the end,
#
# $$k^2 = 1 + \mu \left(1 - p^5 - 5 \int_p^1 k q^2 dq\right).$$

# %%
Hs = sp.Symbol("H", positive=True)
slope_h = delta * (-5 * s**4 + 5 * h(s) * s**2)
slope_k = slope_h.subs(h(s), Hs * k(p)).subs(s, sp.sqrt(Hs) * p) * sp.sqrt(Hs) / Hs**2
assert sp.simplify(slope_k.subs(delta, mu / sp.sqrt(Hs)) - mu * (-5 * p**4 + 5 * k(p) * p**2)) == 0
assert sp.integrate(-5 * q**4, (q, 1, p)) == 1 - p**5

# %% [markdown]
# Again every order $k_j(p)$ is a polynomial, and the end needs no equation to be solved: with $k_0(\mu)$ for $k$ at
# $p = 0$, $H = 1/k_0$ at $\delta = \mu/\sqrt{H} = \mu \sqrt{k_0(\mu)}$. Lagrange's inversion of this $\delta(\mu)$
# yields
#
# $$H_j = \frac{1}{j} [\mu^{j-1}] \left(\frac{1}{k_0}\right)' \left(\frac{\mu}{\delta}\right)^j
# = \frac{1}{j} [\mu^{j-1}] \left(-\frac{k_0'}{k_0^2}\right) k_0^{-j/2}
# = \frac{2}{j (2+j)} [\mu^{j-1}] \left(k_0^{-(2+j)/2}\right)' = \frac{2}{2+j} [\mu^j] k_0^{-(2+j)/2}.$$

# %%
k_0 = sp.Function("k_0", positive=True)(mu)
j = sp.Symbol("j", positive=True)
lagrange = (1 / k_0).diff(mu) * k_0 ** (-j / 2)
assert sp.simplify(lagrange - 2 / (2 + j) * (k_0 ** (-(2 + j) / 2)).diff(mu)) == 0

k_j = [sp.Integer(1)]
for n in range(1, ORDER + 1):
    right = (1 - p**5 if n == 1 else 0) - sp.integrate(5 * k_j[n - 1] * p**2, (p, p, 1))
    k_j.append(sp.expand((right - sum(k_j[i] * k_j[n - i] for i in range(1, n))) / 2))
k_at_0 = sum(mu**n * k_n.subs(p, 0) for n, k_n in enumerate(k_j))
print("k_0 =", k_at_0)
second = [
    sp.Rational(2, 2 + n) * (k_at_0 ** sp.Rational(-(2 + n), 2)).series(mu, 0, n + 1).removeO().expand().coeff(mu, n)
    for n in range(ORDER + 1)
]
assert first == second

# %% [markdown]
# In terms of the result, $\mu = \delta \sqrt{H} = \frac{4}{5} v_\ast^5 \sqrt{\varepsilon}$:
# $\varepsilon_0 = \varepsilon k_0(\frac{4}{5} v_\ast^5 \sqrt{\varepsilon})$.

# %%
eps0 = sp.Symbol("epsilon_0", positive=True)
mu_of_eps = sp.Rational(4, 5) * sp.sqrt(kappa) ** 5 * sp.sqrt(eps0 * Hs)
assert sp.simplify(delta_of_kappa.subs(U, V * eps0) * sp.sqrt(Hs) - mu_of_eps) == 0

# %% [markdown]
# ## Both ways in src, to higher order, and a check in numbers
#
# `viscopade.theory.symbolic.delayed_recovery_series` takes the first way, `viscopade.theory.series.end_series` the
# second. Then one point of $H$ by direct integration: in a time $t$ with $ds/dt = h$ the equation is the smooth system
# $s' = h$, $h' = \frac{5}{2} \delta (h s^2 - s^4)$, from $s = 0$, $h = 1$ to $s^2 = h$.

# %%
HIGH = 32
coefficients = symbolic.delayed_recovery_series(HIGH)
assert coefficients == end_series(HIGH)
assert coefficients[:4] == (1, Fraction(1, 3), Fraction(13, 96), Fraction(4897, 82368))

with mp.workdps(20):
    d = mp.mpf(1) / 5
    path = odefun(lambda _, y: [y[1], 5 * d / 2 * (y[1] * y[0] ** 2 - y[0] ** 4)], 0, [0, 1])
    direct = path(findroot(lambda t: path(t)[0] ** 2 - path(t)[1], 1))[1]
    summed = mp.fsum(mp.mpf(c.numerator) / c.denominator * d**n for n, c in enumerate(coefficients))
    last = mp.mpf(coefficients[-1].numerator) / coefficients[-1].denominator * d**HIGH
    print("H(1/5) =", mp.nstr(direct, 15), " by its series", mp.nstr(summed, 15), " last term", mp.nstr(last, 2))
    assert abs(direct - summed) < 2 * abs(last) + mp.mpf(10) ** -15

print(f"derived: eps = eps0 H((4/5) v*^5 sqrt(eps0)), H in two ways, rational to order {HIGH}")
