#!/usr/bin/env python3
"""Counts the tuning constants and the lines of the rooms that decide the geometry.

  count_constants.py [--list] [ROOM...]

A tuning constant is
- a `constexpr` number, table of numbers or struct of numbers: one for each name that is declared. Left
  out are block sizes of threads, bits and lanes of data structures, infinities and indices of nothing
  (EXEMPT), and constants that are made of others alone;
- a field of a struct ...Options, ...Settings, ...Limits or ...Rules whose default is a number other
  than 0, which stands for "off" or "not set".
Numbers within expressions are counted beside them ("literals"), but for those that mean nothing by
themselves (TRIVIAL), so that a constant does not vanish from the count by losing its name.
"""
import argparse
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROOMS = ["points", "scan", "control", "displacement", "domain", "pipeline"]
EXEMPT = re.compile(r"k(None|NoNode|Missing|.*(Block|PerTask|AtOnce|Bits|Lanes|Width|Offset|Stride))$"
                    r"|k(Block|Axis|Rows|Edges|Faces).*(PerTask|Block|Bits|Offset)")
TRIVIAL = {0.0, 1.0, 2.0, 3.0, 4.0, 0.5, 0.25, 6.0, 8.0, 180.0}
NUMBER = r"(?<![\w.])(?:0x[0-9a-fA-F']+|(?:\d[\d']*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)[fFuUlL]*(?![\w.])"
TYPE = r"(?:double|float|int|int64_t|uint64_t|uint32_t|size_t|uint8_t)"


def without_comments(text):
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    text = re.sub(r'"(?:\\.|[^"\\])*"', '""', text)
    return re.sub(r"//[^\n]*", "", text)


def declarations(code):
    """(name, value) of every constexpr that is declared, and the code without these."""
    found = []

    def take(match):
        for part in split_declarators(match["rest"]):
            name = re.match(r"\s*(k\w+)\s*(?:\[[^\]]*\])*\s*(?:=\s*)?(.*)", part, re.S)
            if name:
                found.append((name[1], name[2]))
        return ""

    rest = re.sub(
        r"(?:static\s+|inline\s+)*constexpr\s+(?!char\b)(?:[\w:]+(?:<[^;=]*?>)?)\s+(?P<rest>k\w+[^;]*);",
        take, code)
    return found, rest


def split_declarators(text):
    parts, depth, start = [], 0, 0
    for i, letter in enumerate(text):
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0:
            parts.append(text[start:i])
            start = i + 1
    return parts + [text[start:]]


def settings_fields(code):
    found = []
    for struct in re.finditer(r"struct (\w+(?:Options|Settings|Limits|Rules)) \{(.*?)\n\};", code, re.S):
        for field in re.finditer(rf"\b{TYPE}\s+([\w ,=.+\-*/()']+?);", struct[2]):
            for part in field[1].split(","):
                default = re.match(r"\s*(\w+)\s*=\s*(.+)", part)
                if default and value_of(default[2]) != 0:
                    found.append((f"{struct[1]}::{default[1]}", default[2]))
    return found


def value_of(literal):
    try:
        return float(literal.strip().replace("'", "").rstrip("fFuUlL"))
    except ValueError:
        return None


def count(room):
    constants, literals, lines = [], 0, 0
    for path in sorted((ROOT / "core" / room).rglob("*")):
        if path.suffix not in (".h", ".cc"):
            continue
        text = path.read_text()
        lines += text.count("\n")
        code = without_comments(text)
        declared, rest = declarations(code)
        named = [(n, v) for n, v in declared if not EXEMPT.match(n) and re.search(NUMBER, v)]
        for name, value in named + settings_fields(code):
            constants.append((path.relative_to(ROOT), name, " ".join(value.split())))
        for match in re.finditer(NUMBER, re.sub(r"#include[^\n]*", "", rest)):
            value = value_of(match[0])
            if value is not None and value not in TRIVIAL and re.search(r"[.eE]", match[0]):
                literals += 1
    return constants, literals, lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--list", action="store_true", help="print every constant")
    parser.add_argument("rooms", nargs="*", default=ROOMS)
    arguments = parser.parse_args()
    total = [0, 0, 0]
    print(f"{'room':14}{'constants':>10}{'literals':>10}{'lines':>8}{'per 1000':>10}")
    for room in arguments.rooms:
        constants, literals, lines = count(room)
        if not lines:
            sys.exit(f"core/{room} holds no source")
        if arguments.list:
            for path, name, value in constants:
                print(f"  {path}: {name} = {value[:60]}")
        for i, figure in enumerate((len(constants), literals, lines)):
            total[i] += figure
        print(f"{room:14}{len(constants):10}{literals:10}{lines:8}{1000 * len(constants) / lines:10.1f}")
    print(f"{'all':14}{total[0]:10}{total[1]:10}{total[2]:8}{1000 * total[0] / total[2]:10.1f}")


if __name__ == "__main__":
    main()
