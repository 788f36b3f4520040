# %% [markdown]
# # 2. Two different materials
#
# The paper's Eqs. 2 and 3 hold for two spheres of one material. Here the two bodies differ: Young moduli $Y_1$,
# $Y_2$, Poisson ratios $\nu_1$, $\nu_2$, dissipative constants $A_1$, $A_2$. We look for $\rho$ and $A$ of the pair.
#
# The answer: with the compliances $D_i = (1 - \nu_i^2)/Y_i$,
#
# $$\rho = \frac{4}{3} \frac{\sqrt{R_\text{eff}}}{D_1 + D_2}, \qquad A = \frac{D_1 A_1 + D_2 A_2}{D_1 + D_2}.$$
#
# The first is Hertz's result. $A$ is derived here from the power that the two bodies dissipate, in the quasi-static
# approximation behind the paper's Eq. 2: the deformation is always nearly that of a static contact. The processes
# within a body do not matter: $A_i$ gives its dissipation in a contact with an equal body. To first order in $A_1$ and
# $A_2$ the two powers add up to the $A$ above. Other generalisations exist, see the end.

# %%
import random

import sympy as sp

from viscopade.collision import spheres

D1, D2, R = sp.symbols("D_1 D_2 R_eff", positive=True)
A1, A2, rho = sp.symbols("A_1 A_2 rho", positive=True)

# %% [markdown]
# ## Hertz: the static contact
#
# A pressure $p$ on the flat surface of body $i$ moves the surface by $u_i = D_i K p$, where $K$ is the same for both
# bodies, $(K p)(r) = 1/\pi$ times the integral of $p(r')/\lvert r - r' \rvert$ over the contact (the elastic half-space
# under a normal load). Hertz's pressure on a disk of radius $a$ is $p = p_0 \sqrt{1 - r^2/a^2}$. In polar coordinates
# $(s, \varphi)$ around a point at distance $r$ from the centre it is $p = (p_0/a) \sqrt{c^2 - 2 b s - s^2}$ with
# $c^2 = a^2 - r^2$ and $b = r \cos \varphi$, and the area element $s \mathrm{d}s \mathrm{d}\varphi$ cancels the
# $1/\lvert r - r' \rvert = 1/s$. A ray from the point to the edge and the opposite one make a chord. With
# $s = \sqrt{c^2 + b^2} \sin \theta - b$ the root becomes $\sqrt{c^2 + b^2} \cos \theta$, and the chord runs from
# $\theta = -\pi/2$ to $\pi/2$.

# %%
a, p0, r, b, c = sp.symbols("a p_0 r b c", positive=True)
phi, theta = sp.symbols("phi theta", real=True)

s = sp.sqrt(c**2 + b**2) * sp.sin(theta) - b
assert sp.simplify(c**2 - 2 * b * s - s**2 - (c**2 + b**2) * sp.cos(theta) ** 2) == 0
chord = (c**2 + b**2) * sp.integrate(sp.cos(theta) ** 2, (theta, -sp.pi / 2, sp.pi / 2))
chord = sp.expand(chord.subs({c: sp.sqrt(a**2 - r**2), b: r * sp.cos(phi)}))
Kp = sp.expand(p0 / (sp.pi * a) * sp.integrate(chord, (phi, 0, sp.pi)))
print("K p =", sp.factor(Kp))

# %% [markdown]
# Both surfaces together close the gap: $u_1 + u_2 = \xi - r^2/(2 R_\text{eff})$ at every $r$ within the contact. The
# coefficients of $r^0$ and $r^2$ give $p_0$ and $\xi$, and the integral of $p$ gives the force.

# %%
xi = sp.Symbol("xi", positive=True)
gap = sp.Poly((D1 + D2) * Kp - (xi - r**2 / (2 * R)), r)
(peak,) = sp.solve(gap.coeff_monomial(r**2), p0)
(depth,) = sp.solve(gap.coeff_monomial(1).subs(p0, peak), xi)
force = sp.integrate(2 * sp.pi * r * sp.sqrt(a**2 - r**2), (r, 0, a)) * peak / a
force = sp.simplify(force.subs(a, sp.sqrt(R * xi)))
print("xi =", depth, "   F =", force)
assert depth == a**2 / R

rho_pair = sp.simplify(force / xi ** sp.Rational(3, 2))
assert sp.simplify(rho_pair - sp.Rational(4, 3) * sp.sqrt(R) / (D1 + D2)) == 0

Y, nu = sp.symbols("Y nu", positive=True)
equal = rho_pair.subs({D1: (1 - nu**2) / Y, D2: (1 - nu**2) / Y})
assert sp.simplify(equal - 2 * Y * sp.sqrt(R) / (3 * (1 - nu**2))) == 0  # the paper's Eq. 3

# %% [markdown]
# ## The dissipated power
#
# Now $\xi$ changes in time. The force $F$ does work on both bodies, which store it as elastic energy $U$ or dissipate
# it: $F d\xi/dt = dU/dt + P$. Two facts give both terms to first order in the $A_i$:
#
# - For given $\xi$ the static deformation minimises $U$. The true deformation differs from it in first order, so $U$
#   differs from Hertz's energy only in second order: $F$ is Hertz's force plus $P/(d\xi/dt)$.
# - $P$ is quadratic in the rates of strain: $P = P_1 + P_2$, and to first order $P_i$ is the dissipation of body $i$
#   with Hertz's deformation.
#
# In the contact of body $i$ with an equal body, of the same $R_\text{eff}$ and at the same $\xi(t)$, each of the two
# bodies dissipates half of the power of the paper's Eq. 2. The radius of the contact does not depend on the materials,
# $a^2 = R_\text{eff} \xi$. So the pressure on body $i$, hence its strains and their rates, are those of that contact
# times one number, the ratio of the peak pressures, and $P_i$ is that power times the number's square. How the body's
# viscous stress depends on the rates (two viscosities, in any ratio) does not matter.
#
# First the two peaks, and the dissipation of each body in either contact.

# %%
rate = sp.Symbol("xi_dot", real=True)


def power(A, compliances):
    """Return the power that a contact dissipates by the paper's Eq. 2."""
    return sp.Rational(3, 2) * A * rho_pair.subs(D1 + D2, compliances) * sp.sqrt(xi) * rate**2


def dissipated_by(A, D):
    """Return the power that one body dissipates, from the contact with an equal body."""
    magnified = sp.simplify(peak / peak.subs(D1 + D2, 2 * D))
    return magnified**2 * power(A, 2 * D) / 2


viscous_force = (dissipated_by(A1, D1) + dissipated_by(A2, D2)) / rate
A_pair = sp.factor(viscous_force * rate / power(1, D1 + D2))
print("A =", A_pair)
assert sp.simplify(A_pair - (D1 * A1 + D2 * A2) / (D1 + D2)) == 0
assert sp.simplify(viscous_force - sp.Rational(3, 2) * A_pair * rho_pair * sp.sqrt(xi) * rate) == 0

# %% [markdown]
# That $U$ is stationary, in the contact at hand: let the bodies' shares $u_i$ of
# $w = \xi - r^2/(2 R_\text{eff}) = u_1 + u_2$, where they touch, be off by epsilon. The pressure that holds $u_i$ is
# $q_i/K$, $q_i = u_i/D_i$, and the energy is the integral of $u_i (q_i/K)/2$. $K$ is linear, symmetric and the same for
# both, so $u_i q_i/2$ is sufficient. (Points in contact stay in contact; at the edge, which may move, the pressure
# vanishes.)

# %%
w, epsilon = sp.symbols("w epsilon")
energy = sum(u**2 / (2 * D) for u, D in ((D1 * w / (D1 + D2) + epsilon, D1), (D2 * w / (D1 + D2) - epsilon, D2)))
assert sp.simplify(energy.diff(epsilon).subs(epsilon, 0)) == 0
assert sp.simplify(energy.subs(epsilon, 0) - w**2 / (2 * (D1 + D2))) == 0

# %% [markdown]
# ## The same from one law of stress
#
# A check, for the special bodies whose viscous stress is $A_i$ times the rate of change of their elastic stress. Action
# equals reaction: both bodies carry the same pressure, at every point and at every moment. So
#
# $$K p = \left(1 + A_1 \frac{d}{dt}\right) \frac{u_1}{D_1} = \left(1 + A_2 \frac{d}{dt}\right) \frac{u_2}{D_2}, \qquad
# u_1 + u_2 = w,$$
#
# where $w = \xi - r^2/(2 R_\text{eff})$ is imposed from outside. All is linear, so write $z$ for $d/dt$ and $q$ for
# $K p$. We eliminate the two $u_i$, and expand the result in the $A_i$, marked by $\lambda$.

# %%
q, z, lam = sp.symbols("q z lambda")
u1, u2 = sp.symbols("u_1 u_2")
laws = [sp.Eq(q, (1 + lam * A1 * z) * u1 / D1), sp.Eq(q, (1 + lam * A2 * z) * u2 / D2), sp.Eq(u1 + u2, w)]
shares = sp.solve(laws, [u1, u2, q], dict=True)[0]
expansion = sp.series(shares[q] / w, lam, 0, 3).removeO()
orders = [sp.factor(expansion.coeff(lam, k)) for k in range(3)]
print("K p / w in orders of A:", *orders, sep="\n  ")

assert orders[0] == 1 / (D1 + D2)
assert sp.simplify(orders[1] / (orders[0] * z) - A_pair) == 0

# %% [markdown]
# To first order $K p = (1 + A d/dt) w/(D_1 + D_2)$: the pair is a contact like Hertz's with one constant $A$. The
# pressure is Hertz's pressure plus $A$ times its rate of change. So is the force: Hertz's pressure vanishes at the edge
# of the contact, whose motion therefore adds nothing to the rate of change of an integral over it.

# %%
time = sp.Symbol("t", real=True)
moving = sp.Function("xi", positive=True)(time)
hertz = rho * moving ** sp.Rational(3, 2)
viscoelastic = hertz + A_pair * hertz.diff(time)
paper = hertz + sp.Rational(3, 2) * A_pair * rho * sp.sqrt(moving) * moving.diff(time)
assert sp.simplify(viscoelastic - paper) == 0  # the paper's Eq. 2, with its factor 3/2

# %% [markdown]
# ## Limits
#
# With a rigid partner ($D_2 \to 0$) the pair has the constant of the soft body. Two equal constants give that constant
# for all moduli. The arithmetic mean is right only for equal compliances (or equal $A_i$).

# %%
assert sp.limit(A_pair, D2, 0) == A1
assert sp.limit(A_pair, D1, 0) == A2
assert sp.simplify(A_pair.subs(A2, A1)) == A1
mistake = sp.factor(A_pair - (A1 + A2) / 2)
print("A - (A_1 + A_2)/2 =", mistake)
assert sp.simplify(mistake - (A1 - A2) * (D1 - D2) / (2 * (D1 + D2))) == 0

# %% [markdown]
# ## Neglected terms
#
# For the special bodies, the first neglected term is of second order and proportional to $(A_1 - A_2)^2$: two different
# viscoelastic bodies in series are not equivalent to one such body. It is small if the constants differ little compared
# with the duration of the collision, and zero for equal constants or a rigid partner. The paper's Eq. 2 itself is of
# first order in $A$.

# %%
second = sp.factor(orders[2] / (orders[0] * z**2))
print("second order:", second)
assert sp.simplify(second + D1 * D2 * (A1 - A2) ** 2 / (D1 + D2) ** 2) == 0

# %% [markdown]
# ## Other generalisations
#
# Many codes take $(A_1 + A_2)/2$. Simbody's Hunt-Crossley force weights two dissipation constants with shares of the
# deformation too, but takes the shares from the $2/3$ powers of the moduli. Goldobin, Susloparov, Pimenova and
# Brilliantov ("Collision of viscoelastic bodies: Rigorous derivation of dissipative force", Eur. Phys. J. E) go beyond
# the quasi-static approximation, for different materials too; their result is not used here. If you know $A$ of the
# pair, from theory or experiment, give both spheres that $A$.
#
# ## The same in `viscopade.collision.spheres`

# %%
draw = random.Random(2)
one, other = (
    spheres.Sphere(
        radius=draw.uniform(0.01, 0.05),
        density=draw.uniform(500, 3000),
        young_modulus=10 ** draw.uniform(6, 9),
        poisson_ratio=draw.uniform(0, 0.5),
        dissipative_constant=10 ** draw.uniform(-5, -3),
    )
    for _ in range(2)
)
pair = spheres.Pair(one, other)
numbers = {R: pair.R_eff, A1: one.dissipative_constant, A2: other.dissipative_constant}
for D, sphere in ((D1, one), (D2, other)):
    numbers[D] = (1 - sphere.poisson_ratio**2) / sphere.young_modulus
for name, symbolic, number in (("rho", rho_pair, pair.rho), ("A", A_pair, pair.A)):
    print(f"{name}: {number:.15g}")
    assert abs(symbolic.subs(numbers).evalf() / number - 1) < 1e-13
print("derived: rho and the dissipative constant of two spheres of different materials")
