"""Sphinx that reads and translates every page as always, and fills the theme's templates for a few.

Called with the names of these, separated by commas, and the arguments of ``sphinx-build``.
The tree of links beside each page takes a sixth of a build, and the index of its words another
tenth; neither can warn of anything that a page says. Plots are drawn without a search for the
places of their axes, which takes half of their time; only the full build sees a search that fails.
"""

import sys
from typing import Any

from matplotlib.figure import Figure
from sphinx.builders.html import StandaloneHTMLBuilder
from sphinx.cmd.build import main

FEW = sys.argv[1].split(",") if __name__ == "__main__" else []
WHOLE = StandaloneHTMLBuilder.handle_page
INDEXED = StandaloneHTMLBuilder.index_page


def handle_page(builder: StandaloneHTMLBuilder, name: str, *arguments: Any, **options: Any) -> None:
    """Write a page if it is one of the few, or one that is made and not read."""
    if name in FEW or name not in builder.env.found_docs:
        WHOLE(builder, name, *arguments, **options)


def index_page(builder: StandaloneHTMLBuilder, name: str, *arguments: Any) -> None:
    """Take the words of a page into the index if it is one of the few."""
    if name in FEW:
        INDEXED(builder, name, *arguments)


if __name__ == "__main__":
    StandaloneHTMLBuilder.handle_page = handle_page  # type: ignore[method-assign]
    StandaloneHTMLBuilder.index_page = index_page  # type: ignore[method-assign]
    Figure.set_layout_engine = lambda *_, **__: None  # type: ignore[method-assign]
    sys.exit(main(sys.argv[2:]))
