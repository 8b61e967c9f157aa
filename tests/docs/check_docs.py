#!/usr/bin/env python3
"""check_docs.py CHECKOUT: what documents refer to exists, and their lists are those of the code.

Links and anchors lead somewhere; README.md leads to every document; every picture is used, and all of them have at most
2 MB. Files and folders that are named exist; CI runs the set-up. gltf.md lists the extensions of the loader, and each
extension of materials has a scene for its picture. The drawing of the rooms is current. tools/slurm/submit knows the
settings on which memory depends. A block after "From `FILE`:" stands in FILE; "// ..." in it stands for other lines.
"""
import pathlib
import re
import subprocess
import sys

MOST_PICTURE_BYTES = 2_000_000
FOLDERS = ("api", "engine", "passes", "renderer", "scenes", "shaders", "tests", "tools")


def anchors(text):
    """Returns the anchors that GitHub makes of headings."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-") for h in headings}


def links(text):
    text = re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)
    return re.findall(r"\]\(([^)\s]+)\)", text) + re.findall(r'(?:src|href)="([^"]+)"', text)


def check(root):
    documents = [root / "README.md", *sorted(root.glob("docs/**/*.md")), root / "tools/README.md",
                 root / "scenes/README.md", root / "shaders/SHADING.md"]
    reached, pictures = set(), set()
    for document in documents:
        name = document.relative_to(root)
        text = document.read_text()
        for link in links(text):
            if "://" in link:
                continue
            path, _, anchor = link.partition("#")
            target = (document.parent / path).resolve() if path else document
            if not target.exists():
                yield f"{name}: {link} does not exist"
            elif anchor and anchor not in anchors(target.read_text()):
                yield f"{name}: {link} has no such heading"
            if document.name == "README.md" and document.parent == root:
                reached.add(target)
            if target.parent.name == "pictures":
                pictures.add(target)
        for path in re.findall(rf"(?<![\w/.-])((?:{'|'.join(FOLDERS)})/[\w./-]*\w)", text):
            if not (root / path).exists() and not re.search(r"grey\.|/[A-Z]+$", path):  # names of the tutorial
                yield f"{name}: {path} does not exist"
        for path, code in re.findall(r"^From `([^`]+)`:\n\n```\w+\n(.*?)^```$", text, re.M | re.S):
            if not all(part in (root / path).read_text() for part in re.split(r"^ *// \.\.\.\n", code, flags=re.M)):
                yield f"{name}: {path} does not have the lines that are quoted from it"
    ci = (root / ".ci/run").read_text()
    for block in re.findall(r"^```console\n(.*?)^```$", (root / "README.md").read_text(), re.M | re.S):
        for line in block.splitlines():
            if not re.search(rf"^{line.split()[0]}\b", ci, re.M):
                yield f"README.md: CI does not run {line.split()[0]}"
    for document in sorted(root.glob("docs/*.md")):
        if document not in reached:
            yield f"README.md does not lead to {document.relative_to(root)}"
    made = {p for p in (root / "docs/pictures").iterdir() if p.suffix != ".md"}
    for picture in sorted(made - pictures):
        yield f"{picture.relative_to(root)}: no document shows it"
    if (size := sum(p.stat().st_size for p in made)) > MOST_PICTURE_BYTES:
        yield f"docs/pictures: {size} bytes, {MOST_PICTURE_BYTES} allowed"

    loader = [*root.glob("engine/io/gltf/*.cpp"), *root.glob("engine/scene/material_*.cpp")]
    known = {e for file in loader for e in re.findall(r"\b(?:KHR|EXT|HALFLIGHT)_[a-z]\w+", file.read_text())}
    listed = set(re.findall(r"^\| `([A-Z]+_\w+)` \|", (root / "docs/gltf.md").read_text(), re.M))
    if not known or known != listed:
        yield f"docs/gltf.md and engine/io/gltf differ in extensions: {sorted(known ^ listed)}"
    settings = re.findall(r"^\| `([\w-]+)` \|.*\| [\w, ]*\bmemory \|", (root / "docs/settings.md").read_text(), re.M)
    cases = re.search(r"case \$\{arguments\[i\]\} in.*?esac", (root / "tools/slurm/submit").read_text(), re.S)[0]
    listed = set(re.findall(r"--([\w-]+)", cases))
    known_to_info = re.search(r"memory_options\(\) \{.*?\n\}", (root / "tools/halflight/arguments.cpp").read_text(), re.S)[0]
    known_to_info = {*settings, *re.findall(r'"--([\w-]+)"', known_to_info), "allow-outside"}
    for setting in settings or ["of memory"]:
        if setting not in listed:
            yield f"tools/slurm/submit does not know --{setting}, on which memory depends"
    for option in sorted(listed - known_to_info):
        yield f"tools/slurm/submit passes --{option} to halflight info, which does not know it"
    scenes = subprocess.run([root / "tools/figures/extension-scenes", "--list"], capture_output=True, text=True).stdout.split()
    for extension in sorted({e for e in known if "_materials_" in e} - set(scenes)):
        yield f"tools/figures/extension-scenes has no scene of {extension}"
    if subprocess.run([root / "tools/figures/docs-architecture", "--check"]).returncode:
        yield "docs/pictures/architecture.svg is not current"


def main():
    errors = list(check(pathlib.Path(sys.argv[1]).resolve()))
    print("\n".join(errors) or "documents are consistent")
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()
