#!/usr/bin/env python3
"""run_commands.py CHECKOUT BUILD FILE: runs every command of the ```sh blocks of a document, and its ```python blocks.

Sizes, samples and scenes are made small first (SMALL). The commands of a document run one after the other in a folder of
their own that has scenes/ and tools/ of the checkout. `halflight view` runs under Xvfb and ends at once; it is left out
if there is none. The python blocks of a document are one program; they are left out if the module is not built.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SMALL = [
    (r"--samples [\d,]+ --adaptive", "--samples 16 --adaptive"),  # the least number
    (r"--samples [\d,]+ --denoise", lambda m: f"--samples {'2,4' if ',' in m[0] else '2'} --denoise"),
    (r"--samples [\d,]+ --keep-noisy", "--samples 2 --keep-noisy"),
    (r"--samples \d+ --(part|sample-parts) ", lambda m: f"--samples 4 --{m[1]} "),  # a sample for each part
    (r"--samples [\d,]+(?![\d,]| --adaptive| --denoise| --keep-noisy| --part| --sample-parts)", lambda m: "--samples 1,2" if "," in m[0] else "--samples 1"),
    (r"--(time|seeds|reference-samples|warm-up) \d+", lambda m: f"--{m[1]} {dict(time=1, seeds=2).get(m[1], 4)}"),
    (r"--(width|height) \d+", lambda m: f"--{m[1]} 32"),
    (r"--size \d+x\d+", "--size 64x48"),
    (r"(?<!airliner )(?<!powerplants )--triangles \d+", "--triangles 4000"),
    (r"(airliner|powerplants) --triangles \d+", lambda m: f"{m[1]} --triangles 250000"),  # about their minimum
    (r"--lights \d+", "--lights 20"),
    (r"--texture-size \d+", "--texture-size 64"),
    (r"--frames \d+-\d+", "--frames 1-3"),
    (r"\b(samples|width|height|frames)=\d+(?![^\n]*keep_noisy)", lambda m: f"{m[1]}={dict(samples=1, frames=2).get(m[1], 32)}"),
]
DEFAULTS = {  # options per command that are added unless given
    "halflight render": [("--width", "--width 32"), (r"--(samples|time|spp)|-s \d", "--samples 1")],
    "halflight converge": [("--width", "--width 16"), ("--seeds", "--seeds 2"), ("--(samples|seconds)", "--samples 1,2"),
                           ("--reference-samples", "--reference-samples 4"), ("--cache", "--cache references")],
    "halflight view": [("--script", "--script quit.txt")],
}


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.M | re.S)


def smaller(code):
    for pattern, replacement in SMALL:
        code = re.sub(pattern, replacement, code)
    return code


def commands(text):
    for block in blocks(text, "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            line = smaller(re.sub(r"\s+#.*", "", line).strip())
            for command, options in DEFAULTS.items():
                if command not in line:
                    continue
                head, mark, tail = line.partition(";") if not line.startswith("for ") else (line, "", "")
                for pattern, option in options:
                    if not re.search(pattern, head):
                        head = re.sub(rf"({command}(?: \S+)?)", rf"\1 {option}", head)
                line = head + mark + tail
            if line:
                yield line


def main():
    checkout, build, document = (pathlib.Path(a).resolve() for a in sys.argv[1:])
    text = document.read_text()
    environment = {**os.environ, "PATH": f"{build}:{os.environ['PATH']}"}
    with tempfile.TemporaryDirectory() as folder:
        environment["XDG_CACHE_HOME"] = f"{folder}/cache"
        for shared in ("scenes", "tools", "shaders"):
            os.symlink(checkout / shared, f"{folder}/{shared}")
        os.symlink(build, f"{folder}/build")
        pathlib.Path(folder, "quit.txt").write_text("wait first\nquit\n")
        count = 0
        for command in commands(text):
            print("$", command, flush=True)
            if command.startswith("halflight view"):
                if not shutil.which("xvfb-run") or not (build / "halflight-view").exists():
                    print("left out: there is no viewer or no Xvfb")
                    continue
                command = "xvfb-run --auto-servernum " + command
            status = subprocess.run(["bash", "-euc", command], cwd=folder, env=environment).returncode
            if status:
                sys.exit(f"{document.name}: exit status {status} of: {command}")
            count += 1
        programs = blocks(text, "python")
        module = next(build.rglob("halflight*.so"), None) or next(build.rglob("halflight/__init__.py"), None)
        if programs and module:
            package = module.parent.parent if module.parent.name == "halflight" else module.parent
            environment["PYTHONPATH"] = str(package)
            code = smaller("\n".join(programs))
            print(code, flush=True)
            if subprocess.run([*environment.get("HALFLIGHT_PYTHON", "python3").split(), "-c", code], cwd=folder, env=environment).returncode:
                sys.exit(f"{document.name}: its python blocks fail")
            count += 1
        print(count, "commands and programs")


if __name__ == "__main__":
    main()
