"""JavaScript for a page that is opened from the disk, where modules are blocked: a script with one global object."""

from dataclasses import replace

from viscopade.kernels.write.languages.javascript import LANGUAGE as MODULE

LANGUAGE = replace(
    MODULE,
    name="script",
    ending=".js",
    begin=MODULE.begin.removeprefix("export "),
    generic="    {name},",
    version=MODULE.version.replace("export ", ""),
    file='{head}\n\nvar {module} = (function () {{\n"use strict";\n\n{version}\n\n{functions}\n\n'
    "return {{\n    VERSION,\n    VERSION_NUMBER,\n{generics}\n}};\n}}());\n\n"
    'if (typeof module === "object") {{ // Node\n    module.exports = {module};\n}}\n',
    # No end tag: it would end the script where a page contains the file.
    take='// after the element <script src="{module}.js"> of the page',
)
