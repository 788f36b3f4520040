"""What is refused: a table of wrong words and files, each with the one line that it gets, and hostile values."""

import os
import shlex
from contextlib import suppress
from pathlib import Path

import click
import pytest

from tests.cli import called, refused
from tests.cli.test_scenes import EXAMPLES, SMALL
from viscopade.cli.main import command
from viscopade.kernels import requests

BALL = "--radius 0.01 --density 2500 --young-modulus 1e7 --poisson-ratio 0.3"
LINEAR = "--law linear --stiffness 1 --mass 1"

BAD = [
    ("coefficients --order -1", "viscopade: --order is -1: expected an integer from 0 to 1000"),
    ("coefficients --digits '٣'", "expected an integer"),
    ("coefficients --order 1000 --digits 5000", "GB of memory: expected what needs at most 4 GB, to"),
    ("coefficients --format xml", "'xml' is not one of 'text', 'json', 'csv'"),
    ("coefficients extra", "extra"),
    ("pade -1 3", "M is -1: expected an integer from 0 to 200"),
    ("pade 3 6 --v-star-max 200", "--v-star-max is '200': expected a number from 0.001 to 100"),
    ("pade", "Missing argument 'M'"),
    ("pade 3 --law hertz", "--law is 'hertz': expected viscoelastic, linear, tsuji, hunt-crossley[:n]"),
    ("coefficients --law 1.37,0.1", "the exponents 137/100,1/10 have too large denominators: expected a and b"),
    ("coefficients --end top", "'top' is not one of 'force', 'return'"),
    ("epsilon --law linear --end return --kappa 2", "expected a smaller kappa, or end 'force'"),
    ("invert --law tsuji --end return --epsilon 1e-30", "expected a larger epsilon, or end"),
    ("epsilon --law hunt-crossley:1 --beta '1 s/m' --speed 1", "beta is '1 s/m': expected a plain"),
    (
        "epsilon --beta 1.307 --speed '1 cm/s'",
        "--beta is '1.307' and --speed is '1 cm/s': expected a unit for both or for neither, such as "
        '"1.307 (s/cm)^(1/5)" or "1.307 (s/m)^(1/5)"',
    ),
    ("epsilon --beta '1.3 (s/cm)^(1/5)' --speed 1", 'for both or for neither, such as "1 cm/s" or "1 m/s"'),
    ("table --beta 1.3 --from '1 mm/s'", "--beta is '1.3' and --from is '1 mm/s': expected a unit for both"),
    ("plot --beta 1.3 --to '5 m/s' -o x.svg", "--beta is '1.3' and --to is '5 m/s': expected a unit for both"),
    ("table --beta '1 (s/m)^(1/5)' --speed 2 --law linear", "and --speed is '2': expected a unit for both"),
    ("table --from '1 cm/s'", "--from and --to are v*, which has no unit"),
    ("epsilon --epsilon 83.67% --speed 4.43", "--epsilon is '83.67%': expected 0 < epsilon <= 1; 83.67% is 0.8367"),
    ("table --epsilon '70 %' --speed 1", "expected a finite decimal number; 70 % is 0.70"),
    ("export c --accuracy 1e-12", "to 0.99, or tables (--from-speed, --full)"),
    ("epsilon --v-star 0,5", "from 1e-1000 to 1e100; the decimal sign is a point"),
    ("table --from '-2,5 cm/s'", "or a number in m/s; the decimal sign is a point"),
    ("plot --font-size 8,5 -o x.svg", "--font-size is '8,5': expected a finite decimal number; the decimal sign is a"),
    ("epsilon --beta 1,3 --speed 1", '"1.3 (s/cm)^(1/5)"; the decimal sign is a point'),
    ("epsilon --v-star inf --pade 3/6", "v-star is inf: expected a finite one with --pade"),
    ("epsilon --v-star 1e-500 --pade 3/6", "the error of [3/6] is below 1e-300: expected a larger v*"),
    ("epsilon --kappa 1 --law linear --pade 3/6", "--pade needs the viscoelastic law without load"),
    ("epsilon --epsilon 0.5 --speed 1 --pade 3/6", "`viscopade table` has the error for a material"),
    ("epsilon --beta 1 --speed 1 --load 1", "expected --kappa, --v-star or --epsilon alone with it"),
    ("epsilon --kappa 1 --gravity 9.81", "--gravity needs a body that falls on a plane: expected a material, --wall"),
    ("epsilon --kappa 1 --load nan", "load is 'nan': expected a finite decimal number"),
    ("epsilon --kappa 1 --v-star 1", "the options do not give one v*: expected --v-star, --kappa"),
    ("epsilon --law 1,-1 --kappa 1", "b is '-1': expected a rational number such as 3/2 or 0.25"),
    (f"epsilon {BALL} --dissipative-constant 1 --speed 1 --law tsuji", "and none of --law, --end"),
    (
        f"invert --epsilon 0.5 {BALL} --speed 1 --law tsuji",
        "a material is given: expected --speed with it, and none of --law, --end",
    ),
    ("pade 1 3", "[1/3] does not exist"),
    ("epsilon --v-star 1 --v-star 3", "--v-star is typed 2 times: expected it once"),
    ("table --digits 18", "--digits is 18: expected an integer from 1 to 17"),
    ("epsilon", "expected --v-star, --kappa, --beta or --epsilon with --speed, --stiffness with --damping and --mass,"),
    ("epsilon --epsilon 0.5", "--epsilon is given: expected --speed with it, the impact speed at which eps is known"),
    ("epsilon --epsilon 0.5 --speed 1 --beta 1", "--epsilon and --beta are given: expected one of them"),
    (
        f"epsilon --epsilon 0.5 {BALL} --speed 1 --dissipative-constant 1",
        "--epsilon and --dissipative-constant are given: expected one of them",
    ),
    (
        f"epsilon --epsilon 0.5 {BALL} --speed 1 --adhesion 1",
        "--epsilon and --adhesion are given: expected one of them",
    ),
    ("epsilon --epsilon 1.5 --speed 1", "--epsilon is '1.5'"),
    ("epsilon --stiffness 1 --damping 1 --mass 1", "need --speed; for the law 3/2,1/2 kappa"),
    ("epsilon --law linear --damping 1 --mass 1", "--damping and --mass need --stiffness"),
    (f"epsilon {LINEAR} --damping -1", "damping is '-1': expected a number >= 0 in N s/m, or one with such"),
    (f"epsilon {LINEAR} --damping '1 N/m'", "damping is '1 N/m': expected a number >= 0 in N s/m"),
    (f"epsilon {LINEAR} --damping 1 --speed -1", "speed is -1.0: expected a positive number"),
    (f"epsilon {LINEAR} --damping 1 --speed 0", "speed is 0: expected a number > 0"),
    (f"epsilon {LINEAR} --damping 1 --kappa 1", "are given: expected none of --v-star, --kappa, --beta"),
    (f"epsilon {LINEAR} --damping 1 --digits 18", "computed in double precision; expected at most 17 digits in text"),
    (
        f"epsilon {LINEAR} --damping 1 --digits 8 --format json",
        "and no --digits in JSON and CSV, which have all of them",
    ),
    (f"epsilon {LINEAR} --damping 3 --end return", "expected a smaller kappa, or end 'force'"),
    (f"epsilon {BALL} --speed 1 --mass 1 --dissipative-constant 1", "a material is given"),
    ("invert --epsilon 0.5 --law linear --stiffness 1", "--stiffness needs --mass"),
    ("invert --epsilon 0.5 --law linear --stiffness 1 --mass -1", "mass is '-1': expected a number > 0 in kg"),
    ("invert --epsilon 0.5 --law linear --stiffness 1 --mass nan", "mass is 'nan': expected a number > 0 in kg"),
    ("invert --epsilon 0.5 --law linear --stiffness 1 --mass inf", "mass is 'inf': expected a number > 0 in kg"),
    (
        f"invert --epsilon 0.5 --speed 1 --stiffness 1 --mass 1 {BALL}",
        "a material is given: expected --speed with it, and none of --law, --end, --stiffness, --damping and --mass",
    ),
    ("epsilon --v-star -1", "--v-star is '-1': expected 0, infinity, or a number from 1e-1000 to 1e100"),
    ("epsilon --v-star nan", "--v-star is 'nan'"),
    ("epsilon --v-star 1 --speed 1", "the options do not give one v*: expected --v-star"),
    ("epsilon --beta 1 --speed -1", "speed is '-1'"),
    ("epsilon --radius 1 --speed 1", "a material also needs --young-modulus, --poisson-ratio, --density"),
    (f"epsilon {BALL} --dissipative-constant 1e-5", "a material is given: expected --speed with it"),
    (f"epsilon {BALL} --dissipative-constant -1 --speed 1", "--dissipative-constant is -1.0"),
    ("invert", "--epsilon and --one-minus-epsilon: neither given, expected exactly one"),
    ("invert --epsilon 0", "--epsilon is '0': expected 0 < epsilon <= 1"),
    ("invert --epsilon 1.3", "--epsilon is '1.3': expected 0 < epsilon <= 1"),
    ("invert --epsilon 1e-400", "--epsilon is '1e-400': expected 1, or a number from 1e-330 to 1 - 1e-1990"),
    ("invert --one-minus-epsilon 1", "--one-minus-epsilon is '1': expected 0 <= one_minus_epsilon < 1"),
    ("invert --epsilon 0.5 --speed 0", "speed is '0'"),
    (f"invert --epsilon 0.5 {BALL}", "a material is given: expected --speed with it"),
    ("bench --quick --rounds 0", "rounds"),
    ("bench --quick --only nothing", "there is no kernel 'nothing': expected one of"),
    ("bench --quick --picture a.jpg", "--picture is a.jpg: expected a name that ends in .svg, .png or .pdf"),
    ("bench --from data.csv -o a.csv", "--from shows a file: expected neither --output nor --only with it"),
    ("bench --from data.csv", "data.csv: expected the columns id,label"),
    ("bench --quick --cc no-such-compiler", "there is no compiler 'no-such-compiler'"),
    ("hardcases --only nothing", "there is no hard case 'nothing': expected one of truncated-series, "),
    ("claims --only everything", "there is no claim 'everything': expected a name such as"),
    ("claims --only pole", "there is no claim 'pole': did you mean pole-of-2-5 or digits-of-the-pole?"),
    ("claims --only no-improvment", "there is no claim 'no-improvment': did you mean no-improvement?"),
    ("figures", "Missing option '--out'"),
    ("figures --out x --only nothing", "'nothing' is not one of 'materials'"),
    ("figures --out x --format gif", "'gif' is not one of 'svg', 'pdf', 'png'"),
    ("export cobol", "TARGET is 'cobol': expected c, cuda, python, arrays"),
    ("export c --pade 3-6", "--pade is '3-6': expected M/N"),
    ("export c --pade 1/1", "[1/1] does not exist"),
    ("export c --pade 0/1", "pade is 0/1: expected m + n >= 2"),
    ("export c --pade 3/6 --pade 3/6", "asked for twice"),
    ("export c --minimax 1/4", "minimax is given without an interval: expected minimax with v_star_max"),
    ("export c --minimax 1/4 --v-star-max -3", "expected a number greater than v_star_min = 0"),
    ("export c --minimax 1/4 --v-star-max 1e9", "expected a number greater than v_star_min = 0, at"),
    ("export c --minimax 1/4 --v-star-min 3 --v-star-max 2", "greater than v_star_min = 3"),
    ("export c --minimax 1/1 --v-star-max 1", "expected at least"),
    ("export c --minimax 1/40 --v-star-max 1", "n is 40: expected an integer from 0 to 15"),
    ("export c --minimax 2/0 --v-star-max 1000", "has a relative error of 1.05e+09: expected an error below 1"),
    ("export c --accuracy 1e-13 --v-star-max 5", "is '1e-13': expected a number from 1e-12 to 0.99"),
    ("export c --accuracy 1e-16", "expected a number from 2.9e-08 to 0.99"),
    ("export c --minimax 6/9 --v-star-max 0.1", "has an error below 1e-12: expected lower degrees"),
    ("export c --accuracy 1e-12 --v-star-max 1000", "or a shorter interval, or tables (--from-speed, --full)"),
    ("export c --minimax 0/9 --v-star-max 1000", "expected other degrees"),
    ("export python --full", "as the kernel has a table"),
    (
        "export rust --from-speed 1e-5",
        "expected c, as the kernel has a table, or a kernel without one (--accuracy 1e-5)",
    ),
    ("export js", "TARGET is 'js': expected javascript (an ES module), or script"),
    *((f"export {name}", "expected c, whose headers are C++ headers, too") for name in ("cpp", "C++", "cxx")),
    ("export c#", "expected csharp"),
    ("export c --from-speed 1e-6", "'1e-6' is not one of '1e-5', '5e-6', '1e-10', 'full'"),
    ("export c --from-speed 1e-10 --from-speed 1e-5", "expected one accuracy, as a file holds one kernel"),
    ("export latex --accuracy 1e-3", "compact_1em3 is no quotient of polynomials in v*, which latex expects"),
    ("export latex --digits 31", "digits is 31: expected an integer from 1 to 30"),
    ("export latex --minimax 1/4 --v-star-max 5 --digits 18", "digits is 18: expected an integer from 1 to 17"),
    ("export cuda --accuracy 1e-9", "expected a number from 2.9e-08"),
    ("export c --accuracy 1e-3 --v-star-min 1", "expected an interval with both ends (--v-star-max)"),
    *(
        (f"export c {kind} --v-star-max 5", "v-star-max is given without minimax or accuracy: expected")
        for kind in ("", "--pade 3/6", "--inverse 1e-3", "--full", "--from-speed 1e-5")
    ),
    ("export version-header --accuracy 1e-3", "--accuracy changes nothing in version-header: expected --output"),
    ("export version-header --digits 50", "--digits changes nothing in version-header: expected --output"),
    ("export series-csv --full", "--full changes nothing in series-csv: expected --order, --digits, --output"),
    ("export json --digits 40", "--digits changes nothing in json: expected --pade, --minimax, --accuracy"),
    ("export vectors --order 40", "--order changes nothing in vectors: expected --pade, --minimax, --accuracy"),
    ("scene", "expected a scene: either FILE, or --example NAME"),
    ("scene x.toml --example ice_rings", "expected a scene: either FILE, or --example NAME"),
    ("scene --example ../x", "there is no example scene '../x': expected acetate, boulders, glass_beads, ice_"),
    ("plot --size '8 cm' -o x.svg", "--size needs two lengths, such as '8.6 cm' '6 cm'"),
    ("plot --epsilon 0.8 --speed 1 -o x.svg --size 1 9", "size is 1 m, 9 m: expected width and height"),
    ("plot --epsilon 0.8 --speed 1 -o x.svg --font-size 1", "font-size is 1: expected 3 to 72 points"),
    ("fit data.csv --empirical x.txt", "--empirical is x.txt: expected a name that ends in .cs, .cuh"),
    ("nonsense", "there is no command 'nonsense'"),
    ("epsilo", "there is no command 'epsilo': did you mean epsilon"),
    ("lammps --help", "there is no command 'lammps': did you mean audit lammps or simulators lammps?"),
    ("physx", "there is no command 'physx': did you mean audit physx?"),
    ("export cc", "TARGET is 'cc': did you mean c?"),
    ("epsilon --v-star 1 --law linaer", "law is 'linaer': did you mean linear?"),
    ("fit examples/none.csv", "the folder that `viscopade --examples-dir` prints has the examples"),
    ("simulators lamps", "PROGRAM is 'lamps': did you mean lammps?"),
    ("pade 1/4 5", "the degrees are 1/4 and 5: expected M/N or M N"),
    ("--nonsense", "No such option"),
    (f"fit data.csv --plot x.svg --scene x.svg {BALL}", "--scene, --plot and --empirical name one file twice"),
    ("fit data.csv --gravity 3", "columns speed and epsilon need no flight: expected no gravity"),
    ("fit data.csv --plot x.bmp", "expected a name that ends in .svg, .png or .pdf"),
    ("fit data.csv --font-size 9", "--font-size is given: expected --plot with it"),
    ("fit data.csv --plot x.svg --size 1 9", "size is 1 m, 9 m: expected width and height"),
    ("fit data.csv --scene x.toml", "the sphere also needs --radius, --density (or --mass), --poisson-ratio"),
    ("fit data.csv --radius '1 cm'", "the sphere also needs --density"),
    ("fit data.csv --mass '1 g'", "--mass is given: expected one --radius with it, and no --density"),
    (f"fit data.csv --mass '1 g' {BALL}", "--mass is given: expected one --radius with it, and no --density"),
    ("fit data.csv --radius '1 cm' --mass '-1 g'", "--mass is '-1 g': expected a mass > 0"),
    ("fit data.csv --drag-coefficient 0.5", "expected --air-density with it"),
    ("fit data.csv --wall", "expected the sphere's --radius"),
    (f"fit data.csv {BALL} --wall-young-modulus 60GPa", "a plane of another material needs --wall-young-modulus and"),
    ("fit data.csv --wall-young-modulus 1 --wall-poisson-ratio 0", "and the material of the sphere"),
    (f"fit data.csv {BALL} --gravity 9,81", "or a number in m/s^2; the decimal sign is a point"),
    (f"fit data.csv {BALL} --drag-coefficient 0,45", "a finite decimal number; the decimal sign is a point"),
    ("fit data.csv --without 99", "there is no line 99 with data: expected 2 to 13"),
    ("fit data.csv --law nothing", "law is 'nothing'"),
    ("fit data.csv --column speed", "is no NAME=HEADER"),
    ("fit data.csv --unit speed=m/s", "the units 'cm/s' in its header and 'm/s' in --unit"),
    (
        "fit data.csv --resolution '1 ms'",
        "--resolution is for instants, heights or speeds: expected a column sigma_epsilon",
    ),
    ("fit data.csv --radius 1cm --density 2500 --poisson-ratio 0.2", "expected --young-modulus, or a column"),
    ("table --law 1,1", "--law and --program need spheres"),
    ("table --epsilon 0.9", "expected a scene, or --beta, or --epsilon with --speed"),
    ("table --speed 1", "the options do not describe spheres"),
    ("table --beta 1 --law 1,1", "--law and --program need --speed"),
    ("table --from 2 --to 1", "expected 0 < --from < --to"),
    ("table --epsilon 0.9 --speed 0", "--speed is '0': expected a speed > 0"),
    ("table --beta x", "beta is 'x'"),
    (f"table --beta 1 {BALL}", "--beta and a material are given"),
    ("table --dissipative-constant 1", "needs a material"),
    ("table --epsilon 0.5 --speed 1 --program nothing", "nothing"),
    ("table --pade 1/1", "does not exist"),
    ("table --gravity 9.81", "--gravity needs a sphere and a plane"),
    ("table --beta 1 --gravity 9.81", "--gravity needs a sphere and a plane"),
    (f"table {BALL} --epsilon 0.5 --speed 1 --gravity 9.81", "a material with --wall, or a"),
    (f"table {BALL} --dissipative-constant 1e-5 --wall --gravity -1", "--gravity is '-1': expected"),
    (
        f"table {BALL} --dissipative-constant 1e-5 --wall --gravity 9 --pade 3/6",
        "--pade and --gravity are given: expected one of them",
    ),
    (
        f"table {BALL} --dissipative-constant 1e-5 --wall --gravity 9 --points 101",
        "points is 101: expected at most 100 with --gravity",
    ),
    ("simulators mujoco --epsilon 0.5 --speed 1 --gravity 9", "gravity needs the contact's dur"),
    (
        f"simulators lammps {BALL} --epsilon 0.5 --speed 1 --gravity 9.81",
        "--gravity needs a sphere and a plane: expected a mat",
    ),
    ("simulators lammps", "expected a scene, or a material with --speed"),
    (f"simulators lammps {BALL} --speed 1", "--epsilon and --dissipative-constant: neither given, expected"),
    (f"simulators lammps {BALL} --epsilon 0.9", "a material also needs --speed"),
    (f"simulators lammps {BALL} --epsilon 0.9 --speed -1", "speed is -1"),
    ("simulators lammps none.toml", "cannot read none.toml"),
    (f"simulators lammps {EXAMPLES / 'rubber.toml'} --tier 1e-5", "--tier is given for"),
    (f"simulators lammps {EXAMPLES / 'rubber.toml'} --speed 1", "either a scene or a material"),
    ("audit x", "there is no file and no program 'x': expected an input of LAMMPS or LIGGGHTS, or a model of MuJoCo"),
    ("audit in.hopper", "or a program, such as lammps, liggghts, yade (viscopade audit has all)"),
    ("audit in.deck -var E1 5e7", "-var is an option of LAMMPS: expected --variable NAME=VALUE"),
    ("audit LAMPS", "did you mean lammps?"),
    ("simulators openfoam", "there is no file for openfoam; viscopade audit openfoam prints the number"),
    ("simulators MuJoCo", "neither given"),
    (
        "simulators mujoco --epsilon 0.5 --speed 1 --contact-time 31ms --gravity 9.81 --time-step 20ms",
        "time-step is 0.5576 of the contact time: no damping gives eps = 0.5 with so few steps",
    ),
    ("audit LAMMPS --set normal=hertz --mass '10 mg' --speed 1", "or --set units=si"),
    ("audit liggghts --speed 1", 'expected --set "model=hertz" or "model=hooke" or "model=hertz/stiffness"'),
    ("audit drake --set point_contact_stiffness=4e4 --speed 1", "expected point_stiffness, its name in AddContactMa"),
    ("audit drake --set hydroelastic_modulus=1e6 --speed 1", "as hydroelastic contact is not computed here"),
    ("audit mujoco --set 'x=1 1' --speed 1", "there is no parameter 'x': expected solref (timeconst"),
    ("audit mujoco --set solref --speed 1", "--set is 'solref': expected NAME=VALUE"),
    ("audit mujoco --set 'solref=nan 1' --speed 1", "solref is 'nan 1': expected timeconst"),
    ("audit mujoco --set 'solref=1 1'", "--speed is missing: expected the impact speed"),
    ("audit mujoco --speed inf", "speed is 'inf': expected a speed"),
    ("audit mujoco --speed 0", "--speed is '0': expected a speed > 0"),
    ("audit mujoco --speed 1 --mass -1", "mass is '-1': expected a mass > 0"),
    ("audit mujoco --speed 1 --time-step 0", "--time-step is '0': expected a time > 0"),
    ("audit --force 1e5*x --mass 1 --speed 1 --radius 1", "--radius has no effect on this contact"),
    ("audit mujoco --speed 1 --gravity=-9.81", "--gravity is '-9.81': expected an acceleration >= 0"),
    ("audit mujoco --speed 1 --set condim=1 --set condim=3", "condim is set twice"),
    ("audit mujoco --speed 1 --gravity '1 kg'", "gravity is '1 kg': expected an acceleration"),
    ("audit mujoco --speed 1 --scheme x", "integrator is 'x': expected Euler, RK4"),
    ("audit mujoco --speed 1 --epsilon 1", "epsilon is '1': expected a number > 0 and < 1"),
    (
        "audit mujoco --speed 1 --step-error 0.1",
        "--step-error is given with --speed: expected --time-step with a tenth",
    ),
    ("audit mujoco --speed 1 --end force", "--end is given for a simulator"),
    ("audit mujoco --mass 1", "--mass is given without --speed"),
    ("audit --speed 1", "expected either a simulator, such as mujoco, or --force"),
    ("audit textbook --speed 1", "Textbook has no contact of native parameters here: expected lammps"),
    ("audit mujoco --speed ''", "--speed is '': expected a speed > 0"),
    ("audit mujoco --speed 1 --epsilon ''", "--epsilon is '': expected a number > 0 and < 1"),
    ("audit mujoco --epsilon ''", "--epsilon is '': expected a number >= 0.001 and < 1"),
    ("audit mujoco --epsilon 0.5 --time-step ''", "--time-step is '': expected a number of contact times"),
    ("audit mujoco --speed 1 --time-step ''", "--time-step is '': expected a time > 0"),
    ("audit --force '1e5*x' --speed 1 --mass ''", "--mass is '': expected a mass > 0"),
    ("audit --force '1e5*x' --speed 1 --mass 1 --gravity ''", "--gravity is '': expected an accel"),
    ("audit --force '1e5*x' --speed 1 --mass 1 --radius ''", "--radius is '': expected a length > 0"),
    ("audit mujoco --speed 1 --mass 2", "--mass has no effect on this contact: expected a command"),
    ("audit newton --scheme SolverMuJoCo --speed 1 --mass 2", "--mass has no effect on this contact"),
    ("audit newton --set ke=1e5 --set kd=100 --mass 2 --radius 1 --speed 1", "--radius has no effect on this contact"),
    ("audit rebound --set coefficient_of_restitution=0.5 --radius 1 --speed 1", "--radius has no effect on this"),
    (
        "audit liggghts --set model=hertz/stiffness --set kn=1 --set gamman=1 --set youngsModulus=1 --mass 1 "
        "--radius 1 --speed 1",
        "--set youngsModulus has no effect on this contact",
    ),
    ("audit mujoco --speed 1 --all", "--all is given with --speed: expected a command without it"),
    ("audit --force '1e5*x' --speed 1", "mass is missing: expected --mass"),
    ("audit --force '1e5*y' --speed 1 --mass 1", "force has 'y': expected numbers, x, v"),
    ("audit isaac --epsilon 0.5", "simulator is 'isaac': did you mean physx?"),
    ("audit Unity --speed 1", "simulator is 'unity': did you mean physx?"),
    ("audit bullet --set restitution=0.5 --speed 1 --time-step '1/60 s'", "radius is missing: expected --radius"),
    (
        "audit physx --set bounceThresholdVelocity=0.2 --speed 1",
        "there is no parameter 'bounceThresholdVelocity': did you mean bounce_threshold_velocity?",
    ),
    ("audit physx --set restitution=-0.5 --speed 1", "restitution is '-0.5': expected a number from 0 to 1"),
    ("audit physx --set contact_offset=0 --set restitution=1 --speed 1", "--set contact_offset has no effect on this"),
    ("audit bullet --set restitution=1 --set contactDamping=1 --speed 1", "--set contactDamping has no effect on this"),
    (
        "audit physx --set solver_type=TGS --set restitution=1 --mass 1 --speed 1 --time-step '1/60 s'",
        "--mass has no effect on this contact",
    ),
    (
        "audit gazebo --set kp=1e4 --set max_vel=9 --mass 1 --radius 1 --speed 1 --time-step '1 ms'",
        "--radius has no effect on this contact",
    ),
    (
        "audit ode --set soft_erp=0.5 --set soft_cfm=1e6 --mass 1 --speed 1 --time-step '10 us'",
        "time-step is 1e-05 s: expected a longer one, or a stiffer contact: an undamped contact lasts 14 s, and",
    ),
    (
        "audit lethe --set 'particle particle contact force method=hertz' --set 'surface energy particles=0.03' "
        "--mass 1 --radius 1 --speed 1",
        "--set surface energy particles has no effect on this",
    ),
    ("audit jolt --speed 1 --time-step '1/0 s'", "time-step is '1/0 s': expected a time > 0"),
    ("audit --force 'c*x' --constant c=1 --constant d=1 --speed 1 --mass 1", "constant d is not in the force 'c*x'"),
    ("audit --force 'c*x' --constant c=1 --constant c=2 --speed 1 --mass 1", "constant c is given twice"),
    ("audit --force 'x*v' --constant v=1 --speed 1 --mass 1", "constant is 'v=1': expected NAME=VALUE, such as c=1e4"),
    ("audit --force 'x' --constant max=1 --speed 1 --mass 1", "constant is 'max=1': expected NAME=VALUE"),
    ("audit --force 'x' --constant in=1 --speed 1 --mass 1", "constant is 'in=1': expected NAME=VALUE"),
    ("audit --force 'c*x' --constant c --speed 1 --mass 1", "constant c is '': expected a number, or a quantity"),
    ("audit --force 'c*x' --constant 'c=1 oz/furlong/foo' --speed 1 --mass 1", "constant c is '1 oz/furlong/foo'"),
    (
        "audit --force 'c*x' --constant c=1 --vary d --speed 1 --mass 1",
        "vary is 'd': expected the name of a --constant: c",
    ),
    ("audit --force 'c*x' --constant c=1 --epsilon 0.5 --speed 1 --mass 1", "expected --vary NAME"),
    ("audit --force 'c*x' --constant c=1 --set c=2 --speed 1 --mass 1", "--set is given with --force"),
    ("audit mujoco --constant c=1 --speed 1", "--constant is given for a simulator, which has its own"),
    ("audit --constant c=1", "--constant is given without --speed"),
    ("audit --force -x --speed 1 --mass 1", "force does not stop a body of mass 1 at speed 1"),
    ("audit --epsilon 1", "epsilon is '1': expected a number >= 0.001 and < 1"),
    ("audit --epsilon 2", "epsilon is '2': expected a number >= 0.001 and < 1"),
    ("audit --time-step 3", "time-step is 3 contact times"),
    ("audit --time-step 1 --contact-time 0", "--contact-time is '0': expected a time > 0"),
    ("audit --step-error 0", "step-error is 0: expected 1e-08 to 1"),
    ("audit --contact-time 1", "expected --time-step with it"),
    ("scene none.toml", "No such file"),
    ("scene folder", "Is a directory"),
    ("scene large.toml", "large.toml: material.glass.young_modulus is or contains"),
    ("scene title.toml", "title.toml: "),
    ("scene bytes.toml", "not text in UTF-8"),
    ("scene /dev/zero", "the content is too long: expected at most 134217728 bytes"),
    ("scene a\x1b[31m\u202e.toml", r"a\x1b[31m\u202e.toml: the text is not TOML"),
    ("scene small.toml --no-check --cc cc", "expected --cc with the check of code in C"),
    ("scene small.toml --cc no-such-compiler", "there is no compiler 'no-such-compiler'"),
    ("scene rust.toml --cc cc", "expected --cc with the check of code in C"),
    ("plot -o x.gif", "expected a name that ends in .svg, .png or .pdf"),
    ("plot -o x.svg --data data.csv", "--data needs spheres"),
    (f"fit data.csv {BALL} --scene mine.toml", "mine.toml: it was not generated by viscopade"),
    ("scene small.toml --out folder", "small_scene.h: it was not generated by viscopade"),
    ("calculator -o mine.toml", "mine.toml: it was not generated by viscopade"),
    ("export c -o mine.toml", "mine.toml: it was not generated by viscopade"),
    ("reproduce --out ''", "--out is '': expected a path"),
    ("scene --example rubber --out ''", "--out is '': expected a path"),
    ("scene ''", "FILE is '': expected a path"),
    ("fit ''", "DATA is '': expected a path"),
    ("fit data.csv --sheet ''", "--sheet is '': expected the name of a sheet"),
    ("export c -o ''", "--output is '': expected a path"),
    (
        "audit mujoco --epsilon 0.5 --time-step '2 ms' --contact-time '50 us'",
        '--time-step is 40 contact times: expected at most 1, or for 20 steps --contact-time "40 ms"',
    ),
    ("audit mujoco --epsilon 0.5 --time-step 1e-6", "finer steps give the eps that is printed without --time-step"),
    ("reproduce --out folder", "viscopade_pade.h: it was not generated by viscopade"),
    ("figures --out folder --only local-exponent", "local-exponent.svg: it was not generated by viscopade"),
    ("export c -o folder", "folder: it is a directory"),
    ("export c -o missing/x.h", "there is no directory missing"),
    ("export c -o mine.toml/x.h", "Not a directory"),
    ("export c -o locked/x.h", "cannot write locked/x.h: Permission denied"),
]


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A directory with the files of the table, some of which are not ours."""
    files = {
        "data.csv": "speed (cm/s),epsilon,sigma_epsilon\n" + "".join(f"{v},0.9,0.01\n" for v in range(1, 13)),
        "small.toml": SMALL,
        "rust.toml": SMALL + '[code]\nlanguage = "rust"\n',
        # TOML has no limit for such integers, Python has one.
        "large.toml": SMALL.replace('"70 GPa"', f"0x{'f' * 5000}"),
        "title.toml": f"title = 0x{'f' * 5000}\n[material.glass]",
        "a\x1b[31m\u202e.toml": "x = [",
        **dict.fromkeys(
            ("mine.toml", *(f"folder/{n}" for n in ("small_scene.h", "viscopade_pade.h", "local-exponent.svg"))), "mine"
        ),
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    (tmp_path / "locked").mkdir()
    may = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).name != "locked" and may(path, mode))
    monkeypatch.chdir(tmp_path)
    return lambda: {path: path.read_bytes() if path.is_file() else None for path in tmp_path.rglob("*")}


@pytest.mark.parametrize(("line", "message"), BAD)
def test_bad_input_is_one_line_and_status_two(line, message, here):
    before = here()
    assert message in refused(*shlex.split(line))
    assert here() == before


def test_targets_are_refused_before_the_work(here, monkeypatch):
    monkeypatch.setattr(requests, "render", lambda *_: pytest.fail("it was made"))
    assert "mine.toml" in refused("export", "c", "--pade", "100/100", "-o", "mine.toml")


def test_no_command_shows_the_help():
    result = called()
    assert result.returncode == 2
    assert "Compute:" in result.stdout + result.stderr


HOSTILE = (
    *("", " ", "\n", "-1", "1e400", "nan", "inf", "0x10", "1_000", "9" * 5000, "1" * 30_000, "\u0661", "1/0", "1j"),
    *(
        "x" * 5000,
        "a\nb",
        "\x1b[31mred",
        "\u202egpj.exe",
        "\udcff",
        "--",
        "$(id)",
        "../..",
        "{0}",
        "%s%n",
        "1 parsec^-9 m",
    ),
    *("1 " + "(" * 50 + "m", "2**2**2**2**9999 m", "1 m; import os", "1:2", ":", "a=b", "=", "3/6/1", "-3/6"),
)


def test_every_option_takes_or_refuses_hostile_values():
    """By the types of all options: what they do not refuse here, the table above has."""
    tried = 0
    for name in command.list_commands(click.Context(command)):
        one = command.get_command(click.Context(command), name)
        context = click.Context(one, info_name=name)
        for option in one.params:
            for value in HOSTILE:
                with suppress(click.UsageError, ValueError):
                    option.type(value, option, context)
                tried += 1
    assert tried > 2000
