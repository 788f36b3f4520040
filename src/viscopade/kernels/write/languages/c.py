"""C: headers in C99 that are valid C++, too."""

from dataclasses import replace
from functools import partial

from viscopade.arithmetic.formats import Format
from viscopade.kernels.arithmetic import HOST, HOST_FLOAT
from viscopade.kernels.write.language import Language, Number, Runner, shortest


def _constant(value: float, form: Format) -> str:
    """Return a macro of c.h: a number in hexadecimal, and in decimal for C++ before C++17, which lacks the former."""
    return f"VISCOPADE_CONSTANT({form.hexadecimal(value)}, {form.decimal(value)})"


def _words(form: Format) -> dict[str, str]:
    """Return calls of words.h, from numbers of a format to their bits and back, and casts: name -> pattern."""
    bits_calls = {name: f"viscopade_{name}{form.suffix}({{0}})" for name in ("bits", "from_bits")}
    types = {"uint32": "uint32_t", "uint64": "uint64_t", "index": "unsigned"}
    return bits_calls | {name: f"VISCOPADE_AS({kind}, {{0}})" for name, kind in types.items()}


_KERNELS = Language(
    name="c",
    ending=".h",
    comment=" *",
    numbers=tuple(
        Number((a,), a.form.name, shortest(a, "{}" + a.form.suffix), a.form.suffix, "{name}" + a.form.suffix,
               nan=f'nan{a.form.suffix}("")', coefficient=partial(_constant, form=a.form), calls=_words(a.form),
               word=f"UINT{8 * a.form.bytes}_C({{digits}})",
               types={"word": f"uint{8 * a.form.bytes}_t", "uint32": "uint32_t", "uint64": "uint64_t",
                      "index": "unsigned", "row": f"{a.form.name} *", "condition": "int"})
        for a in (HOST, HOST_FLOAT)
    ),
    begin="VISCOPADE_INLINE {type} viscopade_{name}{suffix}({arguments})\n{{",
    argument="{type} {argument}",
    index="int {argument}",
    list="static const {type} {name}[{count}] = {{{values}}};",
    constant="const {type} {name} = {value};",
    assign="const {type} {name} = {value};",
    result="return {value};",
    unless="if (!({condition})) {{",
    when="if ({condition}) {{",
    end="}}",
    close="}}",
    block="/*\n{lines}\n */",
    version="#ifndef VISCOPADE_VERSION\n#define VISCOPADE_VERSION \"{version}\"\n"
    "#define VISCOPADE_VERSION_NUMBER {number} /* 10000 major + 100 minor + patch */\n#endif",
    file="{head}\n{version}\n\n{prelude}\n\n#ifdef VISCOPADE_INLINE\n\n{functions}\n\n#endif\n",
    kernel="#ifndef {GUARD}\n#define {GUARD} {identity}\n\nVISCOPADE_KERNEL({identity})\n\n{functions}\n\n"
    "VISCOPADE_KERNEL_END\n\n#elif {GUARD} != {identity}\n"
    '#error "viscopade: two headers have different kernels of one name"\n#endif',
    macro="#define VISCOPADE_{NAME}_ERROR{SUFFIX} {error} /* {rest} */",
    prelude="c.h",
    words="words.h",
    call="viscopade_{name}{suffix}({arguments})",
    take='#include "{module}{ending}"',
    use="{type} {result} = {call};",
    table="VISCOPADE_HEXADECIMAL\nVISCOPADE_TABLE {type} viscopade_{table}_{kernel}[{rows}][{columns}] = {{\n{values}\n"
    "}};\nVISCOPADE_HEXADECIMAL_END",
    row="viscopade_{table}_{kernel}[{index}]",
    run=Runner("c.c", ("cc", "gcc", "clang"), "{tool} -O2 {driver} -o {program} -lm", "{program}", "CC"),
    groups=("pade", "minimax", "inverse"),
)  # fmt: skip

# Functions from materials to beta: for devices, too, where a compiler of CUDA or HIP reads the header. All they need is
# in their block, so that it is the same in all headers.
LANGUAGE = replace(
    _KERNELS,
    material=replace(
        _KERNELS,
        begin="VISCOPADE_EVERYWHERE {type} viscopade_{function}{suffix}({arguments})\n{{",
        call="viscopade_{function}{suffix}({arguments})",
        kernel=_KERNELS.kernel.replace(
            "VISCOPADE_KERNEL({identity})",
            "#if defined(__CUDACC__) || defined(__HIPCC__) || defined(__CUDACC_RTC__) || defined(__HIPCC_RTC__)\n"
            "#define VISCOPADE_EVERYWHERE VISCOPADE_INLINE __host__ __device__\n"
            "#else\n"
            "#define VISCOPADE_EVERYWHERE VISCOPADE_INLINE\n"
            "#endif\n\n"
            "VISCOPADE_KERNEL({identity})",
        ),
    ),
)
