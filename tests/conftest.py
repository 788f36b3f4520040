"""What holds for every test: Hypothesis judges what is computed, never how long a busy machine takes for it.

`--quick`, which `make check` gives, runs only the files of `QUICK`: those that take a few seconds of processor time
each. Several workers share the files out in the order of `FIRST`: the long ones first, so that no worker waits for
another at the end; those of `TOGETHER`, which need the same proofs, go to one worker, and so do those of `PACKAGES`,
which need the same source distribution and wheel.
"""

import os
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests import built, daily

settings.register_profile(
    "viscopade",
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    derandomize="CI"
    in os.environ,  # a submission is judged on the same examples every time; at home new ones are tried
)
settings.load_profile("viscopade")

TESTS = Path(__file__).parent


def files(folder, *names):
    return tuple(str(Path(folder, f"test_{name}.py")) for name in names)


QUICK = frozenset(
    (
        *files("", "docs", "layers", "names", "patience"),
        *files("arithmetic", "balls", "function_balls"),
        *files("theory", "hierarchy_step", "paper", "symbolic"),
        *files("collision", "flow", "restitution", "spheres"),
        *files("approximation", "half_line"),
        *files("kernels", "rounding", "speed_page"),
        *files("simulators", "liggghts", "mercurydpm", "verification", "yade"),
        *files("scene", "encounter", "tolerance"),
        *files("fitting", "flight", "read"),
        *files("cli", "writer"),
    )
)
TOGETHER = (
    *files("kernels", "exports", "speed_kernels", "compact", "inverse"),
    *files("cli", "cli", "scenes"),
    *files("scene", "choice", "render", "check"),
    *files("simulators", "rebound"),
)
PACKAGES = files("", "build", "c_and_cpp")
FIRST = (
    *TOGETHER,
    *files("kernels", "languages"),
    *files("", "notebooks", "derivations", "site"),
    *files("lab", "figures", "claims"),
    *files("collision", "panel_proof"),
)


@pytest.fixture(scope="session")
def source(tmp_path_factory):
    """An unpacked source distribution; nothing may be written into it."""
    return built.unpacked_source(tmp_path_factory.mktemp("copy"))


@pytest.fixture(scope="session")
def without_extension(source, tmp_path_factory):
    """A folder with an unpacked wheel that was built without a C compiler."""
    folder = tmp_path_factory.mktemp("wheel")
    assert built.wheel(source, folder, CC="no-such-compiler") == []
    return folder


def file(path):
    return str(Path(path).relative_to(TESTS))


# --- processor time of each file --------------------------------------------------------------------------------------

LISTED = 40  # files of the table
spent = {"until": 0.0}
seconds_of = Counter()


def processor_seconds():
    """Return the processor time of this process and of its children that have ended."""
    return sum(os.times()[:4])


def pytest_runtest_logstart():
    spent["until"] = processor_seconds()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport():
    """Note in a report what its phase took; a worker sends the report to the process that prints the table."""
    report = yield
    before, spent["until"] = spent["until"], processor_seconds()
    report.processor_seconds = spent["until"] - before
    return report


def pytest_runtest_logreport(report):
    seconds_of[report.nodeid.partition("::")[0]] += report.processor_seconds


def pytest_terminal_summary(terminalreporter):
    """Print where the time goes; the ten longest tests of `--durations` hide a file of many short ones."""
    if terminalreporter.stats.get("failed"):
        terminalreporter.write_line(f"VISCOPADE_DAY={daily.DAY} repeats what was sampled today")
    terminalreporter.section(f"processor time: {seconds_of.total():.0f} s")
    for name, seconds in seconds_of.most_common(LISTED):
        terminalreporter.write_line(f"{seconds:6.1f} s  {name}")


# --- order and quick files --------------------------------------------------------------------------------------------


def pytest_addoption(parser):
    parser.addoption("--quick", action="store_true", help="run the quick files only (tests/conftest.py lists them)")


def pytest_ignore_collect(collection_path, config):
    """Leave out what is not quick, before it is imported."""
    quick = not collection_path.name.startswith("test_") or file(collection_path) in QUICK
    return True if config.getoption("quick") and not quick else None


def place(item):
    """Return where in the order a test comes."""
    name = file(item.path)
    return FIRST.index(name) if name in FIRST else len(FIRST)


def pytest_collection_modifyitems(items):
    items.sort(key=place)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Return how workers share the tests: as `--dist loadfile` does, in the order and groups of this file."""
    from xdist.scheduler import LoadFileScheduling

    class Groups(LoadFileScheduling):
        def _split_scope(self, nodeid):
            name = super()._split_scope(nodeid)
            groups = (group[0] for group in (TOGETHER, PACKAGES) if name.removeprefix("tests/") in group)
            return next(groups, name)

    config.option.loadscopereorder = False  # by the number of tests
    return Groups(config, log)
