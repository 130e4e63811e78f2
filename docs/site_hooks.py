"""Brings what docs/build has made into the site: pages of the gallery's bodies, and notebooks with their output.

MkDocs calls these functions. The site builds without docs/build too; it then says what was not made.
"""

from __future__ import annotations

import html
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

DOCS = Path(__file__).parent
BUILT = DOCS.parent / "build" / "docs"
GALLERY, NOTEBOOKS = "gallery/index.md", "notebooks/index.md"
LIST = "<!-- list -->"  # stands in both pages, where the list comes in
NOT_MADE = "*This build leaves it out; `docs/build` makes it.*"


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Enter the notebooks below their list in the navigation."""
    for _, entry in _sections(config.nav):
        if entry.get("Notebooks") == NOTEBOOKS:
            entry["Notebooks"] = [
                NOTEBOOKS,
                *({_title(each): f"notebooks/{each.stem}.md"} for each in _notebooks()),
            ]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of bodies, and a page for each notebook."""
    for body in _bodies():
        if (page := _page(body)).is_file():
            files.append(File.generated(config, f"gallery/{body['name']}.html", abs_src_path=str(page)))
    for notebook in _notebooks():
        for name, content in _pages(notebook):
            files.append(File.generated(config, f"notebooks/{name}", content=content))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put the lists of bodies and of notebooks into their pages."""
    if page.file.src_uri == GALLERY:
        return markdown.replace(LIST, "\n".join(line for body in _bodies() for line in _entry(body)))
    if page.file.src_uri == NOTEBOOKS:
        links = (f"- [{_title(each)}]({each.stem}.md) ([file]({each.name}))" for each in _notebooks())
        return markdown.replace(LIST, "\n".join(links))
    return markdown


def _sections(nav: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """All entries of the navigation, however deep, with their titles."""
    for entry in nav or ():
        if isinstance(entry, dict):
            for title, below in entry.items():
                yield title, entry
                if isinstance(below, list):
                    yield from _sections(below)


def _bodies() -> list[dict[str, Any]]:
    return tomllib.loads((DOCS / "gallery" / "bodies.toml").read_text(encoding="utf-8"))["body"]


def _page(body: dict[str, Any]) -> Path:
    return BUILT / "gallery" / body["name"] / body["page"]


def _entry(body: dict[str, Any]) -> Iterator[str]:
    """The lines of a body in the gallery's page."""
    yield from ("", f"## {body['title']}", "", body["about"], "")
    if "study" in body:
        name = Path(body["page"]).stem.removesuffix("-page")
        yield from (f'```toml title="{name}.toml"', body["study"].strip(), "```", "")
    yield from ("```sh", *body["commands"], "```", "")
    if "missing" in body:
        yield f"*There is no page yet: {body['missing']}*"
    elif _page(body).is_file():
        page, title = f"{body['name']}.html", html.escape(body["title"])
        yield f'<p><a href="{page}" target="_blank">Open the page</a></p>'
        # a closed part's page is not loaded: eight bodies at once would be 20 MB
        yield f'<details><summary>Touch it here</summary><iframe src="{page}" title="{title}" loading="lazy"'
        yield 'style="width: 100%; height: 34rem; border: 0"></iframe></details>'
    else:
        yield NOT_MADE


def _notebooks() -> list[Path]:
    return sorted((DOCS / "notebooks").glob("*.ipynb"))


def _title(notebook: Path) -> str:
    """The notebook's first heading."""
    found = re.search(r'"# ([^"\\]+)', notebook.read_text(encoding="utf-8"))
    return found[1] if found else notebook.stem


def _pages(notebook: Path) -> Iterator[tuple[str, str | bytes]]:
    """A notebook's page and the files that it shows: pictures, and touched bodies as pages of their own."""
    import nbformat
    from nbconvert import MarkdownExporter

    done = BUILT / "notebooks" / notebook.stem / notebook.name
    cells = nbformat.read(done if done.is_file() else notebook, as_version=4)
    text, made = MarkdownExporter().from_notebook_node(
        cells, {"unique_key": notebook.stem, "output_files_dir": ""}
    )
    yield from made["outputs"].items()
    bodies = re.findall(r'srcdoc="([^"]*)"', text)
    for number, body in enumerate(bodies):
        page = f"{notebook.stem}-body-{number}.html"
        text = text.replace(f'srcdoc="{body}"', f'src="../{page}" loading="lazy"')
        yield page, html.unescape(body)
    if not done.is_file():
        text = re.sub(r"^(# .*)$", rf"\1\n\n{NOT_MADE}", text, count=1, flags=re.MULTILINE)
    yield f"{notebook.stem}.md", text
