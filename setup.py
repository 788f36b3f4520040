"""Build the extension `viscopade.arrays._native`, if there is a C compiler; all else is in pyproject.toml."""

import numpy
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

# Without contraction to fused multiply-add, and whatever CFLAGS says of fast mathematics, results are NumPy's to the
# last bit. The kernel's floating-point exceptions are not used. Nothing depends on the machine that builds: the
# source chooses instructions when it runs.
FLAGS = ("-O3", "-std=c11", "-fno-fast-math", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-g0")


class BuildNative(build_ext):
    """Compile with flags that GCC and Clang know; other compilers with their own defaults."""

    def build_extensions(self) -> None:
        """Add the flags as soon as the compiler is known."""
        if self.compiler.compiler_type in ("unix", "mingw32"):
            for extension in self.extensions:
                extension.extra_compile_args.extend(FLAGS)
        super().build_extensions()


setup(
    ext_modules=[
        Extension(
            "viscopade.arrays._native",
            sources=["src/viscopade/arrays/_native.c"],
            depends=["exports/viscopade_speed_full.h"],
            include_dirs=["exports", numpy.get_include()],
            optional=True,  # without it NumPy computes the same
        )
    ],
    cmdclass={"build_ext": BuildNative},
)
