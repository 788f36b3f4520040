"""Every form of a recording is a row: a small file, what is read, and what is said, by plain arithmetic."""

import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.cli import json_of
from viscopade.cli.fit import read_text
from viscopade.fitting import forms, read
from viscopade.fitting.read import Options

DATA = Path(__file__).with_name("data")
G = 9.80665


def recorded(text, **options):
    return read.recording([(text.encode(), "a.csv")], Options(**options))


def fallen(*heights):
    """Return the speeds after falls from these heights in metres."""
    return [(2 * G * height) ** 0.5 for height in heights]


def rises(*heights):
    """Return eps of successive heights."""
    return [(after / before) ** 0.5 for before, after in pairwise(heights)]


def flown(*times):
    return [G * time / 2 for time in times]


def ratios(*times):
    return [after / before for before, after in pairwise(times)]


V, E = [1, 2, 3], [0.9, 0.85, 0.8]
PAIRS_AND_ERRORS = "1;.9;.01\n2;.85;.02\n3;.8;.03\n"
PAIRS = "1,0.9\n2,0.85\n3,0.8\n"
CM = "100,0.9\n200,0.85\n300,0.8\n"
T = [0.25, 1.25, 2.15, 2.95]  # flights of 1, 0.9 and 0.8 s
TIMES = "\n".join(map(str, T))
OF_TIMES = (flown(1, 0.9), ratios(1, 0.9, 0.8))
H = (1.0, 0.81, 0.64)
OF_HEIGHTS = (fallen(*H[:-1]), rises(*H))

# The text, the speeds, eps, and the columns as they are named: quantity, header, error; and those that are not used.
READ = {
    "error beside its quantity": (
        "Impact velocity (cm/s),COR,+/-,remark\n100,0.9,.01,a\n200,0.85,.01,b\n300,0.8,.01,\n",
        V,
        E,
        "speed: 'Impact velocity (cm/s)'; epsilon: 'COR'; error of epsilon: '+/-'; not used: 'remark'",
    ),
    "error by the name of its column": (
        "v,COR,sigma COR\n1,.9,.01\n2,.85,.01\n3,.8,.01",
        V,
        E,
        "error of epsilon: 'sigma COR'",
    ),
    "d_eps": ("d_eps,v,eps\n.01,1,.9\n.01,2,.85\n.01,3,.8", V, E, "error of epsilon: 'd_eps'"),
    "dv": ("v,dv,de,e\n1,.1,.1,.9\n2,.1,.1,.85\n3,.1,.1,.8", V, E, "error of speed: 'dv'; error of epsilon: 'de'"),
    "u(v)": ("v (cm/s),u(v),e\n100,1,.9\n200,1,.85\n300,1,.8", V, E, "error of speed: 'u(v)'"),
    "both have errors": (
        "v;±;COR;±\n1;0,1;0,9;0,01\n2;0,1;0,85;0,01\n3;0,1;0,8;0,01",
        V,
        E,
        "error of speed: '±'; error of epsilon: '±'",
    ),
    "v / cm s^-1": (f"v / cm s^-1,e\n{CM}", V, E, "speed: 'v / cm s^-1'"),
    "v_cm_s": (f"v_cm_s,e\n{CM}", V, E, "speed: 'v_cm_s'"),
    "v/(cm/s)": (f"v/(cm/s),COR\n{CM}", V, E, "speed: 'v/(cm/s)'"),
    "v_ms": (f"v_ms,eps\n{PAIRS}", V, E, "speed: 'v_ms' in m/s (its header)"),
    "ms-1": (f"Velocity (ms⁻¹),COR\n{PAIRS}", V, E, "speed: 'Velocity (ms⁻¹)'"),
    "v, m/s": (f'"v, m/s",eps\n{PAIRS}', V, E, "speed: 'v, m/s'"),
    "German": (
        "Geschwindigkeit v in cm/s;Restitutionskoeffizient;Fehler Restitutionskoeffizient\n"
        "100;0,9;0,01\n200;0,85;0,01\n300;0,8;0,01\n",
        V,
        E,
        "error of epsilon: 'Fehler Restitutionskoeffizient'",
    ),
    "French": (f"vitesse (m/s),coefficient de restitution\n{PAIRS}", V, E, "speed: 'vitesse (m/s)'"),
    "quoted decimal commas": ('"v (m/s)","e"\n"1,0","0,9"\n"2,0","0,85"\n"3,0","0,8"\n', V, E, "epsilon: 'e'"),
    "units below units": (f"v (m/s),e\nm/s,-\n{PAIRS}", V, E, "speed: 'v (m/s)'"),
    "E, and nothing else": (f"v (m/s),E\n{PAIRS}", V, E, "epsilon: 'E'"),
    "E and a speed after": ("v_in,v_out,E\n1,.9,7\n2,1.7,8\n3,2.4,9\n", V, E, "not used: 'E'"),
    "times": (f"t (s)\n{TIMES}", *OF_TIMES, "time: 't (s)'; not used: none"),
    "t in s": (f"t in s\n{TIMES}", *OF_TIMES, "time: 't in s'"),
    "t_ms": ("t_ms\n250\n1250\n2150\n2950", *OF_TIMES, "time: 't_ms'"),
    "Italian": (f"tempo (s)\n{TIMES}", *OF_TIMES, "time: 'tempo (s)'"),
    "Spanish": (f"tiempo [s]\n{TIMES}", *OF_TIMES, "time: 'tiempo [s]'"),
    "times and errors": (
        "t (s),sigma_t (ms)\n" + "\n".join(f"{t},1" for t in T),
        *OF_TIMES,
        "time: 't (s)'; error of time: 'sigma_t (ms)'",
    ),
    "acoustic stopwatch": (
        'Akustische Stoppuhr\n"Nr.";"Zeit (s)"\n' + "\n".join(f'{k};"{t}"'.replace(".", ",") for k, t in enumerate(T)),
        *OF_TIMES,
        "time: 'Zeit (s)'; not used: 'Nr.'",
    ),
    "intervals": ("interval (ms)\n\n1000\n900\n800", *OF_TIMES, "interval: 'interval (ms)'"),
    "bounces in a row": (
        "bounce 0 (s),bounce 1 (s),bounce 2 (s),bounce 3 (s)\n.25,1.25,2.15,2.95",
        *OF_TIMES,
        "bounces:",
    ),
    "heights": ("height_cm\n100\n81\n64\n", *OF_HEIGHTS, "height: 'height_cm'"),
    "Höhe": (
        "Höhe h / cm;Nr.\n100;0\n81;1\n64;2\n",
        *OF_HEIGHTS,
        "height: 'Höhe h / cm' in cm (its header); number: 'Nr.'; not used: none",
    ),
    "hauteur": ("hauteur (m);±\n1;0,01\n0,81;0,01\n0,64;0,01", *OF_HEIGHTS, "error of height: '±'"),
    "H and h": ("H (cm),h (cm)\n100,81\n81,64\n", *OF_HEIGHTS, "drop_height: 'H (cm)'; rebound_height: 'h (cm)'"),
    "errors of H and h": (
        "H (cm),h (cm),sigma_H (cm),sigma_h (cm)\n100,81,4,.1\n81,64,4,.1\n",
        *OF_HEIGHTS,
        "error of drop_height: 'sigma_H (cm)'; error of rebound_height: 'sigma_h (cm)'; not used: none",
    ),
    "ΔH and Δh": (
        "h (cm),H (cm),ΔH (cm),Δh (cm)\n81,100,4,.1\n64,81,4,.1\n",
        *OF_HEIGHTS,
        "error of drop_height: 'ΔH (cm)'; error of rebound_height: 'Δh (cm)'; not used: none",
    ),
    "an error of h only": (
        "H,h,sigma_h\n1,.81,.1\n.81,.64,.1\n",
        *OF_HEIGHTS,
        "error of rebound_height: 'sigma_h'; not",
    ),
    "an error of h1 and h2": (
        "H,h1,h2,sigma_h\n1,.81,.64,.1\n",
        *OF_HEIGHTS,
        "heights: 'h1', 'h2' in m (plain numbers); error of heights: 'sigma_h'; not used: none",
    ),
    "Drop and Rebound": ("Drop (cm),Rebound (cm)\n100,81\n81,64\n", *OF_HEIGHTS, "drop_height: 'Drop (cm)'"),
    "H0 to H2": (
        "drop,H0 (cm),H1 (cm),H2 (cm)\n1,100,81,64\n",
        *OF_HEIGHTS,
        "heights: 'H0 (cm)', 'H1 (cm)', 'H2 (cm)'",
    ),
    "H, h1, h2": (
        "H,h1,h2\n1,.81,.64\n",
        *OF_HEIGHTS,
        "drop_height: 'H' in m (plain numbers); heights: 'h1', 'h2' in m",
    ),
    "T0 to T2": ("H,T0,T1,T2\n9,1,.9,.8\n", *OF_TIMES, "flights: 'T0', 'T1', 'T2' in s (plain numbers); not used: 'H'"),
    "a gap in a row": (
        "h0,h1,h2,h3\n1,.81,,.5\n1,.81,.64,\n.64,,,\n",
        [fallen(1)[0], *OF_HEIGHTS[0]],
        [0.9, *OF_HEIGHTS[1]],
        "heights:",
    ),
}


@pytest.mark.parametrize("case", READ)
def test_forms(case):
    text, speed, epsilon, shown = READ[case]
    found = recorded(text)
    assert found.points.speed == pytest.approx(speed, rel=1e-12)
    assert found.points.epsilon == pytest.approx(epsilon, rel=1e-9)
    assert shown in " ".join(read_text(found))


@pytest.mark.parametrize("form", forms.FORMS, ids=lambda form: form.header)
def test_examples_are_forms_of_their_own(form):
    assert forms.layout(form.header.split(", "), {}).form == form


# The text, and the standard errors of eps = f(a, b): the root of the sum of squares.
ERRORS = {
    "percent points": ("v,COR (%),± (%)\n1,90,1\n2,85,2\n", [0.01, 0.02]),
    "in the unit of the quantity": ("height (cm),±\n100,1\n64,1\n", [0.8 / 2 * np.hypot(1 / 64, 1 / 100)]),
    "of each height": ("H (cm),±,h (cm),±\n100,1,64,0\n", [0.8 / 2 / 100]),
    "of flights": ("T0,±,T1,±\n1,.01,.8,.02\n", [0.8 * np.hypot(0.01, 0.02 / 0.8)]),
    "of all flights in a row": (
        "T0,T1,T2,sigma\n1,.8,.7,.01\n",
        [0.01 * np.hypot(1, 0.8), 0.01 / 0.8 * np.hypot(1, 0.875)],
    ),
    "of speeds before and after": ("v_in,u(v_in),v_out,u(v_out)\n2,.1,1,.2\n", [np.hypot(0.1 / 4, 0.2 / 2)]),
}


@pytest.mark.parametrize("case", ERRORS)
def test_errors(case):
    text, errors = ERRORS[case]
    assert recorded(text).points.standard_errors == pytest.approx(errors, rel=1e-9)


TRACK = "\n".join(f"{t:.2f},{1 - (t % 0.2):.3f}" for t in np.arange(0, 1, 0.04))

# The text, and a part of the refusal.
REFUSED = {
    "one sigma beside two quantities": (
        f"v,e,sigma\n{PAIRS}".replace("\n3", ",.1\n3"),
        "'sigma' are of speed or of epsilon: expected --column sigma_speed='sigma' or --column sigma_epsilon='sigma'",
    ),
    "rising heights": (
        "height (m)\n0.2\n0.4\n0.6\n",
        "line 3: the height 0.4 m is above .* drops.* drop_height and rebound_height, or a column drop",
    ),
    "a rebound above its drop": (
        "H,h\n1,.8\n1,1.1\n",
        "line 3, h: the height 1.1 m is above the one before it, 1 m: is the order of the columns right.*drop_height=",
    ),
    "repetitions": (
        "H,h1,h2,h3\n100,64,63,62\n80,51,50,49\n",
        "are they repetitions, from one height. Then .* H and h",
    ),
    "repetitions that rise": (
        "H,h1,h2\n1,.64,.66\n.8,.5,.51\n",
        "line 2, h2: the height 0.66 m is above the one before",
    ),
    "equal heights": ("height (cm)\n50\n50\n50\n", "all heights are 0.5 m: are these independent drops"),
    "fast": ("v,e\n100,.9\n200,.85\n300,.8\n", "line 3: the speed is 200 m/s: .* is the unit right.*--unit speed=UNIT"),
    "eps of 1": ("v_in,v_out\n1,1\n2,2\n3,3\n", "eps is 1 at all points: are the columns and the units right"),
    "times and heights of bounces": (
        "Time (s),Height (m)\n.25,1\n1.34,.8\n2.2,.6\n2.9,.5\n",
        "line 3 is 1.09 s after the one before.* evenly spaced .*--column position=- .*--column time=-",
    ),
    "E above 1": (f"v (m/s),E\n{PAIRS}4,1.2\n", "line 5: 'E' is 1.2: expected 0 to 1, or --column epsilon=E"),
    "times that ascend as flights": ("T0,T1,T2,T3\n.3,.9,1.4,1.8\n", "are they instants of bounces"),
    "a series with a gap": ("h0,h1,h3\n1,.8,.5\n", "the columns 'h0' .*'h1' .*'h3' .* are no series"),
    "no unit of a speed": (
        f"v / px,e\n{PAIRS}",
        "the unit of speed is 'px': expected m/s or cm/s, or --unit speed=UNIT",
    ),
    "no common unit": (
        f"v_px,e\n{PAIRS}",
        "columns are 'v_px', 'e': expected .*--column NAME=HEADER.*--unit NAME=UNIT",
    ),
    "c is no unit": (f"v_c,e\n{PAIRS}", "the columns are 'v_c', 'e'"),
    "a length": (f"v_cm,e\n{PAIRS}", "'v_cm': the unit of speed is 'cm': expected m/s or cm/s, or --unit speed=UNIT"),
    "km/h without a sign": (
        f"v_kmh,e\n{PAIRS}",
        "'v_kmh': the unit of speed is 'kmh': expected m/s or cm/s, or --unit",
    ),
    "pixels": (f"t (s),y (px)\n{TRACK}", "unit of position is 'px': .* --length-per-unit"),
    "two units": (f"v (m/s),e\ncm/s,-\n{PAIRS}", "the units 'm/s' in its header and 'cm/s' in the row below"),
    "commas and points": (
        "v;e\n1,000;0.9\n2,000;0.8\n",
        "line 2: '1,000' has a comma, line 2 has '0.9'",
    ),
    "thousands": (
        "v\teps (%)\n1,053\t90\n1,250\t85\n",
        "line 2: '1,053' has a comma, it may be 1053: expected no thousands separators",
    ),
    "time cells": ("time\n00:00:01\n00:00:02\n00:00:03\n", "line 2: time is '00:00:01': expected a number"),
    "1_0": ("v,e\n1_0,.9\n2,.8\n", "line 2: speed is '1_0': expected a number > 0"),
    "heights beside other heights": (
        "Height (cm),Average bounce (cm)\n100,60\n80,50\n60,40\n",
        "'Average bounce .cm.' is not read beside 'Height .cm.': expected --column NAME=2",
    ),
    "heights beside speeds": ("h,v,E\n1,4,.9\n.8,3.9,.8\n.6,3.4,.7\n", "the column 'v' is not read beside 'h'"),
    "percent of what": ("v,COR,error (%)\n1,.9,5\n2,.85,5\n", "errors 'error .%.' are of speed or of epsilon"),
    "percent of eps": ("v,COR,sigma_COR (%)\n1,.9,5\n2,.85,5\n", "the errors of epsilon are in %, but epsilon is not"),
    "an error is missing": ("v,e,±\n1,.9,.1\n2,.85,\n", "line 3: sigma_epsilon is '': expected a number >= 0"),
    "nothing": (
        "a,b\n1,2\n",
        "columns are 'a', 'b': expected .* NAME=HEADER, such as --column speed='a'; --unit NAME=UNIT",
    ),
    "falls": ("Height (m),Fall time (s)\n.8,.4\n.6,.35\n.4,.28\n", "'Fall time .s.' is not read beside 'Height .m.'"),
    **{
        f"{names} beside eps": (
            f"{names}\n.5,.9,.1\n.4,.89,.1\n.3,.88,.1\n",
            "the column '[eE]' is not read beside .* a column speed",
        )
        for names in ("H (m),e,u", "height (m),e,±", "t (s),e,n", "H,E,n", "T,E,n")
    },
    "± of an unknown column": (
        "height (cm),n,±\n100,5,1\n81,5,1\n64,5,1\n",
        "the errors '±' are of height: expected --column sigma_height='±'",
    ),
    "a drop and H": ("drop,H (cm),h (cm)\n1,100,81\n2,81,64\n", "are both drop_height: expected one; choose with"),
    "a unit of h only": (
        "H,h (cm)\n100,81\n81,64\n",
        "'h .cm.' is in cm, but 'H' has no unit: expected one, such as --unit drop_height=cm",
    ),
    "a unit of h0 only": ("h0 (cm),h1,h2\n100,81,64\n", "'h1' has no unit: expected one, such as --unit heights=cm"),
    "a unit of one speed": ("v_in (cm/s),v_out\n100,81\n90,70\n", "'v_out' has no unit: .*--unit speed_out=cm/s"),
    "fractions in percent": (
        f"v,e (%)\n{PAIRS}",
        "'e .%.': all numbers are 0.9 % or less: is the unit right. Expected numbers such as 90, or a header without %",
    ),
    "two errors of eps": (
        "v,e,sigma_e,u(e)\n1,.9,.1,.2\n2,.8,.1,.2\n",
        "'sigma_e' .column 3. and 'u.e.' .column 4. are both errors of epsilon: expected --column sigma_epsilon=NUMBER",
    ),
    "an error of two heights": (
        "Drop (cm),Rebound (cm),sigma height\n100,81,.1\n90,72,.1\n",
        "'sigma height' are of drop_height or of rebound_height: expected --column sigma_drop_height='sigma height' or",
    ),
    "two tables": (f"t (s),y (m)\n{TRACK}\nv,e,sigma_e\n1,.9,.1\n", "line 27: 3 cells under 2 names"),
    "a sound track": ("time (s),amplitude\n" + TRACK.replace(".04,", ".041,"), "evenly spaced, as in a recording"),
    "an energy": ("t,v,e\n" + "".join(f"{row},.5\n" for row in TRACK.split("\n")), "evenly spaced, as in a recording"),
    "v*": ("v*,eps\n1,.9\n2,.8\n", "columns are 'v.', 'eps': expected"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals(case):
    text, message = REFUSED[case]
    with pytest.raises(ValueError, match=message) as caught:
        recorded(text)
    assert str(caught.value).startswith("a.csv: ")


def test_options_lead_out_of_refusals():
    """Each refusal that names an option is right about it."""
    both = REFUSED["times and heights of bounces"][0]
    assert recorded(both, columns={"position": "-"}).points.epsilon == pytest.approx(ratios(1.09, 0.86, 0.7))
    assert recorded(both, columns={"time": "-"}).points.epsilon == pytest.approx(rises(1, 0.8, 0.6, 0.5))
    beside = REFUSED["heights beside other heights"][0]
    found = recorded(beside, columns={"rebound_height": "2"}).points
    assert found.epsilon == pytest.approx([0.6**0.5, 0.625**0.5, (2 / 3) ** 0.5])
    sigma = REFUSED["one sigma beside two quantities"][0].replace("0.9\n", "0.9,.1\n").replace("0.8\n", "0.8,.1\n")
    assert recorded(sigma, columns={"sigma_epsilon": "sigma"}).points.standard_errors == pytest.approx([0.1] * 3)
    for case, units in (("a unit of h only", {"drop_height": "cm"}), ("a unit of h0 only", {"heights": "cm"})):
        assert recorded(REFUSED[case][0], units=units).points.epsilon[0] == pytest.approx(0.9)
    assert recorded(REFUSED["fast"][0], units={"speed": "m/s"}).points.speed.tolist() == [100, 200, 300]
    assert recorded(REFUSED["no unit of a speed"][0], units={"speed": "cm/s"}).points.speed == pytest.approx(
        [0.01, 0.02, 0.03]
    )


THREE = "1,.9,.1,.2\n2,.85,.1,.2\n3,.8,.1,.2\n"

# The text, columns by option, and what is said.
CHOSEN = {
    "an error by option, the other by its name": (
        f"v (m/s),e,sv,sigma_e\n{THREE}",
        {"sigma_speed": "sv"},
        "error of speed: 'sv'; error of epsilon: 'sigma_e'; not used: none",
    ),
    "one of two errors": (f"v,e,sigma_e,u(e)\n{THREE}", {"sigma_epsilon": "4"}, "epsilon: 'u(e)'; not used: 'sigma_e'"),
    "SD and SEM": (f"v,e,SD,SEM\n{THREE}", {"sigma_epsilon": "SEM"}, "error of epsilon: 'SEM'; not used: 'SD'"),
    "no error": (f"v,e,sigma_e,n\n{THREE}", {"sigma_epsilon": "-"}, "epsilon: 'e'; not used: 'sigma_e', 'n'"),
    "± of the other": (
        "v,±,e,±\n1,.1,.9,.2\n2,.1,.8,.2\n",
        {"sigma_epsilon": "4"},
        "of speed: '±'; error of epsilon: '±'",
    ),
    "v is not read": (f"v,e,w,sigma_v\n{THREE}", {"speed": "w"}, "epsilon: 'e'; not used: 'v', 'sigma_v'"),
    "V is not v": (f"v,e,V,sigma_V\n{THREE}", {"speed": "v"}, "epsilon: 'e'; not used: 'V', 'sigma_V'"),
    "± of a column that is not read": (
        "height (m),e,±\n1,.9,.1\n.81,.89,.1\n.64,.88,.1\n",
        {"epsilon": "-"},
        "height: 'height (m)'; not used: 'e', '±'",
    ),
}


@pytest.mark.parametrize(
    "name",
    ["+-", "COR err.", "s_eps", "σ_e", "δe", "∆e", "Fehler von e", "de (1)", "s(e)", "e std. dev.", "u_e", "seps",
     "Ecart-type e", "error of coefficient of restitution", "standard error of e", "Messunsicherheit Stoßzahl"],
)  # fmt: skip
@pytest.mark.parametrize("epsilon", ["e", "COR"])
def test_errors_of_eps_by_their_name(epsilon, name):
    found = recorded(f"v (m/s);{epsilon};{name}\n{PAIRS_AND_ERRORS}")
    assert found.points.standard_errors == pytest.approx([0.01, 0.02, 0.03])
    assert not found.warnings


@pytest.mark.parametrize("name", ["dv (mm/s)", "dv_mm_s", "dv in mm/s", "sv / mm s^-1", "Δv (mm/s)", "s_v (mm/s)"])
def test_errors_of_speeds_by_their_name(name):
    found = recorded(f"v (m/s);{name};COR\n1;20;.9\n2;10;.8\n")
    assert "error of speed: " + repr(name) in read_text(found)[0]
    assert np.linalg.norm(found.points.speed_errors.toarray(), axis=1) == pytest.approx([0.02, 0.01])


@pytest.mark.parametrize(
    "name",
    ["SEM", "SE", "std dev", "std. dev.", "Std.", "s.d.", "uncert.", "Standardabweichung", "Messunsicherheit",
     "écart-type", "Ecart type", "standard error of the mean", "error bars", "incertitude"],
)  # fmt: skip
def test_errors_of_speed_or_eps(name):
    text = f"v (m/s);e;{name}\n{PAIRS_AND_ERRORS}"
    with pytest.raises(ValueError, match=f"--column sigma_speed={name!r} or --column sigma_epsilon={name!r}"):
        recorded(text)
    found = recorded(text, columns={"sigma_epsilon": name}).points
    assert found.standard_errors == pytest.approx([0.01, 0.02, 0.03])


# The headers beside speed and eps, and the option for each column of numbers that is not used.
UNUSED = {
    "v,e,x": ["x' is not used: --column sigma_epsilon='x' if it is an error"],
    "v,e,sigma_e,x": ["x' is not used: --column sigma_speed='x' if it is an error"],
    "v,e,2 sigma,x": ["--column sigma_epsilon='2 sigma' if", "--column sigma_epsilon='x' if"],
    "v,e,x,x": ["--column sigma_epsilon=3 if", "--column sigma_epsilon=4 if"],
    "v,e,,": ["the column 3 is not used: --column sigma_epsilon=3 if", "the column 4 is"],
    "v_in,v_out,x": ["--column sigma_speed_out='x' if"],
    "v,e,t (s)": [],
    "v,e,sv,sigma_e": [],
}


@pytest.mark.parametrize("header", UNUSED)
def test_columns_of_numbers_that_are_not_used(header):
    columns, expected = header.count(",") + 1, UNUSED[header]
    rows = [["1", ".9", ".1", ".2"], ["2", "1.2", ".1", ".2"], ["3", "1.5", ".1", ".2"]]
    found = recorded("\n".join([header, *(",".join(row[:columns]) for row in rows)]))
    assert len(found.warnings) == len(expected)
    assert all(part in warning for part, warning in zip(expected, found.warnings, strict=True))


def test_numbers_of_rows_and_texts_are_no_errors():
    assert not recorded("Nr.,v,e,by\n4,1,.9,A\n5,2,.8,B\n6,3,.7,A\n").warnings


def test_long_headers_take_no_time():
    cells = ["t " * 11, "v_" * 11, "t " * 95, "v_" * 35, "sigma v in m/s a "]
    rows = [",".join(f"{cells[i % len(cells)]}{i}{j}" for j in range(300)) for i in range(100)]
    begin = time.perf_counter()
    with pytest.raises(ValueError, match="the columns are"):
        recorded("\n".join([*rows, ",".join("1" * 300)]), columns={"speed": "1"})
    assert time.perf_counter() - begin < 20


W = "10,.93\n20,.92\n30,.9\n"


@pytest.mark.parametrize(
    ("name", "unit"),
    [(f"w{end}", 0.01) for end in ("_cm_s", " cm/s", " in cm/s", " / cm s^-1", "..cm.s.", "_slow_cm_s", " (cm/s)")]
    + [("w km/h", 1 / 3.6), ("w_m_s", 1), ("w_measured", 1), ("w", 1), ("my_speed", 1)],
)
def test_units_of_columns_by_option(name, unit):
    found = recorded(f'"{name}";q\n{W}'.replace(",", ";"), columns={"speed": "1", "epsilon": "q"}).points
    assert found.speed == pytest.approx([10 * unit, 20 * unit, 30 * unit])


@pytest.mark.parametrize("unit", ["kmh", "km_h", "ft_s", "px", "cm", "s", "GPa"])
def test_a_unit_of_something_else_needs_an_option(unit):
    text, columns = f"w_{unit},q\n{W}", {"speed": f"w_{unit}", "epsilon": "q"}
    with pytest.raises(ValueError, match=f"the unit of speed is '{unit}': expected .*--unit speed=UNIT"):
        recorded(text, columns=columns)
    assert recorded(text, columns=columns, units={"speed": "cm/s"}).points.speed == pytest.approx([0.1, 0.2, 0.3])


@pytest.mark.parametrize("case", CHOSEN)
def test_options_and_headers_together(case):
    text, columns, shown = CHOSEN[case]
    assert shown in " ".join(read_text(recorded(text, columns=columns)))


def test_two_columns_of_the_same_name_by_option():
    with pytest.raises(ValueError, match="are both sigma_speed: expected one; choose with --column sigma_speed=NUMBER"):
        recorded("v,±,e,±\n1,.1,.9,.2\n2,.1,.8,.2\n", columns={"sigma_speed": "±"})


def test_no_epsilon_by_option():
    with pytest.raises(ValueError, match="the columns are 'v', 'e'"):
        recorded(f"v,e\n{PAIRS}", columns={"epsilon": "-"})


@pytest.mark.parametrize(
    ("name", "epsilon"),
    [("H_h_pairs.csv", [0.853, 0.847, 0.860, 0.860, 0.872]), ("v_cm_s.csv", [0.93, 0.92, 0.91, 0.895, 0.88, 0.866])],
)
def test_files_of_owners(name, epsilon):
    found = read.recording([((DATA / name).read_bytes(), name)]).points
    assert np.round(found.epsilon, 3).tolist() == epsilon


def test_drops_with_several_times_of_flight():
    file = DATA / "drops_H_T0_T1_T2.csv"
    found = read.recording([(file.read_bytes(), "a.csv")]).points
    flights = np.loadtxt(file, delimiter=",", skiprows=1)[:, 1:]
    assert found.epsilon.reshape(30, 2) == pytest.approx(flights[:, 1:] / flights[:, :-1])
    assert found.epsilon.reshape(30, 2).mean(axis=0) == pytest.approx([0.942, 0.864], abs=5e-4)


def test_errors_of_times_decide_the_verdict():
    found = json_of("fit", DATA / "times_sigma_t.csv")
    assert found["beta"] == pytest.approx(0.1528, abs=5e-5)
    assert found["verdict"] == "holds"
    assert found["read"]["time"] == {"column": "t (s)", "unit": "s", "unit_from": "its header", "error": "sigma_t (s)"}
    assert (found["read"]["rows"], found["read"]["unused"]) == (10, [])


def test_a_header_of_two_lines_in_a_spreadsheet():
    assert forms.header("Impact speed\n(cm/s)")[:3] == ("Impact speed", "cm/s", ("speed",))


def test_the_page_begins_with_the_forms():
    page = Path(__file__).parents[2] / "docs" / "usage" / "fitting.md"
    rows = [f"| `{form.header}` | {form.row} |" for form in forms.FORMS if form.epsilon == "epsilon"]
    shown = [line for line in page.read_text("utf-8")[:2000].splitlines() if line.startswith("| `")]
    assert len(shown) == 10
    assert shown == [row for row in rows if row in shown]
