"""What is generated for a scene runs and is compared with the exact function, in every language that is there."""

import re
from dataclasses import replace
from pathlib import Path
from shutil import which
from tempfile import gettempdir

import numpy as np
import pytest

from tests.scene.test_render import COMMAND, EACH, choice, chosen, scene, text
from viscopade.kernels.targets.languages import target, targets
from viscopade.kernels.toolchain import NoSuchToolError, ToolchainError
from viscopade.scene import check as checks
from viscopade.scene import read, runners
from viscopade.scene.check import SceneCheck, check_code
from viscopade.scene.choice import choose
from viscopade.scene.render import file_name, render

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
SHADERS = tuple(each.name for each in targets() if each.place == "shader")
NVCC = target("cuda").device
COMPILED = "compiled, not run"
FEW = 500


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(checks, "SPEEDS", FEW)
    monkeypatch.setattr(checks, "COLLISIONS", 2 * FEW)


@pytest.fixture
def no_device(monkeypatch):
    """Device code takes seconds to compile."""
    find = runners.find_tool
    monkeypatch.setattr(runners, "find_tool", lambda runner, *words: None if runner == NVCC else find(runner, *words))


def there(language):
    return runners.find_tool(target(language).runner) is not None


def need(language):
    if not there(language):
        pytest.skip(f"there is no {runners.missing(target(language).runner)}")


# --- the examples -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_every_example_gets_a_validated_kernel(file):
    made = choose(read.from_toml(file.read_bytes(), file.name))
    language = made.scene.code.language
    found = check_code(made, render(made, f"viscopade scene {file.name}"))
    if not there(language):
        assert found.reason.startswith("not run: there is no ")
    elif language in SHADERS:
        assert found.reason == COMPILED
        assert found.how
    else:
        assert found.how
        assert not found.reason
        assert found.collisions == 20_000 * len(made.encounters)
        for name, bound in vars(made.chosen.candidate.errors).items():
            if name in made.scene.tolerance.given() or language != "cuda":
                assert found.errors[name] <= float(bound) + checks.REFERENCE


# --- every language ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("language", "form"), EACH)
@pytest.mark.parametrize("constant", [False, True])
def test_languages(few, no_device, language, form, constant):
    need(language)
    made = choice(language, form, constant)
    found = check_code(made, text(language, form, constant))
    if language in SHADERS:
        assert found == SceneCheck(found.how, reason=COMPILED)
        return
    assert found.how
    assert not found.reason
    assert found.collisions == max(1000, 2 * FEW // 5) * 5
    # The formula's own error shows: what is compared is not the exact function with itself.
    assert (3e-5 if constant or language != "c" else 1e-6) < found.errors["epsilon"] < (0.5 if constant else 1e-3)
    assert found.errors["absolute"] <= found.errors["epsilon"]


@pytest.mark.parametrize("language", ["c", "python"])
@pytest.mark.parametrize("kind", [None, "polynomial"])
def test_from_v_star(few, language, kind):
    need(language)
    made = chosen(scene(language, code='argument = "v_star"'), kind)
    found = check_code(made, render(made, COMMAND))
    assert (1e-7 if kind or language == "python" else 1e-17) < found.errors["epsilon"] < 1e-3


def test_names_that_are_words_of_the_language(few, no_device):
    for language, name in [
        ("c", "int"), ("cuda", "viscopade"), ("glsl", "gl_float"), ("fortran", "module"), ("fortran", "real64"),
        ("rust", "fn"), ("javascript", "class"), ("python", "import"), ("c", "math"),
        ("jax", "jax"), ("numba", "class"), ("warp", "warp"),
    ]:  # fmt: skip
        plain = choice(language)
        made = replace(plain, scene=replace(plain.scene, name=name))
        found = check_code(made, render(made, COMMAND))
        assert found.collisions or found.reason


def test_device_code_is_compiled(few):
    need("cuda")
    if which("nvcc") is None:
        pytest.skip("nvcc is not installed")
    made = chosen(scene("cuda", "float", code='use = "batch"'))
    found = check_code(made, render(made, COMMAND))
    assert "device code compiled by nvcc" in found.how
    assert found.collisions
    with pytest.raises(ToolchainError, match=r"fails its check: nvcc: .*error"):
        checks._device(
            made, render(made, COMMAND).replace("return viscopade_restitution", "return no_restitution"), NVCC
        )


# --- tools that are not there, or fail --------------------------------------------------------------------------------


@pytest.mark.parametrize("language", [each.name for each in targets() if each.runner.tools])
def test_a_missing_tool_is_a_reason(few, no_device, monkeypatch, language):
    monkeypatch.setenv("PATH", "")
    for each in targets():
        if each.runner.variable:
            monkeypatch.delenv(each.runner.variable, raising=False)
    found = check_code(choice(language), text(language))
    assert (found.collisions, found.errors) == (0, {})
    assert found.reason.startswith(f"not run: there is no {target(language).runner.tools[0]}")


def test_the_environment_names_the_tool(few, monkeypatch):
    need("fortran")
    monkeypatch.setenv("FC", "gfortran -O1")
    assert check_code(choice("fortran"), text("fortran")).collisions
    monkeypatch.setenv("FC", "no-such-compiler")
    with pytest.raises(NoSuchToolError, match=r"^FC is 'no-such-compiler', which does not start: accepted"):
        check_code(choice("fortran"), text("fortran"))


def test_a_tool_that_does_not_start_is_not_there(tmp_path, monkeypatch):
    script = tmp_path / "gfortran"
    script.write_text("#!/bin/sh\nexit 1\n")
    script.chmod(0o755)
    monkeypatch.delenv("FC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert runners.find_tool(target("fortran").runner) is None


def test_a_c_compiler_that_is_asked_for_must_be_there():
    with pytest.raises(NoSuchToolError, match="there is no C compiler 'no-such-compiler'"):
        check_code(choice("c"), text("c"), "no-such-compiler")


BROKEN = {
    "c": ("static inline", "static inlin"),
    "cuda": ("VISCOPADE_FUNCTION float tiny", "VISCOPADE_FUNCTION floot tiny"),
    "fortran": ("end function", "end funktion"),
    "rust": ("pub fn beta_of", "pub fun beta_of"),
    "javascript": ("export function", "export funktion"),
    "glsl": ("float tiny_beta_of", "floot tiny_beta_of"),
    "wgsl": ("fn tiny_beta_of", "fun tiny_beta_of"),
    "julia": ("function beta_of", "funktion beta_of"),
    **dict.fromkeys(("python", "jax", "numba", "warp"), ("def beta_of", "dof beta_of")),
}


@pytest.mark.parametrize("language", BROKEN)
def test_code_that_does_not_compile(few, no_device, language):
    need(language)
    form = next(form for lang, form in reversed(EACH) if lang == language)
    broken = text(language, form).replace(*BROKEN[language])
    assert broken != text(language, form)
    with pytest.raises(ToolchainError) as caught:
        check_code(choice(language, form), broken)
    message = str(caught.value)
    assert message.startswith("the generated code fails its check: ")
    assert "error" in message.lower()
    assert "\n" not in message
    assert gettempdir() not in message


@pytest.mark.parametrize("thrown", ["import.meta.url", "process.cwd()"])
def test_messages_have_no_paths(few, thrown):
    need("javascript")
    runner = target("javascript").runner
    with pytest.raises(ToolchainError) as caught:
        runners.run_driver(
            runner, runners.find_tool(runner), f"throw new Error({thrown});\n", ("tiny.mjs", ""), b"", 16
        )
    message = str(caught.value)
    assert message.startswith("the generated code fails its check: node: Error:")
    assert gettempdir() not in message


def test_a_program_that_writes_too_little(few):
    need("javascript")
    driver = 'import { writeFileSync } from "node:fs";\nwriteFileSync("out.bin", "12345");\n'
    runner = target("javascript").runner
    with pytest.raises(ToolchainError, match=r"writes 5 bytes, not 16$"):
        runners.run_driver(runner, runners.find_tool(runner), driver, ("tiny.mjs", ""), b"", 16)


# --- code that is wrong -----------------------------------------------------------------------------------------------


def changed(language, constant):
    """Change a coefficient, or a constant, a little."""
    made = text(language, None, constant)
    if constant:
        head, found, values = made.partition("By pair, eps")
        value = choice(language, None, True).chosen.candidate.values[-1]
        return head + found + re.sub(rf"(?<![\d.]){re.escape(value)}(?!\d)", "0.0625", values)
    if language == "c":
        return re.sub(r"\{(-?0x1\.)\w", r"{\g<1>9", made)  # in each row of the table
    if language == "python":
        return re.sub(r"(a2 = -\d\.)\d", r"\g<1>9", made)
    if language == "cuda":
        return re.sub(r"(a0 = VISCOPADE_CONSTANT\(0x1\.)\w", r"\g<1>9", made)
    return re.sub(r"(a0(: f64)? = (wp.float64\()?1\.)1|(1\.)1(?=\d+,  # a0)", r"\g<1>\g<4>2", made)


@pytest.mark.parametrize("language", [each for each in read.LANGUAGES if each not in SHADERS])
@pytest.mark.parametrize("constant", [False, True])
def test_wrong_numbers_are_found(few, no_device, language, constant):
    need(language)
    wrong = changed(language, constant)
    assert wrong != text(language, None, constant)
    name = "error of eps" if constant else "relative error of eps"
    with pytest.raises(ToolchainError, match=rf"^the generated code fails its check: {name} is .*, more than 0\.\d+$"):
        check_code(choice(language, None, constant), wrong)


def test_a_result_that_is_no_number_is_found(few):
    wrong = text("python").replace('beta."""\n    return restitution_', 'beta."""\n    return math.nan * restitution_')
    assert wrong != text("python")
    with pytest.raises(ToolchainError, match="relative error of eps is inf"):
        check_code(choice("python"), wrong)


def test_a_wrong_dissipation_is_found_without_a_tolerance(few):
    wrong = text("c").replace("return viscopade_dissipation_", "return 1.01 * viscopade_dissipation_")
    assert wrong != text("c")
    assert set(choice("c").scene.tolerance.given()) == {"epsilon"}
    with pytest.raises(ToolchainError, match=r"relative error of 1 - eps\^2 is"):
        check_code(choice("c"), wrong)


@pytest.mark.parametrize("units", ["", '[units]\nlength = "um"\nmass = "mg"\ntime = "ms"'])
def test_collisions_are_all_over_the_scene(few, units):
    made = chosen(scene("fortran", "float", end=units))
    scale, given = made.scene.scale, checks._collisions(made)
    assert given.speed.dtype == given.beta.dtype == np.float32
    for index, encounter in enumerate(made.encounters):
        speed, beta = (values[given.pair == index] for values in (given.speed, given.beta))
        assert speed.min() == np.float32(encounter.speeds[0] / scale.speed)
        assert speed.max() == np.float32(encounter.speeds[2] / scale.speed)
        assert beta.min() == np.float32(scale.beta(encounter.weakest.beta))
        assert beta.max() == np.float32(scale.beta(encounter.strongest.beta))
        v_star = np.sqrt(beta.astype(float)) * speed.astype(float) ** 0.1
        assert v_star.min() == pytest.approx(float(encounter.v_star[0]), rel=1e-6)
        assert v_star.max() == pytest.approx(float(encounter.v_star[1]), rel=1e-6)


def test_file_names_do_not_meet_that_of_the_driver():
    for language in read.LANGUAGES:
        assert not file_name(choice(language).scene).startswith(runners._STEM)
        with pytest.raises(ValueError, match=r"name is"):
            scene(language, top=f'name = "{runners._STEM}"')
