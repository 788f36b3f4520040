# %% [markdown]
# # 11. The collision as a polynomial flow from the turning point
#
# `viscopade.collision.exact` integrates a polynomial flow without roots or singular points, and bounds the difference
# between the computed and the wanted parameter by derivatives. The flow, the formulas for $\kappa$, $\varepsilon$,
# $x_\text{max}$ and $\tau_c$, the balance of energy and the equations behind those bounds are derived here from the
# scaled equation of motion. The proofs that use them are in docs/theory/exact-function.md, with its numbers (1) to (3)
# and steps. Contact ends where the force vanishes (the paper's Eq. 6).

# %%
import sympy as sp
from mpmath import findroot, mp, odefun

from viscopade.arithmetic.balls import to_mpf
from viscopade.collision import exact
from viscopade.theory import equation

scaled = equation.scaled_equation()
x, tau, kappa = scaled.x, scaled.tau, scaled.kappa
X, x_max, k = sp.symbols("X x_max k", positive=True)
r, u, s, F, m = sp.symbols("r u s F m", positive=True)
p = sp.Function("p", positive=True)

# %% [markdown]
# ## Equation (1)
#
# As in `03_turning_point.py` time is eliminated: $\dot{x} = w(x)$, $\ddot{x} = w w'$. Compression is measured by
# $x = x_\text{max} r^2$, but speed without a root: $\lvert \dot{x} \rvert = 2 x_\text{max}^{5/4} p$. `sign` is $+1$ in
# loading, $-1$ in unloading.

# %%
w = sp.Function("w")
acceleration = w(x).diff(tau).subs(x.diff(tau), w(x)).doit().subs(x, X).doit()
without_time = scaled.lhs.subs(x.diff(tau, 2), acceleration).subs(x.diff(tau), w(X)).subs(x, X)
speed_unit = 2 * x_max ** sp.Rational(5, 4)


def p_times_slope(sign):
    """p dp/du with u = 1 - r, from the equation without time."""
    slope_of_w = sign * speed_unit * p(r).diff(r) / (x_max * r**2).diff(r)
    equation = without_time.subs(w(X).diff(X), slope_of_w).subs(w(X), sign * speed_unit * p(r)).subs(X, x_max * r**2)
    (slope,) = sp.solve(equation, p(r).diff(r))
    return sp.expand(sp.simplify(-p(r) * slope))


loading, unloading = p_times_slope(+1), p_times_slope(-1)
k_of_kappa = sp.simplify(2 * loading.coeff(p(r)) / r**2)
print("k =", k_of_kappa)
assert sp.simplify(k_of_kappa - 2 * kappa * x_max ** sp.Rational(1, 4)) == 0

kappa_of_k = sp.solve(sp.Eq(k_of_kappa, k), kappa)[0]
loading, unloading = (sp.expand(sp.simplify(side.subs(kappa, kappa_of_k))) for side in (loading, unloading))
print("loading:   p dp/du =", loading, "  unloading:", unloading)
assert sp.expand(loading - r**2 * (r**2 + k * p(r)) / 2) == 0
assert unloading == loading.subs(k, -k)

# %% [markdown]
# ## The flow, and where it ends
#
# A time $s$ with $du = 2 p ds$ makes it polynomial: $p' = 2 p dp/du$. First contact is $r = 0$, the end of contact is
# where the force vanishes, $\ddot{x} = 0$. There, too, $dp/du = 0$.

# %%
u_rate = 2 * p(r)
p_rate = sp.expand(u_rate * loading / p(r))
print("u' =", u_rate, "  p' =", sp.factor(p_rate))
assert sp.expand(p_rate - r**2 * (r**2 + k * p(r))) == 0

# %% [markdown]
# Unloading backwards in time, $(-s, -p)$, is loading. With a length other than $x_\text{max}$ the turning point is at
# $r = r_t$; $r/r_t$, $p r_t^{-5/2}$, $s r_t^{3/2}$ with $k r_t^{1/2}$ obey the same flow.

# %%
P, r_t = sp.symbols("P r_t", positive=True)
u_flow, p_flow = 2 * P, r**2 * (r**2 + k * P)
reverse = {k: -k, P: -P}
assert -u_flow.subs(reverse) == u_flow
assert p_flow.subs(reverse, simultaneous=True) == p_flow  # d(-p)/d(-s) = dp/ds
scaled_flow = {r: r / r_t, P: P * r_t ** sp.Rational(-5, 2), k: k * sp.sqrt(r_t)}
rate = r_t ** sp.Rational(3, 2)  # d(s r_t^(3/2))/ds
assert sp.simplify(u_flow.subs(scaled_flow, simultaneous=True) * rate - u_flow / r_t) == 0
assert sp.simplify(p_flow.subs(scaled_flow, simultaneous=True) * rate - p_flow * r_t ** sp.Rational(-5, 2)) == 0

speed = sp.Symbol("speed", positive=True)
force = -(scaled.lhs.subs(x.diff(tau, 2), 0).subs(x.diff(tau), -speed).subs(x, X))
at_zero_force = force.subs({X: x_max * r**2, speed: speed_unit * m}).subs(kappa, kappa_of_k)
(m_at_end,) = sp.solve(at_zero_force, m)
assert sp.simplify(m_at_end - r**2 / k) == 0  # r_c^2 = k m
assert sp.simplify(unloading.subs(p(r), m_at_end)) == 0
assert loading.subs(p(r), F).subs(r, 0) == 0

# %% [markdown]
# ## Formulas (2)
#
# The impact speed is 1 and $p = F$ there; $\varepsilon$ is the speed at the end, where $p = m$. The duration follows
# from $d\tau = dx/\lvert \dot{x} \rvert$.

# %%
(depth,) = sp.solve(sp.Eq(speed_unit * F, 1), x_max)
kappa_result = sp.simplify(kappa_of_k.subs(x_max, depth))
eps = sp.simplify((speed_unit * m).subs(x_max, depth))
tau_rate = sp.simplify(((x_max * r**2).diff(r) * u_rate / (speed_unit * p(r))).subs(x_max, depth))  # d tau/ds
print("x_max =", depth, "  kappa =", kappa_result, "  eps =", eps, "  d tau/ds =", tau_rate)
assert sp.simplify(depth / (2 * F) ** sp.Rational(-4, 5)) == 1
assert sp.simplify(kappa_result / (2 ** sp.Rational(-4, 5) * k * F ** sp.Rational(1, 5))) == 1
assert eps == m / F
assert sp.simplify(tau_rate / (2 * (2 * F) ** sp.Rational(1, 5) * r)) == 1  # T is the integral of r ds

# %% [markdown]
# ## Balance of energy (3)
#
# $d(p^2)/du = r^4 \pm k p r^2$. With $W_l$ and $W_u$ the integrals of $p r^2 dr$, $F^2$ and $m^2$ follow, and
# $1 - \varepsilon^2$ is a sum of positive terms.

# %%
W_l, W_u, r_c = sp.symbols("W_l W_u r_c", positive=True)


def p_squared(side, start, work):
    """p^2 at r = start: the integral of 2 p dp/du from there to r = 1, that of p r^2 being `work`."""
    rate = sp.expand(2 * side)
    damping = rate.coeff(p(r)) / r**2
    return sp.integrate(rate.subs(p(r), 0), (r, start, 1)) + damping * work


F_squared, m_squared = p_squared(loading, 0, W_l), p_squared(unloading, r_c, W_u)
print("F^2 =", F_squared, "  m^2 =", m_squared)
lost = sp.expand(F_squared - m_squared)  # (1 - eps^2) F^2
assert sp.expand(lost - (r_c**5 / 5 + k * (W_l + W_u))) == 0

# %% [markdown]
# ## How $p$ changes with $k$ (step 5)
#
# Let $a = d \ln p/d \ln k$ at constant $r$: $dp/dk = a p/k$. Differentiating $p dp/du = r^2 (r^2 + c k p)/2$ ($c = 1$
# in loading, $-1$ in unloading) gives $2 p^2 da/du$. It points inwards at both ends of $0 \le a \le 1$ in loading, and
# of $-1 \le a \le 0$ in unloading.

# %%
c, number = sp.symbols("c a")
P = sp.Symbol("p", positive=True)  # p at one place
p_u, a_u = sp.Function("p", positive=True)(u), sp.Function("a")(u)
p_slope = r**2 * (r**2 + c * k * P) / (2 * P)  # dp/du
assert sp.expand(P * p_slope.subs(c, 1) - loading.subs(p(r), P)) == 0
change = number * P / k  # dp/dk
change_slope = p_slope.diff(P) * change + p_slope.diff(k)  # its derivative with respect to u
product_rule = (a_u * p_u / k).diff(u).subs(p_u.diff(u), p_slope).subs({a_u: number, p_u: P})
(a_slope,) = sp.solve(sp.Eq(product_rule, change_slope), product_rule.atoms(sp.Derivative).pop())
a_rate = sp.expand(sp.simplify(2 * P**2 * a_slope))
print("2 p^2 da/du =", sp.collect(a_rate, number))
in_loading, in_unloading = a_rate.subs(c, 1), a_rate.subs(c, -1)
assert sp.expand(in_loading - (k * r**2 * P * (1 - number) - 2 * number * r**4)) == 0
assert sp.expand(in_unloading - (-k * r**2 * P * (1 - number) - 2 * number * r**4)) == 0

assert in_loading.subs(number, 0).is_positive  # from a = 0 upwards,
assert in_loading.subs(number, 1).is_negative  # but not above 1
assert in_unloading.subs(number, 0).is_negative
assert sp.expand(in_unloading.subs(number, -1) - 2 * r**2 * (r**2 - k * P)) == 0  # >= 0 until the end

# %% [markdown]
# With $0 \le a_F \le 1$ and $-1 \le a_m \le 0$, the logarithmic derivatives of $\kappa$, $\varepsilon$ and
# $x_\text{max}$ are linear in $a_F$, $a_m$.

# %%
a_F, a_m = sp.symbols("a_F a_m")


def log_slope(expression):
    """d ln(expression)/d ln k, with d ln F = a_F d ln k and d ln m = a_m d ln k."""
    terms = ((k, 1), (F, a_F), (m, a_m))
    return sp.simplify(sum(symbol * sp.log(expression).diff(symbol) * slope for symbol, slope in terms))


slopes = {name: log_slope(e) for name, e in (("kappa", kappa_result), ("eps", eps), ("x_max", depth))}
print("d ln/d ln k:", slopes)
assert sp.expand(slopes["kappa"] - 1 - a_F / 5) == 0  # 1 to 6/5
assert sp.expand(slopes["eps"] - (a_m - a_F)) == 0  # -2 to 0
assert sp.expand(slopes["x_max"] + sp.Rational(4, 5) * a_F) == 0  # -4/5 to 0

# %% [markdown]
# In the balance of energy the end's motion cancels: $W_u$ depends on $r_c$ like $-m r_c^2$.

# %%
end_of_balance = (r_c**5 / 5).diff(r_c) + k * (-(r_c**2) * m)
assert sp.simplify(end_of_balance.subs(m, m_at_end.subs(r, r_c))) == 0

# %% [markdown]
# ## Duration
#
# $T = \int r ds = \int r dr/(2 p)$. Its integrand changes by $-a$ relatively; the end of unloading, $r_c^2 = k m$,
# contributes $r_c^2/(2 m) d \ln r_c = (k/4) y d \ln k$, with $y = 1 + a$ there.

# %%
y = sp.Symbol("y")
log_r_c = log_slope(sp.sqrt(k * m))
at_the_end = sp.simplify((r_c / (2 * m) * r_c * log_r_c).subs(r_c, sp.sqrt(k * m)))
assert sp.expand(at_the_end.subs(a_m, y - 1) - k * y / 4) == 0

# %% [markdown]
# For large $k$ there is a better bound of $y$ than 1. With $q = k p$, $D = r^2 - q$ and a "time" $\sigma$ in which
# $r^2 - q$ decays, $d\sigma = k r^2 du/(2 p)$:

# %%
Q, sigma = sp.symbols("q sigma", positive=True)
Y = number + 1
per_sigma = (2 * P / (k * r**2)).subs(P, Q / k)  # du/d sigma
r_rate = -per_sigma
q_rate = sp.simplify(k * unloading.subs(p(r), Q / k) / (Q / k) * per_sigma)
y_rate = sp.simplify(in_unloading.subs(P, Q / k) / (2 * (Q / k) ** 2) * per_sigma)
D = r**2 - Q


def rate(expression):
    """d/d sigma along unloading."""
    parts = ((r, r_rate), (Q, q_rate), (number, y_rate), (sigma, 1))
    return sum(expression.diff(symbol) * symbol_rate for symbol, symbol_rate in parts)


assert sp.simplify(q_rate - D) == 0
assert sp.simplify(rate(D) + D + 4 * Q / (k**2 * r)) == 0
assert sp.simplify(rate(Y * Q**2 * sp.exp(sigma)) - 2 * D * Q * sp.exp(sigma)) == 0
assert sp.simplify(rate(D * sp.exp(sigma)) + 4 * Q * sp.exp(sigma) / (k**2 * r)) == 0
print("d(y q^2 e^sigma)/d sigma = 2 D q e^sigma,  d(D e^sigma)/d sigma = -4 q e^sigma/(k^2 r)")

# %% [markdown]
# ## For the inverse: the growth of $F$
#
# The derivative of $p^2/2$ with respect to $k$ at constant $r$ grows, in the time $s$, like $r^2 p^2 + k r^2$ times
# itself; so it is at least the integral of $r^2 p^2 ds$, which is half of $W_l$, since $du = 2 p ds$.

# %%
half_change = P * change  # d(p^2/2)/dk = p dp/dk
half_rate = 2 * P * (p_slope * change + P * change_slope)  # du = 2 p ds
assert sp.simplify(half_rate.subs(c, 1) - (r**2 * P**2 + k * r**2 * half_change)) == 0

# %% [markdown]
# ## In numbers
#
# From a $k$, mpmath integrates both halves together with $T$ and $W$; formulas (2) give a collision, which must be the
# one that `exact.collision` finds at that $v_\ast$.

# %%


def half(k_number, guess):
    """u, p, T, W at the end of one half."""

    def rates(_, y):
        r = 1 - y[0]
        return [2 * y[1], r**2 * (r**2 + k_number * y[1]), r, 2 * y[1] ** 2 * r**2]

    def excess(s):
        y = path(s)
        return 1 - y[0] if k_number > 0 else (1 - y[0]) ** 2 + k_number * y[1]

    path = odefun(rates, 0, [0, 0, 0, 0])
    return path(findroot(excess, guess))


with mp.workdps(25):
    k_number = mp.mpf(3) / 4
    _, F_number, T_l, W_l_number = half(k_number, (1.1, 1.2))
    _, m_number, T_u, W_u_number = half(-k_number, (0.8, 0.9))
    values = {k: k_number, F: F_number, m: m_number}
    kappa_number, eps_number, depth_number = (
        mp.mpf(expression.subs(values).evalf(25)) for expression in (kappa_result, eps, depth)
    )
    tau_c = (tau_rate / r).subs(F, F_number).evalf(25) * (T_l + T_u)
    balance = (k_number * m_number) ** mp.mpf("2.5") / 5 + k_number * (W_l_number + W_u_number)
    loss = balance / (F_number**2 * (1 + eps_number))
    collision = exact.collision(mp.sqrt(kappa_number), 20)
    found = {name: to_mpf(ball) for name, ball in collision.balls().items()}
    ours = {"epsilon": eps_number, "one_minus_epsilon": loss, "x_max": depth_number, "tau_c": tau_c}
    for name, number_here in ours.items():
        print(name, mp.nstr(mp.mpf(number_here), 18), collision.decimals()[name])
        assert abs(found[name] / number_here - 1) < mp.mpf(10) ** -19

print("derived: the flow from the turning point, its end, and the equations behind the bounds of step 5")
