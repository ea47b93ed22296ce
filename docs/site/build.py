"""Lays out the pages for mkdocs: those of docs/ and of the root beside each other, the README first.
Links to files that are no pages become their names.

    build.py FOLDER"""
import pathlib
import re
import shutil
import sys

SITE = pathlib.Path(__file__).resolve().parent
ROOT = SITE.parent.parent
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s#]*)(#[^)\s]*)?\)")
NAMES = {"README.md": "index.md"}


def pages():
    return sorted((ROOT / "docs").glob("*.md")) + sorted(ROOT.glob("*.md"))


def staged(page):
    """The text of a page, its links as they lead in the folder of all pages."""
    def link(found):
        mark, text, target, anchor = found[1], found[2], found[3], found[4] or ""
        if not target or re.match(r"[a-z]+:", target):
            return found[0]
        path = (page.parent / target).resolve()
        if path.suffix == ".md" and path in pages():
            return f"[{text}]({NAMES.get(path.name, path.name)}{anchor})"
        if path.suffix == ".png":
            return f"{mark}[{text}]({path.relative_to(ROOT / 'docs')})"
        name = str(path.relative_to(ROOT))
        return text if f"`{name}`" in text else f"{text} (`{name}`)"
    return LINK.sub(link, page.read_text(encoding="utf-8"))


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "pages").mkdir(parents=True)
    shutil.copy(SITE / "mkdocs.yml", folder)
    shutil.copytree(ROOT / "docs" / "pictures", folder / "pages" / "pictures",
                    ignore=shutil.ignore_patterns("*.sh"))
    for page in pages():
        (folder / "pages" / NAMES.get(page.name, page.name)).write_text(staged(page), encoding="utf-8")


if __name__ == "__main__":
    main()
