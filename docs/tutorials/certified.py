"""Prints what `remesh --error` proved of each file, from the lines of `--json`: certified.py FILE"""

import json
import sys

for line in open(sys.argv[1], encoding="utf-8"):
    run = json.loads(line)
    figures, balls = run.get("figures", {}), run.get("result", {}).get("exceptions", [])
    if "certified_to_polygons" not in figures:
        print(f"{run['input']}: NOT CERTIFIED: {run['error']}")
        continue
    bound = max(figures["certified_to_polygons"], figures["certified_from_polygons"])
    limits = []
    if "hole_area" in figures:
        limits.append(f"holes of area {figures['hole_area']:.3g} closed")
    if balls:
        limits.append(f"except in {len(balls)} balls")
    print(f"{run['input']}: within {bound:.4g}", *limits, sep=", ")
