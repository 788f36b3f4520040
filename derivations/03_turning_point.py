# %% [markdown]
# # 3. Time eliminated, compression measured by the turning point
#
# The scaled equation $\ddot{x} + x^{3/2} + \kappa \dot{x} \sqrt{x} = 0$ (the paper's Eq. 9) does not contain
# time. Taking the speed as a function of the compression leaves one equation of first order, and with the right units
# of both one equation serves loading and unloading. Here "end" means $x = 0$; the result is called $\varepsilon_0$. The
# true end of contact follows in `05_end_of_contact.py`.

# %%
import sympy as sp
from mpmath import findroot, mp, odefun

from viscopade.theory import equation, symbolic

scaled = equation.scaled_equation()
x, tau, kappa = scaled.x, scaled.tau, scaled.kappa
g, r, K = symbolic.g, symbolic.r, symbolic.K  # only these symbols are used until the end
x_max, S = sp.symbols("x_max S", positive=True)

# %% [markdown]
# ## Without time
#
# On the way in $x$ grows from 0 to $x_\text{max}$, so $\dot{x}$ is a function $w(x)$. SymPy's chain rule gives
# $\ddot{x} = w w'(x)$.

# %%
X = sp.Symbol("X", positive=True)
w = sp.Function("w")
acceleration = w(x).diff(tau).subs(x.diff(tau), w(x)).doit().subs(x, X).doit()
assert acceleration == w(X) * w(X).diff(X)
without_time = scaled.lhs.subs(x.diff(tau, 2), acceleration).subs(x.diff(tau), w(X)).subs(x, X)
print("without time:", without_time, "= 0")

# %% [markdown]
# ## Units: $x = x_\text{max} r^2$, $\lvert \dot{x} \rvert = S g(r)$
#
# $r$ runs from 0 to 1 and measures the square root, so that no root is left in the equation. $S$ is chosen so that
# without damping ($\kappa = 0$) the speed at $r = 0$ is $g = 1$. `sign` is $+1$ on the way in and $-1$ on the way out,
# when $w = -S g$.


# %%
def energy_slope(sign):
    """d(g^2)/dr from the equation without time."""
    slope_of_w = sign * S * g.diff(r) / (x_max * r**2).diff(r)
    equation = without_time.subs(w(X).diff(X), slope_of_w).subs(w(X), sign * S * g).subs(X, x_max * r**2)
    (slope,) = sp.solve(equation, g.diff(r))
    return sp.expand(2 * g * slope)


undamped = energy_slope(+1).subs(kappa, 0)
(speed_unit,) = sp.solve(sp.Eq(-sp.integrate(undamped, (r, 0, 1)), 1), S)
print("S =", speed_unit)
assert sp.simplify(speed_unit - sp.sqrt(sp.Rational(4, 5)) * x_max ** sp.Rational(5, 4)) == 0

loading, unloading = (energy_slope(sign).subs(S, speed_unit) for sign in (+1, -1))
damping = sp.expand(loading).coeff(g)
K_of_kappa = sp.simplify(damping / (-5 * r**2))
print("K =", K_of_kappa)
assert sp.simplify(K_of_kappa - sp.sqrt(sp.Rational(4, 5)) * kappa * x_max ** sp.Rational(1, 4)) == 0

kappa_of_K = sp.solve(sp.Eq(K_of_kappa, K), kappa)[0]
loading, unloading = (sp.expand(sp.simplify(side.subs(kappa, kappa_of_K))) for side in (loading, unloading))
print("loading:   d(g^2)/dr =", loading, "  unloading:", unloading, "  both with g(1) = 0")
assert loading == -5 * r**4 - 5 * K * g * r**2
assert unloading == loading.subs(K, -K)  # one problem, two signs of K

# %% [markdown]
# ## One function gives both halves
#
# Let $V(K) = g(0)$. The first half starts with $\dot{x}(0) = 1 = S V(K)$, which determines $x_\text{max}$. The second
# half ends at $x = 0$ with the speed $\varepsilon_0 = S V(-K)$.

# %%
V, U = sp.symbols("V U", positive=True)  # V(K) and V(-K)
(depth,) = sp.solve(sp.Eq(speed_unit * V, 1), x_max)
eps0 = sp.simplify((speed_unit * U).subs(x_max, depth))
kappa_of_V = sp.powsimp(sp.simplify(kappa_of_K.subs(x_max, depth)))
print("eps0 =", eps0, "  kappa =", kappa_of_V)
assert eps0 == U / V
assert sp.simplify(kappa_of_V / (sp.Rational(5, 4) ** sp.Rational(2, 5) * K * V ** sp.Rational(1, 5))) == 1

# %% [markdown]
# ## The same in `viscopade.theory.symbolic`, and a check in numbers
#
# Choose $K = 1/2$, integrate both halves from the turning point, and compare the resulting $\varepsilon_0$ with a
# direct integration in time at the resulting $\kappa$. Both systems are made polynomial by a suitable time: in the
# first $dr = -g ds$, and in the second $x = q^2$, $d\tau = 2 q ds$.

# %%
equation = symbolic.turning_point_equation()
assert equation.lhs == sp.Derivative(g**2, r)
assert sp.expand(equation.rhs - loading) == 0


def crossing(rates, start, guess):
    """Integrate until the first component is 0, near the time `guess`, and return the second."""
    path = odefun(rates, 0, start)
    return path(findroot(lambda s: path(s)[0], guess))[1]


def V_number(k):
    """V(k) from r' = -g, (g^2)' = (5 r^4 + 5 k g r^2) g, starting at the turning point r = 1, g = 0."""
    return crossing(lambda _, y: [-y[1], (5 * y[0] ** 4 + 5 * k * y[0] ** 2 * y[1]) / 2], [1, 0], 1.1)


with mp.workdps(20):
    half = mp.mpf(1) / 2
    kappa_number = (mp.mpf(5) / 4) ** (mp.mpf(2) / 5) * half * V_number(half) ** (mp.mpf(1) / 5)
    both_halves = V_number(-half) / V_number(half)
    in_time = -crossing(lambda _, y: [y[1], -2 * y[0] ** 4 - 2 * kappa_number * y[0] ** 2 * y[1]], [0, 1], 2.2)
    print("kappa, eps0 from V, eps0 in time:", *(mp.nstr(c, 15) for c in (kappa_number, both_halves, in_time)))
    assert abs(both_halves - in_time) < mp.mpf(10) ** -15

print("derived: the turning point equation, and eps0 and kappa from one function V(K)")
