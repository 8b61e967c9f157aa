#!/usr/bin/env python3
"""extract_pass.py CHECKOUT OUTPUT: writes what docs/adding-a-pass.md prints into a folder.

"Create `FILE`:" is followed by a block with the content of a new file, "Change `FILE`" by ```diff blocks. Each of these
replaces its lines with ` ` and `-`, which must stand exactly once in FILE, by its lines with ` ` and `+`.
"""
import pathlib
import re
import sys


def main():
    checkout, output = map(pathlib.Path, sys.argv[1:])
    page = (checkout / "docs" / "adding-a-pass.md").read_text()
    steps = re.findall(r"^(Create|Change) `([^`]+)`|^```(\w+)\n(.*?)^```$", page, re.M | re.S)
    files, action, name = {}, None, None
    for word, path, language, code in steps:
        if word:
            action, name = word, path
        elif action == "Create" and language in ("cpp", "glsl"):
            files[name], action = code, None
        elif action == "Change" and language == "diff":
            text = files.get(name) or (checkout / name).read_text()
            old = "".join(line[1:] + "\n" for line in code.splitlines() if line[0] in " -")
            new = "".join(line[1:] + "\n" for line in code.splitlines() if line[0] in " +")
            if text.count(old) != 1:
                sys.exit(f"docs/adding-a-pass.md: these lines stand {text.count(old)} times in {name}:\n{old}")
            files[name] = text.replace(old, new)
    for path, text in files.items():
        (output / path).parent.mkdir(parents=True, exist_ok=True)
        (output / path).write_text(text)


if __name__ == "__main__":
    main()
