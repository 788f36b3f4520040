"""Coverage-guided fuzzing of the command line, with the grammar of tests/cli; run by hand.

    pip install atheris -e .
    python -m tests.fuzz.fuzz_cli -max_len=400 -max_total_time=600 CORPUS

The fuzzer's bytes are the dice that the grammar throws: it learns which choices lead to new code. A crash is any fault
that `tests.cli.trial` knows.
"""

import os
import random
import sys
import tempfile

import atheris

INSTRUMENTED = [
    "viscopade.cli.main",
    "viscopade.cli.console",
    "viscopade.arguments",
    "viscopade.records",
    "viscopade.kernels.requests",
]

with atheris.instrument_imports(
    include=[*INSTRUMENTED, "viscopade.scene", "viscopade.simulators", "viscopade.collision.spheres"]
):
    from tests.cli import trial
    from tests.cli.processes import memory


class Dice(random.Random):
    """Random numbers from the fuzzer's bytes."""

    def __init__(self, data: bytes) -> None:
        self.provider = atheris.FuzzedDataProvider(data)
        super().__init__(0)

    def random(self) -> float:
        return self.provider.ConsumeIntInRange(0, (1 << 16) - 1) / (1 << 16)

    def getrandbits(self, k: int) -> int:
        # A constant would be thrown again and again where it is out of range: then the dice are real ones.
        return self.provider.ConsumeIntInRange(0, (1 << k) - 1) if self.provider.remaining_bytes() else self._real(k)

    def _real(self, k: int) -> int:
        return super().getrandbits(k)


def one(data: bytes) -> None:
    found = trial.trial(sandbox, grammar.made(Dice(data)))
    assert not found["faults"], found


if __name__ == "__main__":
    grammar = trial.grammar()
    os.environ["PATH"] = ""
    sandbox = trial.Sandbox(tempfile.mkdtemp(dir=memory()))
    atheris.Setup(sys.argv, one)
    atheris.Fuzz()
