import pathlib
import random
import re
import tempfile
import unittest

from .. import driver, experiment, program
from ..rows import LabError

OPTIONS = [{"name": "size", "default": "1", "minimum": 0.0, "maximum": 10.0},
           {"name": "mode", "default": "slow", "choices": ["slow", "fast"]},
           {"name": "pace", "default": "1", "minimum": 0.0, "maximum": 1e300,
            "only_with": ["mode=fast", "size=2|3"]}]
VOCABULARY = {
    "extractors": [{"name": "toy", "options": OPTIONS}],
    "voxelizers": [{"name": "plain", "options": OPTIONS}],
    "cases": ["ball", "cube"],
    "measurements": [{"name": "letters", "parameters": OPTIONS,
                      "tables": [{"name": "table", "columns": ["level", "count"]}]}]}
EXTRACTION = """question = "why?"
voxelizers = ["plain"]
columns = ["points", "seconds"]
features = 25
variants = [{ name = "toy", label = "toy, fast", options = { size = 2.5, mode = "fast" } },
  { name = "toy", uniform = "toy, fast" }, { label = "copy", command = "cp {in} {out.obj}" }]
[quick]
samples = 77
self_intersections = false
seconds_per_variant = 0.5
timeout = 9
cases = [{ name = "ball", resolutions = [10, 20], closeup = [0, 0.2, 0.3, 0.5], view = [9, -20] },
  { name = "none/there.ply.gz", resolutions = [8] }]
"""
VOXELIZATION = """kind = "voxelization"
question = "why?"
columns = ["seconds"]
exterior_band = 2
voxelizers = [{ name = "plain" }, { name = "plain", label = "plain, fast", options = { mode = "fast" } }]
plots = [{ name = "p", title = "t", case = "ball", x = "swept", y = ["seconds"], x_label = "x", y_label = "y" }]
[quick]
components = true
cases = [{ name = "ball", resolutions = [10], distances = "all", signs = "parity", solid = "cube" },
  { name = "cube", voxel_sizes = [2, 0.5], length = 7, published_seconds = [1, 3], distances = 99, signs = "none" },
  { name = "cube", voxel_sizes = [1], sweep = { side = [1, 2.5] }, signs = "parity", sign_samples = 50 }]
"""
MEASUREMENT = """kind = "measurement"
measurement = "letters"
question = "why?"
seed = 3
plots = [{ name = "p", title = "t", x = "level", y = ["count"], x_label = "x", y_label = "y" }]
[full]
size = 2
"""
EFFECT = """factor = "f"
levels = ["a", "b"]
baseline = "a"
effects = [{ levels = ["b"], column = "count", measure = "ratio", better = "lower", prediction = "p", \
at_least = 2, falsified_if = "high < 2" }]
[full]"""


class Reads(unittest.TestCase):
    def setUp(self):
        self.file = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()), "toy.toml")

    def read(self, text, vocabulary=VOCABULARY):
        self.file.write_text(text)
        return experiment.read_experiment(self.file, vocabulary)


class Files(Reads):
    def test_an_extraction(self):
        found = self.read(EXTRACTION)
        self.assertEqual((found["name"], found["kind"], found["features"]), ("toy", "extraction", 25.0))
        self.assertEqual((found["columns"], found["ablation"]), (["points", "seconds"], None))
        self.assertEqual(found["voxelizers"], [experiment.variant("plain")])
        self.assertEqual(found["variants"], [
            experiment.variant("toy", "toy, fast", {"mode": "fast", "size": "2.5"}),
            experiment.variant("toy") | {"uniform": "toy, fast"},
            experiment.variant("command copy", "copy") | {"command": "cp {in} {out.obj}"}])
        case = experiment.case("ball", [10, 20]) | {"closeup": [0.0, 0.2, 0.3, 0.5], "view": [9.0, -20.0]}
        self.assertEqual(found["tiers"], {"quick": experiment.TIER | {
            "samples": 77, "self_intersections": False, "seconds_per_variant": 0.5, "timeout": 9.0,
            "cases": [case, experiment.case("none/there.ply.gz", [8])]}})

    def test_a_voxelization(self):
        found = self.read(VOXELIZATION)
        self.assertEqual([found[key] for key in ("kind", "exterior_band", "interior_band")],
                         ["voxelization", 2.0, 3.0])
        self.assertEqual(found["plots"], [{"name": "p", "title": "t", "case": "ball", "x": "swept",
                                           "y": ["seconds"], "x_label": "x", "y_label": "y"}])
        first, second, third = found["tiers"]["quick"]["cases"]
        self.assertEqual(first, experiment.case("ball", [10]) | {
            "distances": experiment.ALL, "signs": "parity", "sign_samples": experiment.ALL, "solid": "cube"})
        self.assertEqual(second, experiment.case("cube") | {
            "voxel_sizes": [2.0, 0.5], "length": 7.0, "published_seconds": [1.0, 3.0], "distances": 99})
        self.assertEqual(third["sweep"], [{"parameter": "side", "value": value} for value in (1.0, 2.5)])
        self.assertEqual((third["distances"], third["sign_samples"]), (None, 50))

    def test_a_measurement_has_parameters_and_columns_of_its_own(self):
        found = self.read(MEASUREMENT)
        self.assertEqual([found[key] for key in ("measurement", "seed", "ablation")], ["letters", 3, None])
        self.assertEqual(found["tiers"]["full"]["parameters"], {"size": "2"})
        ablation = MEASUREMENT.replace("[full]", EFFECT)
        self.assertEqual(self.read(ablation)["ablation"]["effects"][0]["at_least"], 2.0)
        with self.assertRaises(LabError):
            self.read(ablation.replace('column = "count"', 'column = "points"'))

    def test_mistakes_name_file_and_key(self):
        ball = '{ name = "ball", resolutions = [10, 20], closeup = [0, 0.2, 0.3, 0.5], view = [9, -20] }'
        self.assert_mistakes(EXTRACTION, [
            ('"why?"', "3", "question"), ('"why?"', '""', "question"), ('"why?"', '"a\\u0007"', "question"),
            ('"why?"', '"why?', "line 1"), ("question", "qustion", '"qustion"'),
            ('question = "why?"', "", '"question"'), ("features", 'kind = "extract"\nfeatures', "kind"),
            ("features", "exterior_band", '"exterior_band"'), ('"plain"', '"plane"', "voxelizers[0]"),
            ("features", 'shows = ["figure 9.8"]\nfeatures', "shows[0]"),
            ('["plain"]', "[]", "voxelizers"), ('["plain"]', '"plain"', "voxelizers"),
            ('"seconds"', '"points"', "columns"), ('"toy"', '"tpy"', "variants[0].name"),
            ("size", "siez", "siez"), ("2.5", "11", "size"), ('"fast"', '"medium"', "medium"),
            ('"fast"', "[1]", "mode"), ('{ size = 2.5, mode = "fast" }', "3", "options"),
            ('uniform = "toy, fast"', 'uniform = "fast"', "uniform"),
            ('label = "copy"', 'label = "toy"', "variants[2]"), ("quick", "quik", '"quik"'),
            (EXTRACTION[EXTRACTION.index("[quick]"):], "", "[quick]"), ("77", "0", "quick.samples"),
            ("77", "7.5", "quick.samples"), ("77", "true", "quick.samples"),
            ("= false", "= 1", "self_intersections"), ("samples", "components", '"components"'),
            ('"ball"', '"bell"', "quick.cases[0].name"),
            ("10, 20", "10, 1", "resolutions[1]"), (ball, '{ name = "ball" }', "resolutions"),
            ("0.2, ", "", "closeup"), ("0.3", "1.5", "closeup[2]"),
            ("view = [9", 'view = ["left"', "view[0]")])
        self.assert_mistakes(VOXELIZATION, [
            ('"plain, fast"', '"plain"', "voxelizers[1]"),
            ('case = "ball"', 'case = "bell"', "plots[0].case"),
            ("swept", "sweep", "plots[0].x"), ("[10]", "[9], view = [1, 2]", '"view"'),
            ("[10]", "[9], voxel_sizes = [1]", "either"), ('"all"', '"some"', "distances"),
            ('"parity"', '"guess"', "signs"), ("[10]", "[9], length = 3", "length"),
            ("[1, 3]", "[1]", "published_seconds"), ("side", "a = [1], side", "sweep"),
            ('"none"', '"none", sign_samples = "all"', "sign_samples")])
        self.assert_mistakes(MEASUREMENT, [
            ('"letters"', '"lettres"', "measurement"), ('measurement = "letters"', "", "measurement"),
            ("seed = 3", "seed = -1", "seed"), ("size = 2", "pace = 2\nsize = 4", "pace"),
            ('"level"', '"points"', "plots[0].x")])

    def assert_mistakes(self, valid, mistakes):
        """Checks that each replacement, of an old by a new text, raises an error that names file and place.
        """
        for old, new, place in mistakes:
            self.assertIn(old, valid)
            with self.subTest(old=old, new=new), self.assertRaises(LabError) as caught:
                self.read(valid.replace(old, new, 1))
            self.assertTrue(str(caught.exception).startswith("toy.toml"), caught.exception)
            self.assertIn(place, str(caught.exception))


class Options(unittest.TestCase):
    def test_numbers_keep_their_value(self):
        for value, text in ((2, "2"), (2.5, "2.5"), (1e-5, "1e-05"), (True, "true"), ("a b", "a b")):
            self.assertEqual(experiment.option_text(value, "x"), text)
        self.assertEqual(float(experiment.option_text(1 / 3, "x")), 1 / 3)

    def test_what_has_no_effect_is_refused(self):
        experiment.check_options("toy", OPTIONS, {"pace": "1", "mode": "fast", "size": "2.0"})
        for given in ({"pace": "1", "mode": "fast"}, {"pace": "1", "size": "2"}, {"size": "nan"},
                      {"size": "0x1"}, {"size": " 1"}, {"size": "1_0"}, {"mode": ""}):
            with self.assertRaises(LabError, msg=given):
                experiment.check_options("toy", OPTIONS, given)


class Groups(Reads):
    def names(self, text, *words):
        arguments = driver.arguments_of(self.file, *words)
        groups = experiment.groups_of(*experiment.with_overrides(self.read(text), arguments, VOCABULARY))
        return [(group["name"], group["weight"]) for group in groups]

    def test_inputs_sizes_and_sweeps(self):
        self.assertEqual(self.names(EXTRACTION)[:2], [("ball/10/plain/", 300), ("ball/20/plain/", 1200)])
        # A length of 7 in voxels of 2 and 0.5; 100 voxels without a length; two voxelizers compete.
        self.assertEqual(self.names(VOXELIZATION), [("ball/10/", 200), ("cube/2/", 24.5), ("cube/0.5/", 392),
                                                    ("cube/1/1/", 20_000), ("cube/2.5/1/", 20_000)])

    def test_overrides(self):
        words = ["--case", "cube", "--resolution", "9", "--variant", "plain, fast"]
        self.assertEqual(self.names(VOXELIZATION, *words),
                         [("cube/9/", 81), ("cube/1/9/", 81), ("cube/2.5/9/", 81)])
        self.assertEqual(self.names(EXTRACTION, "--case", "cube", "--variant", "copy", "toy"),
                         [("cube/10/plain/", 300), ("cube/20/plain/", 1200)])

    def test_the_filter_contains_names_and_labels(self):
        found = self.read(VOXELIZATION)
        for text, count in (("ball", 1), ("cube/0.5/plain, fast", 1), ("/plain", 5), ("none", 0)):
            groups = experiment.groups_of(found, found["tiers"]["quick"], text)
            self.assertEqual(len(groups), count, text)


class Anything(list):
    def __contains__(self, _):
        return True


def vocabulary_of(text):
    """Returns a vocabulary in which the texts of files are names, and their keys options of all names."""
    names = set(re.findall(r'"([^"\n]*)"', text))
    keys = set(re.findall(r"(\w+) *=", text))
    options = [{"name": key, "default": "", "choices": Anything()} for key in keys]
    tables = [{"name": name, "columns": [name]} for name in names]
    return {"cases": Anything(), "extractors": [{"name": name, "options": options} for name in names],
            "voxelizers": [{"name": name, "options": options} for name in names],
            "measurements": [{"name": name, "parameters": options, "tables": tables} for name in names]}


class Project(Reads):
    """The files that come with the project."""

    def setUp(self):
        super().setUp()
        self.experiments = experiment.list_experiments()

    def test_mutated_files_are_read_or_refused(self):
        """Replaces, removes and repeats words of the files, which are valid themselves; fixed seed."""
        texts = [each["file"].read_text() for each in self.experiments]
        vocabulary, generator = vocabulary_of("".join(texts)), random.Random(63)
        refused = 0
        for text in texts:
            self.read(text, vocabulary)
        for _ in range(100):
            words = re.findall(r'"[^"\n]*"|[\w.+-]+|\s+|.', generator.choice(texts))
            junk = [*words, "", "-1", "1e300", "nan", '""', "[]", "{}", "true", "1979-05-27", "\x07", '"""']
            for _ in range(generator.randint(1, 3)):
                words[generator.randrange(len(words))] = generator.choice(junk)
            try:
                self.read("".join(words), vocabulary)
            except LabError as error:
                self.assertIn("toy.toml", str(error))
                refused += 1
        self.assertGreater(refused, 30)

    @unittest.skipUnless(program.program_file().is_file(), "the program is not built")
    def test_files_name_variants_options_and_measurements_of_the_program(self):
        vocabulary = driver.with_own_measurements(program.load_program().description)
        for each in self.experiments:
            with self.subTest(each["name"]):
                found = experiment.read_experiment(each["file"], vocabulary)
                self.assertEqual(found["question"], each["question"])

    def test_each_table_and_figure_of_chapter_9_is_made_once(self):
        shows = [number for each in self.experiments for number in each["shows"]]
        wanted = [f"table_9_{i}" for i in range(1, 5)] + [f"figure_9_{i}" for i in range(1, 17)]
        self.assertEqual([shows.count(number) for number in wanted], [1] * 20)

    def test_experiments_are_found_by_path_name_and_number(self):
        headline = experiment.find_experiment("headline")
        self.assertEqual(headline.name, "headline.toml")
        self.assertEqual(experiment.find_experiment(str(headline)), headline)
        self.assertEqual(experiment.find_experiment("mine.toml"), pathlib.Path("mine.toml"))
        self.assertEqual(experiment.find_experiment("figure_9_9").name, "table_9_2.toml")
        with self.assertRaises(LabError):
            experiment.find_experiment("figure_9_99")


if __name__ == "__main__":
    unittest.main()
