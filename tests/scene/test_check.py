"""What is generated for a scene runs and is compared with the exact function, in every language that is there."""

import re
from dataclasses import replace
from pathlib import Path
from tempfile import gettempdir

import numpy as np
import pytest

from tests.scene.test_render import COMMAND, EACH, NAMES, choice, kinds, need, of_kind, scene, text
from viscopade.kernels.write.languages import language
from viscopade.kernels.write.runners import NoSuchToolError, ToolchainError
from viscopade.scene import check as checks
from viscopade.scene import read
from viscopade.scene.check import check_code
from viscopade.scene.choice import choose
from viscopade.scene.render import render

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
FEW = 500


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(checks, "SPEEDS", FEW)
    monkeypatch.setattr(checks, "COLLISIONS", 2 * FEW)


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_every_example_gets_a_validated_kernel(file):
    made = choose(read.from_toml(file.read_bytes(), file.name))
    need(made.scene.code.language)
    found = check_code(made, render(made, f"viscopade scene {file.name}"))
    assert found.how
    assert not found.reason
    assert found.collisions == 20_000 * len(made.encounters)
    for name, bound in made.chosen.errors.items():
        assert found.errors[name] <= float(bound) + checks.REFERENCE


@pytest.mark.parametrize(("name", "form", "kind"), [(*each, kind) for each in EACH for kind in kinds(each[0])])
def test_languages(few, name, form, kind):
    need(name)
    if kind == "constant" and form != language(name).forms[0]:
        pytest.skip("constants in the language's first format alone")
    made = choice(name, form, kind)
    found = check_code(made, text(name, form, kind))
    assert (found.how, found.reason) == (found.how, "")
    assert found.collisions == max(1000, 2 * FEW // 5) * 5
    # The formula's own error shows: what is compared is not the exact function with itself.
    assert 1e-6 < found.errors["epsilon"] < (0.5 if kind == "constant" else 1e-3)
    assert found.errors["absolute"] <= found.errors["epsilon"]


@pytest.mark.parametrize(
    ("name", "kind"), [("c", "ready"), *((name, "quotient") for name in ("c", "python", "rust"))]
)  # the others have no table of v*
def test_from_v_star(few, name, kind):
    need(name)
    made = of_kind(scene(name, code='argument = "v_star"'), kind)
    found = check_code(made, render(made, COMMAND))
    assert (1e-7 if kind == "quotient" else 1e-17) < found.errors["epsilon"] < 1e-3


def test_names_that_are_words_of_the_language(few):
    for spoken, name in [
        ("c", "int"), ("cuda", "viscopade"), ("fortran", "module"), ("fortran", "real64"),
        ("rust", "fn"), ("javascript", "class"), ("python", "import"), ("c", "math"), ("arrays", "numpy"),
        ("warp", "warp"),
    ]:  # fmt: skip
        plain = choice(spoken)
        made = replace(plain, scene=replace(plain.scene, name=name))
        found = check_code(made, render(made, COMMAND))
        assert found.collisions or found.reason


# --- tools that are not there, or fail --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in NAMES if language(name).run.tools])
def test_a_missing_tool_is_a_reason(few, monkeypatch, name):
    monkeypatch.setenv("PATH", "")
    for each in map(language, NAMES):
        if each.run.variable:
            monkeypatch.delenv(each.run.variable, raising=False)
    found = check_code(choice(name), text(name))
    assert (found.collisions, found.errors) == (0, {})
    assert found.reason.startswith(f"not run: there is no {language(name).run.tools[0]}")


def test_a_c_compiler_that_is_asked_for_must_be_there():
    with pytest.raises(NoSuchToolError, match="there is no compiler 'no-such-compiler' that starts"):
        check_code(choice("c"), text("c"), "no-such-compiler")


# --- code that is wrong -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_code_that_does_not_compile(few, name):
    need(name)
    broken = re.sub(r"(?i)restitution_tiny(?=\w*\()", "restitution_t(ny", text(name))
    assert broken != text(name)
    with pytest.raises(ToolchainError) as caught:
        check_code(choice(name), broken)
    message = str(caught.value)
    assert message.startswith("the generated code fails its check: ")
    assert "error" in message.lower()
    assert "\n" not in message
    assert gettempdir() not in message


def changed(name, kind):
    """Change a coefficient, or a constant, a little."""
    made = text(name, None, kind)
    if kind == "constant":
        value = choice(name, None, kind).chosen.kernel.lists["values"][-1]
        head, end = made.rsplit(repr(value), 1)
        return f"{head}0.0625{end}"
    return re.sub(r"(\ba[02]\b[^\n=]*= \D*)([01])(\.|x1\.)(\w)", r"\g<1>\g<2>\g<3>9", made)


@pytest.mark.parametrize("name", ["c", "fortran", "python"])  # that others run the text that is given: see above
@pytest.mark.parametrize("kind", ["quotient", "constant"])
def test_wrong_numbers_are_found(few, name, kind):
    need(name)
    wrong = changed(name, kind)
    assert wrong != text(name, None, kind)
    what = "error of eps" if kind == "constant" else "relative error of eps"
    with pytest.raises(ToolchainError, match=rf"^the generated code fails its check: {what} is .*, more than 0\.\d+$"):
        check_code(choice(name, None, kind), wrong)


def test_a_result_that_is_no_number_is_found(few):
    wrong = text("python").replace("return elastic / (", "return math.nan * (")
    assert wrong != text("python")
    with pytest.raises(ToolchainError, match="relative error of eps is inf"):
        check_code(choice("python"), wrong)


def test_a_wrong_dissipation_is_found_without_a_tolerance(few):
    wrong = text("python", None, "quotient").replace("return (1.0 - eps)", "return 1.01 * (1.0 - eps)")
    assert wrong != text("python", None, "quotient")
    assert set(choice("python", None, "quotient").scene.tolerance.limits()) == {"epsilon"}
    with pytest.raises(ToolchainError, match=r"relative error of 1 - eps\^2 is"):
        check_code(choice("python", None, "quotient"), wrong)


@pytest.mark.parametrize("units", ["", '[units]\nlength = "um"\nmass = "mg"\ntime = "ms"'])
def test_collisions_are_all_over_the_scene(few, units):
    made = of_kind(scene("fortran", "float", end=units), "ready")
    scale, given = made.scene.scale, checks.collisions(made)
    assert {values.dtype for values in given.arguments} == {np.dtype(np.float32)}
    for index, encounter in enumerate(made.encounters):
        speed, beta = (values[given.pair == index] for values in given.arguments)
        assert speed.min() == np.float32(encounter.speeds.slowest / scale.speed)
        assert speed.max() == np.float32(encounter.speeds.fastest / scale.speed)
        assert beta.min() == np.float32(scale.beta(encounter.weakest.beta))
        assert beta.max() == np.float32(scale.beta(encounter.strongest.beta))
        v_star = np.sqrt(beta.astype(float)) * speed.astype(float) ** 0.1
        assert v_star.min() == pytest.approx(float(encounter.v_star[0]), rel=1e-6)
        assert v_star.max() == pytest.approx(float(encounter.v_star[1]), rel=1e-6)
