"""What holds for every test: Hypothesis judges what is computed, never how long a busy machine takes for it.

`--quick`, which `make check` gives, runs only the files of `QUICK`: those that take a few seconds of processor time
each.
"""

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


QUICK = frozenset(
    f"test_{name}.py"
    for name in (
        *(
            "balls",
            "compensated",
            "docs",
            "expansions",
            "flow",
            "halfline",
            "hierarchy_step",
            "latex",
            "layers",
            "model",
        ),
        *("names", "paper", "patience", "perturbation", "restitution", "rounding", "scene_cost", "scene_encounter"),
        *("scene_tolerance", "simulators_liggghts", "simulators_mercurydpm", "simulators_tsuji", "simulators_yade"),
        *("speed_page", "wiener", "writer"),
    )
)


def pytest_addoption(parser):
    parser.addoption("--quick", action="store_true", help="run the quick files only (tests/conftest.py lists them)")


def pytest_ignore_collect(collection_path, config):
    """Leave out what is not quick, before it is imported."""
    name = collection_path.name
    return True if config.getoption("quick") and name.startswith("test_") and name not in QUICK else None


LONGEST = ("test_notebooks.py", "test_exports.py", "test_figures.py", "test_derivations.py", "test_gapped_kernels.py")


def pytest_collection_modifyitems(items):
    """Begin with the files that take longest: at the end they would keep one worker busy and the others idle."""
    items.sort(key=lambda item: item.path.name not in LONGEST)
