"""Our answer in the parameters of simulators: LAMMPS, REBOUND, MercuryDPM, YADE and LIGGGHTS."""
