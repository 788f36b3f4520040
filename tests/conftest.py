"""What holds for every test: Hypothesis judges what is computed, never how long a busy machine takes for it."""

import os

from hypothesis import HealthCheck, settings

settings.register_profile(
    "viscopade",
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    derandomize="CI"
    in os.environ,  # a submission is judged on the same examples every time; at home new ones are tried
)
settings.load_profile("viscopade")
