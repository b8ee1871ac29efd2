"""The libraries include downwards only, and files and functions stay short.

Usage: check_structure.py SOURCE_FOLDER. Says what is wrong and exits with 1. Files have to be laid out as .clang-format says.
"""
import re
import sys
from pathlib import Path

MOST_LINES, MOST_IN_A_FUNCTION = 400, 60

# Each library, where it lies, and what stands right below it. What is below that may be included too.
LIBRARIES = {
    "base": ("vdbfrac/base", []),
    "scene": ("vdbfrac/scene", ["base"]),
    "tetmesh": ("tetmesh", ["base"]),
    "mesher": ("tetmesh/mesher", ["tetmesh"]),
    "repair": ("tetmesh/repair", ["tetmesh"]),
    "solids": ("tetmesh/solids", ["tetmesh"]),
    "skin": ("tetmesh/skin", ["tetmesh"]),
    "grid": ("vdbfrac/grid", ["scene", "tetmesh"]),
    "solver": ("solver", ["tetmesh"]),
    "core": ("vdbfrac/core", ["grid", "solver", "mesher", "skin", "solids"]),
    "contact": ("vdbfrac/contact", ["core"]),
    "effects": ("vdbfrac/effects", ["core", "contact"]),
    "lab/machine": ("tools/lab/machine", ["base"]),
    "lab/samples": ("tools/lab/samples", ["solver"]),
    "lab/scenes": ("tools/lab/scenes", ["effects"]),
    "lab/forecast": ("tools/lab/forecast", ["lab/machine", "lab/scenes"]),
    "lab/study": ("tools/lab/study", ["lab/machine", "lab/scenes"]),
    "lab/verify": ("tools/lab/verify", ["lab/machine", "lab/samples", "lab/scenes"]),
    "lab/bench": ("tools/lab/bench", ["lab/machine", "lab/samples", "lab/scenes"]),
    "pictures": ("tools/pictures", ["tetmesh"]),
    "report": ("tools/report", ["tetmesh"]),
    "farm": ("tools/farm", ["lab/study"]),
    "cli": ("tools/cli", ["farm", "lab/bench", "lab/forecast", "lab/study", "lab/verify", "repair", "report", "pictures"]),
}
# Of the command line, tests link what reads lists of frames; all else they reach through the program.
TESTS_OF_CLI = {"tests/unit/drawn_colliders_test.cpp", "tests/unit/frame_list_test.cpp"}

LONG_FILES = {}
LONG_FUNCTIONS = {}


def below(library):
    """All that a library may include, itself too."""
    return {library}.union(*(below(b) for b in LIBRARIES[library][1]))


def library_of(file):
    """The library that a file is part of, by the longest folder; None: a test."""
    parts = [(len(folder), name) for name, (folder, _) in LIBRARIES.items() if file.startswith(folder + "/")]
    return max(parts)[1] if parts else None


def is_own(file, header):
    """A part of an effect bears the effect's name: fracture.cpp and fracture_law.cpp may include "fracture_law.h"."""
    return Path(file).stem.startswith(Path(header).stem.split("_")[0])


def include_complaints(source, file, text):
    library = library_of(file)
    for kind, name in re.findall(r'^#include ([<"])(.*)[>"]', text, re.MULTILINE):
        other = re.match(r"vdbfrac/(lab/\w+|\w+)/", name)
        if other and other[1] not in LIBRARIES:
            yield f"{file}: there is no library of <{name}>"
        elif other and library and other[1] not in below(library):
            yield f"{file}: {library} includes <{name}>, which is not below it"
        elif other and not library and other[1] == "cli" and file not in TESTS_OF_CLI:
            yield f"{file}: a test includes <{name}>"
        elif kind == '"' and library:
            path = (source / file).parent / name
            if not path.is_file() or library_of(path.resolve().relative_to(source).as_posix()) != library:
                yield f'{file}: "{name}" is not a file of {library}'
            elif library == "effects" and name != "all.h" and not is_own(file, name):
                yield f'{file}: an effect includes "{name}": effects know nothing of each other'


def functions(lines):
    """First line and length of the body of each: braces of functions stand on lines of their own."""
    for first, line in enumerate(lines):
        if line.strip() == "{":
            end = line.rstrip().replace("{", "}")
            last = next(n for n in range(first, len(lines)) if lines[n].startswith(end))
            yield first + 1, last - first - 1


def length_complaints(file, text):
    lines = text.splitlines()
    if (len(lines) > MOST_LINES) != (file in LONG_FILES):
        yield f"{file}: {len(lines)} lines, " + (f"at most {MOST_LINES}" if file not in LONG_FILES else "no exception any more")
    for first, length in functions(lines):
        if length > MOST_IN_A_FUNCTION and file not in LONG_FUNCTIONS:
            yield f"{file}:{first}: a function of {length} lines, at most {MOST_IN_A_FUNCTION}"


def names_of_base(source):
    """Of functions in headers of base."""
    names = set()
    for path in (source / "vdbfrac/base/include").rglob("*.h"):
        names |= set(re.findall(r"^[\w:]\S*(?: \S+)*? (\w+)\(", path.read_text(), re.MULTILINE))
    assert "counted" in names, "names of base are not found"
    return names


def local_name_complaints(file, text, taken):
    """Files are compiled together: a local function that is named like one of base would be called in its place by others."""
    for inner in re.findall(r"^namespace \{$(.*?)^\}  // namespace$", text, re.MULTILINE | re.DOTALL):
        for name in re.findall(r"^[\w:]\S*(?: \S+)*? (\w+)\(", inner, re.MULTILINE):
            if name in taken:
                yield f"{file}: {name}() is a name of base"


def complaints(source):
    taken = names_of_base(source)
    for top in ("vdbfrac", "tetmesh", "solver", "tools", "tests"):
        for path in sorted((source / top).rglob("*")):
            file = path.relative_to(source).as_posix()
            if path.suffix in (".h", ".cpp"):
                text = path.read_text()
                yield from include_complaints(source, file, text)
                yield from length_complaints(file, text)
                if top != "tests" and path.suffix == ".cpp" and library_of(file) != "base":
                    yield from local_name_complaints(file, text, taken)
            elif path.name == "CMakeLists.txt" and top != "tests" and re.search(r"\btests\b|\btest/", path.read_text()):
                yield f"{file}: names the folder of tests"


found = list(complaints(Path(sys.argv[1]).resolve()))
for line in found:
    print(line)
sys.exit(bool(found))
