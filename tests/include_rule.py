#!/usr/bin/env python3
"""The rules that keep the code's rooms apart.

    include_rule.py [SOURCE_DIRECTORY]

A file includes headers of its own folder and of those that its folder builds on. The constitutive laws know no mesh:
nothing of deal.II is included in material/, and in base/ only by the headers made for it. One header alone knows
deal.II's versions. No file is longer than 600 lines, and none leaves work undone in a comment.
"""

import os
import re
import sys

BUILDS_ON = {
    "base": [],
    "material": ["base"],
    "grid": ["base"],
    "points": ["base", "material", "grid"],
    "transfer": ["base", "material", "grid", "points"],
    "condition": ["base", "grid"],
    "contact": ["base", "material", "grid", "points", "transfer"],
    "solver": ["base", "material", "grid", "points", "transfer", "condition", "contact"],
    "simulation": ["base", "material", "grid", "points", "transfer", "condition", "contact", "solver"],
    "": ["base", "simulation"],  # main.cc
}
MAY_INCLUDE_DEALII_IN_BASE = ("include/peat/base/compat.h", "include/peat/base/precompiled.h")
KNOWS_VERSIONS = "include/peat/base/compat.h"
MOST_LINES = 600
UNDONE = re.compile(r"\b(TODO|FIXME|XXX)\b")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def files(root):
    """Paths from the root, '/' between names."""
    for top in ("include/peat", "source"):
        for path, _, names in sorted(os.walk(os.path.join(root, top))):
            for name in sorted(names):
                if name.endswith((".h", ".cc")):
                    yield os.path.relpath(os.path.join(path, name), root).replace(os.sep, "/")


def folder(path):
    """'grid' of include/peat/grid/cut_box.h and of source/grid/cut_box.cc; '' of source/main.cc."""
    parts = path.split("/")[:-1]
    parts = parts[2:] if parts[0] == "include" else parts[1:]
    return parts[0] if parts else ""


def wrong_include(root, path, quote, header):
    """Why the file must not include the header, or None."""
    home = folder(path)
    if quote == '"':
        is_beside = "/" not in header and os.path.exists(os.path.join(root, os.path.dirname(path), header))
        return None if is_beside else f'includes "{header}", which is not beside it; write <peat/...>'
    if header.startswith("deal.II/"):
        if home == "material" or (home == "base" and path not in MAY_INCLUDE_DEALII_IN_BASE):
            return f"includes <{header}>, but {home}/ knows nothing of deal.II"
        return None
    elif header.startswith("peat/"):
        if not os.path.exists(os.path.join(root, "include", header)):
            return f"includes <{header}>, which does not exist"
        other = header.split("/")[1]
    else:
        return None
    if other == home or other in BUILDS_ON[home]:
        return None
    allowed = ", ".join([name for name in [home] if name] + BUILDS_ON[home])
    return f"includes {header}, but {home or 'main.cc'} may use only {allowed}"


def problems(root, path):
    with open(os.path.join(root, path), encoding="utf-8") as file:
        lines = file.read().splitlines()
    if folder(path) not in BUILDS_ON:
        yield f"{path}: the folder '{folder(path)}' has no place in the include rule"
        return
    if len(lines) > MOST_LINES:
        yield f"{path}: {len(lines)} lines, more than {MOST_LINES}"
    for number, line in enumerate(lines, 1):
        include = INCLUDE.match(line)
        wrong = wrong_include(root, path, *include.groups()) if include else None
        if wrong:
            yield f"{path}:{number}: {wrong}"
        if UNDONE.search(line):
            yield f"{path}:{number}: {UNDONE.search(line).group(0)}"
        if "DEAL_II_VERSION" in line and path != KNOWS_VERSIONS:
            yield f"{path}:{number}: only {KNOWS_VERSIONS} knows deal.II's versions"


def main():
    root = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
    paths = list(files(root))
    if not paths:
        sys.exit(f"no sources below '{root}'")
    found = [problem for path in paths for problem in problems(root, path)]
    for problem in found:
        print(problem)
    print(f"{len(paths)} files, {len(found)} problems")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
