"""Coverage-guided fuzzing of scene files and of benchmark results; run by hand, not by pytest.

In an environment of its own with atheris and the package:

    pip install atheris -e .
    python tests/fuzz/fuzz_scene.py -dict=tests/fuzz/toml.dict -max_len=4000 -max_total_time=600 CORPUS examples/
    python tests/fuzz/fuzz_scene.py --result -max_len=8000 -max_total_time=600 CORPUS tests/data/

CORPUS is an empty directory for what is found. A crash is any exception but a ValueError of one line that names the
file.
"""

import sys

import atheris

INSTRUMENTED = ["viscopade.scene", "viscopade.records", "viscopade_lab.bench.result", "tomllib"]

with atheris.instrument_imports(include=INSTRUMENTED):
    from viscopade.scene.read import from_toml
    from viscopade_lab.bench.result import Result

SOURCE = "scene.toml"


def read_scene(data: bytes) -> None:
    """Read a scene, and see that the numbers that the rest works with are finite."""
    found = from_toml(data, SOURCE)
    for meeting in found.meetings:
        pair = found.pair(meeting)
        assert 0 < pair.beta < float("inf"), pair


def read_result(data: bytes) -> None:
    Result.from_text(data, SOURCE)


def one(data: bytes) -> None:
    try:
        read(data)
    except ValueError as error:
        line = str(error)
        assert line.startswith(f"{SOURCE}: "), line
        assert "\n" not in line, line
        assert len(line) < 1000, line


if __name__ == "__main__":
    read = read_result if "--result" in sys.argv else read_scene
    atheris.Setup([word for word in sys.argv if word != "--result"], one)
    atheris.Fuzz()
