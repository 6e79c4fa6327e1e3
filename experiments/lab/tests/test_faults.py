import json
import pathlib
import signal
import tempfile
import types
import unittest

from .. import faults, program

HERMESH = program.program_file().with_name("hermesh")
WHOLE = {"out/mesh.ply": "1234", "rows.jsonl": ["a", "b"]}


class Contents(unittest.TestCase):
    def test_rows_without_times_and_memory(self):
        with tempfile.TemporaryDirectory() as directory:
            rows = [{"digest": "x", "seconds": {"all": [1]}, "values": [{"peak_bytes": 3, "count": 4}]}]
            path = pathlib.Path(directory, "rows.jsonl")
            path.write_text(json.dumps(rows[0]) + '\n{"half')
            self.assertEqual(faults.contents(directory),
                             {"rows.jsonl": ['{"digest": "x", "values": [{"count": 4}]}', "torn"]})

    def test_half_written(self):
        for found, wrong in (({}, []), (WHOLE, []), ({"rows.jsonl": ["b"]}, []),
                             ({"out/.hermesh-1-0-mesh.ply": "12"}, []),
                             ({"out/mesh.ply": "12"}, ["out/mesh.ply"]),
                             ({"rows.jsonl": ["a", "torn"]}, ["rows.jsonl"]),
                             ({"rows.jsonl": ["a", "a"]}, ["rows.jsonl"])):
            with self.subTest(found=found):
                self.assertEqual(faults.half_written(found, WHOLE), wrong)
                self.assertEqual(faults.is_whole(found, WHOLE), found == WHOLE)
        self.assertTrue(faults.is_whole(WHOLE, WHOLE | {"exploded.png": "a whole picture"}))
        self.assertEqual(faults.half_written({"a.png": "12"}, {"a.png": "a whole picture"}), ["a.png"])


@unittest.skipUnless(HERMESH.is_file(), "the program is not built")
class Faults(unittest.TestCase):
    def test_a_few_of_remesh_and_combine(self):
        described = types.SimpleNamespace(file=HERMESH.with_name("hermesh-lab"))
        labels = ["kill, remesh", "memory, remesh", "closed pipe, combine"]
        parameters = {"kills": 3, "levels": 3, "others": 1}
        found = list(faults.measure(parameters, labels.__contains__, described, str))
        self.assertEqual([label for label, _, _ in found], labels)
        for label, values, broken in found:
            with self.subTest(label):
                self.assertEqual(broken, [])
                self.assertEqual(values["done"] + values["nothing"] + values["partly"], values["faults"])
        self.assertGreaterEqual(found[1][1]["nothing"], 1)  # the lowest limit suffices for nothing
        self.assertGreaterEqual(found[1][1]["done"], 1)

    def test_what_is_wrong_is_noticed(self):
        with tempfile.TemporaryDirectory() as scratch:
            bench = faults.Bench(HERMESH, scratch)
            bench.prepare("remesh")
            values = dict.fromkeys(("faults", "done", "nothing", "partly", "leftovers", "resumed",
                                    "half_written", "blocked", "differing"), 0)
            (bench.out / "a.ply").write_text("half")
            wrong = bench.judge("remesh", faults.Attempt(-signal.SIGSEGV, "", 1.0), values)
            self.assertIn("half written", wrong[0])
            self.assertIn("SIGSEGV", wrong[1])
            self.assertEqual((values["half_written"], values["blocked"], values["differing"]), (1, 0, 0))
            bench.clean()
            self.assertEqual(bench.judge("remesh", faults.Attempt(0, "", 1.0), values),
                             ["success without all files"])
            self.assertEqual(bench.judge("remesh", faults.Attempt(1, "", 1.0), values),
                             ["exit code 1 without a message"])
