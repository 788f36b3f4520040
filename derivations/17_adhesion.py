# %% [markdown]
# # 17. Adhesion: the neck, and the speed below which spheres stick
#
# Surfaces that touch gain the work of adhesion $w$ for each unit of area. This file derives the relation of Johnson,
# Kendall and Roberts (1971) between force, compression and contact radius, the largest pull, the energy that elastic
# spheres lose in the neck, and the speed below which they stay together. It compares them with computed collisions
# (`viscopade.collision.adhesion`, `viscopade.collision.contact`).

# %%
import sympy as sp
from mpmath import mp, mpf

from viscopade.collision.adhesion import JKR, LARGEST_PULL, TURN_OF_COMPRESSION

E, R, w, a, m, v, z = sp.symbols("E R w a m v z", positive=True)
x = sp.Symbol("x", real=True)

# %% [markdown]
# ## Force and compression
#
# Press the spheres, without adhesion, to the contact radius $a$: Hertz' compression is $a^2/R$, his force
# $4 E a^3/(3 R)$. Then pull them back to the compression $x$ with the contact radius held. A flat punch of radius $a$
# has the stiffness $2 E a$, so the energy is that of Hertz, and that of this spring from there. The surfaces gain
# $\pi a^2 w$.

# %%
x_hertz, F_hertz = a**2 / R, 4 * E * a**3 / (3 * R)
U_hertz = sp.integrate(F_hertz * sp.diff(x_hertz, a), a)
back = x - x_hertz
U = U_hertz + F_hertz * back + E * a * back**2 - w * sp.pi * a**2
assert sp.simplify(sp.diff(U, x) - (F_hertz + 2 * E * a * back)) == 0  # the force

# %% [markdown]
# At a given $x$ the contact radius is that of the least energy, $dU/da = 0$. All terms but two cancel:
# $E (x - a^2/R)^2 = 2 \pi w a$. The spring pulls, so $x$ is below $a^2/R$.

# %%
assert sp.simplify(sp.diff(U, a) - (E * back**2 - 2 * sp.pi * w * a)) == 0
x_of_a = x_hertz - sp.sqrt(2 * sp.pi * w * a / E)
F_of_a = F_hertz - sp.sqrt(8 * sp.pi * w * E * a**3)
assert sp.simplify((F_hertz + 2 * E * a * back).subs(x, x_of_a) - F_of_a) == 0
stability = sp.diff(U, a, 2).subs(x, x_of_a)  # the energy is least, and not largest, for dx/da > 0
assert sp.simplify(stability - 2 * E * sp.sqrt(2 * sp.pi * w * a / E) * sp.diff(x_of_a, a)) == 0
print("x =", x_of_a, "   F =", F_of_a)

# %% [markdown]
# ## In units of the first contact
#
# Approaching spheres touch first at $x = 0$. There $a$ is $a_0 = (2 \pi w R^2/E)^{1/3}$ at once. With
# $z = (a/a_0)^{1/2}$, $x$ in units of $a_0^2/R$ and $F$ in units of $4 E a_0^3/(3 R)$, everything is a polynomial:

# %%
a_0 = (2 * sp.pi * w * R**2 / E) ** sp.Rational(1, 3)
length, force = a_0**2 / R, 4 * E * a_0**3 / (3 * R)
X, F = z**4 - z, z**6 - sp.Rational(3, 2) * z**3
assert sp.simplify(x_of_a.subs(a, a_0 * z**2) / length - X) == 0
assert sp.simplify(F_of_a.subs(a, a_0 * z**2) / force - F) == 0

# %% [markdown]
# Three places matter: first contact, $z = 1$; the largest pull, $dF/dz = 0$; and $dx/da = 0$, where no longer neck
# exists. Free bodies come to the last one, because they move with a given compression, and not under a given force.
# Some programs end contact at the largest pull.

# %%
z_pull, z_turn = sp.Rational(3, 4) ** sp.Rational(1, 3), sp.Rational(1, 4) ** sp.Rational(1, 3)
assert sp.diff(F, z).subs(z, z_pull) == 0
assert sp.diff(X, z).subs(z, z_turn) == 0
for place, factor in ((1, sp.Rational(4, 3)), (z_pull, sp.Rational(3, 2)), (z_turn, sp.Rational(5, 6))):
    assert sp.simplify((force * F).subs(z, place) + factor * sp.pi * w * R) == 0
for place, stated in ((z_pull, "-0.2271"), (z_turn, "-0.4725")):
    assert abs(sp.N(X.subs(z, place)) - sp.Float(stated)) < 5e-5
print("first contact: F = -4/3 pi w R; largest pull 3/2 pi w R; dx/da = 0: F = -5/6 pi w R")

# %% [markdown]
# ## The contact radius of a compression
#
# $z^4 - z = X$ is a quartic. It is a product of two quadratics with the coefficients $\pm p$ of $z$, where $u = p^2$
# solves $u^3 + 4 X u - 1 = 0$. Exactly one $u$ is positive, because the zeros have the product 1 and the sum 0. $z$ is
# the larger root; it is real as long as $p^3 \le 2$, that is from the $X$ of $dx/da = 0$ on.

# %%
p = sp.Symbol("p", positive=True)
product = (z**2 + p * z + (p**2 + 1 / p) / 2) * (z**2 - p * z + (p**2 - 1 / p) / 2)
assert sp.simplify(product - (z**4 - z) - (p**4 - p**-2) / 4) == 0  # so X = -(p^4 - 1/p^2)/4
resolvent = p**6 + 4 * sp.Symbol("X") * p**2 - 1
assert sp.simplify(resolvent.subs(sp.Symbol("X"), -(p**4 - p**-2) / 4)) == 0
root = (p + sp.sqrt(2 / p - p**2)) / 2
assert sp.simplify(root**2 - p * root + (p**2 - 1 / p) / 2) == 0
assert root.subs(p, 2 ** sp.Rational(1, 3)).equals(z_turn)  # the square root is 0 where dx/da = 0

# %% [markdown]
# ## The energy of the neck
#
# Elastic spheres come and go along the same $F(x)$, but for the neck: it holds from $x = 0$ to the break, on the way
# back only. So they lose $W = -\int F dx$ between the break and $x = 0$, at every speed.

# %%
lost = sp.integrate(-F * sp.diff(X, z), (z, z, 1))
claimed = sp.Rational(9, 40) + sp.Rational(2, 5) * z**10 - z**7 + sp.Rational(3, 8) * z**4
assert sp.expand(lost - claimed) == 0
STATED = {z_turn: "7.09220", z_pull: "3.50260"}
k = {}
for place, stated in STATED.items():
    W = force * length * lost.subs(z, place)
    k[place] = sp.simplify(W / (w**5 * R**4 / E**2) ** sp.Rational(1, 3))
    assert not k[place].free_symbols
    assert abs(sp.N(k[place]) - sp.Float(stated)) < 5e-6
assert k[z_turn].equals(sp.Rational(4, 3) * (2 * sp.pi) ** sp.Rational(5, 3) * (sp.Rational(9, 40) + 3 * z_turn / 80))
assert k[z_pull].equals(sp.Rational(4, 3) * (2 * sp.pi) ** sp.Rational(5, 3) * (sp.Rational(9, 40) - 9 * z_pull / 80))
print("W = k (w^5 R^4/E^2)^(1/3), k =", *(f"{sp.N(number, 7)}" for number in k.values()))

# %% [markdown]
# ## The speed below which elastic spheres stick
#
# $m v^2/2 - W$ is left after the break. So $\varepsilon = (1 - (v_s/v)^2)^{1/2}$, $v_s = (2 W/m)^{1/2}$, and
# $\varepsilon = 0$ below $v_s$. $v_s$ grows with $w^{5/6}$: ten times the surface energy is a factor of 6.8. For a
# sphere of radius $R$ and density $D$ on a plane of its material, with $m = \frac{4}{3} \pi D R^3$, $v_s$ is in
# proportion to $R^{-5/6}$: small spheres stick.

# %%
v_s = sp.sqrt(2 * k[z_turn] / m) * (w**5 * R**4 / E**2) ** sp.Rational(1, 6)
eps = sp.sqrt(1 - v_s**2 / v**2)
assert sp.simplify(m * v**2 / 2 * (1 - eps**2) - k[z_turn] * (w**5 * R**4 / E**2) ** sp.Rational(1, 3)) == 0
D = sp.Symbol("D", positive=True)
assert sp.simplify(sp.diff(sp.log(v_s), w) * w) == sp.Rational(5, 6)
assert sp.simplify(sp.diff(sp.log(v_s.subs(m, 4 * sp.pi * D * R**3 / 3)), R) * R) == -sp.Rational(5, 6)
print("v_s =", sp.simplify(v_s))

# %% [markdown]
# ## DMT is a constant load
#
# For small and stiff spheres the contact has Hertz' profile, and attraction outside of it pulls with $2 \pi w R$ as
# long as they touch (Derjaguin, Muller and Toporov 1975). That is the constant load of `16_load.py`: elastic spheres
# lose nothing, and damped ones stick below a speed. The same holds for programs whose JKR force acts at $x > 0$ only.
#
# ## Against the package
#
# The formulas above in 30 digits, the package's contact radius and force, and whole collisions.

# %%
numbers = {E: mpf("3.5e6"), R: mpf("2e-4"), w: mpf("0.07"), m: mpf("4e-8")}
places = {"turn": (z_turn, TURN_OF_COMPRESSION), "pull": (z_pull, LARGEST_PULL)}
for name, (place, in_package) in places.items():
    spheres = JKR(*(float(numbers[symbol]) for symbol in (E, R, w)), neck=in_package)
    with mp.workdps(30):
        W = sp.lambdify((E, R, w), force * length * lost.subs(z, place), "mpmath")(*(numbers[s] for s in (E, R, w)))
        speed = mp.sqrt(2 * W / numbers[m])
        of_z = sp.lambdify((z, E, R, w), (length * X, force * F, a_0 * z**2), "mpmath")
        for at_z in (mpf("0.63"), mpf("0.7"), mpf(1), mpf(3), mpf(1000)):
            compression, pull, radius = (float(q) for q in of_z(at_z, numbers[E], numbers[R], numbers[w]))
            found = spheres.contact_radius(compression)
            error = 1e-10 if at_z < 0.64 else 1e-13  # near dx/da = 0 radius and force have fewer digits than x
            assert abs(float(found) / radius - 1) < error
            assert abs(float(spheres.force(found)) / pull - 1) < error
    assert abs(spheres.neck_energy / float(W) - 1) < 1e-14
    contact = spheres.contact(float(numbers[m]), lambda a: 0 * a)
    assert abs(contact.neck_energy / float(W) - 1) < 1e-11
    for factor in (1.001, 1.5, 10):
        collision = contact.collide(factor * float(speed))
        assert abs(collision.epsilon - (1 - factor**-2) ** 0.5) < 1e-10
    assert not contact.collide(0.999 * float(speed)).parts
    print(f"{name}: W = {float(W):.6g} J, spheres of 40 ug stick below {float(speed):.6g} m/s")

print("derived: the force of adhering spheres, the energy of the neck and the sticking speed")
