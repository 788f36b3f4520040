"""Kernels of laws of contact other than the paper's: their proven errors against closed forms, in every language."""

import json
import re
import shutil
import subprocess
import sys
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from mpmath import mp, mpf

from tests import compiled
from tests.closed_forms import nu_1, nu_2
from viscopade.approximation import cheapest, minimax
from viscopade.arithmetic.formats import DOUBLE, FLOAT
from viscopade.collision import exact
from viscopade.kernels import prove_rational
from viscopade.kernels.requests import Request
from viscopade.kernels.targets import quotients
from viscopade.kernels.targets.languages import target as target_of
from viscopade.kernels.targets.languages import targets
from viscopade.scene.runners import find_tool
from viscopade.theory.law import law_of

LAWS = {"hunt-crossley": nu_1, "linear": lambda kappa: nu_2(kappa / 2, "force")}
"""By name, eps of kappa in closed form."""


def request(law, **more):
    return Request(law=law, **{"accuracy": ("1e-4",), "kappa_max": "2"} | more)


@cache
def kernel(law):
    (found,) = request(law).quotients()
    return found


def quotient(of, form, v_star):
    """The formula with the coefficients of a type, exactly but for 40 digits."""
    a, b = of.rounded(form)
    top, bottom = (mp.polyval([mpf(c) for c in values[::-1]], v_star) for values in (a, b))
    return top / bottom


def worst(of, form, true, v_stars):
    """The largest error relative to the smaller one of eps and 1 - eps."""
    with mp.workdps(40):
        errors = []
        for v_star in map(mpf, v_stars):
            epsilon = true(v_star)
            errors.append(abs(quotient(of, form, v_star) - epsilon) / min(epsilon, 1 - epsilon))
        return float(max(errors))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("form", [DOUBLE, FLOAT], ids=lambda form: form.name)
def test_the_proven_error_is_the_largest_one(law, form):
    found = worst(kernel(law), form, LAWS[law], np.geomspace(1e-3, 1.999, 400))
    bound = float(kernel(law).variant(form).certificate.bound)
    assert 0.97 * bound < found < bound < 1e-4


@pytest.mark.parametrize(
    ("law", "kappa_max", "accuracy"),
    [pytest.param("kelvin-voigt:1", "3", "1e-4", marks=pytest.mark.slow), ("3/2,1/2", "4", "1e-3")],
)
def test_laws_without_a_closed_form(law, kappa_max, accuracy):
    """The second one is the paper's law, with v* = kappa^(1/2); its proof is that of the table of panels."""
    (found,), of = request(law, kappa_max=kappa_max, accuracy=(accuracy,)).quotients(), law_of(law)
    high = float(kappa_max) ** (1 / of.d)
    points = [Fraction(round(x * 2**20), 2**20) for x in np.linspace(high / 50, high, 50)]
    with mp.workdps(40):
        errors = []
        for v_star in points:
            true = exact.collision(v_star, 25, law=of)
            epsilon, loss = (mpf(x.mid().str(30, radius=False)) for x in (true.epsilon, true.one_minus_epsilon))
            approximated = quotient(found, DOUBLE, mpf(v_star.numerator) / v_star.denominator)
            errors.append(abs(approximated - epsilon) / min(epsilon, loss))
    assert 0.5 * float(found.bounds[0].bound) < max(errors) < float(found.bounds[0].bound) <= float(accuracy)


def test_the_papers_law_by_its_exponents_is_the_papers():
    by_kappa, by_v_star = (
        Request(accuracy=("1e-3",), **end).quotients()[0] for end in ({"kappa_max": "25"}, {"v_star_max": "5"})
    )
    for one, other in zip(by_kappa.rounded(DOUBLE), by_v_star.rounded(DOUBLE), strict=True):
        assert one == pytest.approx(other, rel=1e-9)
    assert by_kappa.law.d == 2
    assert by_kappa.interval[1] >= 5


def test_an_interval_that_begins_late():
    (found,) = request("linear", v_star_min="1", accuracy=("1e-6",)).quotients()
    assert found.bounds[0].low == 1
    size = worst(found, DOUBLE, LAWS["linear"], np.geomspace(1, 1.999, 200))
    assert 0.9 * float(found.bounds[0].bound) < size < float(found.bounds[0].bound)


def test_pade_kernels():
    (found,) = request("hunt-crossley", accuracy=(), kappa_max=None, pade=((3, 4),)).quotients()
    ends = [bound.high for bound in found.bounds]
    assert ends == [Fraction(1, 2), 1, 2, 5]
    for bound in found.bounds:
        size = worst(found, DOUBLE, LAWS["hunt-crossley"], np.linspace(0.01, float(bound.high), 100))
        assert 0.9 * float(bound.bound) < size < float(bound.bound) * (1 + 1e-9)


# --- all kappa --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("accuracy", ["1e-5", "1e-10"])
def test_ready_kernels_for_all_kappa(law, accuracy):
    """They are records of the package."""
    (found,) = request(law, kappa_max="inf", accuracy=(accuracy,)).quotients()
    bound = float(found.bounds[0].bound)
    size = worst(found, DOUBLE, LAWS[law], np.geomspace(1e-3, 1e7, 1500))
    assert (0.9 if accuracy == "1e-5" else 0.2) * bound < size < bound < float(accuracy)  # panels are known to 1e-11
    assert found.bounds[0].high is None
    assert f"all_{accuracy.replace('-', 'm')}" in found.lasting_name


def test_a_quotient_without_the_limit_is_refused():
    with pytest.raises(ValueError, match=r"the degrees are \[3/5\]: accepted up to infinity is n = m \+ 1"):
        minimax.fit(3, 5, "inf", law=law_of("hunt-crossley"))
    with pytest.raises(ValueError, match=r"v_star_max is inf: accepted for the law 3/2,1/2 is a number"):
        cheapest.cheapest_fit("1e-3", "inf")


# --- languages --------------------------------------------------------------------------------------------------------

POINTS = (0.0, 2.0**-30, 0.125, 1.0, 1.5, 1.96875, 2.0)
OUTSIDE = (-1.0, 2.5)
DRIVERS = {
    "cuda": '#include <cstdio>\n#include <initializer_list>\n#include "{file}"\n'
    "int main() {{ for (double x : {{{points}}}) "
    'std::printf("%.17g %.9g\\n", viscopade_{name}(x), viscopade_{name}f((float)x)); }}',
    "cpp-policy": '#include <cstdio>\n#include <initializer_list>\n#include "{file}"\n'
    "int main() {{ for (double x : {{{points}}}) "
    'std::printf("%.17g %.9g\\n", viscopade::{name}(x), viscopade::{name}((float)x)); }}',
    "fortran": "program check\n use viscopade\n use, intrinsic :: iso_fortran_env\n implicit none\n integer :: i\n"
    " real(real64) :: x({number}) = [{points}]\n do i = 1, {number}\n"
    "  print *, {name}_r64(x(i)), {name}_r32(real(x(i), real32))\n end do\nend program",
    "rust": '#[path = "{file}"] mod scene;\nfn main() {{ for x in [{points}] {{ let x: f64 = x; '
    'println!("{{:e}} {{:e}}", scene::{name}(x), scene::{name}_f32(x as f32)); }} }}',
    "javascript": 'import {{ {name} }} from "./{file}";\n'
    "for (const x of [{points}]) console.log({name}(x));",
}  # fmt: skip


@pytest.mark.parametrize("language", DRIVERS)
def test_every_language_computes_the_same(tmp_path, language):
    of, target = kernel("hunt-crossley"), target_of(language)
    file, name = f"laws{target.suffix}", f"epsilon_{of.name}"
    (tmp_path / file).write_text(request("hunt-crossley").render(language))
    given = (*POINTS, *OUTSIDE)
    written = [f"{x!r}_real64" if language == "fortran" else repr(x) for x in given]
    comma = ", &\n   " if language == "fortran" else ", "
    driver = DRIVERS[language].format(file=file, name=name, points=comma.join(written), number=len(given))
    main = tmp_path / f"driver{target.runner.ending}"
    main.write_text(driver)
    tool = find_tool(target.runner)
    if tool is None:
        pytest.skip(f"none of {', '.join(target.runner.tools)} is installed")
    words = {"{driver}": main.name, "{file}": file, "{program}": "driver.exe"}
    for line in (target.runner.build, target.runner.start):
        if line:
            command = [part for word in line for part in (tool.words if word == "{tool}" else [words.get(word, word)])]
            command = ["./driver.exe" if word.startswith("./") else word for word in command]
            done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
            assert not done.returncode, done.stderr
    rows = [[float(x) for x in row.split()] for row in done.stdout.replace("-nan", "nan").split("\n") if row]
    assert len(rows) == len(given)
    for v_star, row in zip(given, rows, strict=True):
        for found, form in zip(row, (DOUBLE, FLOAT), strict=False):
            if v_star in OUTSIDE:
                assert np.isnan(found)
            else:
                allowed = float(of.variant(form).rounding)
                assert found == pytest.approx(float(quotient(of, form, mpf(v_star))), rel=allowed)


@pytest.mark.parametrize("standard", ["c99", "c++17"])
def test_the_header_for_c(tmp_path, standard):
    of = kernel("hunt-crossley")
    functions = compiled.build(tmp_path, [request("hunt-crossley").render("c")], standard)
    assert sorted(functions) == [f"epsilon_{of.name}", f"epsilon_{of.name}f"]
    for v_star in POINTS:
        found = functions[f"epsilon_{of.name}"](v_star)
        assert found == pytest.approx(float(quotient(of, DOUBLE, mpf(v_star))), rel=float(of.variant(DOUBLE).rounding))
    assert np.isnan(functions[f"epsilon_{of.name}"](-1.0))


def test_the_module_for_python(tmp_path):
    of = kernel("linear")
    (tmp_path / "laws.py").write_text(request("linear").render("python"))
    program = f"import laws; print([laws.epsilon_{of.name}(x) for x in {POINTS}], hasattr(laws, '_v_star'))"
    done = subprocess.run([sys.executable, "-W", "error", "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.endswith("] False\n"), done.stderr
    found = json.loads(done.stdout.split("]")[0] + "]")
    assert found == pytest.approx([float(quotient(of, DOUBLE, mpf(x))) for x in POINTS], rel=1e-14)


def test_glsl_compiles(tmp_path):
    tool = shutil.which("glslangValidator")
    if tool is None:
        pytest.skip("glslangValidator is not installed")
    of = kernel("hunt-crossley")
    text = request("hunt-crossley").render("glsl")
    shader = (
        "#version 450\nlayout(binding = 0) buffer data {{ float x[]; }};\n{}\n"
        "void main() {{ x[0] = viscopade_{}(x[0]); }}"
    )
    (tmp_path / "check.comp").write_text(shader.format(text, f"epsilon_{of.name}"))
    done = subprocess.run([tool, "-V", "check.comp", "-o", "check.spv"], cwd=tmp_path, capture_output=True, text=True)
    assert not done.returncode, done.stdout


@pytest.mark.parametrize("language", ["jax", "numba", "warp"])
def test_packages_of_python(tmp_path, language):
    pytest.importorskip(language)
    of = kernel("hunt-crossley")
    (tmp_path / "laws.py").write_text(request("hunt-crossley").render(language))
    name = f"epsilon_{of.name}"
    programs = {
        "jax": "import jax; jax.config.update('jax_enable_x64', True)\n"
        f"import laws; print([float(laws.{name}(x)) for x in {POINTS}])",
        "numba": f"import laws; print([float(laws.{name}(x)) for x in {POINTS}])",
        "warp": "import warp as wp, laws\n@wp.kernel\ndef run(x: wp.array(dtype=wp.float64)):\n    i = wp.tid()\n"
        f"    x[i] = laws.{name}(x[i])\nx = wp.array({POINTS}, dtype=wp.float64, device='cpu')\n"
        "wp.launch(run, dim=len(x), inputs=[x], device='cpu')\nprint(x.numpy().tolist())",
    }
    (tmp_path / "main.py").write_text(programs[language])
    done = subprocess.run([sys.executable, "main.py"], cwd=tmp_path, capture_output=True, text=True)
    found = json.loads(done.stdout.splitlines()[-1])
    assert found == pytest.approx([float(quotient(of, DOUBLE, mpf(x))) for x in POINTS], rel=1e-14)


@pytest.mark.parametrize("language", [target.name for target in targets() if target.compact])
def test_every_text_has_the_formula_the_law_and_the_error(language):
    text, of = request("hunt-crossley").render(language), kernel("hunt-crossley")
    assert "a = 3/2, b = 3/2" in text
    assert "kappa = c k^(-1) v" in text
    assert of.bounds[0].bound in text
    forms = [number.form for number in target_of(language).numbers]
    for form in forms:
        a, b = of.rounded(form)
        written = [
            float.fromhex(x.rstrip("f")) if "0x" in x else float(x.rstrip("f").replace("f0", ""))
            for x in NUMBER.findall(text)
        ]
        assert {FLOAT.nearest(Fraction(c)) for c in (*a, *b)} <= {
            FLOAT.nearest(Fraction(x)) for x in written if abs(x) > 1e-30
        }


NUMBER = re.compile(r"(?<![\w.])(?:0x1(?:\.[0-9a-f]+)?p[+-]\d+f?|\d+\.\d+(?:e-?\d+)?)")


def test_vectors_are_exact():
    """Those of a law are from the exact function; here they are compared with the closed form."""
    data = json.loads(request("hunt-crossley").render("vectors"))
    rows = [dict(zip(data["columns"], row, strict=True)) for row in data["vectors"]]
    checked = 0
    for row in rows:
        x = float.fromhex(row["x"]) if row["x"] not in ("inf", "nan", "-inf") else float(row["x"])
        if row["type"] == "double" and 1e-6 < x <= 2:
            with mp.workdps(40):
                assert abs(mpf(row["exact"]) / nu_1(mpf(x)) - 1) < 1e-18
            least, most = (float.fromhex(row[end]) for end in ("least", "most"))
            assert least <= float.fromhex(row["bits"]) <= most
            checked += 1
    assert checked > 10


def test_certificates_name_the_law():
    (entry, *_) = json.loads(request("linear").render("certificates"))["certificates"]
    assert (entry["law"], entry["end"], entry["measure"]) == ("1,0", "force", "both")
    (record,) = json.loads(request("linear").render("json"))["approximants"]
    assert (record["law"], record["kappa"], record["d"]) == ("1,0", "c k^(-1/2) m^(-1/2)", 1)


# --- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"law": "cubic"}, "law is 'cubic': accepted is viscoelastic"),
        ({"kappa_max": "x"}, "kappa_max is 'x': accepted is a number from 1e-9 to 1e18, or inf"),
        ({"kappa_max": "-1"}, "kappa_max is '-1': accepted is a number"),
        ({"v_star_max": "2"}, "kappa_max and v_star_max are both given: accepted is one of them"),
        ({"end": "return", "law": "linear"}, "accepted, as proofs need it, is the end 'force'"),
        ({"kappa_max": None}, "accepted with it is accuracy or minimax with kappa_max"),
        ({"accuracy": (), "kappa_max": None, "full": True}, "accepted with it is accuracy or minimax with kappa_max"),
        ({"law": "kelvin-voigt:1", "kappa_max": "inf"}, "v_star_max is inf: accepted for the law 2,1 is a number"),
    ],
)
def test_requests_that_are_refused(given, message):
    with pytest.raises(ValueError, match=re.escape(message).replace("'cubic'", "'cubic'")):
        request(**{"law": "hunt-crossley"} | given).quotients()


def test_a_language_without_the_type():
    (found,) = request("hunt-crossley", accuracy=("1e-9",), kappa_max="0.4").quotients()
    with pytest.raises(ValueError, match=r"cannot be written in glsl: .*; accepted are other degrees or targets"):
        quotients.render(target_of("glsl"), [found], "viscopade export glsl")


def test_too_far_for_a_proof():
    with pytest.raises(ArithmeticError, match="proofs for the law 1,0 end at"):
        prove_rational._certified(
            (Fraction(1),), (Fraction(1), Fraction(1)), (Fraction(0), Fraction(10**8)), "both", law_of("linear")
        )


@pytest.mark.parametrize("order", [1, -1])
def test_headers_of_two_laws_in_one_program(tmp_path, order):
    """The paper's one brings v* of speed and beta, which other laws have no use for."""
    headers = [Request(pade=((3, 6),)).render("c"), request("hunt-crossley").render("c"), request("linear").render("c")]
    functions = compiled.build(tmp_path, headers[::order])
    assert functions["epsilon_pade_3_6"](0.5) == pytest.approx(functions["restitution_pade_3_6"](0.5**10, 1.0))
    assert f"epsilon_{kernel('linear').name}" in functions
