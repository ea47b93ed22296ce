#!/usr/bin/env python3
"""Counts the tuning constants and the lines of the rooms that decide the geometry.

  count_constants.py [--list] [ROOM...]

A tuning constant is a setting (settings.py), or a field of a struct ...Options, ...Limits or ...Rules
whose default is a number other than 0, which stands for "off" or "not set". Numbers within expressions
are counted beside them ("literals"), but for those that mean nothing by themselves (TRIVIAL), so that a
constant does not vanish from the count by losing its name.
"""
import argparse
import re
import sys

import settings

TRIVIAL = {0.0, 1.0, 2.0, 3.0, 4.0, 0.5, 0.25, 6.0, 8.0, 180.0}
NUMBER = r"(?<![\w.])(?:0x[0-9a-fA-F']+|(?:\d[\d']*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)[fFuUlL]*(?![\w.])"


def option_fields(code):
    found = []
    for struct in re.finditer(r"struct (\w+(?:Options|Limits|Rules)) \{(.*?)\n\};", code, re.S):
        for field in re.finditer(r"\b(?:double|float|u?int(?:\d+_t)?|size_t)\s+(\w+ = [^;]+);", struct[2]):
            for part in settings.split_declarators(field[1]):
                name, _, default = part.partition("=")
                if value_of(default) != 0:
                    found.append((f"{struct[1]}::{name.strip()}", default.strip()))
    return found


def value_of(literal):
    try:
        return float(literal.strip().replace("'", "").rstrip("fFuUlL"))
    except ValueError:
        return None


def count(room):
    constants, literals, lines = [], 0, 0
    for path in settings.sources([room]):
        text = path.read_text()
        lines += text.count("\n")
        if path.name == "settings.h":
            constants += [(path, s.name, s.value) for s in settings.settings_of(path)]
            continue
        code = settings.without_comments(text)
        constants += [(path, name, value) for name, value in option_fields(code)]
        rest = settings.DECLARATION.sub("", re.sub(r"#include[^\n]*", "", code))
        for match in re.finditer(NUMBER, rest):
            value = value_of(match[0])
            if value is not None and value not in TRIVIAL and re.search(r"[.eE]", match[0]):
                literals += 1
    return constants, literals, lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--list", action="store_true", help="print every constant")
    parser.add_argument("rooms", nargs="*", default=settings.ROOMS)
    arguments = parser.parse_args()
    total = [0, 0, 0]
    print(f"{'room':14}{'constants':>10}{'literals':>10}{'lines':>8}{'per 1000':>10}")
    for room in arguments.rooms:
        constants, literals, lines = count(room)
        if not lines:
            sys.exit(f"core/{room} holds no source")
        if arguments.list:
            for path, name, value in constants:
                print(f"  {path.relative_to(settings.ROOT)}: {name} = {value[:60]}")
        for i, figure in enumerate((len(constants), literals, lines)):
            total[i] += figure
        print(f"{room:14}{len(constants):10}{literals:10}{lines:8}{1000 * len(constants) / lines:10.1f}")
    print(f"{'all':14}{total[0]:10}{total[1]:10}{total[2]:8}{1000 * total[0] / total[2]:10.1f}")


if __name__ == "__main__":
    main()
