"""How long a test waits for another process."""

HANGS = 3600
"""Seconds after which a process counts as one that hangs. No machine is so busy: no test depends on speed."""
