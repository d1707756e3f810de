"""How Sphinx builds the site: `make docs`, warnings are errors."""

import sys
from pathlib import Path

from pygments.lexers.special import TextLexer
from sphinx.highlighting import lexers

ROOT = Path(__file__).parents[1]
DOCS = Path(__file__).parent
sys.path[:0] = [str(ROOT), str(DOCS / "_ext")]

project = "drake_disasm"
copyright = "the drake_disasm authors, BSD-3-Clause"
release = "0.1.0"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "docstrings",
    "repository_links",
]
exclude_patterns = ["_ext", "_templates", "images", "results/pages", "results/data"]
templates_path = ["_templates"]

# Notebooks are executed in every build; a cell that fails ends it.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # s
nb_merge_streams = True

# Pages: Markdown; `#heading` links work for headings down to ###.
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3

smartquotes = False  # --log stays what is typed

lexers["csv"] = TextLexer()

# API reference, from docstrings in Google's style. `name` in a docstring links to
# what it names, where that is documented.
default_role = "py:obj"
suppress_warnings = ["ref.python"]  # `effects` may be an attribute of several classes
# Autosummary writes a page per module, and leaves those of modules that are gone, and
# their names on the pages of packages.
for page in (DOCS / "reference" / "api").glob("*.rst"):
    if not (ROOT / page.stem.replace(".", "/")).with_suffix(".py").is_file():
        page.unlink()
autosummary_generate = True
autosummary_ignore_module_all = True
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 72
napoleon_use_ivar = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False

# Inheritance from pydrake and torch is shown, and their own docstrings are not ours.
autodoc_inherit_docstrings = False

html_theme = "pydata_sphinx_theme"
html_title = "drake_disasm"
html_static_path = ["_static"]
# Recorded by `make docs`, which is too large to be kept.
html_extra_path = [str(path) for path in [ROOT / "build" / "recorded"] if path.exists()]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_prev_next": False,
    "navigation_with_keys": False,
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
html_sidebars = {"index": []}

# `$ ` and `>>> ` are prompts; output below them is not copied.
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
