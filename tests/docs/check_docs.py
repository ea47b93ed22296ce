"""The pages of the project: every link leads somewhere, every page can be reached from the README,
and aspell knows every word or finds it in words.txt.

    check_docs.py SOURCE_DIR

Ends with 1 and a line per fault."""
import pathlib
import re
import shutil
import subprocess
import sys

LINK = re.compile(r"(?<!\\)\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"```.*?```|`[^`\n]+`", re.DOTALL)


def anchors(text):
    """Of the headings, as GitHub makes them."""
    found = set()
    for heading in re.findall(r"^#+ +(.*)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.M):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        found.add(re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-"))
    return found


def links_of(page):
    for target in LINK.findall(CODE.sub("", page.read_text(encoding="utf-8"))):
        if not re.match(r"[a-z]+:", target):
            yield target


def check_links(root, pages):
    faults, reached, left = [], set(), [root / "README.md"]
    while left:
        page = left.pop()
        if page in reached:
            continue
        reached.add(page)
        for target in links_of(page):
            path, _, anchor = target.partition("#")
            to = (page.parent / path).resolve() if path else page
            if not to.exists():
                faults.append(f"{page.relative_to(root)}: {target} does not exist")
            elif to.suffix == ".md":
                left.append(to)
                if anchor and anchor not in anchors(to.read_text(encoding="utf-8")):
                    faults.append(f"{page.relative_to(root)}: {target}: no heading gives that anchor")
    return faults + [f"{page.relative_to(root)}: no link leads there from the README"
                     for page in pages if page not in reached]


def check_words(root, pages):
    if shutil.which("aspell") is None:
        print("skipped: aspell is not installed, so no word was checked")
        return []
    known = (pathlib.Path(__file__).parent / "words.txt").read_text(encoding="utf-8").split()
    faults, used = [], set()
    for page in pages:
        text = page.read_text(encoding="utf-8")
        shown = re.sub(r"\]\([^)]*\)", "]", re.sub(r"https?://\S+", "", CODE.sub("", text)))
        unknown = subprocess.run(["aspell", "list", "--lang=en_GB", "--encoding=utf-8"],
                                 input=shown, capture_output=True, text=True, check=True)
        for word in sorted({re.sub("'s?$", "", word) for word in unknown.stdout.split()}):
            if word in known:
                used.add(word)
            else:
                faults.append(f"{page.relative_to(root)}: {word}: a mistake, or a word for words.txt")
    return faults + [f"words.txt: {word}: no page needs it"
                     for word in known if word not in used]


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    pages = sorted((root / "docs").glob("*.md")) + [root / name for name in
                                                    ("README.md", "CHANGELOG.md", "CONTRIBUTING.md",
                                                     "SECURITY.md")]
    faults = check_links(root, pages) + check_words(root, pages)
    print("\n".join(faults) or f"{len(pages)} pages checked")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
