"""From a description of a simulation to the cheapest kernel that is good enough for it."""
