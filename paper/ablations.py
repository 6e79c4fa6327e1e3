"""Effects of ablations, from rows and from the tables that the program has made of them.

A folder of results/ is an ablation's if its rows have the key "ablation". The size of each effect is computed here once more
from the rows: the mean over models of the mean over a model's pairs, of logarithms for ratios. The interval (a bootstrap) and
the verdict are read from the folder's table.md, which `hermesh report --check` holds against the rows; a line of it is
taken only if its effect, models and pairs are those that the rows give here, so that a table of other rows is refused.
"""

import math

from row_database import PaperError, find, latest_groups, readable, text_at

VERDICTS = ["holds", "falsified", "undecided"]
HEAD = "| level | against | column | measure |"


def is_ablation(rows):
    return any(find(row, "/ablation") for row in rows)


def _place(row, levels):
    """(model, subject, level)"""
    model, resolution = text_at(row, "/case/name"), text_at(row, "/resolution")
    variant, voxelizer = text_at(row, "/variant/label"), text_at(row, "/voxelization/label")
    if levels == "variants":
        return model, (model, resolution, voxelizer), variant
    if levels == "voxelizers":
        return model, (model, resolution, variant), voxelizer
    if levels == "resolutions":
        return model, (model, variant, voxelizer), resolution
    model = text_at(row, "/values/model")
    return model, (model, text_at(row, "/values/resolution")), text_at(row, "/values/level")


def _effect(baseline, level, measure):
    """On the scale that is averaged; None where the pair has none."""
    numbers = [v for v in (baseline, level) if isinstance(v, (int, float)) and math.isfinite(v)]
    if len(numbers) < 2:
        return None
    if measure == "difference":
        return level - baseline
    plus = 1 if measure == "count-ratio" else 0
    return math.log((level + plus) / (baseline + plus)) if level + plus > 0 and baseline + plus > 0 else None


def sizes(rows, value):
    """[(effect as the row has it, estimate, models, pairs, left out)]; `value(row, column)` is a column of a row."""
    ablation = rows[-1]["ablation"]
    subjects = {}
    for row in rows:
        if row["ablation"] == ablation:
            model, subject, level = _place(row, ablation["levels"])
            subjects.setdefault(subject, (model, {}))[1][level] = row
    result = []
    for effect in ablation["effects"]:
        by_model, left_out = {}, 0
        for model, levels in subjects.values():
            if ablation["baseline"] in levels and effect["level"] in levels:
                pair = [None if find(row, "/failed") else value(row, effect["column"])
                        for row in (levels[ablation["baseline"]], levels[effect["level"]])]
                size = _effect(*pair, effect["measure"])
                if size is None:
                    left_out += 1
                else:
                    by_model.setdefault(model, []).append(size)
        means = [sum(each) / len(each) for each in by_model.values()]
        estimate = sum(means) / len(means) if means else None
        if means and effect["measure"] != "difference":
            estimate = math.exp(estimate)
        result.append((effect, estimate, len(means), sum(map(len, by_model.values())), left_out))
    return result


def _lines_of_table(text, tier):
    """The lines of effects in a table.md, below the heading of that tier."""
    lines, of_tier, inside = [], False, False
    for line in text.splitlines():
        if line.startswith("## "):
            of_tier = f"({tier})" in line
        inside = line.startswith(HEAD) or (inside and line.startswith("|"))
        if inside and of_tier and not line.startswith((HEAD, "| ---")):
            lines.append([cell.strip() for cell in line.strip().strip("|").split("|")])
    return lines


def judged(rows, table, value, where):
    """[{"factor", "level", "baseline", "column", "measure", "effect", "interval", "predicted", "verdict"}] of one folder: of
    its full tier, or of the quick one where it has no other. Raises PaperError where table and rows disagree."""
    shown = [row for row in latest_groups(rows) if find(row, "/ablation")]
    tier = "full" if any(row["tier"] == "full" for row in shown) else "quick"
    shown = [row for row in shown if row["tier"] == tier]
    lines, result = _lines_of_table(table, tier), []
    for effect, estimate, models, pairs, left_out in sizes(shown, value):
        head = [effect["level"], shown[-1]["ablation"]["baseline"], effect["column"], effect["measure"], effect["better"], str(models),
                str(pairs), str(left_out), "–" if estimate is None else readable(estimate)]
        found = next((line for line in lines if line[:len(head)] == head), None)
        if found is None or len(found) < len(head) + 4:
            raise PaperError(f"{where}/table.md has no line for the effect of {effect['level']} on {effect['column']} that the "
                             f"rows give ({head[-1]} over {models} models)")
        interval, predicted, _, verdict = found[len(head):len(head) + 4]
        result.append({"factor": shown[-1]["ablation"]["factor"], "level": head[0], "baseline": head[1], "column": head[2],
                       "measure": head[3], "models": models, "effect": head[-1], "interval": interval, "predicted": predicted,
                       "verdict": verdict})
    return result
