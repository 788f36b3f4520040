# %% [markdown]
# # 1. From Newton's equation to one parameter
#
# Two viscoelastic spheres collide: the paper's Eq. 1 with the force of its Eq. 2. The problem has four parameters:
# $m_\text{eff}$, $\rho$, $A$ and the impact speed $v$. We choose the units of length and time so that all but one
# disappear. The remaining one is $\kappa = v_\ast^2 = \beta v^{1/5}$, with $\beta$ of the paper's Eq. 8.

# %%
import random

import sympy as sp

from viscopade.collision import spheres
from viscopade.theory import equation

m, rho, A, v = sp.symbols("m_eff rho A v", positive=True)
X, T = sp.symbols("X T", positive=True)  # the units of length and time, chosen below
scaled = equation.scaled_equation()  # only its symbols are used until the end
x, tau = scaled.x, scaled.tau

# %% [markdown]
# ## The scaled equation
#
# Write the compression as $\xi(t) = X x(\tau)$ with $\tau = t/T$. A derivative with respect to $t$ is one with respect
# to $\tau$, divided by $T$. While the spheres push each other, Newton's equation reads
#
# $$m \ddot{\xi} + \rho \xi^{3/2} + \frac{3}{2} A \rho \sqrt{\xi} \dot{\xi} = 0.$$


# %%
def newton_lhs(xi, rate):
    """m xi'' - F, with F the force of the paper's Eq. 2 before the min(0, ...) is taken."""
    force = -rho * xi ** sp.Rational(3, 2) - sp.Rational(3, 2) * A * rho * sp.sqrt(xi) * rate(xi)
    return m * rate(rate(xi)) - force


lhs = newton_lhs(X * x, lambda f: f.diff(tau) / T)
lhs = sp.expand(sp.powdenest(sp.expand_power_base(lhs / (m * X / T**2))))
print("divided by the coefficient of x'':", lhs)

elastic = lhs.coeff(sp.sqrt(x) ** 3)
viscous = lhs.coeff(x.diff(tau) * sp.sqrt(x))
assert sp.expand(lhs - (x.diff(tau, 2) + elastic * sp.sqrt(x) ** 3 + viscous * x.diff(tau) * sp.sqrt(x))) == 0

# %% [markdown]
# ## The units that remove the parameters
#
# The spheres touch with $x(0) = 0$ and with $\dot{\xi}(0) = v$, that is $\dot{x}(0) = v T/X$. Two units can make two
# numbers equal to 1: the elastic coefficient and this initial velocity.

# %%
(time_of_length,) = sp.solve(sp.Eq(v * T / X, 1), T)
roots = sp.solve(sp.Eq(elastic.subs(T, time_of_length), 1), X)
(length,) = [root for root in roots if root.is_positive]  # the other fifth roots are complex
time = sp.simplify(time_of_length.subs(X, length))
print("unit of length X =", length)
print("unit of time   T =", time)
assert sp.simplify(length / ((rho / m) ** sp.Rational(-2, 5) * v ** sp.Rational(4, 5))) == 1
assert sp.simplify(time / ((rho / m) ** sp.Rational(-2, 5) * v ** sp.Rational(-1, 5))) == 1

# %% [markdown]
# ## The remaining parameter
#
# The coefficient of $\dot{x} \sqrt{x}$ is a pure number, and it is the only parameter: $\kappa$. It grows like
# $v^{1/5}$, and $\beta$ is what remains when the speed is divided out. This is the paper's Eq. 8, and
# $v_\ast = \sqrt{\kappa}$.

# %%
kappa = sp.simplify(viscous.subs({X: length, T: time}))
beta = sp.simplify(kappa / v ** sp.Rational(1, 5))
print("kappa =", kappa)
print("beta  =", beta)
assert beta.diff(v) == 0
assert sp.simplify(beta - sp.Rational(3, 2) * A * (rho / m) ** sp.Rational(2, 5)) == 0

scaled_lhs = x.diff(tau, 2) + sp.sqrt(x) ** 3 + scaled.kappa * x.diff(tau) * sp.sqrt(x)
assert sp.simplify(lhs.subs({X: length, T: time}) - scaled_lhs.subs(scaled.kappa, kappa)) == 0

# %% [markdown]
# ## When the contact ends
#
# Spheres without adhesion never attract each other: the force is $\min(0, \dots)$, and in scaled units its second
# argument is $-\sqrt{x} (x + \kappa y)$ with $y = \dot{x}$. It is repulsive while $x + \kappa y > 0$. On the way in
# $y > 0$, and at the turning point $y = 0$ with $x > 0$. On the way out $y < 0$, and at $x = 0$ the sum would be
# $\kappa y < 0$. So the force vanishes before the compression does, where $x = -\kappa y$. That is $\ddot{x} = 0$,
# the paper's Eq. 6.
#
# From there on the minimum keeps $y$ constant, $x$ decreases, and $x + \kappa y$ stays negative: the contact is over,
# and $\varepsilon = -y$. The spheres separate still compressed, at $x_c = \kappa \varepsilon > 0$, and relax later. (An
# older model stops at $x = 0$ instead, so the spheres attract each other at the end.)

# %%
eps, x_c = sp.symbols("epsilon x_c", positive=True)
(acceleration,) = sp.solve(scaled_lhs, x.diff(tau, 2))
assert sp.expand(acceleration + sp.sqrt(x) * (x + scaled.kappa * x.diff(tau))) == 0

on_the_way_out = acceleration.subs(x.diff(tau), -eps).subs(x, x_c)
(compression,) = sp.solve(on_the_way_out, x_c)
print("x'' = 0 at x_c =", compression)
assert compression == scaled.kappa * eps
assert on_the_way_out.subs(x_c, 2 * compression).is_negative  # before: repulsion
assert sp.simplify(on_the_way_out.subs(x_c, compression / 2)).is_positive  # after: attraction

# %% [markdown]
# ## The same in `viscopade.collision.spheres`
#
# First the symbols, then numbers: a pair of spheres drawn at random, its $\beta$, $v_\ast$ and scales.

# %%
assert sp.simplify(scaled.lhs - scaled_lhs) == 0
assert equation.end_of_contact() == sp.Eq(x.diff(tau, 2), 0)

draw = random.Random(1)
pair = spheres.Pair(
    *(
        spheres.Sphere(
            radius=draw.uniform(0.01, 0.05),
            density=draw.uniform(500, 3000),
            young_modulus=10 ** draw.uniform(6, 9),
            poisson_ratio=draw.uniform(0, 0.5),
            dissipative_constant=10 ** draw.uniform(-4, -3),
        )
        for _ in range(2)
    )
)
speed = draw.uniform(0.1, 1)
numbers = {m: pair.m_eff, rho: pair.rho, A: pair.A, v: speed}
for name, symbolic, number in (
    ("beta", beta, pair.beta),
    ("v*", sp.sqrt(kappa), pair.v_star(speed)),
    ("unit of length", length, pair.length_scale(speed)),
    ("unit of time", time, pair.time_scale(speed)),
):
    print(f"{name}: {number:.15g}")
    assert abs(symbolic.subs(numbers).evalf() / number - 1) < 1e-13

# %% [markdown]
# ## A direct check
#
# Integrate Newton's equation in physical units, and the scaled equation, and compare. The square root makes both
# singular at the first touch. A new time $s$ with $dt = 2 \sqrt{\xi} ds$ removes that: for $q = \sqrt{\xi}$ and
# $u = \dot{\xi}$ the equations $dq/ds = u$ and $du/ds = 2 q \ddot{\xi}$ are smooth. The last Runge-Kutta step is
# bisected until it ends where the force vanishes.


# %%
def restitution(acceleration, speed, step):
    """Return eps and the compression at the end of contact, for xi'' = acceleration(xi, xi')."""

    def rates(q, u):
        return u, 2 * q * acceleration(q * q, u)

    def advance(q, u, h):
        k1 = rates(q, u)
        k2 = rates(q + h / 2 * k1[0], u + h / 2 * k1[1])
        k3 = rates(q + h / 2 * k2[0], u + h / 2 * k2[1])
        k4 = rates(q + h * k3[0], u + h * k3[1])
        return tuple(w + h / 6 * (a + 2 * b + 2 * c + d) for w, a, b, c, d in zip((q, u), k1, k2, k3, k4, strict=True))

    def pushing(q, u):
        return u > 0 or acceleration(q * q, u) < 0

    state = 0.0, speed
    while pushing(*(following := advance(*state, step))):
        state = following
    for _ in range(50):
        step /= 2
        following = advance(*state, step)
        if pushing(*following):
            state = following
    q, u = state
    return -u / speed, q * q


def newton(xi, rate):
    return -pair.rho * (xi**1.5 + 1.5 * pair.A * xi**0.5 * rate) / pair.m_eff


def unit(xi, rate):
    return -(xi**1.5) - pair.v_star(speed) ** 2 * xi**0.5 * rate


one = pair.time_scale(speed) / pair.length_scale(speed) ** 0.5  # the unit of s
physical, xi_c = restitution(newton, speed, 1e-3 * one)
dimensionless, x_c = restitution(unit, 1.0, 7e-4)
print(f"eps in physical units {physical:.12f}, scaled {dimensionless:.12f}")
assert abs(physical - dimensionless) < 1e-9
assert abs(x_c - pair.v_star(speed) ** 2 * dimensionless) < 1e-9
assert abs(xi_c / pair.length_scale(speed) - x_c) < 1e-9
print("derived: the scaled equation of motion, beta and v*, and the end of contact at x_c = kappa eps")
