"""Contact parameters in the words of simulators: LAMMPS, REBOUND, MercuryDPM, YADE and LIGGGHTS."""

TARGETS = ("lammps", "rebound-c", "rebound-python", "mercurydpm", "yade", "liggghts")

__all__ = [
    "gas",
    "lammps",
    "liggghts",
    "rebound",
    "render",
    "setup",
    "stated",
    "yade",
]
