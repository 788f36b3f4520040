# %% [markdown]
# # 13. Cooling: $T \sim t^{-2}$ for constant $\varepsilon$, $T \sim t^{-5/3}$ for viscoelastic spheres
#
# A gas of equal, smooth spheres loses energy in its collisions. If $\varepsilon$ is a constant, its temperature follows
# Haff's law, $T = T_0 (1 + t/\tau)^{-2}$. For viscoelastic spheres slow impacts are nearly elastic,
# $\varepsilon = 1 + h_2 v_\ast^2 + \dots$, and the gas cools more slowly: $T \sim t^{-5/3}$. Both are derived here,
# with their factors and, for the second one, with the next terms, for velocities that are Maxwellian at all times.
# (This is an approximation; `viscopade_lab.gas.cool` works without it and shows its error.)
#
# $T$ is the variance of one component of the velocities, the granular temperature over the mass of a particle.

# %%
import numpy as np
import sympy as sp

import viscopade as vp
from viscopade.collision.spheres import v_star
from viscopade_lab import gas

T, T_0, v, u, x = sp.symbols("T T_0 v u x", positive=True)
m, n, d, eps, t, k = sp.symbols("m n d epsilon t k", positive=True)

# %% [markdown]
# ## The energy loss in a collision
#
# The component $v$ of the relative velocity along the line of centres becomes $-\varepsilon v$. The motion of the
# centre of mass does not change.

# %%
before = sp.Matrix([sp.Symbol("c_1"), sp.Symbol("c_2")])  # normal components of two velocities, of a frontal pair
impulse = (1 + eps) / 2 * (before[0] - before[1])
after = before + sp.Matrix([-impulse, impulse])
assert sp.expand(sum(after) - sum(before)) == 0
assert sp.expand(after[0] - after[1] + eps * (before[0] - before[1])) == 0
lost = sp.factor(m / 2 * (before.dot(before) - after.dot(after)))
per_collision = lost.subs(before[0], before[1] + v)
print("energy lost in a collision:", sp.factor(per_collision))
assert sp.simplify(per_collision - m / 4 * (1 - eps**2) * v**2) == 0

# %% [markdown]
# ## Frequency and speeds of collisions
#
# The difference of two Maxwellian velocities is normal with the variance $2 T$ in every component, so along any
# direction $e$. Partners that approach with $v$ along $e$ within a time $dt$ come from a slanted cylinder, with the
# volume $v d^2 dt$ per solid angle of $e$. With $n$ partners per volume and $4 \pi$ directions, counting only pairs
# that approach ($v > 0$):

# %%
component = sp.exp(-(v**2) / (4 * T)) / sp.sqrt(4 * sp.pi * T)
assert sp.integrate(component, (v, -sp.oo, sp.oo)) == 1
frequency = sp.simplify(4 * sp.pi * n * d**2 * sp.integrate(v * component, (v, 0, sp.oo)))
print("collisions of a particle per time:", frequency)
assert sp.simplify(frequency - 4 * sp.sqrt(sp.pi * T) * n * d**2) == 0

impact = sp.simplify(v * component / sp.integrate(v * component, (v, 0, sp.oo)))
print("distribution of impact speeds:", impact)
assert sp.simplify(impact - v / (2 * T) * sp.exp(-(v**2) / (4 * T))) == 0
of_u = sp.simplify(impact.subs(v, 2 * sp.sqrt(T * u)) * sp.diff(2 * sp.sqrt(T * u), u))
assert of_u == sp.exp(-u)  # u = v^2/(4 T) is exponentially distributed

# %% [markdown]
# A particle has the energy $\frac{3}{2} m T$, and a collision has two particles. With
# $L = \int (1 - \varepsilon^2) u e^{-u} du$ and the frequency $f$:
#
# $$\frac{3}{2} m \frac{dT}{dt} = -\frac{f}{2} \left\langle \frac{m}{4} (1 - \varepsilon^2) 4 T u \right\rangle, \qquad
# \frac{d \ln T}{dt} = -\frac{f L}{3}.$$
#
# From now on the unit of time is the initial mean collision time, so $f = \sqrt{T/T_0}$.

# %%
L = sp.Symbol("L", positive=True)
energy_rate = -frequency / 2 * (per_collision / (1 - eps**2)).subs(v, 2 * sp.sqrt(T * u)) / u * L
rate = sp.simplify(energy_rate / (sp.Rational(3, 2) * m * T))
assert sp.simplify(rate + frequency * L / 3) == 0

# %% [markdown]
# ## Constant $\varepsilon$: Haff's law
#
# Every collision removes the same fraction $L = 1 - \varepsilon^2$ of $T$.

# %%
assert sp.integrate(u * sp.exp(-u), (u, 0, sp.oo)) == 1
haff = T_0 * (1 + t * L / 6) ** -2
assert sp.simplify(haff.diff(t) / haff + L / 3 * sp.sqrt(haff / T_0)) == 0
assert sp.limit(sp.simplify(t * haff.diff(t) / haff), t, sp.oo) == -2

at = np.array([0.0, 1.0, 1e3, 1e6])
found = gas.maxwellian(lambda speed: np.full_like(speed, 0.8), at, temperature=2.5)
known = [float(haff.subs({T_0: 2.5, L: 1 - 0.8**2, t: time})) for time in at]
assert np.allclose(found, known, rtol=1e-8, atol=0)

# %% [markdown]
# ## Viscoelastic spheres
#
# With $v_\ast = \sqrt{\beta} v^{1/10}$ and $v = \sqrt{4 T u}$ the mean of $v_\ast^k$ is a Gamma function: with the
# typical $v_\ast^2$
#
# $$x = \beta (4 T)^{1/10}, \qquad \int v_\ast^k u e^{-u} du = x^{k/2} \Gamma\left(2 + \frac{k}{20}\right).$$

# %%
beta = sp.Symbol("beta", positive=True)
x_of_T = beta * (4 * T) ** sp.Rational(1, 10)
moment = sp.integrate(u ** (1 + k / 20) * sp.exp(-u), (u, 0, sp.oo))
assert sp.simplify(moment - sp.gamma(2 + k / 20)) == 0
mean_power = sp.powdenest((sp.sqrt(beta) * sp.sqrt(4 * T * u) ** sp.Rational(1, 10)) ** k, force=True)
assert sp.simplify(sp.expand_log(sp.log(mean_power / (x_of_T ** (k / 2) * u ** (k / 20))), force=True)) == 0

h = sp.symbols("h_0:8")
w = sp.Symbol("w", positive=True)  # v*; h_1 = h_3 = 0
squared = sp.expand(1 - (1 + sum(h[i] * w**i for i in (2, 4, 5, 6))) ** 2)
terms = {i: squared.coeff(w, i) for i in (2, 4, 5, 6)}
assert terms == {2: -2 * h[2], 4: -2 * h[4] - h[2] ** 2, 5: -2 * h[5], 6: -2 * h[6] - 2 * h[2] * h[4]}
l_2, l_4, l_5 = (terms[i] * sp.gamma(2 + sp.Rational(i, 20)) for i in (2, 4, 5))
print("L =", l_2, "x + (", l_4, ") x^2 + (", l_5, ") x^(5/2) + …")

# %% [markdown]
# The leading term alone: $d \ln T/dt \sim T^{3/5}$. Haff's law becomes $T = T_0 (1 + t/\tau)^{-5/3}$ with
# $\tau = 5/L_0$, where $L_0$ is $L$ at the start.

# %%
L_0 = sp.Symbol("L_0", positive=True)
law = T_0 * (1 + t * L_0 / 5) ** sp.Rational(-5, 3)
assert sp.simplify(law.diff(t) / law + L_0 / 3 * (law / T_0) ** sp.Rational(3, 5)) == 0
assert sp.limit(sp.simplify(t * law.diff(t) / law), t, sp.oo) == sp.Rational(-5, 3)

# %% [markdown]
# The collisions per particle, $dC/dt = \sqrt{T/T_0}$, then grow like $t^{1/6}$: a gas that has cooled by many decades
# has had few collisions, which makes its simulation cheap. (For constant $\varepsilon$ they grow like $\ln t$.)

# %%
C = 30 / L_0 * ((1 + t * L_0 / 5) ** sp.Rational(1, 6) - 1)
assert sp.simplify(C.diff(t) - sp.sqrt(law / T_0)) == 0
assert C.subs(t, 0) == 0

# %% [markdown]
# ## The approach to $-5/3$
#
# $T = (x/\beta)^{10}/4$ turns the equation into $dt \sim -dx/(x^6 L)$, and $L \sim x (1 - a x - b x^{3/2} - \dots)$
# into
#
# $$t \sim \int dx x^{-7} (1 + a x + b x^{3/2} + \dots), \qquad \frac{d \ln T}{d \ln t} = \frac{10 t}{x dt/dx}.$$
#
# The initial state adds a constant to $t$, which is of order $x^6$.

# %%
a, b, Y = sp.symbols("a b Y", positive=True)  # Y = sqrt(x)
inverse = sp.series(1 / (1 - a * Y**2 - b * Y**3), Y, 0, 4).removeO()
integrand = sp.expand(inverse.subs(Y, sp.sqrt(x)) * x**-7)
time = -sp.integrate(integrand, x)
local_slope = sp.series(sp.simplify((10 * time / (x * time.diff(x))).subs(x, Y**2)), Y, 0, 4).removeO()
print("d ln T/d ln t =", sp.expand(local_slope).subs(Y, sp.sqrt(x)), "+ O(x^2)")
assert sp.expand(local_slope + sp.Rational(5, 3) * (1 + a * Y**2 / 5 + b * Y**3 / 3)) == 0

# %% [markdown]
# ## Numbers
#
# $L$, its next terms and the slopes, compared with quadrature over the exact $\varepsilon$.

# %%
exact_h = vp.series(order=6, digits=20).floats()
values = {h[i]: exact_h[i] for i in (2, 4, 5, 6)}
first, second, third = (float(term.subs(values)) for term in (l_2, l_4, l_5))
a_value, b_value = -second / first, -third / first
print(f"L = {first:.6f} x (1 - {a_value:.6f} x - {b_value:.6f} x^(3/2) - …)")
print(f"d ln T/d ln t = -5/3 (1 + {a_value / 5:.4f} x + {b_value / 3:.4f} x^(3/2) + …)")

BETA = 1.307


def exact(speed):
    """Return the exact eps."""
    return vp.epsilon(v_star(speed, BETA))


for temperature in (1e-20, 1e-30, 1e-40):
    small = BETA * (4 * temperature) ** 0.1
    quadrature = float(gas.loss(exact, temperature))
    leading, three = first * small, first * small * (1 - a_value * small - b_value * small**1.5)
    print(f"x = {small:.2e}: L/leading term = {quadrature / leading:.8f}, over three terms {quadrature / three:.8f}")
    assert abs(quadrature / three - 1) < 2 * small**2

start = 1e-10
x_0 = BETA * (4 * start) ** 0.1
times = np.geomspace(1e9, 1e24, 61)
temperatures = gas.maxwellian(exact, times, temperature=start)
slopes = np.diff(np.log(temperatures)) / np.diff(np.log(times))
at_x = BETA * (4 * np.sqrt(temperatures[1:] * temperatures[:-1])) ** 0.1
predicted = -5 / 3 * (1 + a_value / 5 * at_x + b_value / 3 * at_x**1.5)
for i in (0, 20, 40, 59):
    print(f"t = {times[i]:.0e}: x = {at_x[i]:.2e}, slope {slopes[i]:.6f}, by the expansion {predicted[i]:.6f}")
assert np.all(np.abs(slopes - predicted)[10:] < 2 * at_x[10:] ** 2 + 1e-7)
assert np.all(np.diff(slopes[10:]) > 0)
assert abs(slopes[-1] + 5 / 3) < 1e-3

# The factor of the law: T^(-3/5)/t tends to T_0^(-3/5) L_0/5, with L_0 the leading term of L at the start.
factor = temperatures[-1] ** -0.6 / times[-1] / (start**-0.6 * first * x_0 / 5)
print(f"T^(-3/5)/t over its limit: {factor:.6f}")
assert abs(factor - 1) < 2 * at_x[-1]
print("derived: Haff's laws, T ~ t^-2 and T ~ t^(-5/3), their factors, and how the second is reached")
