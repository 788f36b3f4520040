"""Settings of the documentation site, which `make docs` builds with Sphinx from the files of the repository.

The root of the sources is the root of the repository, so a link between two files is the same on a repository page and
on the site. The modules beside this one hold what differs: `pages`, `files`, `formulas` and `docstrings`.
"""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]
os.environ["VISCOPADE_BACKEND"] = "numpy"  # whose `restitution` has a source; the pages do not depend on a compiler

from viscopade import __version__  # noqa: E402 - from this checkout

project = "viscopade"
author = "viscopade developers"
copyright = author
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "tools.site.pages",
    "tools.site.files",
    "tools.site.formulas",
    "tools.site.docstrings",
]
root_doc = "docs/index"
include_patterns = ["*.md", "docs/**.md", "examples/**.md", "exports/*.md", "checkers/*.md"]
include_patterns += ["notebooks/*.md", "notebooks/*.ipynb", "derivations/*.md", "derivations/*.py"]
exclude_patterns = ["build", "src", "tests", "tools", ".*"]
source_suffix = {".md": "markdown", ".ipynb": "markdown", ".py": "markdown"}

nitpicky = True
# Names of other packages, and words such as "array" in the types of arguments, have no page here.
nitpick_ignore_regex = [(r"py:.*", r"(?!viscopade\.).*")]
highlight_language = "none"
default_role = "py:obj"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 6
myst_dmath_allow_labels = False
autodoc_typehints = "none"  # the docstrings name the types
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False
toc_object_entries_show_parents = "hide"
copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True
copybutton_only_copy_prompt_lines = True

html_math_renderer = "mathml"
html_theme = "furo"
html_title = "viscopade"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_search_summary = False  # it would be fetched, which a browser refuses for files on the disk
html_theme_options = {"navigation_with_keys": True}
