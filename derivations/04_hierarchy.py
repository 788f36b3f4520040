# %% [markdown]
# # 4. The hierarchy of perturbation equations
#
# $g = \sum K^n g_n(r)$ solves the equation of derivation 3,
#
# $$\frac{d(g^2)}{dr} = -5 r^4 - 5 K g r^2, \qquad g(1) = 0.$$
#
# SymPy writes the equation of each order. We bring it to the form of a recursion, show that no order is singular
# anywhere on $0 \le r \le 1$, and compute $G_n = g_n(0)$, the coefficients of $V(K) = g(0)$, in three ways.

# %%
import sympy as sp
from mpmath import mp, quad

from viscopade.theory import symbolic
from viscopade.theory.series import g_coefficients

K, r = symbolic.K, symbolic.r
g = symbolic.g_function
equation = symbolic.turning_point_equation()

# %% [markdown]
# ## Order by order
#
# Insert the sum and collect powers of $K$. With the Cauchy product $(g^2)_n = \sum_i g_i g_{n-i}$ the equation of order
# $n$ is $d(g^2)_n/dr = -5 r^2 g_{n-1}$, except for $n = 0$, where the right side is $-5 r^4$.

# %%
HIGHEST = 8
ansatz = sum(K**n * g(n) for n in range(HIGHEST + 1))
left, right = (sp.expand(side.subs(symbolic.g, ansatz).doit()) for side in equation.args)
for n in range(HIGHEST + 1):
    order_n = sp.Eq(left.coeff(K, n), right.coeff(K, n))
    square_n = sum(g(i) * g(n - i) for i in range(n + 1))
    source = -5 * r**2 * g(n - 1) if n else -5 * r**4
    assert sp.expand(order_n.lhs - square_n.diff(r)) == 0
    assert order_n.rhs == source
    assert order_n == symbolic.hierarchy(n)
    if n < 3:
        print(f"K^{n}:", order_n)

# %% [markdown]
# Both sides are integrated from $r$ to 1, where every $g_n$ vanishes. With $P_n = 5 \int_r^1 g_{n-1} s^2 ds$ this is
#
# $$g_0 = \sqrt{1 - r^5}, \qquad 2 g_0 g_n = P_n - \sum_{0 < i < n} g_i g_{n-i}.$$
#
# Each order is one integration of the previous order, then a division by $g_0$.

# %%
g_0 = sp.sqrt(sp.integrate(5 * r**4, (r, r, 1)))
assert sp.expand(g_0**2 - (1 - r**5)) == 0
assert sp.simplify(symbolic.hierarchy(0).subs(g(0), g_0).doit()) == sp.true

# %% [markdown]
# ## Why it is regular: the turning point
#
# $g_0$ vanishes at $r = 1$, and every order divides by it. This is harmless. Let $t = 1 - r$. Then
#
# $$g_n = t^{(n+1)/2} f_n(t), \qquad f_n \text{ analytic for } \lvert t \rvert < 2 \sin(\pi/5) = 1.1756.$$
#
# For $n = 0$, $f_0^2 = (1 - (1-t)^5)/t$ is a polynomial that vanishes nowhere in that disc, so that $f_0$ and $1/f_0$
# are analytic there.

# %%
t = sp.Symbol("t", positive=True)
f_0_squared = sp.cancel((1 - (1 - t) ** 5) / t)
assert f_0_squared.subs(t, 0) == 5
zeros = [1 - sp.exp(2 * sp.pi * sp.I * j / 5) for j in range(1, 5)]
for zero in zeros:
    assert sp.simplify(sp.expand(f_0_squared.subs(t, zero), complex=True)) == 0
radius = min(abs(complex(zero)) for zero in zeros)
print(f"f_0^2 = {f_0_squared}, its nearest zero is at |t| = {radius:.4f}")
assert abs(radius - float(2 * sp.sin(sp.pi / 5))) < 1e-12

# %% [markdown]
# For $n \ge 1$, by induction. All terms of the recursion have the same power of $t$: the product $g_i g_{n-i}$ has
# $t^{(i+1)/2 + (n-i+1)/2} = t^{n/2+1}$, so has $g_0 g_n$, and so has $P_n$, because a power $t^{n/2+j}$ in the
# integrand becomes $t^{n/2+1+j}/(n/2+1+j)$. This divides the coefficient $j$ of an analytic function by $n/2 + 1 + j$,
# which does not change its disc of convergence. Without the common power,
#
# $$2 f_0 f_n = p_n - \sum_{0 < i < n} f_i f_{n-i}, \qquad
# [t^j] p_n = \frac{5}{n/2 + 1 + j} [t^j] (1-t)^2 f_{n-1}$$
#
# with the coefficient $[t^j]$ of $t^j$, and division by $f_0$ is harmless. (So $g$ is analytic in $\sqrt{t}$ and $K$
# together: the square root is that of any turning point, $x_\text{max} - x$ proportional to the time squared.)

# %%
n, i, j = sp.symbols("n i j", positive=True)
power = sp.Rational(1, 2) + (n + 1) / 2
assert sp.simplify((i + 1) / 2 + (n - i + 1) / 2 - power) == 0
s = sp.Symbol("s", positive=True)
assert sp.simplify(sp.integrate(s ** (n / 2 + j), (s, 0, t)) - t ** (power + j) / (n / 2 + 1 + j)) == 0

# %% [markdown]
# ## Why it is regular: first contact
#
# Around $r = 0$, $g_0 = \sqrt{1 - r^5}$ is analytic and not zero for $\lvert r \rvert < 1$, and so are integrals and
# products. So every $g_n$ is analytic for $\lvert r \rvert < 1$; the nearest singularities are the fifth roots of
# unity, and the other series resolves $r = 1$. The two discs overlap: at $r = 1/2$ both converge, the one around
# $r = 0$ like $2^{-j}$ and the one around $r = 1$ like $(\frac{1}{2} / 1.1756)^j = 2.35^{-j}$.
#
# ## First way to the numbers: this file, in plain floating point


# %%
def product(a, b):
    return [mp.fsum(a[k] * b[m - k] for k in range(m + 1)) for m in range(len(a))]


def quotient(a, b):
    q = []
    for m, a_m in enumerate(a):
        q.append((a_m - mp.fsum(q[k] * b[m - k] for k in range(m))) / b[0])
    return q


def square_root(a):
    root = [mp.sqrt(a[0])]
    for m in range(1, len(a)):
        root.append((a[m] - mp.fsum(root[k] * root[m - k] for k in range(1, m))) / (2 * root[0]))
    return root


def next_order(orders, p_n):
    """(p_n - sum f_i f_(n-i)) / (2 f_0)."""
    products = [product(a, b) for a, b in zip(orders[1:], reversed(orders[1:]), strict=True)]
    rest = [p - mp.fsum(terms) for p, *terms in zip(p_n, *products, strict=True)]
    return quotient(rest, [2 * c for c in orders[0]])


def values_at_zero(highest, terms):
    """G_0 … G_highest from Taylor series with `terms` terms around r = 1 and r = 0, joined at r = 1/2."""
    pad = [0] * (terms - 6)
    f = [square_root([5, -10, 10, -5, 1, 0, *pad])]
    inner = [square_root([1, 0, 0, 0, 0, -1, *pad])]
    weight = [1, -2, 1, 0, 0, 0, *pad]  # (1-t)^2
    middle = mp.mpf(1) / 2
    for n in range(1, highest + 1):
        p_n = [5 * c / (mp.mpf(n) / 2 + 1 + j) for j, c in enumerate(product(weight, f[n - 1]))]
        f.append(next_order(f, p_n))
        P_middle = middle ** (mp.mpf(n) / 2 + 1) * mp.polyval(p_n[::-1], middle)
        integral = [0, 0, 0] + [5 * c / mp.mpf(j + 3) for j, c in enumerate(inner[n - 1][:-3])]
        P_n = [P_middle + mp.polyval(integral[::-1], middle)] + [-c for c in integral[1:]]
        inner.append(next_order(inner, P_n))
    return [g_n[0] for g_n in inner]


ORDERS, DIGITS = 12, 25
with mp.workdps(DIGITS + 15):
    plain = values_at_zero(ORDERS, 130)

# %% [markdown]
# ## Second way: the proven enclosures of `viscopade.theory.series`

# %%
proven = g_coefficients(ORDERS, DIGITS)
with mp.workdps(DIGITS + 15):
    for n, (value, ball) in enumerate(zip(plain, proven, strict=True)):
        middle = mp.mpf(ball.str(DIGITS + 5, radius=False))
        print(f"G_{n} = {mp.nstr(middle, DIGITS)}")
        assert abs(value - middle) < mp.mpf(10) ** -DIGITS * abs(middle)

# %% [markdown]
# ## Third way: quadrature for $G_1$ and $G_2$
#
# $2 G_1 = 5 \int_0^1 g_0 s^2 ds$ is a Beta function of $u = s^5$. Then $2 G_2 = 5 \int_0^1 g_1 s^2 ds - G_1^2$, where
# $2 g_0 g_1 = P_1$ is the same integral from $r$ on. Near $r = 1$ the integrands are smooth in $y = \sqrt{1 - r^5}$,
# $dr = -2 y dy / (5 r^4)$, and near $r = 0$ in $r$ itself.

# %%
u = sp.Symbol("u", positive=True)
dr_du = (u ** sp.Rational(1, 5)).diff(u)
integrand = sp.powsimp(5 * g_0.subs(r, u ** sp.Rational(1, 5)) * u ** sp.Rational(2, 5) * dr_du)
assert sp.simplify(integrand - u ** sp.Rational(-2, 5) * sp.sqrt(1 - u)) == 0  # of B(3/5, 3/2)
G_1 = sp.gamma(sp.Rational(3, 5)) * sp.gamma(sp.Rational(3, 2)) / sp.gamma(sp.Rational(21, 10)) / 2
print("G_1 = B(3/5, 3/2)/2 =", G_1)
assert sp.simplify(G_1 / symbolic.g_1_at_0()) == 1

with mp.workdps(DIGITS + 5):
    joint = (mp.mpf(1) / 2) ** (mp.mpf(1) / 5)

    def P_1(q):
        """5 int_q^1 g_0 s^2 ds = int_0^y(q) 2 y^2 (1-y^2)^(-2/5) dy, a hypergeometric function."""
        y = mp.sqrt(1 - q**5)
        return 2 * y**3 / 3 * mp.hyp2f1(mp.mpf(2) / 5, mp.mpf(3) / 2, mp.mpf(5) / 2, y * y)

    def near_turning_point(y):
        q = (1 - y * y) ** (mp.mpf(1) / 5)
        return P_1(q) / q**2

    inner_part = quad(lambda q: 5 * q**2 * P_1(q) / (2 * mp.sqrt(1 - q**5)), [0, joint])
    outer_part = quad(near_turning_point, [0, mp.sqrt(mp.mpf(1) / 2)])
    G_2 = (inner_part + outer_part - (P_1(mp.mpf(0)) / 2) ** 2) / 2
    print("by quadrature G_2 =", mp.nstr(G_2, DIGITS))
    assert abs(P_1(mp.mpf(0)) / 2 - plain[1]) < mp.mpf(10) ** -DIGITS
    assert abs(G_2 - plain[2]) < mp.mpf(10) ** (1 - DIGITS)

print(f"derived: the hierarchy to order {HIGHEST}, regular, and G_0 … G_{ORDERS} in numbers")
