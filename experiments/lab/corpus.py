"""Corpora of mesh files that are published in Debian packages.

A corpus is a table of tab-separated values in experiments/data, one file per line: package, version, path,
sha256, format, bytes, licence, and what is computed of it: class, tags, triangles, and order, a stratified
random permutation (set_order()). A path has the form ARCHIVE!MEMBER if the file is inside an archive of the
package. Nothing is installed: packages are downloaded with apt, and the required files are unpacked into the
cache.
"""

import collections
import csv
import dataclasses
import hashlib
import io
import json
import math
import os
import pathlib
import posixpath
import random
import subprocess
import tarfile
import tempfile
import zipfile

from .rows import LabError


OPERATIONS = ("union", "intersection", "difference")
SIZES = {1_000: "below 1,000 triangles", 10_000: "below 10,000", 100_000: "below 100,000", math.inf: "larger"}


@dataclasses.dataclass
class Entry:
    package: str
    version: str
    path: str
    sha256: str
    format: str
    bytes: int
    licence: str
    kind: str = ""  # column "class"
    tags: str = ""
    triangles: int = 0
    order: int = 0  # from 1; 0: not computed

    @property
    def name(self):
        return posixpath.basename(self.path.split("!")[-1])


class Pair:
    """Two entries and a Boolean operation: what a row of the task combine is about."""

    def __init__(self, first, second, operation, seed):
        self.first, self.second, self.operation = first, second, operation
        self.key = hashlib.sha256(f"{seed} {first.sha256} {second.sha256}".encode()).hexdigest()
        self.sha256 = hashlib.sha256(f"{self.key} {operation}".encode()).hexdigest()
        self.package, self.path = f"{first.package}, {second.package}", f"{first.path}, {second.path}"
        self.name = f"{operation} of {first.name} and {second.name}"


def read_corpus(path):
    """Returns the entries of a corpus."""
    with open(path, newline="") as file:
        rows = [{"kind" if key == "class" else key: value for key, value in row.items()}
                for row in csv.DictReader(file, delimiter="\t")]
    numbers = ("bytes", "triangles", "order")
    return [Entry(**{key: int(value or 0) if key in numbers else value for key, value in row.items()})
            for row in rows]


def write_corpus(path, entries):
    """Replaces a corpus by these entries."""
    names = [field.name for field in dataclasses.fields(Entry)]
    partial = pathlib.Path(path).with_suffix(".partial")
    with open(partial, "w", newline="") as file:
        out = csv.writer(file, delimiter="\t", lineterminator="\n")
        out.writerow(["class" if name == "kind" else name for name in names])
        out.writerows([getattr(entry, name) for name in names] for entry in entries)
    partial.rename(path)


def size_group(triangles):
    """Returns the name of the group of models of this size."""
    return next(name for limit, name in SIZES.items() if triangles < limit)


def set_order(entries, seed):
    """Numbers the entries from 1, such that the first n contain each stratum in proportion, for any n.

    Strata are classes of one group of size. Within a stratum, the order is that of the SHA-256 of the seed
    and the file's hash; entry k of a stratum of m gets the position (k + u) / m with a random u of the
    stratum.
    """
    strata = collections.defaultdict(list)
    for entry in entries:
        strata[entry.kind, size_group(entry.triangles)].append(entry)

    def key(text):
        return hashlib.sha256(f"{seed} {text}".encode()).hexdigest()

    positions = []
    for name, own in strata.items():
        offset = int(key(" ".join(name))[:8], 16) / 2**32
        ranked = sorted(own, key=lambda e: key(e.sha256))
        positions += [((rank + offset) / len(own), e.sha256, e) for rank, e in enumerate(ranked)]
    for number, (*_, entry) in enumerate(sorted(positions, key=lambda position: position[:2]), 1):
        entry.order = number


def listed(entries, count, seed=None):
    """Returns the first entries of the corpus by the column `order`; all of them if `count` is "all"."""
    if any(not entry.order for entry in entries):
        raise LabError("the corpus has no column order; hermesh benchmark --classify CORPUS computes it")
    return sorted(entries, key=lambda e: e.order)[:None if count == "all" else count]


def sample(entries, count, seed):
    """Returns a random sample of the entries, in the order of the corpus; all of them if `count` is "all"."""
    if count == "all" or count >= len(entries):
        return entries
    chosen = set(random.Random(seed).sample(sorted(e.sha256 for e in entries), count))
    return [e for e in entries if e.sha256 in chosen]


def single_meshes(entries):
    """Returns the entries of formats without scenes."""
    return [e for e in entries if e.format.removesuffix(".gz") in ("obj", "off", "ply", "stl")]


def pairs(entries, count, seed):
    """Returns random pairs of single meshes, each with all operations."""
    known = sorted(single_meshes(entries), key=lambda e: e.sha256)
    if len(known) < 2 or count == "all":
        raise LabError("the task combine requires a number of pairs, and two models in OBJ, OFF, PLY or STL")
    draw, chosen = random.Random(seed), {}
    while len(chosen) < min(count, len(known) * (len(known) - 1)):
        first, second = draw.sample(known, 2)
        chosen[first.sha256, second.sha256] = first, second
    return [Pair(*pair, operation, seed) for pair in chosen.values() for operation in OPERATIONS]


def cache_root():
    """Returns the directory that holds everything downloaded."""
    return pathlib.Path(os.environ.get("HERMESH_CACHE") or os.path.join(
        os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "hermesh"))


def cache_directory():
    return cache_root() / "corpus"


def location(entry, cache):
    """Returns where an entry is, or will be, in the cache. The directory also holds the buffers that it
    refers to.
    """
    return cache / entry.sha256[:16] / entry.name


def fetch(entries, cache, say):
    """Downloads and unpacks the entries that are not in the cache yet; `say` is called with progress
    messages.

    Raises LabError if a package cannot be downloaded, or a file differs from the corpus.
    """
    missing = [e for e in entries if not location(e, cache).exists()]
    sizes = {package: _package_bytes(package) / 2**20 for package in sorted({e.package for e in missing})}
    if sizes:
        say(f"{len(missing)} models are in {len(sizes)} packages: {sum(sizes.values()):.0f} MiB to download")
    for package, size in sizes.items():
        say(f"downloading {package}, {size:.0f} MiB")
        wanted = [e for e in missing if e.package == package]
        with tempfile.TemporaryDirectory() as work:
            _unpack(_download(package, work), wanted, cache, work)


def _package_bytes(package):
    try:
        shown = subprocess.run(["apt-cache", "show", "--no-all-versions", package],
                               capture_output=True, text=True)
    except FileNotFoundError:
        raise LabError(f"apt is required to download the package {package}") from None
    return next((int(line.split()[1]) for line in shown.stdout.splitlines() if line.startswith("Size:")), 0)


def _download(package, work):
    try:
        got = subprocess.run(["apt-get", "download", package], cwd=work, capture_output=True, text=True)
    except FileNotFoundError:
        raise LabError(f"apt is required to download the package {package}") from None
    found = sorted(pathlib.Path(work).glob("*.deb"))
    if got.returncode or not found:
        reason = got.stderr.strip() or "no package"
        raise LabError(f"{package}: apt-get download failed: {reason}; try apt-get update")
    return found[0]


class _Package:
    """The files of a package, by path."""

    def __init__(self, deb, work):
        data = os.path.join(work, "data.tar")
        with open(data, "wb") as out:
            subprocess.run(["dpkg-deb", "--fsys-tarfile", deb], stdout=out, check=True)
        self._tar = tarfile.open(data)
        self._archives = {}

    def read(self, path):
        outer, _, inner = path.partition("!")
        if not inner:
            return self._tar.extractfile(f"./{outer}").read()
        if outer not in self._archives:
            content = io.BytesIO(self.read(outer))
            is_zip = zipfile.is_zipfile(content)
            content.seek(0)
            self._archives[outer] = zipfile.ZipFile(content) if is_zip else tarfile.open(fileobj=content)
        archive = self._archives[outer]
        is_zip = isinstance(archive, zipfile.ZipFile)
        return archive.read(inner) if is_zip else archive.extractfile(inner).read()


def _unpack(deb, entries, cache, work):
    package = _Package(deb, work)
    for entry in entries:
        try:
            content = package.read(entry.path)
        except (KeyError, AttributeError):
            raise LabError(f"{deb.name} has no file {entry.path}") from None
        if hashlib.sha256(content).hexdigest() != entry.sha256:
            raise LabError(f"{deb.name}: the SHA-256 of {entry.path} differs from that of version "
                           f"{entry.version}, which the corpus names")
        target = location(entry, cache)
        target.parent.mkdir(parents=True, exist_ok=True)
        if entry.format == "gltf":
            _unpack_buffers(package, entry.path, content, target.parent)
        # The name appears when the file and its buffers are complete.
        partial = target.with_suffix(".partial")
        partial.write_bytes(content)
        partial.rename(target)


def _unpack_buffers(package, path, content, directory):
    try:
        buffers = json.loads(content).get("buffers", [])
    except (ValueError, AttributeError):
        return
    for buffer in buffers:
        uri = buffer.get("uri", "") if isinstance(buffer, dict) else ""
        if not uri or uri.startswith("data:") or posixpath.isabs(uri) or ".." in uri.split("/"):
            continue
        try:
            found = package.read(posixpath.join(posixpath.dirname(path), uri))
        except (KeyError, AttributeError):
            continue  # Files with missing buffers belong to the corpus as they are.
        (directory / uri).parent.mkdir(parents=True, exist_ok=True)
        (directory / uri).write_bytes(found)
