"""Build the extension `viscopade._native`, if there is a C compiler; put headers and scenes into the package.

All else is in pyproject.toml.
"""

from pathlib import Path

import numpy
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py

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


# Folders of an installed package, and their files here, where they are under version control. An editable installation
# and a checkout find the latter: src/viscopade/shipped.py.
SHIPPED = {
    "include": ("exports/*.h", "exports/*.cuh"),
    "share/cmake/viscopade": ("cmake/*.cmake",),
    "examples": ("examples/*.toml", "examples/*.csv", "examples/in.*", "examples/*.xml"),
}


class BuildPackage(build_py):
    """Build the package with the files that other programs take from it."""

    def run(self) -> None:
        """Copy the files; viscopade.pc gets the version."""
        super().run()
        if self.editable_mode:
            return
        package = Path(self.build_lib, "viscopade")
        for folder, patterns in SHIPPED.items():
            (package / folder).mkdir(parents=True, exist_ok=True)
            for file in (file for pattern in patterns for file in Path().glob(pattern)):
                self.copy_file(str(file), str(package / folder / file.name))
        text = Path("cmake/viscopade.pc.in").read_text(encoding="utf-8")
        made = package / "share" / "pkgconfig" / "viscopade.pc"
        made.parent.mkdir(parents=True, exist_ok=True)
        made.write_text(text.replace("@PROJECT_VERSION@", self.distribution.get_version()), encoding="utf-8")


setup(
    ext_modules=[
        Extension(
            "viscopade._native",
            sources=[str(file) for file in sorted(Path("src/native").glob("*.c"))],
            depends=["exports/viscopade_speed_full.h", "src/native/native.h"],
            include_dirs=["exports", numpy.get_include()],
            optional=True,  # without it Python and NumPy compute the same
        )
    ],
    cmdclass={"build_ext": BuildNative, "build_py": BuildPackage},
)
