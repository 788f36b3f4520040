"""Audit: the eps that programs and formulas deliver, why it is not the one asked for, and what to write instead."""

__all__ = [
    "measured",
    "program",
    "programs",
    "textbook",
]
