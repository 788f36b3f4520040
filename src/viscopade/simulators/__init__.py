"""Contact parameters in the words of other programs: DEM codes, and robotics codes with contacts of their own."""

TARGETS = ("lammps", "rebound-c", "rebound-python", "mercurydpm", "yade", "liggghts")
"""Programs that get the viscoelastic law, or what is nearest to it."""
SOFT = ("mujoco", "drake", "simbody", "chrono", "jaxdem")
"""Programs with a contact of their own law, whose stiffness is free."""

__all__ = [
    "lammps",
    "rebound",
    "render",
    "setup",
    "soft",
    "soft_text",
    "verification",
]
