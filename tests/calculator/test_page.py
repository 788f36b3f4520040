"""The page in a headless Chromium: numbers, the keyboard, bad input, the address, and its looks."""

import json
import re
from pathlib import Path

import pytest

import viscopade as vp
from tests.cli import called
from tests.devtools import opened
from viscopade.calculator import page
from viscopade.collision.adhesion import adhesive

ROOT = Path(__file__).parents[2]
COMMAND = "viscopade calculator"
MOST_BYTES = 400_000
TAB, ENTER, SPACE, RIGHT, DOWN, END, SHIFT = 9, 13, 32, 39, 40, 35, 8


@pytest.fixture(scope="module")
def text():
    return page.page(COMMAND)


@pytest.fixture(scope="module")
def url(text, tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "calculator.html"
    file.write_text(text, "utf-8")
    return file.as_uri()


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with opened(tmp_path_factory.mktemp("profile")) as tab:
        yield tab


@pytest.fixture
def tab(browser, url):
    browser.open(url)
    yield browser
    assert browser.errors == []
    assert browser.requests == [browser.evaluate("location.href.split('#')[0]")]


def test_it_is_one_small_file_that_is_the_same_each_time(text):
    assert len(text.encode()) < MOST_BYTES
    assert text == page.page(COMMAND)
    assert {*re.findall(r"https?://[^\"'\s)]+", text)} == {"http://www.w3.org/2000/svg"}
    assert not re.search(r"<link(?! rel=\"icon\" href=\"data:,\")|\bimport\(|@import|fetch\(|src=", text)


SET = """
const put = (id, value) => {
  const field = document.getElementById(id);
  if (field.type === "checkbox") field.checked = value; else field.value = value;
  field.dispatchEvent(new Event("input", { bubbles: true }));
};
const rows = () => [...document.querySelectorAll(".numbers tr")];
const row = (name) => rows().find((r) => r.cells[0].textContent === name)?.cells[1];
"""


def js(body):
    return f"(() => {{ {SET} {body} }})()"


def put(tab, **fields):
    tab.evaluate(js("".join(f"put({name!r}, {json.dumps(value)});" for name, value in fields.items())))


def shown(tab, id):
    return tab.evaluate(f"document.getElementById({id!r}).textContent")


def value(tab, name):
    return float(tab.evaluate(js(f"return row({name!r}).dataset.value")))


def test_material_and_units(tab):
    """The same ball in other units: the same eps, and the times and lengths of the package."""
    ball = vp.Sphere(radius=2e-3, density=2500, young_modulus=7e10, poisson_ratio=0.22, dissipative_constant=1e-7)
    wall = vp.Sphere.wall(young_modulus=7e10, poisson_ratio=0.22, dissipative_constant=1e-7)
    pair = vp.Pair(ball, wall)
    put(tab, radius="2 mm", kind="wall", by="A", damping="0.1 us", speed="50 cm/s")
    for system in ("SI (m, kg, s)", "CGS (cm, g, s)", "um, pg, us", "mm, t, s (MPa)"):
        put(tab, system=system)
        assert value(tab, "eps") == pytest.approx(pair.epsilon(0.5), rel=3e-8)
        assert value(tab, "1 - eps") == pytest.approx(pair.one_minus_epsilon(0.5), rel=3e-8)
        assert value(tab, "Contact time, without weight") == pytest.approx(pair.contact_time(0.5), rel=1e-10)
        assert value(tab, "Largest overlap, without weight") == pytest.approx(pair.max_compression(0.5), rel=1e-10)
        assert value(tab, "beta") == pytest.approx(pair.beta, rel=1e-12)
    stated = re.search(r"within ([0-9.e-]+) min\(eps, 1 - eps\)", shown(tab, "accuracy"))[1]
    assert float(stated) == float(page._facts()["kernels"][-1]["bound"])
    assert tab.evaluate("document.getElementById('radius').value") == "2 mm"
    assert tab.evaluate("document.getElementById('density').value") == "2.5e-09"
    printed = json.loads(called(*shown(tab, "command").split()[1:], "--format", "json").stdout)
    assert value(tab, "eps") == pytest.approx(float(printed["epsilon"]), rel=3e-8)


def test_another_way_to_give_the_damping_keeps_eps(tab):
    put(tab, damping="0.7", speed="1")
    for by in ("A", "beta", "kappa", "epsilon"):
        put(tab, by=by)
        assert value(tab, "eps") == pytest.approx(0.7, rel=1e-7)
    for law in ("linear", "tsuji", "hunt-crossley", "kelvin-voigt:1", "3/2,0", "viscoelastic"):
        put(tab, law=law)
        assert value(tab, "eps") == pytest.approx(0.7, rel=1e-7)
        assert "NaN" not in tab.evaluate("document.body.innerText")


# --- the keyboard ----------------------------------------------------------------------------------------------------


def focused(tab):
    return tab.evaluate("document.activeElement.id")


def tab_to(tab, id, most=80):
    for _ in range(most):
        if focused(tab) == id:
            return
        tab.press("Tab", code=TAB)
    raise AssertionError(f"the key Tab does not reach {id}")


def typed(tab, text):
    tab.press("a", code=65, modifiers=2)  # the control key: all that is there
    tab.evaluate("document.activeElement.select()")
    for letter in text:
        tab.press(letter, text=letter)


def test_the_keyboard_is_enough(tab):
    tab.press("Tab", code=TAB)
    assert focused(tab) == "speed"
    typed(tab, "20 cm/s")
    assert "at 0.2 m/s" in shown(tab, "summary")
    tab_to(tab, "slide-speed")
    tab.press("ArrowRight", code=RIGHT)
    assert "at 0.2 m/s" not in shown(tab, "summary")
    tab_to(tab, "by")
    tab.press("ArrowDown", code=DOWN)
    assert tab.evaluate("document.getElementById('by').value") == "drop"
    tab.press("ArrowDown", code=DOWN)
    assert tab.evaluate("document.getElementById('by').value") == "A"
    tab_to(tab, "damping")
    typed(tab, "1e-7")
    assert value(tab, "A of the pair") == pytest.approx(1e-7, rel=1e-12)
    tab_to(tab, "kind")
    tab.press("a", text="a")  # "another size"
    tab_to(tab, "radius2")
    typed(tab, "1 m")
    assert value(tab, "A of the pair") == pytest.approx(1e-7, rel=1e-12)
    tab_to(tab, "approximants")
    tab.press("Enter", text="\r", code=ENTER)
    tab_to(tab, "curve-1")
    tab.press(" ", text=" ", code=SPACE)
    # The law's curve, and those of [0/3] and of its difference.
    assert tab.evaluate("document.querySelectorAll('#plot path').length") == 3
    tab_to(tab, "program")
    tab.press("m", text="m")
    assert tab.evaluate("document.getElementById('program').value") == "mercurydpm"
    assert "setDissipation(1e-07)" in shown(tab, "line")
    tab_to(tab, "copy-line")
    tab.press("Enter", text="\r", code=ENTER)
    tab.evaluate("new Promise((done) => setTimeout(done, 100))")
    assert shown(tab, "copied") != ""


def test_every_control_has_a_label_and_a_place_in_the_order(tab):
    bare = """JSON.stringify([...document.querySelectorAll("input, select, button")]
      .filter((e) => !(e.labels?.length || e.getAttribute("aria-label") || (e.tagName === "BUTTON" && e.textContent)))
      .map((e) => e.id))"""
    assert json.loads(tab.evaluate(bare)) == []
    tab.evaluate("document.querySelectorAll('details').forEach((each) => each.open = true)")
    reachable = """JSON.stringify([...document.querySelectorAll("input, select, button, pre, summary")]
      .filter((e) => e.offsetParent && !e.disabled).map((e) => e.id))"""
    wanted = json.loads(tab.evaluate(reachable))
    seen = []
    for _ in wanted:
        tab.press("Tab", code=TAB)
        seen.append(focused(tab))
    assert seen == wanted


# --- bad input, and the address -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "bad"),
    [
        ("speed", ""), ("speed", "-1"), ("speed", "1 kg"), ("speed", "1e400"), ("speed", "x" * 300),
        ("damping", "1.5"), ("damping", "nan"), ("poisson", "0.6"), ("young", "1e-99"), ("from", "200"), ("to", "<b>"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line_and_leaves_no_number(tab, field, bad):
    put(tab, **{field: bad})
    problem = shown(tab, "problem")
    assert problem
    assert "expected" in problem
    assert "\n" not in problem
    assert tab.evaluate("document.querySelectorAll('[aria-invalid]').length") == 1
    text = tab.evaluate("document.body.innerText")
    assert "NaN" not in text.replace(bad, "")
    assert "undefined" not in text
    assert tab.evaluate("document.getElementById('good').offsetParent") is None
    put(tab, **{field: {"from": "0.001"}.get(field, "0.3")})
    if field == "to":
        put(tab, **{field: "10"})
    assert shown(tab, "problem") == ""
    assert tab.evaluate("document.querySelectorAll('[aria-invalid]').length") == 0


def test_a_setting_is_in_the_address(tab, url):
    put(tab, system="CGS (cm, g, s)", law="linear", end="return", damping="0.42", kind="wall", program="drake")
    put(tab, **{"curve-12": True}, vertical="log", bodies=True)
    before = [shown(tab, id) for id in ("summary", "numbers", "line", "shown")]
    tab.evaluate("new Promise((done) => setTimeout(done, 500))")  # the address follows a quarter of a second later
    address = tab.evaluate("location.href")
    assert address.startswith(f"{url}#")
    tab.open(address)
    assert [shown(tab, id) for id in ("summary", "numbers", "line", "shown")] == before
    assert tab.evaluate("location.href") == address


@pytest.mark.parametrize(
    "fragment",
    [
        "law=nothing&by=x&kind=9",
        "%%%",
        "damping=<img src=x onerror=alert(1)>",
        "curves=%2B%2B&from=9&to=1",
    ],
)
def test_hostile_addresses(browser, url, fragment):
    browser.open(f"{url}#{fragment}")
    assert browser.errors == []
    assert "NaN" not in browser.evaluate("document.getElementById('right').innerText").replace('"NaN"', "")
    assert browser.evaluate("document.querySelectorAll('img').length") == 0


def test_a_ball_that_falls(tab):
    """Gravity is asked for at walls, in the chosen units, and the numbers with weight are shown."""
    names = ["eps with weight, if it falls", "g t_c / v", "Stays down below"]
    shown = f"return {names}.map((name) => row(name)?.textContent ?? null);"
    put(tab, young="1e7", speed="0.05", at="0.05", damping="0.7", kind="same")
    assert tab.evaluate(js(shown)) == [None, None, None]
    put(tab, kind="wall")
    eps, share, sticking = tab.evaluate(js(shown))
    glass = {"young_modulus": 1e7, "poisson_ratio": 0.22, "dissipative_constant": 0}
    pair = vp.Pair(vp.Sphere(radius=0.01, density=2500, **glass), vp.Sphere.wall(**glass)).calibrated(0.05, 0.7)
    assert float(eps) == pytest.approx(pair.epsilon(0.05, gravity=9.81), abs=1e-6)
    assert float(share) == pytest.approx(9.81 * pair.damped(0).contact_time(0.05) / 0.05, rel=2e-3)
    assert sticking.endswith(" m/s")
    put(tab, system="CGS (cm, g, s)")
    assert tab.evaluate('document.getElementById("gravity").value') == "981"
    assert tab.evaluate(js(shown)) == [eps, share, f"{float(sticking.split()[0]) * 100:.3g} cm/s"]
    put(tab, speed="1e-2")
    assert tab.evaluate(js(shown))[0] == "0: it stays down"
    put(tab, gravity="0")
    assert tab.evaluate(js(shown)) == [None, None, None]


def test_spheres_that_adhere(tab):
    """The work of adhesion is asked for where the law is the paper's; a curve falls to 0 at the sticking speed."""
    names = ["eps with adhesion", "Sticks below"]
    shown = f"return {names}.map((name) => row(name)?.textContent);"
    curves = "document.querySelectorAll('[data-curve=curve-adhesion]').length"
    put(tab, kind="same", radius="0.1 mm", young="50 MPa", poisson="0.3", by="A", damping="1 us", speed="0.1")
    assert tab.evaluate(js(shown)) == [None, None]
    assert tab.evaluate(curves) == 0
    put(tab, adhesion="70 mJ/m^2")
    eps, sticking = tab.evaluate(js(shown))
    rubber = {"young_modulus": 5e7, "poisson_ratio": 0.3, "dissipative_constant": 1e-6}
    ball = vp.Sphere(radius=1e-4, density=2500, **rubber)
    assert float(eps) == pytest.approx(adhesive(vp.Pair(ball, ball), 0.07).collide(0.1).epsilon, abs=1e-6)
    assert sticking.endswith(" m/s")
    assert tab.evaluate(curves) == 2  # eps, and its difference from the law
    put(tab, speed="0.01")
    assert tab.evaluate(js(shown))[0] == "0: they stick"
    put(tab, end="return")
    assert tab.evaluate(js(shown)) == [None, None]


def test_a_drop_and_its_rebound(tab):
    """The damping with which a ball that falls from H, with its weight in the contact, rebounds to h = eps^2 H."""
    put(tab, young="1e7", poisson="0.22", by="drop", damping="70 cm", height="1")
    ball = vp.Sphere(radius=0.01, density=2500, young_modulus=1e7, poisson_ratio=0.22, dissipative_constant=0)
    wall = vp.Sphere.wall(young_modulus=1e7, poisson_ratio=0.22, dissipative_constant=0)
    pair = vp.Pair(ball, wall).damped(value(tab, "A of the pair"))
    impact = (2 * 9.81) ** 0.5
    assert pair.epsilon(impact, gravity=9.81) == pytest.approx(0.7**0.5, abs=1e-6)
    assert shown(tab, "summary") == "eps = 0.83666 at 4.429447 m/s, with the weight"
    assert tab.evaluate("[speed.value, speed.disabled].join()") == "4.429447,true"
    assert "from the height" in shown(tab, "label-speed")
    time = value(tab, "Contact time, without weight")
    assert tab.evaluate(js("return row('Contact time, without weight').textContent")) == f"{time:.4g} s"
    for text, height in {"10 cm": 0.1, "2": 2}.items():
        put(tab, other=text)
        again = pair.epsilon((2 * 9.81 * height) ** 0.5, gravity=9.81)
        row = f"From {height:g} m it rebounds to"
        assert value(tab, row) == pytest.approx(again, abs=1e-6)
        words = f"{100 * height * again**2:.3g} cm ({100 * again**2:.3g} %), eps = {again:.4g}"
        assert tab.evaluate(js(f"return row({row!r}).textContent")) == words
    assert words.startswith("137 cm (68.3 %)")
    put(tab, other="", damping="70 %", adhesion="1")
    assert tab.evaluate(js("return row('eps with adhesion and weight')")) is None
    assert value(tab, "eps with weight, if it falls") == pytest.approx(0.7**0.5, abs=1e-6)
    put(tab, by="epsilon", adhesion="")
    assert value(tab, "eps") == pytest.approx(pair.epsilon(impact), rel=1e-6)
    put(tab, speed="1")
    assert value(tab, "eps") == pytest.approx(pair.epsilon(1), rel=1e-6)
    put(tab, by="drop")
    rebound = tab.evaluate("Number(damping.value)")
    assert rebound == pytest.approx(0.7, rel=1e-6)
    put(tab, damping="1.2")
    assert "expected a height > 0 and below 1" in shown(tab, "problem")
    put(tab, damping="0.7", kind="same")
    assert "expected a ball on a wall" in shown(tab, "problem")


def test_a_contact_time_stands_for_the_bodies(tab):
    """A law without Hertz's force has no bodies: a contact time gives MuJoCo's line, and eps with the weight."""
    put(tab, law="linear", contact="40 ms", damping="0.5", speed="1", program="mujoco")
    assert tab.evaluate("document.getElementById('radius').offsetParent") is None
    # MuJoCo has its own eps with weight: the law's is hidden, and the command writes a file for it and the time step.
    heavy = tab.evaluate(js("return row('eps with weight, if it falls').textContent"))
    assert heavy.startswith("in the file for MuJoCo")
    assert tab.evaluate(js("return row('Stays down below')")) is None
    assert "a contact lasts 20 steps" in shown(tab, "reason")
    command = shown(tab, "simulator")
    assert command.endswith("--speed 1 --contact-time 0.04 --gravity 9.81 --time-step 0.002")
    assert "at 1 m/s rebounds with eps = 0.5000 (mean" in called(*command.split()[1:]).stdout
    solref = re.search(r'solref="(\S+) (\S+)"', shown(tab, "line")).groups()
    command = ("simulators", "mujoco", "--epsilon", "0.5", "--speed", "1", "--contact-time", "40 ms")
    file = re.search(r'solref="(\S+) (\S+)"', called(*command).stdout).groups()
    assert [*map(float, solref)] == pytest.approx([*map(float, file)], rel=1e-7)
    put(tab, program="drake")
    assert "The line sets no stiffness" in shown(tab, "reason")
    put(tab, program="lammps")
    # The same contact on the command line, by its stiffness and mass.
    stiffness = -float(file[0])
    options = ("--law", "linear", "--stiffness", repr(stiffness), "--mass", "1", "--speed", "1", "--gravity", "9.81")
    kappa = str(value(tab, "kappa") * stiffness**0.5)
    heavy = json.loads(called("epsilon", *options, "--damping", kappa, "--format", "json").stdout)
    assert value(tab, "eps with weight, if it falls") == pytest.approx(float(heavy["epsilon"]), abs=1e-6)
    assert tab.evaluate(js("return row('Stays down below').textContent")).endswith(" m/s")
    put(tab, by="drop", height="20 cm", damping="5 cm")
    assert value(tab, "eps with weight, if it falls") == pytest.approx(0.5, abs=1e-6)
    put(tab, program="mujoco")
    assert "--epsilon 0.5 " in shown(tab, "simulator")


def test_a_program_says_where_a_contact_time_is_typed(tab):
    put(tab, program="mujoco")
    assert 'To give a contact time instead of the bodies, clear "Bodies are known"' in shown(tab, "reason")
    put(tab, bodies=False, contact="31 ms")
    assert "Bodies" not in shown(tab, "reason")
    assert "solref" in shown(tab, "line")


def test_eps_in_percent_without_its_sign(tab):
    put(tab, damping="83.67")
    assert shown(tab, "problem").endswith("expected a number > 0 and <= 1, from 1e-9 on, such as 83.67 %")
    put(tab, damping="1.5")
    assert "%" not in shown(tab, "problem")
    put(tab, damping="83.67 %")
    assert shown(tab, "problem") == ""


def test_a_law_begins_with_the_contact_time_of_the_spheres(tab):
    before = value(tab, "Contact time, without weight")
    put(tab, law="linear")
    assert value(tab, "Contact time, without weight") == pytest.approx(before, rel=1e-3)


def test_the_page_says_that_eps_is_the_input(tab):
    assert tab.evaluate("document.getElementById('more').open") is False
    assert "You gave eps = 0.9 at 1 m/s. A faster impact loses a larger share" in shown(tab, "explanation")
    assert value(tab, "eps") < 0.9
    put(tab, young="5 MPa")
    assert "The bodies give the contact time and the overlap, not eps" in shown(tab, "explanation")
    put(tab, law="linear")
    assert "loses the same share" in shown(tab, "explanation")
    put(tab, law="3/2,0")
    assert "loses a smaller share" in shown(tab, "explanation")
    put(tab, contact="40 ms", speed="1")
    assert "Without weight, a faster impact" in shown(tab, "explanation")
    put(tab, law="viscoelastic", damping="1")
    assert "faster" not in shown(tab, "explanation")
    put(tab, damping="0.9", adhesion="0.1")
    assert "faster" not in shown(tab, "explanation")
    put(tab, law="viscoelastic", by="A")
    assert "You gave A and the bodies" in shown(tab, "explanation")


@pytest.mark.parametrize(
    ("field", "odd", "usual"), [("radius", "1", "1 cm"), ("density", "2.5", "2.5 g/cm3"), ("young", "70", "70 GPa")]
)
def test_a_forgotten_unit_is_noticed(tab, field, odd, usual):
    put(tab, **{field: odd})
    assert "Is the unit right?" in shown(tab, "warnings")
    put(tab, **{field: usual})
    assert "Is the unit right?" not in shown(tab, "warnings")


def test_unknown_settings_of_the_address_are_named(tab, url):
    tab.open(f"{url}#Speed=2&eps=0,5&law=none&radius=2+cm&curves=linear")
    assert shown(tab, "unread") == "The page does not know these settings of its address: Speed=2, eps=0,5, law=none."
    tab.open(f"{url}#radius=2+cm")
    assert shown(tab, "unread") == ""


@pytest.mark.parametrize(
    ("typed_text", "metres_a_second"), [("0,5", 0.5), ("1,25 m/s", 1.25), ("0,125", 0.125), (",5e1", 5.0)]
)
def test_a_decimal_comma(tab, typed_text, metres_a_second):
    put(tab, speed=typed_text)
    assert shown(tab, "problem") == ""
    assert f"at {metres_a_second:g} m/s" in shown(tab, "summary")


def test_a_comma_that_may_mean_thousands_is_refused(tab):
    put(tab, speed="1,000")
    assert shown(tab, "problem") == 'impact speed is "1,000", which has two meanings: expected 1.000 or 1000'


def test_the_result_is_above_the_fields_on_a_phone(tab):
    above = "document.getElementById('answers').getBoundingClientRect().top < form.getBoundingClientRect().top"
    tab.call("Emulation.setDeviceMetricsOverride", width=400, height=800, deviceScaleFactor=1, mobile=True)
    assert tab.evaluate(above)
    tab.call("Emulation.clearDeviceMetricsOverride")
    assert not tab.evaluate(above)


def test_the_page_of_the_calculator_shows_the_rebound_from_another_height(tab):
    put(tab, by="drop", damping="70 cm", height="1 m", other="10 cm")
    words = tab.evaluate(js("return row('From 0.1 m it rebounds to').textContent"))
    assert f'for `10 cm` the page prints "{words}"' in (ROOT / "docs/usage/calculator.md").read_text("utf-8")


def test_the_numbers_of_the_bouncing_balls():
    """Two balls fall from 1 m and rebound to 70 cm: their contact times and A, and rebounds from other heights."""
    words = (ROOT / "docs" / "usage" / "calculator.md").read_text("utf-8").partition("## A bouncing ball")[2]
    glass = {"young_modulus": 7e10, "poisson_ratio": 0.22, "dissipative_constant": 0}
    rubber = {"young_modulus": 5e6, "poisson_ratio": 0.49, "dissipative_constant": 0}
    for radius, density, material in ((8e-3, 2500, glass), (2e-2, 1100, rubber)):
        pair = vp.Pair(vp.Sphere(radius=radius, density=density, **material), vp.Sphere.wall(**material))
        pair = pair.calibrated(19.62**0.5, 0.7**0.5)
        assert f"| {1e3 * pair.contact_time(19.62**0.5):#.2g} ms | {1e6 * pair.A:.3g} µs |" in words
        rebound = {height: height * pair.epsilon((19.62 * height) ** 0.5) ** 2 for height in (2, 0.1)}
        assert f"from 2 m they rebound to {rebound[2]:.2f} m ({50 * rebound[2]:.0f} %)" in words
        assert f"from 10 cm to {100 * rebound[0.1]:.1f} cm ({1000 * rebound[0.1]:.0f} %)" in words
