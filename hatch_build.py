"""What a build adds: the README as the description of the package, without links that only a repository can follow."""

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface


class Description(MetadataHookInterface):
    """The README as a package index can show it, where files of the repository are not at hand."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the description of the package."""
        readme = Path(self.root, "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": without_links(readme)}


def without_links(markdown: str) -> str:
    """Markdown without pictures and comments, with links reduced to their words."""
    plain = re.sub(r"^(!\[[^\]]*\]\([^)]*\)|<!--.*?-->)\n+", "", markdown, flags=re.MULTILINE)
    return re.sub(r"\[([^\]]+)\]\([^)]*\)", r"\1", plain)
