import pathlib
import tempfile
import unittest

from .. import release
from ..rows import LabError, ROOT


class Release(unittest.TestCase):
    """Copies the files that state a version, and changes one at a time."""

    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.root = pathlib.Path(directory.name)
        for file in ["CMakeLists.txt", *(stated[0] for stated in release.STATED), *release.REQUIRED]:
            (self.root / file).parent.mkdir(parents=True, exist_ok=True)
            (self.root / file).write_text((ROOT / file).read_text(encoding="utf-8"), encoding="utf-8")

    def change(self, file, before, after):
        text = (self.root / file).read_text(encoding="utf-8")
        self.assertIn(before, text)
        (self.root / file).write_text(text.replace(before, after, 1), encoding="utf-8")

    def test_the_files_of_the_project_agree(self):
        # Between releases there are undated changes.
        for root in (ROOT, self.root):
            problems = [problem for problem in release.problems(root) if "Unreleased" not in problem]
            self.assertEqual(problems, [])

    def test_each_file_with_another_version_or_date_is_named(self):
        version = release.version_of(ROOT)
        for file, _, of_date in release.STATED:
            with self.subTest(file=file):
                self.setUp()
                self.change(file, version if file != "CHANGELOG.md" else f"## {version},",
                            "7.8.9" if file != "CHANGELOG.md" else "## 7.8.9,")
                self.assertTrue(any(problem.startswith(f"{file} has version 7.8.9")
                                    for problem in release.problems(self.root)), release.problems(self.root))
        self.setUp()
        self.change("codemeta.json", '"dateModified": "2', '"dateModified": "1')
        self.assertIn("dates", release.problems(self.root)[0])

    def test_the_version_of_cmake_is_compared_with_all(self):
        self.change("CMakeLists.txt", f"VERSION {release.version_of(ROOT)}", "VERSION 7.8.9")
        named = {problem.split()[0] for problem in release.problems(self.root)}
        self.assertEqual(named, {stated[0] for stated in release.STATED})
        self.change("CMakeLists.txt", "VERSION 7.8.9", "")
        with self.assertRaises(LabError):
            release.problems(self.root)

    def test_missing_files_and_undated_changes(self):
        (self.root / "SECURITY.md").unlink()
        self.change("CHANGELOG.md", "## ", "## Unreleased\n- A change.\n\n## ")
        found = release.problems(self.root)
        self.assertTrue(any("SECURITY.md" in problem for problem in found), found)
        self.assertTrue(any("Unreleased" in problem for problem in found), found)

    def test_placeholders_are_listed(self):
        self.assertIn(("CITATION.cff", "10.0000/placeholder"), release.placeholders(self.root))

    def test_the_notes_of_a_tag_are_the_changes_of_the_version(self):
        version = release.version_of(ROOT)
        self.change("CHANGELOG.md", f"## {version}, ", f"## 9.9.9, 2030-01-01\n- Later.\n\n## {version}, ")
        self.assertEqual(release.notes(self.root, "9.9.9"), "- Later.")
        self.assertNotIn("\n## ", release.notes(self.root, version))


class Dependencies(unittest.TestCase):
    def test_the_list_of_dependencies_has_the_packages_that_are_installed(self):
        import importlib.util
        spec = importlib.util.spec_from_file_location("make_sbom", ROOT / "packages/make_sbom.py")
        make_sbom = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(make_sbom)
        self.assertEqual(make_sbom.problems(), [])
        read = make_sbom.document(None)
        self.assertEqual(len(read["packages"]), 1 + len(make_sbom.dependencies()))
        self.assertEqual(len({each["SPDXID"] for each in read["packages"]}), len(read["packages"]))


if __name__ == "__main__":
    unittest.main()
