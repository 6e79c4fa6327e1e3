import io
import json
import pathlib
import shutil
import tempfile
import unittest
from unittest import mock

from .. import merge
from ..rows import ROOT, LabError, append_rows, read_rows


class Merge(unittest.TestCase):
    """Deals the rows of results/sharp_features to three shards, so that each case is in all of them."""

    def setUp(self):
        self.enterContext(mock.patch("experiments.lab.tables.write_plots"))
        self.root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.rows = read_rows(ROOT / "results/sharp_features/rows.jsonl")
        self.shards = [self.root / str(number) for number in (1, 2, 3)]
        cells = [[row["cell"], f"cell-{i}", i % 3 + 1] for i, row in enumerate(self.rows)]
        self.manifest = self.rows[0] | {"file_sha256": "a" * 64, "of": 3, "cells": cells, "finished": True}
        for number, shard in enumerate(self.shards, 1):
            (shard / "meshes").mkdir(parents=True)
            (shard / "meshes" / f"{number}.ply").write_text("ply")
            self.write_manifest(shard)
            own = self.rows[number - 1::3]
            append_rows(shard / "rows.jsonl", [row | {"run": f"run {number}"} for row in own])

    def write_manifest(self, shard, **changes):
        (shard / "shard.json").write_text(json.dumps(self.manifest | {"shard": int(shard.name)} | changes))

    def change(self, number, change):
        """Applies a function to each row of a shard."""
        file = self.shards[number - 1] / "rows.jsonl"
        rows = read_rows(file)
        file.unlink()
        for row in rows:
            change(row)
        append_rows(file, rows)

    def merged(self, shards=None):
        out = self.root / "merged"
        shutil.rmtree(out, ignore_errors=True)
        merge.merge_shards(out, shards or self.shards, io.StringIO())
        return read_rows(out)

    def test_a_full_disk_leaves_no_half_of_a_mesh(self):
        def half(source, target):
            pathlib.Path(target).write_text("p")
            raise OSError("the disk is full")

        with mock.patch("shutil.copy2", half), self.assertRaises(shutil.Error):
            self.merged()
        self.assertEqual(list((self.root / "merged").rglob("*.ply")), [])

    def assert_refused(self, part, shards=None):
        with self.assertRaisesRegex(LabError, part):
            self.merged(shards)

    def test_merged_shards_are_the_rows_of_one_run(self):
        rows = self.merged(self.shards[::-1])
        for i, (row, whole) in enumerate(zip(rows, self.rows, strict=True)):
            self.assertEqual(row.pop("shard_run", "run 1"), f"run {i % 3 + 1}")
            self.assertEqual(row, whole | {"run": "run 1"})
        self.assertEqual(len(list((self.root / "merged/meshes").iterdir())), 3)
        self.assertFalse((self.root / "merged/shard.json").exists())
        for out in (self.root / "merged", self.shards[0] / "deeper"):
            with self.assertRaises(LabError):
                merge.merge_shards(out, self.shards, io.StringIO())

    def test_names_what_is_missing(self):
        self.assert_refused("of 3 shards: 2;", [self.shards[0], self.shards[2]])
        self.assert_refused("none", [self.root / "none"])
        file = self.shards[1] / "rows.jsonl"
        lines = file.read_text().splitlines(keepends=True)
        file.write_text("".join(lines[:-1]))
        self.assert_refused("^1 of 12 .* cell-10 of shard 2")
        file.write_text("".join(lines) + lines[0])
        self.assertEqual(len(self.merged()), 12)

    def test_the_last_row_of_the_shards_program_counts(self):
        changes = {"digest": "later"}, {"digest": "of another", "binary": "ffff"}
        append_rows(self.shards[0] / "rows.jsonl", [self.rows[0] | change for change in changes])
        self.assertEqual(self.merged()[0]["digest"], "later")

    def test_a_cell_in_two_shards_must_have_the_same_values(self):
        twice = [*self.shards, self.root / "twice"]
        shutil.copytree(self.shards[0], twice[3])
        self.change(1, lambda row: row.update(peak_bytes=2**40, seconds={"median": 17.0}))
        self.assertEqual(len(self.merged(twice)), 12)
        for change in (lambda row: row["report"]["to_reference"].update(max=0.0),
                       lambda row: row.update(digest="0" * 16)):
            shutil.copy(twice[3] / "rows.jsonl", self.shards[0])
            self.change(1, change)
            for order in (twice, twice[::-1]):
                self.assert_refused("cell-.* has other values", order)

    def test_refuses_parts_of_different_wholes(self):
        for change in [{"experiment": "other"}, {"tier": "other"}, {"binary": "ffff"}, {"commit": "ffff"},
                       {"file_sha256": "ffff"}, {"threads": 999}, {"of": 4}, {"cells": []}]:
            self.write_manifest(self.shards[2], **change)
            self.assert_refused("different")
        for torn in ('{"experiment": "x"}', '{"experiment": '):
            (self.shards[2] / "shard.json").write_text(torn)
            self.assert_refused("manifest")

    def test_refuses_cases_of_different_inputs(self):
        self.change(2, lambda row: row["case"].update(sha256="ffff"))
        self.assert_refused("another input")

    def test_a_shard_may_have_no_cells(self):
        shards = [*self.shards, self.root / "4", self.root / "5"]
        for shard in shards:
            shard.mkdir(exist_ok=True)
            self.write_manifest(shard, of=5)
        (shards[4] / "rows.jsonl").touch()
        self.assertEqual(len(self.merged(shards)), 12)


if __name__ == "__main__":
    unittest.main()
