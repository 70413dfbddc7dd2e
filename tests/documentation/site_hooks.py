"""Hooks of MkDocs beyond mkdocs.yml: navigation by folders, walk-throughs of samples/ in tutorial/, formulas as MathML.

A page appears in the navigation when its file is there. Pages of `samples/` stay beside the files they walk through; the
site shows them under `tutorial/` at the same place below it, and links to `../../samples/PAGE.md` lead there.
"""

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

FOLDERS = {
    "Tutorial": "tutorial",
    "How to": "how-to",
    "Reference": "reference",
    "Explanation": "explanation",
    "Validation": "validation",
}
_TO_SAMPLES = re.compile(r"\]\((?:\.\./)+samples/([^)#]+\.md)")
_TO_DOCS = re.compile(r"\]\((?:\.\./)+docs/([^)#]+\.md)")


def on_config(config: Any) -> Any:
    """Navigation from the folders, index pages first; a fence `math` for formulas."""
    root, samples = Path(config.docs_dir), Path(config.docs_dir).parent / "samples"
    walks = [uri for uri, _ in _walks(samples)]
    nav: list[dict[str, Any] | str] = ["index.md"]
    for title, folder in FOLDERS.items():
        nav.append({title: _pages(root, folder) + (walks if folder == "tutorial" else [])})
    nav.append("glossary.md")
    config.nav = nav
    fences = [{"name": "math", "class": "math", "format": _mathml}]
    config.mdx_configs.setdefault("pymdownx.superfences", {})["custom_fences"] = fences
    return config


def _walks(samples: Path) -> list[tuple[str, Path]]:
    """Walk-throughs of samples/, each with its address on the site."""
    pages = [samples / "tutorial.md", *sorted(samples.glob("*/README.md"))]
    return [(f"tutorial/{path.relative_to(samples).as_posix()}", path) for path in pages]


def _pages(root: Path, folder: str) -> list[Any]:
    """Pages of a folder as entries of the navigation; a folder in it is an entry with its own."""
    here = root / folder
    pages = sorted((path for path in here.glob("*.md")), key=lambda path: (path.stem != "index", path.stem))
    below = sorted(path for path in here.iterdir() if path.is_dir() and any(path.glob("*.md")))
    return [f"{folder}/{path.name}" for path in pages] + [
        {path.name.capitalize(): _pages(root, f"{folder}/{path.name}")} for path in below
    ]


def on_files(files: Files, config: Any) -> Files:
    """The walk-throughs of samples/, with the pages of tutorial/."""
    samples = Path(config.docs_dir).parent / "samples"
    for uri, path in _walks(samples):
        files.append(File.generated(config, uri, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links into samples/, and from there into docs/, lead to where the site shows those pages."""
    here = posixpath.dirname(page.file.src_uri) or "."
    markdown = _TO_SAMPLES.sub(lambda found: f"]({posixpath.relpath(f'tutorial/{found[1]}', here)}", markdown)
    return _TO_DOCS.sub(lambda found: f"]({posixpath.relpath(found[1], here)}", markdown)


def _mathml(source: str, *_: Any, **__: Any) -> str:
    from latex2mathml.converter import convert

    return "\n".join(convert(line, display="block") for line in source.splitlines() if line.strip())
