#!/usr/bin/env python3
"""Reads the settings of the stages that decide the geometry: the structs of their settings.h.

  settings.py check             exit code 1 if a numeric constant stands elsewhere in these rooms, or
                                a setting has no word of explanation
  settings.py table FILE.cc     C++ that changes settings by name, for builds with RILIEVO_ABLATION
  settings.py list              name, value, file

A setting is a field of a struct ...Settings with a default; `RILIEVO_SETTINGS ...Settings kName;`
after it is what the stage reads.
"""
import pathlib
import re
import sys
from typing import NamedTuple

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROOMS = ["points", "scan", "control", "displacement", "domain", "pipeline"]
STRUCT = re.compile(
    r"^struct (?P<name>\w+Settings) \{\n(?P<body>.*?)^\};\nRILIEVO_SETTINGS (?P=name) (?P<instance>k\w+);",
    re.S | re.M)
FIELD = re.compile(r"(?P<fixed>static constexpr )?(?P<type>[\w:]+(?:<[^;=]*>)?) (?P<fields>\w+ = [^;]*);")
NUMBERS = {"double", "float", "int", "int64_t", "size_t"}
# What no measurement could choose: sizes of tasks and blocks that change no result, bits, lanes and
# offsets of data structures, tables of a cell, marks for nothing, factors of a formula, and bounds of
# formats.
STRUCTURE = re.compile(
    r"k(None|NoNode|Neither|GivenMesh|Far|Infinity|One|Half|Cells|Rows|Size|Places|PlaceStride|Block"
    r"|QuadricTerms|EntriesOfFar|HashBytes|FilesOfParts|Cell(EdgeCorners|Faces)|Plate"
    r"|.*(PerTask|AtOnce|Bits|Lanes|Mask|Offset"
    r"|ColumnStride|RowStride|OfBlock|MostParts))$")
DECLARATION = re.compile(r"\bconst(?:expr)?\s+(?:[\w:]+(?:<[^;=]*?>)?)\s+(?P<rest>k[A-Z]\w*[^;]*);")


class Setting(NamedTuple):
    name: str  # file.field: find_foliage.own_sheet
    place: str  # in C++: kFindFoliage.own_sheet
    type: str
    value: str
    explained: bool
    fixed: bool  # the size of an array
    path: pathlib.Path


def snake(name):
    return re.sub(r"(?<!^)([A-Z])", r"_\1", name).lower()


def split_declarators(text):
    """The parts between the commas that stand in no brackets."""
    parts, depth, start = [], 0, 0
    for i, letter in enumerate(text):
        depth += (letter in "([{<") - (letter in ")]}>")
        if letter == "," and depth == 0:
            parts.append(text[start:i])
            start = i + 1
    return parts + [text[start:]]


def without_comments(text):
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    text = re.sub(r'"(?:\\.|[^"\\])*"', '""', text)
    return re.sub(r"//[^\n]*", "", text)


def sources(rooms=None):
    for room in rooms or ROOMS:
        for path in sorted((ROOT / "core" / room).rglob("*")):
            if path.suffix in (".h", ".cc"):
                yield path


def settings_of(path):
    found = []
    for struct in STRUCT.finditer(path.read_text()):
        comment = False  # above the line, with no other field between
        statement = ""
        for line in struct["body"].split("\n"):
            code, _, words = line.partition("//")
            if not code.strip():
                comment = bool(words.strip())
                continue
            statement += code
            explained = comment or bool(words.strip())
            if ";" not in code:
                continue
            field = FIELD.search(statement)
            statement = ""
            comment = False
            for part in split_declarators(field["fields"]) if field else []:
                name, _, value = (word.strip() for word in part.partition("="))
                found.append(Setting(f"{snake(struct['instance'][1:])}.{name}",
                                     f"{struct['instance']}.{name}", field["type"],
                                     " ".join(value.split()), explained, bool(field["fixed"]), path))
    return found


def all_settings(rooms=None):
    return [s for path in sources(rooms) if path.name == "settings.h" for s in settings_of(path)]


def stray_constants():
    """(path, name) of each number somebody chose that is a constant outside settings.h."""
    for path in sources():
        if path.name == "settings.h":
            continue
        code = without_comments(path.read_text())
        for declaration in DECLARATION.finditer(code):
            for part in split_declarators(declaration["rest"]):
                match = re.match(r"\s*(k\w+)\s*(?:\[[^\]]*\])*\s*=?\s*(.*)", part, re.S)
                # A number of its own, but for those that stand in a formula.
                if match and re.search(r"(?<![\w.])(\d|\.\d)", match[2]) and not STRUCTURE.match(match[1]):
                    yield path.relative_to(ROOT), match[1]


def check():
    wrong = [f"{path}: {name} belongs into the settings.h beside it" for path, name in stray_constants()]
    seen = {}
    for setting in all_settings():
        if not setting.explained:
            wrong.append(f"{setting.path.relative_to(ROOT)}: {setting.name} has no word of explanation")
        if seen.setdefault(setting.name, setting.path) != setting.path:
            wrong.append(f"{setting.name} stands in {seen[setting.name]} and in {setting.path}")
    for path in sources():
        structs = re.findall(r"^struct (\w+Settings) ", path.read_text(), re.M)
        known = {match["name"] for match in STRUCT.finditer(path.read_text())}
        wrong += [f"{path.relative_to(ROOT)}: {name} has no RILIEVO_SETTINGS after it, or is not in settings.h"
                  for name in structs if name not in known or path.name != "settings.h"]
    return wrong


def table(path):
    settings = [s for s in all_settings() if s.type in NUMBERS and not s.fixed]
    lines = ["// Made by tests/accuracy/settings.py.", '#include "tests/accuracy/settings_by_name.h"']
    lines += [f'#include "{header}"' for header in
              sorted({str(s.path.relative_to(ROOT)) for s in settings})]
    lines += ["namespace rilievo {", "std::vector<NamedSetting> AllSettings() {", "  return {"]
    for s in settings:
        whole = "false" if s.type in ("double", "float") else "true"
        lines.append(f'      {{"{s.name}", {whole}, [] {{ return static_cast<double>({s.place}); }}, '
                     f"[](double value) {{ {s.place} = static_cast<{s.type}>(value); }}}},")
    lines += ["  };", "}", "}  // namespace rilievo", ""]
    text = "\n".join(lines)
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def main():
    if sys.argv[1:] == ["check"]:
        wrong = check()
        print("\n".join(wrong) if wrong else f"{len(all_settings())} settings")
        sys.exit(1 if wrong else 0)
    if sys.argv[1:] == ["list"]:
        for setting in all_settings():
            print(setting.name, setting.value, setting.path.relative_to(ROOT))
    elif len(sys.argv) == 3 and sys.argv[1] == "table":
        table(pathlib.Path(sys.argv[2]))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
