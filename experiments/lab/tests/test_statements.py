import os
import pathlib
import tempfile
import unittest

from .. import statements
from ..rows import LabError, ROOT

PROGRAM = os.environ.get("HERMESH") or ROOT / "build/release/hermesh"
PROGRAM = PROGRAM if pathlib.Path(PROGRAM).is_file() else None

# (page, what it states, a contradiction that was in a page once or would be one)
CONTRADICTIONS = [
    ("paper/sections/limits.tex", "The slack.", "The distance to the input is measured,\nnot promised."),
    ("paper/sections/limits.tex", "Cubes and boxes at nearly all rotations are reproduced",
     "A polyhedron that is turned against the lattice is not reproduced"),
    ("CHANGELOG.md", "reproduces cubes and boxes at nearly all rotations",
     "reproduces polyhedra at any rotation"),
    ("CHANGELOG.md", "meet outside.", "meet outside: rotated polyhedra are reproduced."),
    ("algorithms/extraction/README.md", "may exceed the tolerance by 0.0061 voxel",
     "is 0.00573 voxel, where 0.005 are promised"),
    ("algorithms/extraction/README.md", "the tolerance and\n0.005 voxel", "the tolerance and\n0.004 voxel"),
    ("paper/hermesh.tex", "slack of the distance is 0.005 voxel", "slack of the distance is 0.05 voxel"),
    ("algorithms/voxelization/README.md", "The default is `auto`", "The default is `flood-fill`"),
    ("algorithms/voxelization/README.md", "`auto` floods", "`auto`, the default, floods"),
    ("reproduce", "minutes to hours each", "hours on a small machine"),
    ("README.md", "minutes to hours each", "minutes to an hour each"),
    ("README.md", "to max [vx] | from max [vx]", "to max [vx]"),
    ("README.md", "| boundary edges |", "| open |"),
    ("README.md", "under GPL-3 as a whole", "under GPL-2 as a whole"),
    ("README.md", "On Debian 12", "On Debian 13"),
    ("codemeta.json", "licenses/Apache-2.0", "licenses/MIT"),
    ("packages/python/README.md", "hermesh-1.0.0-*.whl", "hermesh-1.1.0-*.whl"),
    ("experiments/cli/README.md", "At most 2,000 voxels", "At most 4,000 voxels"),
    ("experiments/lab/README.md", "on 60 of their mesh files", "on 58 of their mesh files"),
]


class Statements(unittest.TestCase):
    def test_pages_and_program_agree(self):
        self.assertEqual(statements.problems(statements.Checkout(ROOT, PROGRAM)), [])

    def test_a_contradiction_that_is_put_back_is_found(self):
        checkout = statements.Checkout(ROOT)
        self.assertEqual(statements.problems(checkout), [])
        for file, right, wrong in CONTRADICTIONS:
            text = checkout.text(file)
            right, wrong = statements.flat(right), statements.flat(wrong)
            with self.subTest(file=file, wrong=wrong):
                self.assertIn(right, text)
                checkout.texts[file] = text.replace(right, wrong)
                found = statements.problems(checkout)
                self.assertTrue(any(file in problem for problem in found), found)
            checkout.texts[file] = text

    def test_a_passage_that_disappeared_and_a_missing_file_are_named(self):
        places = [{"in": "README.md", "pattern": "no such (x)"}, {"in": "absent.md", "pattern": "(x)"}]
        statement = {"name": "size", "everywhere": "", "places": places}
        checkout = statements.Checkout(ROOT)
        found = statements.problems_of_statement(statement, checkout, [])
        self.assertEqual(len(found), 2)
        self.assertIn("README.md does not state the size", found[0])
        self.assertIn("absent.md", found[1])

    def test_line_breaks_and_spelling_of_values_do_not_matter(self):
        self.assertEqual(statements.flat("/// at most\n/// 2,000   voxels\n"), "/// at most 2,000 voxels ")
        self.assertEqual(statements.value_of("2,000"), statements.value_of("2000"))
        self.assertEqual(statements.value_of("Cubes"), "cubes")

    def test_mistakes_in_the_file_are_named(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        path = pathlib.Path(directory.name, "wrong.toml")
        for text in ('[[statement]]\nname = "x"', '[[contradiction]]\npattern = "x"',
                     '[[statement]]\nname = "x"\nplaces = [{ in = "README.md" }]\n[[contradiction]]\n'):
            path.write_text(text)
            with self.assertRaises(LabError):
                statements.read_statements(path)


if __name__ == "__main__":
    unittest.main()
