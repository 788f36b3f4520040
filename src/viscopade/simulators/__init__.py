"""Contact parameters in the words of other programs: DEM codes, and robotics codes with contacts of their own."""

TARGETS = ("lammps", "rebound-c", "rebound-python", "mercurydpm", "yade", "liggghts")
"""Programs that get the viscoelastic law, or what is nearest to it."""
SOFT = ("mujoco", "drake", "simbody", "chrono", "jaxdem")
"""Programs with a contact of their own law, whose stiffness is free."""

DECKS = ("lammps", "rebound-python")
"""Programs that get a deck, a complete input."""

__all__ = [
    "deck",
    "gas",
    "lammps",
    "liggghts",
    "rebound",
    "render",
    "setup",
    "soft",
    "soft_text",
    "stated",
    "verification",
    "yade",
]
