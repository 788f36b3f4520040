"""Measurements of single questions: what a route costs, and what another way would give."""
