"""Docstrings: their examples run, their sections are complete, and their parameters are those of the functions."""

import doctest
import inspect
import os
import re
import tempfile
import unittest

import hermesh
from hermesh import _validation

CLASSES = [getattr(hermesh, name) for name in hermesh.__all__ if inspect.isclass(getattr(hermesh, name))]
RESULTS = [value for value in vars(_validation).values() if inspect.isclass(value)]
FUNCTIONS = [getattr(hermesh, name) for name in hermesh.__all__ if not inspect.isclass(getattr(hermesh, name))]


def members(kind):
    """Public members of a class of the module, with their names."""
    return [(f"{kind.__name__}.{name}", inspect.getattr_static(kind, name)) for name in vars(kind)
            if not name.startswith("_") or name == "__init__"]


def sections(text):
    """Section titles of a numpydoc docstring to their lines."""
    parts = re.split(r"(?m)^(\w[\w ]*)\n-{3,}$", inspect.cleandoc(text))
    return dict(zip(parts[1::2], parts[2::2]))


def parameters(section):
    return [name.strip().lstrip("*") for line in re.findall(r"(?m)^(\S[^:\n]*)(?: :.*)?$", section)
            for name in line.split(",")]


class Docstrings(unittest.TestCase):

    def test_examples(self):
        names = {}
        texts = [("hermesh", hermesh.__doc__)]
        for each in FUNCTIONS + CLASSES + RESULTS:
            texts.append((each.__name__, each.__doc__ or ""))
        for kind in CLASSES + RESULTS:
            texts += [(name, getattr(member, "__doc__", None) or "") for name, member in members(kind)]
        runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                for name, text in texts:
                    test = doctest.DocTestParser().get_doctest(text, dict(names), name, name, 0)
                    # The examples use the cube of the module's docstring.
                    runner.run(test, clear_globs=False)
                    names = names or test.globs
            finally:
                os.chdir(before)
        self.assertEqual(runner.failures, 0)
        self.assertGreater(runner.tries, 60)

    def test_functions_have_the_sections_of_numpydoc(self):
        for function in FUNCTIONS:
            found = sections(function.__doc__)
            with self.subTest(function=function.__name__):
                if function.__name__ not in ("write_mesh", "write_vdb"):
                    self.assertIn("Returns", found)
                # trimesh, meshio and pyopenvdb are not installed everywhere.
                if function.__name__ not in ("to_trimesh", "to_meshio", "to_pyopenvdb", "from_pyopenvdb"):
                    self.assertIn("Examples", found)
                try:
                    names = list(inspect.signature(function).parameters)
                except ValueError:  # a function of the extension module
                    continue
                self.assertEqual(sorted(parameters(found.get("Parameters", ""))), sorted(names))

    def test_defaults_are_those_of_the_functions(self):
        for function in FUNCTIONS:
            try:
                signature = inspect.signature(function)
            except ValueError:
                continue
            for names, default in re.findall(r"(?m)^(\w[\w, ]*) : [^\n]*default ([^\n]+)$",
                                             sections(function.__doc__).get("Parameters", "")):
                for name in names.split(", "):
                    given = signature.parameters[name].default
                    # None stands for the default of the algorithms, which tests of the program check.
                    if given is not None:
                        self.assertEqual(eval(default), given, f"{function.__name__}({name})")


class Messages(unittest.TestCase):

    def test_name_options_as_python_does(self):
        for of_program, of_python in (
                ("see --ends", "see ends"),
                ("was asked for exact data, -o hermite=level-set", "was asked for exact data, hermite='level-set'"),
                ("the side -o tile=512", "the side tile=512"),
                ("give --over-holes, or --except-thin to except", "give over_holes=True, or except_thin=True to except"),
                ("use --ends closed", "use ends='closed'"),
                ("with --smallest-voxel and --limit-points, or", "with smallest_voxel and limit_points, or"),
                ("--replace-nan VALUE", "replace_nan"),
                ("(--frame N takes another)", "(frame takes another)"),
                ("'a--b.ply' cannot be read", "'a--b.ply' cannot be read")):
            self.assertEqual(hermesh._in_python(of_program), of_python)

    def test_errors_of_the_algorithms(self):
        points, quads = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]
        with self.assertRaises(hermesh.Error) as caught:
            hermesh.remesh_within((points, quads), error=0.01, smallest_voxel=0.01)
        self.assertNotRegex(str(caught.exception), r"--|-o ")


if __name__ == "__main__":
    unittest.main()
