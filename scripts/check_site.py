# SPDX-License-Identifier: MIT
"""Check built pages: every link within them leads somewhere, and nothing is loaded from elsewhere.

Usage: check_site.py FOLDER
"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADING = {"link", "script", "img", "iframe", "source", "embed", "object", "audio", "video"}


class Page(HTMLParser):
    """What a page may be linked by, what it links to, and what it loads."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.names: set[str] = {""}
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.names |= {given[name] for name in ("id", "name") if name in given}
        target = given.get("href") or given.get("src") or given.get("data") or ""
        if tag in LOADING and given.get("rel") not in ("canonical", "alternate"):
            self.loaded.append(target)
        if target:
            self.links.append(target)


def complaints(folder: Path) -> list[str]:
    """Return what is wrong, a line each."""
    pages = {path: Page(path) for path in sorted(folder.rglob("*.html"))}
    found = [] if pages else [f"no pages in {folder}"]
    for path, page in pages.items():
        name = path.relative_to(folder)
        found += [
            f"{name} loads {target}"
            for target in page.loaded
            if target.startswith(("http:", "https:", "//"))
        ]
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                found.append(f"{name} links to {link}, which does not exist")
            elif target in pages and unquote(parts.fragment) not in pages[target].names:
                found.append(f"{name} links to {link}, which has no such place")
    return found


if __name__ == "__main__":
    lines = complaints(Path(sys.argv[1]).resolve())
    print(*lines, sep="\n", end="\n" if lines else "", file=sys.stderr)
    sys.exit(bool(lines))
