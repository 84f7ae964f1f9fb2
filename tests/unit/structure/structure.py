"""What design.md and style.md ask of the tree, read from the tree itself. Each check returns one line a fault.

A tree is a dict from path (relative to the root, '/' between) to text; Read() makes it from a folder.
"""
import pathlib
import re

SOURCE_FOLDERS = ("core", "proto", "server", "worker", "client", "tests")

# Folder (longest match wins) -> folders whose headers it may include.
ALLOWED_FOLDERS = {
    "core": ("core",),
    "proto": ("core", "proto"),
    "server": ("core", "proto", "server"),
    "worker": ("core", "proto", "worker"),
    "client": ("core", "proto", "client"),
    "client/local": ("core", "proto", "client", "server", "worker"),
    "tests": SOURCE_FOLDERS,
}

# One folder per outside library: how its headers begin -> where they may be included. Tests may include all.
ALLOWED_LIBRARIES = {
    r"absl/": SOURCE_FOLDERS,
    r"embree\d/": ("worker/trace",),
    r"tbb/|oneapi/": ("worker", "server", "client/local"),  # threads, as the standard library's
    r"OpenMesh/": ("server/chart",),
    r"Eigen/": ("server/chart", "worker/finish"),  # linear algebra
    r"sqlite3|SQLiteCpp/": ("server/store",),
    r"httplib": ("server/http",),
    r"grpc": ("proto/rpc", "server/rpc", "worker/rpc", "client/rpc", "client/local"),
    r"google/protobuf/": ("proto",),
    r"tiny_gltf|stb_": ("client/gltf",),
    r"nlohmann/": ("core/artifact", "client/gltf", "client/local"),
    r"CLI/": ("client/cli", "client/local", "server/cli", "worker/cli"),
    r"spdlog/": ("server/cli", "worker/cli"),
    r"Imf|Imath|OpenEXR/|Iex": ("core/image",),
    r"png\.h": ("core/image",),
    r"openssl/": ("core/base",),
    r"zstd": ("core/codec",),
}

# The standard library has no dot; these are the C library and the operating system.
SYSTEM_HEADER = re.compile(r"[a-z_]+|(sys|netinet|arpa|linux)/\w+\.h|(unistd|fcntl|signal|pthread|dirent|poll|\w+intrin|"
                           r"cpuid|time|errno|stdio|stdlib|string|math|stdint)\.h")
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)', re.MULTILINE)
GENERATED = re.compile(r"server/http/dashboard\.inc|server/store/migrations\.inc")
FORBIDDEN_NAMES = {"common", "misc", "helpers", "utils", "util", "manager"}
LONGEST_SOURCE, LONGEST_HEADER = 450, 150


def Read(root):
    tree = {}
    for folder in SOURCE_FOLDERS:
        for path in sorted((pathlib.Path(root) / folder).rglob("*")):
            if path.suffix in (".cpp", ".h", ".py", ".proto") or path.name == "CMakeLists.txt":
                tree[path.relative_to(root).as_posix()] = path.read_text(encoding="utf-8", errors="replace")
    return tree


def IsSource(path):
    return path.endswith((".cpp", ".h"))


def LongestMatch(path, table):
    matches = [folder for folder in table if path.startswith(folder + "/")]
    return max(matches, key=len) if matches else None


def IsInside(path, folders):
    return any(path.startswith(folder + "/") for folder in folders)


def Includes(tree):
    """(file, quoted header or None, bracketed header or None) for each #include line of each source."""
    for path, text in tree.items():
        if IsSource(path):
            for quoted, bracketed in INCLUDE.findall(text):
                yield path, quoted or None, bracketed or None


def FolderFaults(tree):
    """Quoted includes are paths from the root, of files that are there (or generated), in folders that design.md allows."""
    faults = []
    for path, quoted, _ in Includes(tree):
        if quoted is None:
            continue
        allowed = ALLOWED_FOLDERS[LongestMatch(path, ALLOWED_FOLDERS)]
        generated = GENERATED.fullmatch(quoted) or (re.fullmatch(r"proto/.*\.pb\.h", quoted) and
                                                   re.sub(r"(\.grpc)?\.pb\.h$", ".proto", quoted) in tree)
        if quoted not in tree and not generated:
            faults.append(f'{path} includes "{quoted}", which is no file of the tree (paths start at the root)')
        elif not IsInside(quoted, allowed):
            faults.append(f'{path} includes "{quoted}"; design.md lets it include {", ".join(allowed)} only')
    return faults


def LibraryFaults(tree):
    """Bracketed includes are of the system, or of an outside library in the one folder that is its own."""
    faults = []
    for path, _, header in Includes(tree):
        if header is None or path.startswith("tests/") or SYSTEM_HEADER.fullmatch(header):
            continue
        folders = next((f for pattern, f in ALLOWED_LIBRARIES.items() if re.match(pattern, header)), None)
        if folders is None:
            faults.append(f"{path} includes <{header}>, a library that tests/unit/structure/structure.py does not know")
        elif not IsInside(path, folders):
            faults.append(f'{path} includes <{header}>, which belongs in {", ".join(folders)} only')
    return faults


def NearestList(path, tree):
    """The folder of the CMakeLists.txt that has to name `path`: its own folder's, or else the next one above."""
    folder = path.rpartition("/")[0]
    while "/" in folder and f"{folder}/CMakeLists.txt" not in tree:
        folder = folder.rpartition("/")[0]
    return folder


def RegistrationFaults(tree):
    """Every .cpp and every *_test.py is named, relative to it, in the nearest CMakeLists.txt."""
    faults = []
    for path in tree:
        if not path.endswith((".cpp", "_test.py")):
            continue
        folder = NearestList(path, tree)
        name = path[len(folder) + 1:]
        listed = re.sub(r"#.*", "", tree.get(f"{folder}/CMakeLists.txt", ""))
        if not re.search(rf"(?<![\w./-]){re.escape(name)}(?![\w.])", listed):
            faults.append(f"{path} is not listed in {folder}/CMakeLists.txt: nothing builds or runs it")
    return faults


def SubdirectoryFaults(tree):
    """Every folder with a CMakeLists.txt is added by its parent's."""
    faults = []
    for path in tree:
        folder, _, name = path.rpartition("/")
        parent, _, child = folder.rpartition("/")
        if name == "CMakeLists.txt" and parent:
            if not re.search(rf"\b{re.escape(child)}\b", re.sub(r"#.*", "", tree.get(f"{parent}/CMakeLists.txt", ""))):
                faults.append(f"{path} is not added by {parent}/CMakeLists.txt")
    return faults


def NameFaults(tree):
    faults = []
    for path in tree:
        words = [pathlib.PurePosixPath(part).stem for part in path.split("/")]
        faults += [f"{path}: nothing is called {word} (style.md 5)" for word in words if word in FORBIDDEN_NAMES]
    return faults


def LengthFaults(tree):
    faults = []
    for path, text in tree.items():
        limit = LONGEST_HEADER if path.endswith(".h") else LONGEST_SOURCE
        lines = text.count("\n")
        if IsSource(path) and lines > limit:
            faults.append(f"{path} has {lines} lines; the limit is {limit} (style.md 11)")
    return faults
