# %% [markdown]
# # 6. Time reversal: half of the coefficients of $\varepsilon_0$ vanish
#
# A time-reversed collision is a collision with negative damping. This maps the pair $(\kappa, \varepsilon_0)$ to
# another one, and in the right variable $\nu$ the logarithm of $\varepsilon_0$ is odd:
#
# $$\ln \varepsilon_0 = -\Lambda(\nu), \qquad \nu = \kappa \varepsilon_0^{1/10}, \qquad
# \Lambda(\nu) = \lambda_1 \nu + \lambda_3 \nu^3 + \dots$$
#
# Here $\varepsilon_0$ ends at $x = 0$, the two half collisions of derivation 3, and $\kappa$ may have any sign: near
# $\kappa = 0$, $\varepsilon_0$ is an analytic function of $\kappa$, by the hierarchy.

# %%
import sympy as sp
from mpmath import findroot, mp, odefun
from sympy.polys.ring_series import rs_exp, rs_log, rs_trunc

from viscopade.theory import equation, symbolic
from viscopade.theory.series import g_coefficients, lambda_coefficients

scaled = equation.scaled_equation()
x, tau, kappa = scaled.x, scaled.tau, scaled.kappa
eps0, a, b, z_value, z_rate = sp.symbols("epsilon_0 a b z z_rate", positive=True)

# %% [markdown]
# ## Time reversal
#
# Let $y(t) = x(\tau_\text{end} - t)$. Then $\dot{y} = -\dot{x}$, $\ddot{y} = \ddot{x}$: the damping changes its sign.
# It starts at $y = 0$ with the speed $\varepsilon_0$ and ends at $y = 0$ with the speed 1. In units $a$ of length and
# $b$ of time, $y(t) = a z(t/b)$, it starts with the speed 1, as in the scaled problem, and the elastic coefficient must
# be 1 again.

# %%
z = sp.Function("z", nonnegative=True)
sigma = sp.Symbol("sigma", real=True)
backwards = scaled.lhs.subs(kappa, -kappa)  # for y, with the same names
in_units = (
    backwards.subs(x.diff(tau, 2), a / b**2 * z(sigma).diff(sigma, 2))
    .subs(x.diff(tau), a / b * z(sigma).diff(sigma))
    .subs(x, a * z(sigma))
)
in_units = sp.expand(sp.powdenest(sp.expand_power_base(sp.expand(in_units * b**2 / a))))
elastic = in_units.coeff(sp.sqrt(z(sigma)) ** 3)
damping = in_units.coeff(z(sigma).diff(sigma) * sp.sqrt(z(sigma)))
print("backwards:", in_units, "= 0")

b_of_a = a / eps0  # the initial speed a/b z' is eps0 with z' = 1
roots = sp.solve(sp.Eq(elastic.subs(b, b_of_a), 1), a)
(length,) = [root for root in roots if root.is_positive]  # the other fifth roots are complex
kappa_mirror = sp.powsimp(damping.subs(b, b_of_a).subs(a, length))
eps0_mirror = 1 / (a / b).subs(b, b_of_a)  # the final speed is 1 = a/b |z'|
print("a =", length, "  kappa ->", kappa_mirror, "  eps0 ->", eps0_mirror)
assert sp.simplify(kappa_mirror + kappa * eps0 ** sp.Rational(1, 5)) == 0
assert eps0_mirror == 1 / eps0

# %% [markdown]
# So if $\varepsilon_0$ belongs to $\kappa$, $1/\varepsilon_0$ belongs to $-\kappa \varepsilon_0^{1/5}$. The map is an
# involution, and it changes the sign of both $\ln \varepsilon_0$ and $\nu = \kappa \varepsilon_0^{1/10}$, which is the
# geometric mean of $\kappa$ and $\lvert \kappa \rvert$ of the mirror image. Near $\nu = 0$, $\ln \varepsilon_0$ is a
# function of $\nu$, $\ln \varepsilon_0 = -\Lambda(\nu)$, and for the mirror image this says
# $-\ln \varepsilon_0 = -\Lambda(-\nu)$. $\Lambda$ is odd.


# %%
def mirror(pair):
    return tuple(c.subs({kappa: pair[0], eps0: pair[1]}, simultaneous=True) for c in (kappa_mirror, eps0_mirror))


def nu(pair):
    return pair[0] * pair[1] ** sp.Rational(1, 10)


start = (kappa, eps0)
assert [sp.simplify(c / d) for c, d in zip(mirror(mirror(start)), start, strict=True)] == [1, 1]
assert sp.simplify(nu(mirror(start)) / nu(start)) == -1
assert sp.simplify(nu(start) ** 2 + kappa * kappa_mirror) == 0

# %% [markdown]
# ## The same from $V(K)$
#
# With $\varepsilon_0 = V(-K)/V(K)$ and $\kappa = (5/4)^{2/5} K V(K)^{1/5}$, $\ln \varepsilon_0$ is odd in $K$ at once,
# and so is $\nu = (5/4)^{2/5} K (V(K) V(-K))^{1/10}$: the mirror image of $K$ is $-K$. Let $\ln V = E + O$, even and
# odd:
#
# $$\Lambda = 2 O(K), \qquad \nu = \left(\frac{5}{4}\right)^{2/5} K \exp\left(\frac{E(K)}{5}\right).$$

# %%
K, E, odd, V, U = sp.symbols("K E O V U", positive=True)
c = sp.Rational(5, 4) ** sp.Rational(2, 5)
nu_of_V = nu((c * K * V ** sp.Rational(1, 5), U / V))
assert sp.simplify(nu_of_V / (c * K * (U * V) ** sp.Rational(1, 10))) == 1
parts = {V: sp.exp(E + odd), U: sp.exp(E - odd)}
assert sp.expand_log(sp.log(U / V).subs(parts), force=True) == -2 * odd
assert sp.simplify(nu_of_V.subs(parts) / (c * K * sp.exp(E / 5))) == 1

# %% [markdown]
# ## $\lambda_k$ in terms of the $G_n$
#
# The direct way is: expand $\ln V = \ln(1 + G_1 K + G_2 K^2 + \dots)$, split it, and determine $\lambda_1$,
# $\lambda_3$, … one after the other so that $\Lambda(\nu(K)) = 2 O(K)$. `symbolic.lambda_from_G` takes a shorter way,
# by Lagrange's inversion.

# %%
HIGHEST = 7
ring, t, *G = sp.ring([K, *(symbolic.G_symbol(n) for n in range(1, HIGHEST + 1))], sp.QQ)


def truncated(polynomial):
    return rs_trunc(polynomial, t, HIGHEST + 1)


log_V = rs_log(1 + sum(G_n * t**n for n, G_n in enumerate(G, 1)), t, HIGHEST + 1)
odd_part = sum(ring({m: q}) for m, q in log_V.terms() if m[0] % 2)
even_part = log_V - odd_part
nu_of_K = truncated(t * rs_exp(even_part * sp.QQ(1, 5), t, HIGHEST + 1))  # without the factor (5/4)^(2/5)
remaining, found = 2 * odd_part, {}
for k in range(1, HIGHEST + 1, 2):
    leading = sum(ring({(0, *m[1:]): q}) for m, q in remaining.terms() if m[0] == k)
    found[k] = sp.expand(leading.as_expr()) / c**k
    remaining = truncated(remaining - leading * nu_of_K**k)
    print(f"lambda_{k} =", found[k])
    assert sp.expand(found[k] - symbolic.lambda_from_G(k)) == 0
assert remaining == 0  # no even power remains

# %% [markdown]
# ## Numbers
#
# $\lambda_1$ has a closed form, as $G_1$ has. The others come from the enclosures of $G_n$, and are compared digit by
# digit with known values.

# %%
lambda_1 = found[1].subs(symbolic.G_symbol(1), symbolic.g_1_at_0())
print("lambda_1 =", symbolic.lambda_1())
assert sp.simplify(lambda_1 / symbolic.lambda_1()) == 1

DIGITS = 25


def number_in(ball):
    return sp.Float(ball.str(DIGITS, radius=False), DIGITS)


balls = g_coefficients(HIGHEST, DIGITS)
values = {symbolic.G_symbol(n): number_in(balls[n]) for n in range(1, HIGHEST + 1)}
quoted = {1: "1.15344885809529", 3: "0.0906370642356782", 5: "0.0113029473180618"}
for k, ball in zip(found, lambda_coefficients(len(found), DIGITS), strict=True):
    number = found[k].subs(values)
    print(f"lambda_{k} =", sp.N(number, DIGITS - 3))
    assert abs(number - number_in(ball)) < sp.Float(10) ** (3 - DIGITS)
    assert str(sp.N(number, 15)) == quoted.get(k, str(sp.N(number, 15)))

# %% [markdown]
# ## A collision and its mirror image, integrated in time
#
# With $x = q^2$ and $d\tau = 2 q ds$, the system $q' = w$, $w' = -2 q^4 - 2 \kappa q^2 w$ is smooth. The collision at
# $\kappa = 1/2$ gives $\varepsilon_0$; its mirror image, with negative damping, must give $1/\varepsilon_0$.


# %%
def eps0_in_time(kappa, guess):
    path = odefun(lambda _, y: [y[1], -2 * y[0] ** 4 - 2 * kappa * y[0] ** 2 * y[1]], 0, [0, 1])
    return -path(findroot(lambda s: path(s)[0], guess))[1]


with mp.workdps(20):
    half = mp.mpf(1) / 2
    film = eps0_in_time(half, 2.2)
    mirrored = eps0_in_time(-half * film ** (mp.mpf(1) / 5), 2.2)
    print("eps0 =", mp.nstr(film, 15), "  of its mirror image:", mp.nstr(mirrored, 15))
    assert abs(film * mirrored - 1) < mp.mpf(10) ** -15

print("derived: Lambda is odd, and lambda_k is a polynomial in G_1 … G_k times (4/5)^(2k/5)")
