#!/usr/bin/env python3
"""check_sources.py CHECKOUT BUILD FOLDER: passes shader sources through glslangValidator, the Khronos reference compiler.

FOLDER has the final sources of the programs that tests have linked (HALFLIGHT_SHADER_SOURCES). Sources older than the
build are removed. Kernels of shaders/ that are still missing are made by small renders, so that the test also runs alone.
Variants of a kernel differ in the macros at their head. They are compiled until each two values that macros have together
in some variant have been compiled together. Prints errors, warnings and the number of variants by kernel.
"""
import collections
import concurrent.futures
import itertools
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77  # exit status of a test that cannot run
SOURCES = "[!.]*.*"  # a process that a test kills may leave the hidden file under which it was writing a source
BATCH = 40  # sources that one process compiles: it prepares the built-in functions once
# Commands in an order that makes every kernel, run where one of the kernels that only they make is missing. {P} is the
# program, {S} the folder of scenes, {T} that of tests.
MAKERS = [
    (["cull.comp", "trace_tiles.comp", "trace_rest.comp"], "{P} render {S}/cornell.glb a.exr --width 32 --samples 2 --culling compute"),
    (["raster_trace.frag", "reuse_gather.comp", "half_blend.comp"],
     "{P} render {S}/cornell.glb b.exr --width 32 --samples 2 --culling raster --estimator reuse=16 --denoise"),
    (["gbuffer.frag", "aov.comp"],
     "{P} render {S}/still-life.glb c.exr --width 32 --samples 2 --culling off --primary raster --keep-all --aov all"),
    (["adaptive_mean.comp", "block_errors.comp"], "{P} render {S}/cornell.glb d.exr --width 32 --samples 16 --adaptive"),
    (["temporal.comp", "radiance_cache_feed.comp", "preview_output.comp"],
     "{P} render {S}/cornell.glb e.#.exr --width 32 --samples 6 --frames 0-1 --preview cache,temporal,filter"),
    (["half_lens.comp", "debug_aov.comp", "count_batch.comp"],
     "{P} render {S}/cornell.glb f.exr --width 32 --samples 4 --denoise --fstop 1.4 --focus 0.5,0.5 --aov nodes --stats f"),
    (["neighbour_add.comp", "neighbour_light.comp"],
     "{P} render {S}/cornell.glb g.#.exr --width 32 --samples 4 --frames 0-1 --denoise"),
    (["denoiser_window.comp"],
     "{P} render {S}/cornell.glb w.exr --width 32 --samples 4 --denoise --stereo over-under"),
    (["catcher_rays.comp", "catcher_sums.comp"],
     "{P} render {S}/cornell.glb x.exr --width 32 --samples 1 --shadow-catcher mesh:floor"),
    (["specular_chain.comp"], "{P} render {S}/still-life.glb y.exr --width 32 --samples 2 --denoise"),
    (["connection.comp"], "{P} bench --scene {S}/cornell.glb --size 64x48 --turns 1 --kinds connection --methods plain"),
    (["trace_paged.comp"], "{P} pack {S}/cornell.glb h && {P} render {S}/cornell.glb h.exr --pages h --width 32 --samples 1"),
    (["page_ends.comp"], "{T}/test_pass_rays --sources=test_paging.cpp"),
    (["deform.comp"], "{T}/test_pass_picture --sources=test_deform.cpp"),
    (["nl_means.comp"], "{T}/test_pass_picture --sources=test_native_means.cpp"),
    (["radiance_cache_age.comp"], "{T}/test_pass_light --sources=test_radiance_cache.cpp"),
    (["view.frag"], "printf 'wait first\\nquit\\n' >q; xvfb-run -a {P} view {S}/cornell.glb --script q"),
]


def newest(build):
    """Returns the time of the newest program or test of a build."""
    programs = [*build.glob("halflight*"), *(build / "tests").glob("test_*")]
    return max((p.stat().st_mtime for p in programs if p.is_file()), default=0)


def compiled(sources):
    """Compiles sources of one stage. Yields each with its messages."""
    done = subprocess.run(["glslangValidator", *map(str, sources)], capture_output=True, text=True)
    by_name = {str(source): source for source in sources}
    messages = {source: [] for source in sources}
    source = sources[0]  # a single source without messages is not named
    for line in done.stdout.splitlines():
        source = by_name.get(line, source)
        if line not in by_name and line.strip():
            messages[source].append(line)
    if done.returncode not in (0, 2) or (len(sources) > 1 and not all(str(s) in done.stdout for s in sources)):
        sys.exit(f"glslangValidator ended with {done.returncode} before it had read all sources:\n{done.stdout}")
    if done.returncode and not any(messages.values()):
        messages[source].append(f"ERROR: exit status {done.returncode}")
    return messages.items()


def linked(stages):
    """Compiles and links the stages of a program, vertex stage first. Returns the last stage with the messages."""
    names = [str(s) for s in sorted(stages, key=lambda s: s.suffix, reverse=True)]
    result = subprocess.run(["glslangValidator", "-l", *names], capture_output=True, text=True)
    lines = [line for line in result.stdout.splitlines() if line.strip() and line not in names]
    if result.returncode and not any(line.startswith("ERROR") for line in lines):
        lines.append(f"ERROR: exit status {result.returncode}")
    return [(stages[0], lines)]


def with_text(line, source):
    """Adds the text of the source line that a message names."""
    place = re.match(r"\w+: \d+:(\d+):", line)
    lines = source.read_text().splitlines()
    return f"{line}\n      {lines[int(place[1]) - 1].strip()}" if place and 0 < int(place[1]) <= len(lines) else line


def kernel_of(source):
    return source.stem.rpartition("-")[0]


def macros(source):
    """Returns the macros at the head of a source, with their values."""
    head = itertools.takewhile(lambda line: line.startswith("#"), source.read_text().splitlines()[1:])
    return dict(re.match(r"#define (\S+) ?(.*)", line).groups() for line in head if line.startswith("#define "))


def covering(sources):
    """Returns those of the variants of a kernel that contain each pair of values of two macros."""
    values = {source: macros(source) for source in sources}
    names = sorted({name for known in values.values() for name in known})
    chosen, covered = [], set()
    for source in sorted(sources, key=lambda s: (-len(values[s]), s.name)):
        settings = [(name, values[source].get(name)) for name in names]
        pairs = set(itertools.combinations(settings, 2)) if len(names) > 1 else {tuple(settings)}
        if not pairs <= covered:
            chosen.append(source)
            covered |= pairs
    return chosen


def without_program(checkout, build, folder):
    """Returns the kernels of which the folder has no program, without those of a viewer that cannot run."""
    made = {kernel_of(source) for source in folder.glob(SOURCES)}
    kernels = sorted(p.name for e in ("comp", "vert", "frag") for p in (checkout / "shaders").glob(f"*.{e}"))
    if not (build / "halflight-view").exists() or not shutil.which("xvfb-run"):
        kernels.remove("view.frag")
    def is_of(name, kernel):  # kernels with a view transform are named after it
        stem = kernel.partition(".")[0]
        return re.search(rf"(^|-){re.sub('[.]', '-', kernel)}($|-)", name) or name.startswith(f"{stem}-through-")

    return [k for k in kernels if not any(is_of(name, k) for name in made)]


def make_missing(checkout, build, folder):
    places = {"P": build / "halflight", "S": checkout / "scenes", "T": build / "tests"}
    with tempfile.TemporaryDirectory() as work:
        environment = {**os.environ, "HALFLIGHT_SHADER_SOURCES": str(folder), "XDG_CACHE_HOME": work}
        for kernels, command in MAKERS:
            if not set(kernels) & set(without_program(checkout, build, folder)):
                continue
            command = command.format(**places)
            print("$", command, flush=True)
            done = subprocess.run(["bash", "-euc", command], cwd=work, env=environment, capture_output=True, text=True)
            if done.returncode:
                sys.exit(f"exit status {done.returncode}\n{done.stdout}{done.stderr}")


def main():
    checkout, build, folder = (pathlib.Path(a).resolve() for a in sys.argv[1:])
    if not shutil.which("glslangValidator"):
        print("glslangValidator is missing (Debian's glslang-tools)")
        sys.exit(SKIPPED)
    folder.mkdir(parents=True, exist_ok=True)
    since = newest(build)
    for source in folder.glob("*"):
        if source.stat().st_mtime < since:
            source.unlink()
    make_missing(checkout, build, folder)

    programs = {}
    for source in sorted(folder.glob(SOURCES)):
        programs.setdefault(source.stem, []).append(source)
    variants = {}
    for stages in programs.values():
        if len(stages) == 1:
            variants.setdefault(kernel_of(stages[0]), []).append(stages[0])
    kernels = [source for sources in variants.values() for source in covering(sources)]
    batches = [(compiled, kernels[i:i + BATCH]) for i in range(0, len(kernels), BATCH)]
    batches += [(linked, stages) for stages in programs.values() if len(stages) > 1]
    refused, warnings = 0, {}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for result in pool.map(lambda batch: batch[0](batch[1]), batches):
            for source, lines in result:
                for line in (l for l in lines if l.startswith("WARNING")):
                    warnings.setdefault(re.sub(r" \d+:\d+:", "", line), set()).add(kernel_of(source))
                errors = [line for line in lines if not line.startswith("WARNING")]
                if errors:
                    refused += 1
                    print(f"{source.name}:", *(f"    {with_text(line, source)}" for line in errors), sep="\n")
    counts = collections.Counter(kernel_of(stages[0]) for stages in programs.values())
    for kernel, count in sorted(counts.items()):
        print(f"{count:5} {kernel}")
    for line, where in warnings.items():
        print(line, "in", ", ".join(sorted(where)))
    print(f"{len(programs)} programs, {len(kernels)} of {sum(map(len, variants.values()))} kernels compiled, {refused} refused, "
          f"{len(warnings)} kinds of warnings")
    missing = without_program(checkout, build, folder)
    if missing:
        print("no program was made of", *missing)
    sys.exit(1 if refused or missing else 0)


if __name__ == "__main__":
    main()
