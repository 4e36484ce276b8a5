"""The documentation as a site: `make docs` builds it into out/site; warnings are errors."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from ugv_acceptance import __version__

project = 'ugv_acceptance'
author = 'ugv_acceptance maintainers'
version = release = __version__
copyright = f'{author}, Apache-2.0'

extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.napoleon']
source_suffix = {'.md': 'markdown'}
root_doc = 'index'
exclude_patterns = ['examples']
myst_heading_anchors = 4
nitpicky = False

autodoc_member_order = 'bysource'
autodoc_typehints = 'signature'
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
napoleon_google_docstring = False

html_theme = 'furo'
html_title = f'ugv_acceptance {__version__}'
html_copy_source = False
html_show_sourcelink = False
