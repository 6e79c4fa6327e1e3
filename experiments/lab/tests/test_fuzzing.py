import unittest

from ...fuzzing import fuzz_lab


class Replay(unittest.TestCase):
    """Reads the files of experiments/fuzzing like the fuzzing program. Its targets in C++ have their own test.
    """

    def test_the_corpus_has_values_and_findings_are_read_or_refused(self):
        for target in fuzz_lab.TARGETS:
            corpus = list((fuzz_lab.HERE / "corpus" / target).iterdir())
            values = [fuzz_lab.attempt(target, file.read_bytes()) for file in corpus]
            self.assertTrue(any(values), target)
            for file in (fuzz_lab.HERE / "findings" / target).iterdir():
                with self.subTest(file.name):
                    fuzz_lab.attempt(target, file.read_bytes())


if __name__ == "__main__":
    unittest.main()
