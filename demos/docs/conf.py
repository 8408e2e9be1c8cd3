"""The documentation: built by ``python -m sphinx -W -b html demos/docs out/docs``, from the top of the repository.

Every demo is run for its page, but for studies of ten minutes. With ``-t quick`` only a few are; the others show their pictures of
``demos/pictures``. The builder ``linkcheck`` in place of ``html`` also asks the addresses outside, for which it needs the network.
"""

import hashlib
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import demo_pages  # noqa: E402
import repository_pages  # noqa: E402
from sphinx.application import Sphinx  # noqa: E402
from sphinx.domains.python import PyObject  # noqa: E402

import femmembrane  # noqa: E402

project = "femmembrane"
author = "femmembrane developers"
copyright = "femmembrane developers, MIT licence"
version = release = femmembrane.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_gallery.gen_gallery", "mathml"]
exclude_patterns = ["generated/scripts", "**/README.*"]
smartquotes = False
suppress_warnings = ["config.cache"]

myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3
myst_links_external_new_tab = False

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
python_maximum_signature_line_length = 88

RUN = demo_pages.QUICK if tags.has("quick") else None  # type: ignore[name-defined]  # noqa: F821
sphinx_gallery_conf = {
    "examples_dirs": ["generated/scripts/demos", "generated/scripts/paper"],
    "gallery_dirs": ["generated/demos", "generated/paper"],
    "filename_pattern": demo_pages.pattern(RUN),
    "ignore_pattern": r"__init__\.py",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("demo_pages.pictures",),
    "reset_argv": "demo_pages.arguments",
    "reset_modules": (),
    "capture_repr": (),
    "run_stale_examples": True,
    "abort_on_example_error": True,
    "download_all_examples": False,
    "default_thumb_file": str(HERE / "generated" / "drawings" / "table.png"),
    "remove_config_comments": True,
    "write_computation_times": False,
    "min_reported_time": 1,
    "notebook_extensions": set(),
    "backreferences_dir": None,
    "show_signature": False,
    "copyfile_regex": "",
}

html_theme = "furo"
html_title = f"femmembrane {release}"
html_static_path = ["static"]
html_css_files = ["documentation.css"]
html_copy_source = False
html_show_sphinx = False


def setup(app: Sphinx) -> None:
    for field in PyObject.doc_field_types:
        if field.name == "variable":
            field.label = "Attributes"  # the word of the docstrings
    made_by = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(HERE.glob("*.py")))).hexdigest()
    app.add_config_value("made_by", made_by, "env")  # other code here: every page is made anew
    app.connect("config-inited", repository_pages.generate, priority=1)
    app.connect("source-read", repository_pages.include)
    app.connect("autodoc-process-docstring", repository_pages.escape, priority=1)
