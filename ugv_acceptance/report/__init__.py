"""Pages and pictures of results: self-contained HTML, figures as SVG, JUnit XML.

In: results as JSON from `offline/` and `campaign/`, columns of margins, and grids of the studies.
Out: text of files, written by the callers: the report to sign, the campaign's page, maps, and the
recomputed paper (`paper/`). Numbers are formatted here and never computed, but for the maps and the
paper's figures. Read `acceptance.py` first; `regions.py` and `format.py` are shared by all.
"""
