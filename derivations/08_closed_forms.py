# %% [markdown]
# # 8. Closed forms
#
# Which of the numbers $G_n$ (derivation 3) and $\lambda_k$ (derivation 6) are values of known functions? This file
# derives and proves:
#
# $$G_1 = \frac{1}{2} B\left(\frac{3}{5}, \frac{3}{2}\right), \qquad
# \lambda_1 = 2 \left(\frac{4}{5}\right)^{2/5} G_1, \qquad G_2 = \frac{3}{5} G_1^2 - \frac{25}{132},$$
#
# $$G_3 = \frac{7}{25} G_1^3 - \frac{5}{22} G_1 + \frac{125}{2904} B\left(\frac{9}{5}, \frac{1}{2}\right), \qquad
# \lambda_3 = \left(\frac{4}{5}\right)^{6/5} \frac{125}{1452} B\left(\frac{9}{5}, \frac{1}{2}\right)
# - \frac{\lambda_1^3}{600}.$$
#
# $G_4$ and $\lambda_5$ contain one new number each, a single integral, for which we found no combination of Gamma
# functions; the search is at the end, with the bound that it proves.

# %%
import sympy as sp
from flint import fmpz_mat
from mpmath import mp, pslq, quad

from viscopade.theory import symbolic
from viscopade.theory.series import g_coefficients, lambda_coefficients

# %% [markdown]
# ## The functions that can occur
#
# Each order of the hierarchy, $2 g_0 g_n = P_n - \sum_{0 < i < n} g_i g_{n-i}$ with $r P_n' = -5 r^3 g_{n-1}$, is one
# integration. Let $X = r^3$ and $y = g_0 = \sqrt{1 - r^5}$. With $\theta = r \frac{d}{dr}$, $\theta X = 3 X$ and
# $\theta y = \frac{5}{2} (y - 1/y)$: powers of $X$ and $y$ transform into each other. Other integrals become new
# functions: an incomplete Beta function $F_i$ of $u = r^5$ or an integral over some of them:
#
# $$\theta F_i = \frac{5 X^i}{y} \quad (i = 1, 3, 5), \qquad \theta D = F_1 \theta F_3, \qquad
# \theta T = F_1^2 \theta F_3.$$
#
# Counting $X$ and $F_i$ with weights 1 and $i$, $D$ with 4, $T$ with 5, each order raises the weight by one. And $g^2$,
# whose part of order $K^n$ is $P_n$, stays the same if $g$ and $K$ change their signs: with $y$ and all $F_i$ (the same
# $r$, on the other branch of the root) $P_n$ is even or odd like $n$.

# %%
X, y, F_1, F_3, F_5, D, T = sp.symbols("X y F_1 F_3 F_5 D T")
THETA = {
    X: 3 * X,
    y: sp.Rational(5, 2) * (y - 1 / y),
    F_1: 5 * X / y,
    F_3: 5 * X**3 / y,
    F_5: 5 * X**5 / y,
    D: 5 * X**3 / y * F_1,
    T: 5 * X**3 / y * F_1**2,
}
WEIGHT = {X: 1, F_1: 1, F_3: 3, D: 4, F_5: 5, T: 5}
PARITY = {X: 0, F_1: 1, F_3: 1, D: 0, F_5: 1, T: 1}


def theta(f):
    return sp.expand(sum(f.diff(v) * rate for v, rate in THETA.items()))


def monomials(weight, letters=tuple(WEIGHT)):
    """All products of the letters with this weight, with their parity."""
    if not letters:
        return [(sp.Integer(1), 0)] if weight == 0 else []
    first, *rest = letters
    return [
        (first**power * other, (PARITY[first] * power + parity) % 2)
        for power in range(weight // WEIGHT[first] + 1)
        for other, parity in monomials(weight - power * WEIGHT[first], rest)
    ]


def antiderivative(f, n, weights):
    """P with theta P = f, by undetermined coefficients; up to a constant."""
    trial = [
        product * y**power
        for weight in weights
        for product, parity in monomials(weight)
        for power in range(-n, n + 1)
        if (power + parity - n) % 2 == 0
    ]
    unknowns = sp.symbols(f"c:{len(trial)}")
    residual = theta(sum(c * m for c, m in zip(unknowns, trial, strict=True))) - f
    equations = sp.Poly(sp.expand(residual * y ** (n + 2)), *THETA).coeffs()
    (solution,) = sp.linsolve(equations, unknowns)
    values = [c.subs(dict.fromkeys(unknowns, 0)) for c in solution]
    return sum(c * m for c, m in zip(values, trial, strict=True))


def solve_hierarchy(orders, weights, constant):
    """g_0 … g_orders; `constant` returns the integration constant to subtract."""
    orders_so_far = [y]
    for n in range(1, orders + 1):
        P_n = antiderivative(-5 * X * orders_so_far[n - 1], n, weights(n))
        P_n -= constant(P_n)
        products = sum(orders_so_far[i] * orders_so_far[n - i] for i in range(1, n))
        orders_so_far.append(sp.expand((P_n - products) / (2 * y)))
        assert_solved(orders_so_far, n)
    return orders_so_far


def assert_solved(orders, n):
    """The equation of order n, as `viscopade.theory.symbolic` writes it, holds identically."""
    r = symbolic.r
    equation = symbolic.hierarchy(n)
    residual = r * (equation.lhs - equation.rhs)
    for i in range(n + 1):
        g_i = symbolic.g_function(i)
        residual = residual.subs(g_i.diff(r), theta(orders[i]) / r).subs(g_i, orders[i])
    assert sp.expand(residual.expand().subs(r, X ** sp.Rational(1, 3))) == 0


# %% [markdown]
# ## $G_1$ to $G_4$: from the turning point
#
# $g_n$ vanishes at $r = 1$, and all $F_i$, $D$ are counted from there: near $y = 0$, $dF_i = -2 (1-y^2)^{(3i-3)/5} dy$
# and $X = (1-y^2)^{3/5}$, so that the constant in $P_n$ follows from a Taylor polynomial in $y$. Weights below $n$
# occur because of these constants.

# %%
TAYLOR = 8


def at_turning_point(f):
    """The constant of the Laurent series at y = 0; there are no negative powers."""

    def power_of_r(exponent):
        return sum(sp.binomial(sp.Rational(exponent, 5), m) * (-y * y) ** m for m in range(TAYLOR // 2 + 1))

    def integral(rate):
        return sp.integrate(sp.expand(rate), y)

    F_1_near, F_3_near = (integral(-2 * power_of_r(3 * i - 3)) for i in (1, 3))
    D_near = integral(F_1_near * F_3_near.diff(y))
    near = sp.expand(f.subs({F_1: F_1_near, F_3: F_3_near, D: D_near, X: power_of_r(3)}))
    assert all(near.coeff(y, -power) == 0 for power in range(1, TAYLOR))
    return near.coeff(y, 0)


g_turning = solve_hierarchy(4, lambda n: range(n, -1, -2), at_turning_point)
for n in (1, 2, 3):
    print(f"g_{n} =", g_turning[n])

# %% [markdown]
# At $r = 0$ we have $X = 0$, $y = 1$. Let $B_i = 5 \int_0^1 r^{3i-1} dr/\sqrt{1-r^5} = B(3i/5, 1/2)$: $F_i(0) = -B_i$.
# And let $a = D(0) = \int_0^1 (B_1 - f_1) df_3$, where $f_i = F_i + B_i$ is counted from $r = 0$.

# %%
B_1, B_3, a, G_1 = sp.symbols("B_1 B_3 a G_1", positive=True)
G = [g_n.subs({X: 0, y: 1, F_1: -B_1, F_3: -B_3, D: a}) for g_n in g_turning]
in_G_1 = {B_1: sp.Rational(22, 5) * G_1}
assert G[1].subs(in_G_1) == G_1
for n in (2, 3, 4):
    print(f"G_{n} =", sp.expand(G[n].subs(in_G_1)))

gamma_forms = {
    B_i: sp.gamma(q) * sp.sqrt(sp.pi) / sp.gamma(q + sp.Rational(1, 2))
    for B_i, q in ((B_1, sp.Rational(3, 5)), (B_3, sp.Rational(9, 5)))
}
assert sp.gammasimp(G[1].subs(gamma_forms) - symbolic.g_1_at_0()) == 0
assert sp.gammasimp(G[2].subs(gamma_forms) - symbolic.g_2_at_0()) == 0
assert sp.gammasimp(G[3].subs(gamma_forms) - symbolic.g_3_at_0()) == 0

# %% [markdown]
# $G_2$ is a consequence of one integration by parts, with $(y r^3)' = \frac{11}{2} y r^2 - \frac{5}{2} r^2/y$. Written
# as a hypergeometric series,
#
# $$2 G_2 + G_1^2 = \frac{5}{6} B\left(\frac{6}{5}, \frac{3}{2}\right)
# {}_3F_2\left(\frac{1}{2}, \frac{3}{5}, \frac{6}{5}; \frac{8}{5}, \frac{27}{10}; 1\right),$$
#
# which is contiguous to Dixon's well-poised sum (with $17/10$ instead of $27/10$).

# %%
with mp.workdps(25):
    fifth = mp.mpf(1) / 5
    hypergeometric = mp.hyp3f2(0.5, 3 * fifth, 6 * fifth, 8 * fifth, mp.mpf(27) / 10, 1)
    left = 5 * mp.beta(6 * fifth, 1.5) / 6 * hypergeometric
    right = mp.mpf(11) / 5 * (mp.beta(3 * fifth, 1.5) / 2) ** 2 - mp.mpf(25) / 66
    print("3F2 and its closed form:", mp.nstr(left, 20), mp.nstr(right, 20))
    assert abs(left - right) < mp.mpf(10) ** -20

# %% [markdown]
# ## $\lambda_1$, $\lambda_3$, $\lambda_5$: around the turning point
#
# There is a shorter way to the $\lambda_k$, which also shows their numbers. Measure the compression by the turning
# point of the undamped motion with the same initial speed: $r = 0$, $g = 1$ is the start, and $K$ becomes
# $k = (4/5)^{2/5} \kappa$, because $\kappa = (5/4)^{2/5} K V^{1/5}$ with $V = 1$. The hierarchy is the same; its
# initial condition is $g_n(0) = 0$ for $n \ge 1$.
#
# Now the orders are singular at $r = 1$, near the true turning point. But a path of complex $r$ from 0 around $r = 1$
# and back to 0 stays away from it, so that there the expansion converges for small $k$. The true $g$, an analytic
# function of $r$ with a square root's branch point at its own turning point, arrives with the other sign: unloading. At
# the end $y = -1$ and $g = -\varepsilon_0$. Now order $n$ is exactly homogeneous, of weight $n$.

# %%
g_loop = solve_hierarchy(5, lambda n: [n], lambda P_n: P_n.subs(dict.fromkeys((X, F_1, F_3, F_5, D, T), 0)))
for g_n in g_loop[1:]:
    assert g_n.subs(dict.fromkeys((X, F_1, F_3, F_5, D, T), 0)) == 0

# %% [markdown]
# Values at the end. On the way back both $y$ and $dr$ have the other sign: the $F_i$, counted from the start, are $B_i$
# at the turning point and $2 B_i$ at the end. With $f_i$ on the way out and $2 B_i - f_i$ on the way back,
#
# $$D = \int (f_1 + (2 B_1 - f_1)) df_3 = 2 B_1 B_3,$$
#
# $$T = \int (f_1^2 + (2 B_1 - f_1)^2) df_3 = 2 B_1^2 B_3 + 2 M, \qquad M = \int_0^1 (B_1 - f_1)^2 df_3:$$
#
# the new number $a$ of $G_4$ drops out. $B_5 = B(3, 1/2) = 16/15$ is rational.

# %%
M = sp.Symbol("M", positive=True)
F_5_once = sp.integrate(2 * (1 - y**2) ** 2, (y, 0, 1))
assert F_5_once == sp.Rational(16, 15)
at_end = {
    X: 0,
    y: -1,
    F_1: 2 * B_1,
    F_3: 2 * B_3,
    F_5: 2 * F_5_once,
    D: 2 * B_1 * B_3,
    T: 2 * B_1**2 * B_3 + 2 * M,
}
eps0 = [sp.expand(-g_n.subs(at_end)) for g_n in g_loop]
print("eps0 =", " + ".join(f"({c}) k^{n}" for n, c in enumerate(eps0)))

# %% [markdown]
# On the other hand the coefficients of $\varepsilon_0$ are polynomials in the $\lambda_k$ (`07_coefficients.py`; the
# factors $4/5$ go into $l_i = (5/4)^{2i/5} \lambda_i$). Orders 1, 3 and 5 determine $l_1$, $l_3$ and $l_5$. Orders 2
# and 4 must agree without a new number, by time reversal.

# %%
l_1, l_3, l_5, t = sp.symbols("l_1 l_3 l_5 t")
found = {}
for n in range(1, 6):
    rate = -sp.Rational(10 + n, 10)
    exponent = rate * (l_1 * t + l_3 * t**3 + l_5 * t**5)
    power = sum(exponent**m / sp.factorial(m) for m in range(n + 1))
    difference = (sp.Rational(10, 10 + n) * sp.expand(power).coeff(t, n) - eps0[n]).subs(found)
    if n % 2:
        unknown = {1: l_1, 3: l_3, 5: l_5}[n]
        (found[unknown],) = sp.solve(difference, unknown)
        found[unknown] = sp.expand(found[unknown])
        print(f"(5/4)^({2 * n}/5) lambda_{n} =", found[unknown])
    else:
        assert sp.expand(difference) == 0

scale = sp.Rational(4, 5) ** sp.Rational(2, 5)
for n, unknown, closed in ((1, l_1, symbolic.lambda_1()), (3, l_3, symbolic.lambda_3())):
    assert sp.gammasimp(sp.expand(closed / scale**n - found[unknown].subs(gamma_forms))) == 0
    in_the_G = symbolic.lambda_from_G(n).subs({symbolic.G_symbol(i): G[i] for i in range(1, n + 1)})
    assert sp.expand(in_the_G / scale**n - found[unknown]) == 0

# %% [markdown]
# So $\lambda_5$ and $h_{10}$ are the first to contain more than Gamma functions. In $h_6$ the cubes combine.

# %%
lambda_1, lambda_3 = symbolic.lambda_symbol(1), symbolic.lambda_symbol(3)
closed_h = [k for k in range(30) if symbolic.h_polynomial(k).free_symbols <= {lambda_1, lambda_3}]
print("in Gamma functions: h_k for k =", closed_h)
assert closed_h == [*range(10), 11, 13]

h_6 = symbolic.h_polynomial(6).subs(lambda_3, sp.Rational(125, 1452) * scale**3 * B_3 - lambda_1**3 / 600)
print("h_6 =", sp.expand(h_6))
assert sp.expand(h_6 + sp.Rational(7, 25) * lambda_1**3 + sp.Rational(125, 1452) * scale**3 * B_3) == 0

# %% [markdown]
# ## The same in numbers
#
# The closed forms and the two formulas with $a$ and $M$, against the proven enclosures, with $a$ and $M$ by quadrature
# in $z = \sqrt{1 - r^5}$: $df_i = 2 (1-z^2)^{(3i-3)/5} dz$ towards $r = 0$.

# %%
DIGITS = 400


def number_in(ball):
    return mp.mpf(ball.str(DIGITS, radius=False))


with mp.workdps(DIGITS):
    G_number = [number_in(ball) for ball in g_coefficients(4, DIGITS)]
    l_number = {
        n: number_in(ball) * (mp.mpf(5) / 4) ** (mp.mpf(2 * n) / 5)
        for n, ball in zip((1, 3, 5), lambda_coefficients(3, DIGITS), strict=True)
    }
    beta = {e: mp.beta(mp.mpf(e) / 5, 0.5) for e in (1, 2, 3, 4, 9)}
    known = {B_1: beta[3], B_3: beta[9]}
    tiny = mp.mpf(10) ** (10 - DIGITS)

    def evaluated(expression, values):
        return sp.lambdify(list(values), expression, "mpmath")(*values.values())

    for n in (1, 2, 3):
        assert abs(evaluated(G[n], known) - G_number[n]) < tiny
    for n, l_n in ((1, l_1), (3, l_3)):
        assert abs(evaluated(found[l_n], known) - l_number[n]) < tiny
    (a_formula,), (M_formula,) = (sp.solve(G[4] - t, a), sp.solve(found[l_5] - t, M))
    a_number = evaluated(a_formula, known | {t: G_number[4]})
    M_number = evaluated(M_formula, known | {t: l_number[5]})

with mp.workdps(30):

    def from_turning_point(z):
        """B_1 - f_1 = int_0^z 2 (1-z^2)^(-2/5) dz."""
        return 2 * z * mp.hyp2f1(mp.mpf(2) / 5, 0.5, 1.5, z * z)

    for name, power, number in (("a", 1, a_number), ("M", 2, M_number)):
        integral = quad(
            lambda z, power=power: 2 * (1 - z * z) ** (mp.mpf(4) / 5) * from_turning_point(z) ** power, [0, 1]
        )
        print(f"{name} by quadrature and from the enclosures:", mp.nstr(integral, 20), mp.nstr(number, 20))
        assert abs(integral - number) < mp.mpf(10) ** -25

# %% [markdown]
# ## Relations found by PSLQ
#
# Integer relations between numbers, at 60 digits, without the derivation. They are the proven relations.

# %%
with mp.workdps(60):
    G_2_relation = pslq([+G_number[2], G_number[1] ** 2, mp.mpf(1)], maxcoeff=10**6, maxsteps=10**5)
    l_3_relation = pslq([+l_number[3], +beta[9], G_number[1] ** 3], maxcoeff=10**6, maxsteps=10**5)
    print("PSLQ: (G_2, G_1^2, 1) .", G_2_relation, "= 0,  (l_3, B_3, G_1^3) .", l_3_relation, "= 0")
    for relation, proven in (
        (G_2_relation, [1, -sp.Rational(3, 5), sp.Rational(25, 132)]),
        (l_3_relation, [1, -sp.Rational(125, 1452), sp.Rational(1, 75)]),
    ):
        assert [sp.Rational(c, relation[0]) for c in relation] == proven

# %% [markdown]
# ## Relations not found
#
# $a$ and $M$ are iterated integrals of $r^2 dr/y$ and $r^8 dr/y$ on the curve $y^2 = 1 - r^5$. Turning $r$ by a fifth
# root of unity multiplies these forms, the integrals $W_e = B(e/5, 1/2)$ and products of them by roots of unity: $W_e$
# by the $e$-th power. Candidates for $a$ have a sum of $e = 2$ mod 5, those for $M$ have 0, and the numbers of the real
# field that $\sqrt{5}$, $\sin(\pi/5)$ and $\sin(2 \pi/5)$ generate may occur as factors.
#
# For numbers $x_1, \dots, x_n$ and a large $S$ the lattice of all $(m_1, \dots, m_n, \sum m_i \text{ round}(S x_i))$
# has a vector of about the length of $m$ if $m$ is a relation. The shortest Gram-Schmidt vector of any basis is a lower
# bound for the length of all lattice vectors; a basis reduced by LLL makes it useful. So an empty search is also a
# proof: no relation has length $(m_1^2 + \dots + m_n^2)^{1/2}$ below the bound.


# %%
def relation_bound(numbers, digits):
    """Proven lower bound on the length of an integer relation between numbers known to `digits` digits."""
    n = len(numbers)
    with mp.workdps(digits + 20):
        scaled = [int(mp.nint(x * mp.mpf(10) ** digits)) for x in numbers]
    rows = fmpz_mat([[int(i == j) for j in range(n)] + [scaled[i]] for i in range(n)]).lll().tolist()
    with mp.workdps(2 * digits):
        orthogonal, squares = [], []
        for row in rows:
            vector = [mp.mpf(int(c)) for c in row]
            for other, square in zip(orthogonal, squares, strict=True):
                share = mp.fdot(vector, other) / square
                vector = [c - share * d for c, d in zip(vector, other, strict=True)]
            orthogonal.append(vector)
            squares.append(mp.fdot(vector, vector))
        # Each rounding is off by at most 1, so that the last entry is at most sqrt(n) times the length of m.
        return mp.sqrt(min(squares) / (1 + n))


with mp.workdps(DIGITS):
    W = beta
    factors = [mp.mpf(1), mp.sqrt(5), mp.sin(mp.pi / 5), mp.sin(2 * mp.pi / 5)]
    logarithms = [mp.log(2), mp.log(5), mp.log((1 + mp.sqrt(5)) / 2)]
    one = mp.mpf(1)

    def times_factors(*products):
        return [product * factor for product in products for factor in factors]

    bases = {
        "a: W_3 W_4, W_1^2, W_2": [a_number, *times_factors(W[3] * W[4], W[1] ** 2, W[2])],
        "a: also 1, pi, W_2 log": [
            a_number,
            *times_factors(W[3] * W[4], W[1] ** 2, W[2], one, mp.pi),
            *(W[2] * c for c in (mp.pi, *logarithms)),
        ],
        "M: 1, pi, W_3^2 W_4, W_2 W_4^2, W_1^2 W_3, W_1 W_2^2": [
            M_number,
            *times_factors(one, mp.pi, W[3] ** 2 * W[4], W[2] * W[4] ** 2, W[1] ** 2 * W[3], W[1] * W[2] ** 2),
        ],
        "M: 1, pi, W_3^2 W_4, W_1^2 W_3, W_3^5, W_3 a, logs, pi^2, zeta(3)": [
            M_number,
            *times_factors(one, mp.pi, W[3] ** 2 * W[4], W[1] ** 2 * W[3]),
            *(W[3] ** 5, W[3] * a_number, *logarithms, mp.pi**2, mp.zeta(3)),
        ],
    }
for name, numbers in bases.items():
    bound = relation_bound(numbers, DIGITS - 20)
    print(f"{name}: no relation of {len(numbers)} numbers with length below {mp.nstr(bound, 2)}")
    assert bound > 10**9

print("derived: G_1, G_2, G_3, lambda_1, lambda_3 in Gamma functions; G_4, lambda_5 with an integral each")
