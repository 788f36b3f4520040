# %% [markdown]
# # 12. Damping with $x^{1/4}$: one coefficient of restitution for all speeds
#
# Many programs do not use the viscoelastic law, but damp Hertz's force with $x^{1/4}$,
#
# $$m \ddot{x} = -k x^{3/2} - \alpha \sqrt{m k} x^{1/4} \dot{x},$$
#
# because $\varepsilon$ is then independent of the speed. This file derives $\varepsilon$ as a function of $\alpha$, for
# the two ends of contact in such programs, and its inverse.

# %%
import math

import sympy as sp
from mpmath import mpf

from viscopade.collision import exact
from viscopade.simulators.formula import ratio_at_force_end, ratio_for_return, tsuji_kappa
from viscopade.theory.law import law_of

m, k, alpha, x, u = sp.symbols("m k alpha x u", positive=True)
force = -k * x ** sp.Rational(3, 2) - alpha * sp.sqrt(m * k) * x ** sp.Rational(1, 4) * u

# %% [markdown]
# ## Transformation to a linear oscillator
#
# Let $q = x^{5/4}$, and let a new time $s$ run with $ds = \omega x^{1/4} dt$. A derivative with respect to $s$ is one
# with respect to $t$, divided by $\omega x^{1/4}$. For a function $f(x, u)$ with $\dot{x} = u$ and $\dot{u}$ the force
# divided by $m$:

# %%
omega = sp.symbols("omega", positive=True)


def rate(f):
    """df/ds of a function of x and u along the motion."""
    return sp.simplify((f.diff(x) * u + f.diff(u) * force / m) / (omega * x ** sp.Rational(1, 4)))


q = x ** sp.Rational(5, 4)
first = rate(q)
second = sp.expand(rate(first))
print("q'  =", first)
print("q'' =", second)
assert sp.simplify(first - sp.Rational(5, 4) * u / omega) == 0  # q' is the speed, except for a factor

# q'' + 2 zeta q' + q = 0 needs the coefficient of q to be 1, which sets omega, and zeta follows.
stiffness = -second.subs(u, 0) / q
(unit,) = sp.solve(sp.Eq(sp.simplify(stiffness), 1), omega)
zeta_of_alpha = sp.simplify((-(second - second.subs(u, 0)) / (2 * first)).subs(omega, unit))
print("omega =", unit)
print("zeta  =", zeta_of_alpha)
assert sp.simplify(unit - sp.sqrt(5 * k / (4 * m))) == 0
assert sp.simplify(zeta_of_alpha - alpha / sp.sqrt(5)) == 0

# %% [markdown]
# ## The motion
#
# The spheres touch with $q = 0$, $q' = 1$. Below critical damping put $\zeta = \cos \psi$,
# $\sqrt{1 - \zeta^2} = \sin \psi$ and measure time by $\theta = s \sin \psi$.

# %%
psi, theta = sp.symbols("psi theta", positive=True)
zeta = sp.cos(psi)
s = theta / sp.sin(psi)
motion = sp.exp(-zeta * s) * sp.sin(theta) / sp.sin(psi)
speed = sp.simplify(motion.diff(theta) * sp.sin(psi))
assert sp.simplify(speed.diff(theta) * sp.sin(psi) + 2 * zeta * speed + motion) == 0
assert motion.subs(theta, 0) == 0
assert sp.simplify(speed.subs(theta, 0)) == 1

# %% [markdown]
# ## The end at $x = 0$
#
# $q = 0$ again at $\theta = \pi$, and $\varepsilon = -q'$ there.

# %%
at_position = sp.simplify(-speed.subs(theta, sp.pi))
print("eps, end at x = 0:      ", at_position)
assert sp.simplify(at_position - sp.exp(-sp.pi * sp.cot(psi))) == 0

# The inverse: with L = -ln eps = pi zeta/sqrt(1 - zeta^2).
L, z = sp.symbols("L z", positive=True)
(inverse,) = sp.solve(sp.Eq(L**2 * (1 - z**2), sp.pi**2 * z**2), z)
assert sp.simplify(inverse - L / sp.sqrt(L**2 + sp.pi**2)) == 0

# %% [markdown]
# ## The end at zero force
#
# The force is $x^{1/4}$ times $q''$, up to a positive factor, and $q'' = -(2 \zeta q' + q)$ is proportional to
# $-\sin(2 \psi - \theta)$: it is repulsive from first contact to $\theta = 2 \psi$, after the turning point at
# $\theta = \psi$. Because $2 \psi < \pi$, the force vanishes before $x$ does. A program that clips it, $\max(0, F)$,
# has a constant $q'$ from there on, so that $2 \zeta q' + q$ falls below zero: the contact has ended.

# %%
push = 2 * zeta * speed + motion
shape = sp.exp(-zeta * s) * sp.sin(2 * psi - theta) / sp.sin(psi)
assert sp.simplify(sp.expand_trig(push - shape)) == 0
assert sp.simplify(speed.subs(theta, psi)) == 0

at_force = sp.simplify(-speed.subs(theta, 2 * psi))
print("eps, end at zero force: ", at_force)
assert sp.simplify(sp.expand_trig(at_force - sp.exp(-2 * psi * sp.cot(psi)))) == 0

# %% [markdown]
# ## Beyond critical damping
#
# Here $\psi$ is imaginary: with $\psi = i \chi$, $\zeta = \cosh \chi$, and $\cos$ and $\sin$ become $\cosh$ and
# $i \sinh$. The same force vanishes at $\theta = 2 i \chi$. At critical damping both branches give $e^{-2}$, and
# $-\ln \varepsilon$ is analytic in $\zeta$ there. The function rises with $\zeta$, so the inverse is unique; for strong
# damping $\varepsilon \to 1/(4 \zeta^2)$.

# %%
chi = sp.symbols("chi", positive=True)
beyond = sp.exp(-2 * chi * sp.coth(chi))
continued = sp.expand_trig((psi * sp.cot(psi)).subs(psi, sp.I * chi)).rewrite(sp.exp)
assert sp.simplify(continued - (chi * sp.coth(chi)).rewrite(sp.exp)) == 0
below_series = sp.series(2 * psi * sp.cot(psi), psi, 0, 6).removeO()
beyond_series = sp.series(2 * chi * sp.coth(chi), chi, 0, 6).removeO()
assert sp.expand(below_series.subs(psi, sp.I * chi) - beyond_series) == 0
assert below_series.subs(psi, 0) == 2
rise = sp.simplify((psi * sp.cot(psi)).diff(psi) * 2 * sp.sin(psi) ** 2 - (sp.sin(2 * psi) - 2 * psi))
assert rise == 0  # -ln eps falls with psi, as sin(2 psi) < 2 psi: it rises with zeta
assert sp.limit(beyond * 4 * sp.cosh(chi) ** 2, chi, sp.oo) == 1

# %% [markdown]
# ## The same by the exact function of the law, and in the formulas of programs
#
# In scaled units $\kappa = \alpha = \sqrt{5} \zeta$. The exact function integrates the motion and knows no closed form.

# %%
for number in (0.5, 1.0, 1.4, 1.57):
    ratio = sp.cos(sp.Float(number, 40))
    for end, formula in (("force", at_force), ("return", at_position)):
        closed = formula.subs(psi, sp.Float(number, 40)).evalf(40)
        proven = exact.collision(kappa=str(sp.sqrt(5).evalf(40) * ratio), law=law_of("tsuji", end), digits=20)
        print(f"zeta {float(ratio):.6f}, end {end:8}: eps {float(closed):.15g}")
        assert abs(sp.Float(proven.decimals()["epsilon"], 20) / closed - 1) < 1e-18
for number in (1e-6, 0.1, 1.0, 10.0):
    closed = beyond.subs(chi, sp.Float(number, 40)).evalf(40)
    assert abs(ratio_at_force_end(mpf(str(closed))) / math.cosh(number) - 1) < 1e-13
for wanted in (0.999999, 0.9, 0.5, 0.2, 0.1, 1e-6):
    found = float(inverse.subs(L, -math.log(wanted)))
    assert abs(ratio_for_return(wanted) / found - 1) < 1e-14
assert abs(tsuji_kappa(0.5) / ratio_for_return(0.5) - float(sp.solve(zeta_of_alpha - 1, alpha)[0])) < 1e-15
print("derived: eps of the x^(1/4) damping for both ends of contact, and zeta = alpha/sqrt(5)")
