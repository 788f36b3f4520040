"""Padé approximants of other laws of contact: the errors that files state are sampled, and functions return eps."""

import itertools
import json
import types
from fractions import Fraction

import pytest

from tests import compiled
from viscopade.collision import exact
from viscopade.kernels import prove_rational
from viscopade.kernels.names import TARGETS
from viscopade.kernels.requests import Request
from viscopade.theory.law import law_of
from viscopade.theory.pade import pade

REQUESTS = [Request(law=law, pade=[degrees]) for law, degrees in (("tsuji", (1, 3)), ("hunt-crossley:1", (2, 3)))]
of_laws = pytest.mark.parametrize("request_of_law", REQUESTS, ids=lambda of: of.law)


@of_laws
def test_every_file_names_the_law_and_states_a_sampled_error(request_of_law):
    law, (kernel,) = law_of(request_of_law.law), request_of_law.kernels()
    sampled = [bound for bound in kernel.bounds if not bound.proven]
    assert len(sampled) == len(kernel.bounds) > 0
    for target in TARGETS:
        if target in ("certificates", "vectors"):
            with pytest.raises(ValueError, match=f"of which nothing is proven: expected viscoelastic for {target}"):
                request_of_law.render(target)
            continue
        text = request_of_law.render(target)
        if target == "json":
            (found,) = json.loads(text)["approximants"]
            assert (found["law"], found["proven"], found["rounding"]) == (str(law), [], {})
            continue
        words = " ".join(" ".join(line.lstrip(" *#%!/") for line in text.splitlines()).split())
        assert f"a = {law.elastic}, b = {law.damping}," in words
        assert "(sampled)" in words or "no bound" in words or "not proven" in words
        assert "proven by" not in words


@of_laws
def test_functions_in_c_and_python_are_the_formula_with_the_error(request_of_law, tmp_path):
    law, (kernel,) = law_of(request_of_law.law), request_of_law.quotients()
    library = compiled.build(tmp_path, [request_of_law.render("c")])
    module = types.ModuleType("law")
    exec(request_of_law.render("python"), module.__dict__)
    name, (a, b) = f"epsilon_{kernel.name}", kernel.exact
    for low, (end, error) in zip(
        (Fraction(0), *(Fraction(v) for v, _ in kernel.sampled)), kernel.sampled, strict=False
    ):
        for share in (0.37, 0.81, 0.999):
            v_star = float(low) + (float(end) - float(low)) * share
            found = getattr(module, name)(v_star)
            assert library[name](v_star) == found
            top, bottom = (sum(c * Fraction(v_star) ** i for i, c in enumerate(part)) for part in (a, b))
            assert found == pytest.approx(float(top / bottom), rel=1e-14, abs=0)
            true = exact.collision(Fraction(v_star), 20, law=law).floats()
            off = abs(found - true["epsilon"]) / min(true["epsilon"], true["one_minus_epsilon"])
            assert off <= 1.001 * float(error) + 1e-13


def test_samples_end_where_contact_does():
    """By a linear spring with the end x = 0 contact ends below kappa = 2 only."""
    law = law_of("linear", "return")
    approximant = pade(2, 2, 20, law)
    ends = [end for end, _ in prove_rational.sampled_errors(approximant, law)]
    assert ends == ["0.5", "1"]
    with pytest.raises(ValueError, match="does not end at x = 0"):
        prove_rational.sampled_errors(approximant, law, 3)
    (named,) = prove_rational.sampled_errors(approximant, law, "0.75")
    errors = [float(error) for _, error in prove_rational.sampled_errors(approximant, law)]
    assert named[0] == "0.75"
    assert all(left < right for left, right in itertools.pairwise((errors[0], float(named[1]), errors[1])))
