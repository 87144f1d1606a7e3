# SPDX-FileCopyrightText: 2026 topo_region_seg contributors
# SPDX-License-Identifier: Apache-2.0
"""Settings of the site: `make site`, or `rosdoc2 build`, which executes this file in a copy of its folder.

The documents are written for two places: a repository browser, where ``../setup.py`` is a file, and the site, which
holds `docs/` alone. `source-read` rewrites those links: to the page of the site that holds the same text, or to a
page made of the source file, at the line that defines the function that the link names.
"""

from __future__ import annotations

import ast
import importlib.util
import re
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from sphinx.application import Sphinx

# rosdoc2 executes this file from a copy of its folder, but puts the package on the path.
_package = importlib.util.find_spec("topo_region_seg")
_places = [
    Path(__file__).resolve().parents[1],
    Path.cwd(),
    *(Path(p).parent for p in (_package and _package.submodule_search_locations) or ()),
]
ROOT = next(place for place in _places if (place / "docs" / "conf.py").exists() and (place / "package.xml").exists())
MANIFEST = ElementTree.parse(ROOT / "package.xml").getroot()

# rosdoc2 has set these already; what follows is for `make site`.
project = "topo_region_seg"
author = copyright = "topo_region_seg contributors"
release = version = str(MANIFEST.findtext("version"))

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
rosdoc2_settings = {
    "override_theme": False,
    "enable_intersphinx": False,
    "automatically_extend_intersphinx_mapping": False,
}
# All but the first are pages that rosdoc2 puts beside ours, which say the same.
exclude_patterns = ["_build", "__*", "index.rst", "README.md", "CHANGELOG.rst", "CONTRIBUTING.md"]
html_theme_options: dict[str, Any] = {}  # rosdoc2 presets those of another theme
myst_heading_anchors = 4
myst_enable_extensions = ["deflist"]
myst_url_schemes = {"http": None, "https": None, "mailto": None, "source": {"url": "source/{{path}}.html#{{fragment}}"}}
suppress_warnings = ["myst.header"]  # benchmarks.md and soak.md are generated for reading in the repository too

# Shapes, units and dtypes are in the docstrings, which says more than annotations do.
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_use_param = napoleon_use_rtype = False
nitpicky = True

html_theme = "furo"
html_title = f"topo_region_seg {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
linkcheck_ignore = ["source/.*"]

PAGES = {
    "README.md": "index.md",
    "SECURITY.md": "security.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.rst": "changelog.rst",
    "bags/README.md": "bags.md",
}
"""Documents outside of `docs/` and the pages of the site that hold their text."""
LINK = re.compile(r"(\[([^\]]*)\]\()((?!\w+:)[^)#\s]+)(#[^)\s]*)?\)")


def line_of(source: Path, name: str) -> int:
    """Return the line that defines a function or class, `f` or `C.f`; 1 if it defines none of the name."""
    scope: Any = ast.parse(source.read_text(encoding="utf-8"))
    for part in name.split("."):
        found = [node for node in scope.body if getattr(node, "name", None) == part]
        if not found:
            return 1
        scope = found[0]
    return int(scope.lineno)


def on_the_site(text: str, folder: Path) -> str:
    """Return a document of `folder` with the links that leave `docs/` turned to pages of the site."""

    def turned(match: re.Match[str]) -> str:
        begin, words, target, anchor = match.groups()
        path = (folder / target).resolve()
        if not path.is_file() or not path.is_relative_to(ROOT):
            return match.group()
        name = path.relative_to(ROOT).as_posix()
        if name in PAGES:
            return f"{begin}{PAGES[name]}{anchor or ''})"
        if name.startswith("docs/"):
            return f"{begin}{name.removeprefix('docs/')}{anchor or ''})"
        line = line_of(path, words.strip("`")) if path.suffix == ".py" else 1
        return f"{begin}source:{name}#line-{line})"

    return LINK.sub(turned, text)


def read_document(app: Sphinx, docname: str, content: list[str]) -> None:
    """Turn the links of a document; take the text of those that are kept elsewhere from there."""
    for name, page in PAGES.items():
        if page == f"{docname}.md" and name != "README.md":
            content[0] = on_the_site((ROOT / name).read_text(encoding="utf-8"), (ROOT / name).parent)
            return
        if page == f"{docname}.rst":
            content[0] = (ROOT / name).read_text(encoding="utf-8")
            return
    content[0] = on_the_site(content[0], ROOT / "docs")


def source_pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Make a page of every source file that a document links to."""
    documents = [*(ROOT / "docs").glob("*.md"), *(ROOT / name for name in PAGES if name.endswith(".md"))]
    texts = [on_the_site(path.read_text(encoding="utf-8"), path.parent) for path in documents]
    for name in sorted({name for text in texts for name in re.findall(r"\]\(source:([^#)]+)", text)}):
        language = {".py": "python", ".yaml": "yaml", ".xml": "xml", ".sh": "bash"}.get(Path(name).suffix, "text")
        code = (ROOT / name).read_text(encoding="utf-8")
        highlighted = app.builder.highlighter.highlight_block(code, language, force=True)  # type: ignore[attr-defined]
        before, _, rest = highlighted.partition("<pre>")
        lines = "\n".join(f'<span id="line-{n}"></span>{line}' for n, line in enumerate(rest.split("\n"), 1))
        body = f"<h1 class='source'>{escape(name)}</h1>{before}<pre>{lines}"
        yield f"source/{name}", {"title": name, "body": body, "parents": []}, "page.html"


def setup(app: Sphinx) -> None:
    """Connect the two."""
    app.connect("source-read", read_document)
    app.connect("html-collect-pages", source_pages)
