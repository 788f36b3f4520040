r"""Cells of a table in LaTeX: symbols, powers and numbers become formulas, other characters are escaped."""

from __future__ import annotations

import re

# Symbols that the rules below do not compose; a star is the paper's index.
_NAMES = {
    "v*": "v_*",
    "v_star": "v_*",
    "epsilon": r"\varepsilon",
    "one_minus_epsilon": r"1-\varepsilon",
    "1 - eps": r"1-\varepsilon",
    "(1-eps)": r"(1-\varepsilon)",
    "|d eps|": r"|d\varepsilon|",
    "eps0": r"\varepsilon_0",
    "dissipative_constant": "A",
    "max_compression": r"\xi_{\max}",
    "contact_time": "t_c",
    "[m/n]": "[m/n]",
    "<=": r"\leq",
    ">=": r"\geq",
}
_GREEK = {name: "\\" + name for name in ("beta", "kappa", "lambda", "nu", "rho", "tau", "xi")} | {"eps": r"\varepsilon"}
_INDICES = {"max": r"\max", "eff": r"\mathrm{eff}"}

_FORMULA = re.compile(
    r"(?<![\w.*^-])"
    r"(?:(?P<factor>[+-]?[0-9]+(?:\.[0-9]+)?)e(?P<exponent>[+-]?[0-9]+)"
    rf"|(?:(?P<name>{'|'.join(map(re.escape, sorted(_NAMES, key=len, reverse=True)))})"
    rf"|(?P<base>[+-]?[0-9]+(?:\.[0-9]+)?|{'|'.join(_GREEK)}|[A-Za-z]|(?<=\))(?=\^))(?:_(?P<index>[0-9]+|[A-Za-z]+))?)"
    r"(?:\^(?P<power>-?[0-9]+(?:\.[0-9]+)?|[a-z]|\([A-Za-z0-9/.+-]+\)))?)"
    r"(?![\w^*-]|\.[0-9])"
)
_SPECIAL = str.maketrans(
    {character: "\\" + character for character in "&%$#_{}"}
    | {character: f"${character}$" for character in "<>|"}  # which the usual encoding of a font lacks
    | {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
)


def latex_cell(cell: str) -> str:
    """Return a cell as LaTeX; "{}" goes before a leading bracket or star, else an argument of the line's end above."""
    parts, end = [], 0
    for found in _FORMULA.finditer(cell):
        parts += [cell[end : found.start()].translate(_SPECIAL), _formula(found)]
        end = found.end()
    text = "".join(parts) + cell[end:].translate(_SPECIAL)
    return ("{}" if text.startswith(("[", "*")) else "") + text


def _formula(found: re.Match[str]) -> str:
    """Return a match as a formula, or unchanged where both look the same."""
    factor, exponent, name, base, index, power = found.groups()
    if factor:
        return rf"${factor}\times10^{{{int(exponent)}}}$"
    whole = found[0] == found.string  # a letter alone is a symbol, in a sentence it may be a word
    if not (name or index or power or base in _GREEK or base[:1] in ("+", "-") or (whole and base.isalpha())):
        return str(found[0])
    text = _NAMES[name] if name else _GREEK.get(base, base)
    text += f"_{_group(_INDICES.get(index, index))}" if index else ""
    text += f"^{_group(power.strip('()'))}" if power else ""
    return f"${text}$"


def _group(text: str) -> str:
    """Return an index or a power, in braces if it has more than one character."""
    return text if len(text) == 1 else f"{{{text}}}"
