# %% [markdown]
# # 16. A constant load: weight during the contact
#
# The weight $F_0$ presses a body that falls on a plane down during contact:
#
# $$m \ddot{\xi} + k \xi^a + c \xi^b \dot{\xi} = F_0.$$
#
# This file derives the load $G$ of the scaled equation, the loss for small damping with a load, $\lambda(G)$, and its
# slope $\lambda'(0)$. It checks the numbers of docs/theory/mathematics.md, section 12, with computed collisions
# (`viscopade.collision.contact`).

# %%
import sympy as sp
from mpmath import mp, mpf

from viscopade.collision import exact
from viscopade.collision.contact import Contact
from viscopade.theory.law import law_of

a, k, m, v, F0, G, kappa = sp.symbols("a k m v F_0 G kappa", positive=True)
b = sp.Symbol("b", nonnegative=True)
x, x_m = sp.symbols("x x_m", positive=True)

# %% [markdown]
# ## The scaled load
#
# Lengths in units of $X$, times in units of $T$ (derivation 15): the acceleration $F_0/m$ is $G$ in units of $X/T^2$.

# %%
T = (m / k) ** (1 / (a + 1)) * v ** ((1 - a) / (1 + a))
X = v * T
scaled = F0 / m * T**2 / X
claimed = F0 / m * (k / m) ** (-1 / (a + 1)) * v ** (-2 * a / (a + 1))
assert sp.simplify(sp.expand(sp.expand_log(sp.log(scaled / claimed), force=True))) == 0
# kappa ~ v^(2/nu-1): for one body on one plane a power of kappa times G does not depend on v. Hertz: kappa^6 G.
viscoelastic = {a: sp.Rational(3, 2), b: sp.Rational(1, 2)}
of_kappa = (2 * (b + 1) / (a + 1) - 1).subs(viscoelastic)
assert 6 * of_kappa + (-2 * a / (a + 1)).subs(viscoelastic) == 0
print("G =", claimed)

# %% [markdown]
# ## The loss for small damping
#
# Without damping $E = w^2/2 + x^{a+1}/(a+1) - G x$ is constant, $1/2$ at first contact. So $\varepsilon = 1$ for every
# load: the speed at $x = 0$ is the same on return. With damping $dE/dt = -\kappa x^b w^2$, that is
# $dE/dx = -\kappa x^b w$ in loading and $+\kappa x^b \lvert w \rvert$ in unloading. To first order $w$ is that without
# damping, and both halves have the same loss:

# %%
w2 = 1 + 2 * G * x - 2 * x ** (a + 1) / (a + 1)
energy = sp.Rational(1, 2) * w2 + x ** (a + 1) / (a + 1) - G * x
assert sp.simplify(energy - sp.Rational(1, 2)) == 0
lost = sp.Symbol("lambda", positive=True)  # over kappa: 2 int_0^(x_m) x^b w dx
eps = sp.sqrt(1 - 2 * kappa * lost)
assert sp.series(eps, kappa, 0, 2).removeO() == 1 - kappa * lost
# The end condition makes no difference to this order. At the end "force" x^a = kappa x^b |w|, so x_c^(a-b) = kappa
# |w|. Between x_c and x = 0 the work of both forces is below kappa x_c^(b+1), which is o(kappa).
print("1 - eps = kappa lambda(G),  lambda(G) = 2 int_0^(x_m) x^b sqrt(1 + 2 G x - 2 x^(a+1)/(a+1)) dx")

# %% [markdown]
# ## The slope
#
# The radicand vanishes at $x_m$, so $x_m$ does not contribute to the derivative:
# $\lambda'(0) = 2 \int_0^{x_m} x^{b+1}/w dx$ at $G = 0$. With $y = 2 x^{a+1}/(a+1)$ from 0 to 1 it is a Beta function,
# as $\lambda(0)$ is.

# %%
y = sp.Symbol("y", positive=True)
x_of_y = ((a + 1) / 2 * y) ** (1 / (a + 1))
assert sp.simplify(w2.subs(G, 0).subs(x, x_of_y) - (1 - y)) == 0


def power_and_factor(integrand):
    """Return p and c of the integrand c y^p (1 - y)^(+-1/2) after the substitution."""
    inner = sp.log(integrand.subs(x, x_of_y)) + sp.log(sp.diff(x_of_y, y))
    inner = sp.expand(sp.expand_log(sp.simplify(inner), force=True))
    p = sp.simplify(y * sp.diff(inner, y))
    return p, sp.simplify(sp.exp(sp.simplify(sp.expand(inner - p * sp.log(y)))))


for integrand, half in ((2 * x**b, sp.Rational(3, 2)), (2 * x ** (b + 1), sp.Rational(1, 2))):
    p, factor = power_and_factor(integrand)
    extra = 0 if half == sp.Rational(3, 2) else 1
    n = (b + 1 + extra) / (a + 1)  # B(n, half)
    assert sp.simplify(p + 1 - n) == 0
    wanted = 2 / (a + 1) * ((a + 1) / 2) ** n
    assert sp.simplify(sp.expand(sp.expand_log(sp.log(factor / wanted), force=True))) == 0
at_0 = 2 / (a + 1) * ((a + 1) / 2) ** ((b + 1) / (a + 1)) * sp.beta((b + 1) / (a + 1), sp.Rational(3, 2))
slope = 2 / (a + 1) * ((a + 1) / 2) ** ((b + 2) / (a + 1)) * sp.beta((b + 2) / (a + 1), sp.Rational(1, 2))
t_c = 2 * sp.sqrt(sp.pi) * ((a + 1) / 2) ** (1 / (a + 1)) * sp.gamma(1 + 1 / (a + 1))
t_c = t_c / sp.gamma(sp.Rational(1, 2) + 1 / (a + 1))  # of the contact without damping
print("lambda(0) =", at_0)
print("lambda'(0) =", slope)

NAMES = {"viscoelastic": (sp.Rational(3, 2), sp.Rational(1, 2)), "linear": (1, 0), "hunt-crossley:1": (1, 1)}
STATED = {  # docs/theory/mathematics.md, section 12: lambda(0), lambda'(0), the factor of g t_c/v
    "viscoelastic": ("1.153449", 2, "0.539"),
    "linear": (sp.pi / 2, 2, "0.405"),
    "hunt-crossley:1": (sp.Rational(2, 3), sp.pi / 2, None),
}
for name, (elastic, damping) in NAMES.items():
    here = {a: elastic, b: damping}
    zeroth, first = at_0.subs(here), slope.subs(here)
    stated = STATED[name]
    assert abs(sp.N(zeroth - sp.sympify(stated[0]), 20)) < 5e-7
    assert abs(sp.N(first - stated[1], 20)) < 1e-18
    # the loss grows by the factor 1 + lambda'(0)/lambda(0) G, and G is g t_c/v over the scaled contact time
    per_time = sp.N(first / zeroth / t_c.subs(here), 15)
    if stated[2]:
        assert abs(per_time - sp.Float(stated[2])) < 5e-4
    print(f"{name}: 1 - eps = kappa ({sp.N(zeroth, 8)} + {sp.N(first, 8)} G), 1 + {sp.N(per_time, 4)} g t_c/v")

# %% [markdown]
# ## Against whole collisions
#
# $\lambda(G)$ by quadrature is compared with $1 - \varepsilon$ of collisions with small damping, for both ends.
# Viscoelastic spheres at $G = 0.1$ and 0.3: 1.369959 and 1.908500. A linear dashpot: 1.787170 and 2.329856.


# %%
def quadrature(elastic, damping, load):
    """Return lambda(G)."""
    with mp.workdps(25):
        p, q, g = mpf(elastic.p) / elastic.q, mpf(damping.p) / damping.q, mpf(load)

        def radicand(at):
            return 1 + 2 * g * at - 2 * at ** (p + 1) / (p + 1)

        end = mp.findroot(radicand, (mpf("0.5"), mpf(4)), solver="anderson")
        # x = end sin^2, so that the square root at x_m is smooth
        return 2 * mp.quad(
            lambda s: (end * mp.sin(s) ** 2) ** q * mp.sqrt(abs(radicand(end * mp.sin(s) ** 2))) * end * mp.sin(2 * s),
            [0, mp.pi / 4, mp.pi / 2],
        )


EXPECTED = {("viscoelastic", "0.1"): "1.369959", ("viscoelastic", "0.3"): "1.908500"}
EXPECTED |= {("linear", "0.1"): "1.787170", ("linear", "0.3"): "2.329856"}
for name, (elastic, damping) in NAMES.items():
    elastic, damping = sp.Rational(elastic), sp.Rational(damping)
    for load in ("0", "0.1", "0.3"):
        value = quadrature(elastic, damping, load)
        if load == "0":
            assert abs(value - mpf(str(sp.N(at_0.subs({a: elastic, b: damping}), 25)))) < mpf("1e-15")
        if (name, load) in EXPECTED:
            assert abs(value - mpf(EXPECTED[name, load])) < mpf("1e-6")
        for end in ("force", "return"):
            found = Contact.of_law(law_of(name, end), 1e-7, float(load)).collide()
            assert abs((1 - found.epsilon) / 1e-7 / float(value) - 1) < 1e-5
    h = mpf("1e-6")
    difference = (quadrature(elastic, damping, h) - quadrature(elastic, damping, -h)) / (2 * h)
    assert abs(difference - mpf(str(sp.N(slope.subs({a: elastic, b: damping}), 25)))) < mpf("1e-9")

# For any kappa: eps at G = 0.01, 0.03 and 0.1 of a body with eps = 0.5 without a load.
for name, end, values in (
    ("linear", "force", (0.492, 0.476, 0.411)),
    ("linear", "return", (0.494, 0.480, 0.427)),
    ("viscoelastic", "force", (0.490, 0.468, 0.380)),
    ("hunt-crossley", "force", (0.489, 0.465, 0.365)),
):
    law = law_of(name, end)
    damping = exact.invert("0.5", law=law, digits=12).floats()["v_star"] ** law.d
    found = [Contact.of_law(law, damping, load).collide().epsilon for load in (0.01, 0.03, 0.1)]
    assert all(abs(one - other) < 6e-4 for one, other in zip(found, values, strict=True))
    print(f"{name}, end {end}: 0.5 becomes", *(f"{value:.4f}" for value in found))

print("derived: the scaled load, the loss for small damping with a load and its slope")
