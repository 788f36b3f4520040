# %% [markdown]
# # 7. Every $h_k$ as a polynomial in $\lambda_1$, $\lambda_3$, …
#
# $\varepsilon = \varepsilon_0 H(\frac{4}{5} v_\ast^5 \sqrt{\varepsilon_0})$ with a rational series $H$ (derivation 5),
# and $\ln \varepsilon_0 = -\Lambda(\nu)$ with $\nu = \kappa \varepsilon_0^{1/10}$, $\kappa = v_\ast^2$, $\Lambda$ odd
# (derivation 6). So $\varepsilon = 1 + \sum h_k v_\ast^k$ (the paper's Eq. 7) follows without further integrals. We
# derive a formula for $h_k$ by Lagrange's inversion, compute the coefficients a second time by brute force, and compare
# with proven numbers.

# %%
import sympy as sp
from sympy.polys.ring_series import rs_exp, rs_trunc

from viscopade.theory import symbolic
from viscopade.theory.series import end_series, lambda_coefficients, series

HIGHEST = 20

# %% [markdown]
# ## Powers of $\varepsilon_0$, by Lagrange's inversion
#
# $\varepsilon_0 = \exp(-\Lambda(\nu))$, so $\kappa = \nu \varepsilon_0^{-1/10} = \nu \exp(\Lambda/10)$. For a function
# $F(\nu)$ and $\kappa = \nu/\varphi(\nu)$, Lagrange's formula reads
# $[\kappa^n] F = \frac{1}{n} [\nu^{n-1}] F'(\nu) \varphi(\nu)^n$. Here $\varphi = \exp(-\Lambda/10)$ and
# $F = \varepsilon_0^{p/10} = \exp(-p \Lambda/10)$:
#
# $$F' \varphi^n = -\frac{p}{10} \Lambda' \exp\left(-\frac{p+n}{10} \Lambda\right)
# = \frac{p}{p+n} \left(\exp\left(-\frac{p+n}{10} \Lambda\right)\right)'$$
#
# and $\frac{1}{n} [\nu^{n-1}] f' = [\nu^n] f$, hence
#
# $$\varepsilon_0^{p/10} = \sum_n \kappa^n \frac{p}{p+n} [\nu^n] \exp\left(-\frac{p+n}{10} \Lambda(\nu)\right).$$

# %%
nu, n, p = sp.symbols("nu n p", positive=True)
Lambda = sp.Function("Lambda")(nu)
F_slope = sp.exp(-p * Lambda / 10).diff(nu) * sp.exp(-n * Lambda / 10)
assert sp.simplify(F_slope - p / (p + n) * sp.exp(-(p + n) * Lambda / 10).diff(nu)) == 0

# %% [markdown]
# ## The formula for $h_k$
#
# $\varepsilon = \sum_j H_j (4/5)^j v_\ast^{5j} \varepsilon_0^{1+j/2}$. The power of $\varepsilon_0$ has $p = 10 + 5j$,
# and $\kappa^n$ is $v_\ast^{2n}$:
#
# $$h_k = \sum_{5j+2n=k} H_j \left(\frac{4}{5}\right)^j
# \frac{p}{p+n} [\nu^n] \exp\left(-\frac{p+n}{10} \Lambda(\nu)\right), \qquad p = 10 + 5j.$$
#
# Truncated series in a polynomial ring evaluate it:

# %%
odd = range(1, HIGHEST // 2 + 1, 2)
ring, t, *lambdas = sp.ring([sp.Symbol("t"), *(symbolic.lambda_symbol(k) for k in odd)], sp.QQ)
Lambda_t = sum(symbol * t**k for k, symbol in zip(odd, lambdas, strict=True))
H = [sp.QQ(c.numerator, c.denominator) for c in end_series(HIGHEST // 5)]


def coefficient(polynomial, power):
    """[t^power], as an expression in the lambdas."""
    return sum((ring({(0, *m[1:]): q}) for m, q in polynomial.terms() if m[0] == power), ring(0)).as_expr()


def h_by_formula(k):
    total = sp.Integer(0)
    for j, n in ((j, (k - 5 * j) // 2) for j in range(k // 5 + 1) if (k - 5 * j) % 2 == 0):
        p = 10 + 5 * j
        power = rs_exp(sp.QQ(-(p + n), 10) * Lambda_t, t, n + 1)
        total += coefficient(power * (H[j] * sp.QQ(4, 5) ** j * sp.QQ(p, p + n)), n)
    return sp.expand(total)


h = [h_by_formula(k) for k in range(HIGHEST + 1)]
for k, h_k in enumerate(h):
    print(f"h_{k} =", h_k)
    assert h_k == symbolic.h_polynomial(k)
assert h[:4] == [1, 0, -symbolic.lambda_symbol(1), 0]

# %% [markdown]
# ## Brute force
#
# No inversion: start with $\ln \varepsilon_0 = 0$ and repeat
# $\ln \varepsilon_0 = -\Lambda(\kappa \exp(\frac{1}{10} \ln \varepsilon_0))$, which gives one more correct order in
# $\kappa$ each time. Then insert the result into $H$. All in powers of $v_\ast$, the $t$ of the ring.

# %%
ORDER = 15


def truncated(polynomial):
    return rs_trunc(polynomial, t, ORDER + 1)


def exponential(polynomial):
    """exp of a series without constant term, by its Taylor series."""
    total, term = ring(1), ring(1)
    for m in range(1, ORDER + 1):
        term = truncated(term * polynomial * sp.QQ(1, m))
        total += term
    return total


log_eps0 = ring(0)
for _ in range(ORDER // 2):
    nu_t = truncated(t**2 * exponential(log_eps0 * sp.QQ(1, 10)))
    log_eps0 = -sum(symbol * truncated(nu_t**k) for k, symbol in zip(odd, lambdas, strict=True))
eps = sum(
    truncated((t**5 * sp.QQ(4, 5)) ** j * exponential(log_eps0 * sp.QQ(2 + j, 2))) * H[j] for j in range(ORDER // 5 + 1)
)
for k in range(ORDER + 1):
    assert sp.expand(coefficient(eps, k) - h[k]) == 0
print(f"brute force agrees to k = {ORDER}")

# %% [markdown]
# ## Numbers
#
# The polynomials at the proven $\lambda_k$ are compared with the proven $h_k$, which `viscopade.theory.series` computes
# without the $\lambda_k$.

# %%
DIGITS = 30
balls = lambda_coefficients(len(odd), DIGITS + 10)
values = {
    symbolic.lambda_symbol(k): sp.Float(ball.str(DIGITS + 10, radius=False), DIGITS + 10)
    for k, ball in zip(odd, balls, strict=True)
}
for k, ball in enumerate(series(HIGHEST, DIGITS + 5).h):
    number = sp.N(h[k].subs(values), DIGITS + 5)
    assert abs(number - sp.Float(ball.str(DIGITS + 5, radius=False), DIGITS + 5)) < sp.Float(10) ** -DIGITS
    if 0 < k < 9:
        print(f"h_{k} =", sp.N(number, DIGITS))

print(f"derived: h_0 … h_{HIGHEST} as polynomials with rational coefficients in lambda_1, lambda_3, …")
