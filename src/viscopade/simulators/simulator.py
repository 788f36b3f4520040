"""What one module says of its simulator: the formulas that the audit knows, and the text with our parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from viscopade.simulators.formula import DampingFormula
from viscopade.simulators.native import Native

Comment = Literal["#", "//", "/*", "<!--"]


@dataclass(frozen=True)
class InputFile:
    """The text that `viscopade simulators` writes for a program with the viscoelastic law.

    Attributes
    ----------
    comment : str
        How comments begin.
    use : str
        Sentences at the beginning, without comment marks: what to do with the file. A template of Jinja, as `code`.
    code : str
        What follows the comment at the beginning.
    values : callable
        From a `Setup` and options to the values that both templates have, by name: "contacts", a list of dicts of
        `input_file.template_contact`, "types", the rows of a table, and the program's own. Besides these the templates
        have `setup`, `units`, `command` and the function `number`. A "setup" among the values is that of the program,
        where its contacts are not those of the bodies.
    way_out : str
        What to do if eps is off for some sizes.
    """

    comment: Comment
    use: str
    code: str
    values: Callable[..., Mapping[str, Any]]
    way_out: str = ""


@dataclass(frozen=True)
class OwnLaw:
    """The text for a program whose contacts have a law of their own, and a free stiffness.

    Attributes
    ----------
    formula : str
        Name of the formula whose law the contacts have.
    number : str
        What the text calls the number that follows from the formula's parameter, such as "dissipation".
    comment, use, code : str
        As of `InputFile`. The templates have `contacts`, `units` and `time_step`. Each contact has its `name`,
        `stiffness`, and `number` under its own name.
    per_speed : bool
        Whether the number is the parameter over the impact speed.
    per_mass : bool
        Whether the stiffness is one over a mass, in 1/time^2, and the number is the parameter times its root.
    carried : float
        The part of a weight, from 0 to 1, that the contacts carry without a penetration.
    """

    formula: str
    number: str
    comment: Comment
    use: str
    code: str
    per_speed: bool = False
    per_mass: bool = False
    carried: float = 0.0


@dataclass(frozen=True)
class Simulator:
    """A program that collides particles.

    Attributes
    ----------
    name : str
        That of its module, as `viscopade audit` takes it.
    title : str
        As its authors write it.
    version : str
        Version or commit of which the source was read.
    formulas : tuple of DampingFormula
        The program's ways from a wanted eps to its damping: rows of the audit.
    texts : mapping
        Its text by target (`viscopade simulators`).
    lines : mapping
        The line that the calculator writes, by "pair" (of like spheres), "wall" or "any" (bodies with this eps).
        Numbers stand in braces.
    walls : bool
        Whether it has walls.
    native : Native or None
        Its contact in the parameters of a user's file; None if the file has no contact.
    default_step : float or None
        The time step that it has unless the user gives one, in SI units; MuJoCo and JaxDEM have none.
    """

    name: str
    title: str
    version: str
    formulas: tuple[DampingFormula, ...]
    texts: Mapping[str, InputFile | OwnLaw] = field(default_factory=dict)
    lines: Mapping[str, str] = field(default_factory=dict)
    walls: bool = True
    native: Native | None = None
    default_step: float | None = None

    def __post_init__(self) -> None:
        """Refuse two formulas with one name."""
        if len({formula.name for formula in self.formulas}) < len(self.formulas):
            raise ValueError(f"two formulas of {self.title} have one name")

    @property
    def page(self) -> str:
        """Name of its page in docs/usage/simulators: its own if viscopade writes a file for it."""
        return self.name if self.texts else "other-programs"

    def formula(self, name: str) -> DampingFormula:
        """Return the formula of a name."""
        return next(formula for formula in self.formulas if formula.name == name)
