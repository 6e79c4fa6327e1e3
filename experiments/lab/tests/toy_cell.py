"""Takes jobs as `hermesh-lab cell` does (child.py); its variants crash, hang and eat memory."""

import hashlib
import json
import os
import pathlib
import signal
import sys
import time

poisoned = False


def send(**answer):
    os.write(3, json.dumps(answer).encode() + b"\n")


def digest_of(*parts):
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def load(name, require_data):
    """Returns the facts about an input: a file, or a name that is not "brick" if data are required."""
    if name == "brick" and require_data:
        send(error="the case brick would be a stand-in", missing=True)
        sys.exit()
    content = pathlib.Path(name).read_text() if pathlib.Path(name).is_file() else name
    if content.endswith(".off"):
        send(error=f"the case {name} cannot be read: there is no such file", unreadable=True)
        sys.exit()
    origin = "stand-in: toy" if name == "brick" else "file"
    return {"name": name, "origin": origin, "sha256": digest_of(content)}


def misbehave(name):
    global poisoned
    if name == "crashing" or name == "fragile" and poisoned:
        os.kill(os.getpid(), signal.SIGSEGV)
    if name == "forking" and os.fork() == 0:
        os.close(3)
        pathlib.Path(os.environ["TOY_PID"]).write_text(str(os.getpid()))
    if name in ("hanging", "forking"):
        time.sleep(60)
    while name == "talking":  # which is no progress
        send(stage="talk", fraction=0.5)
        time.sleep(0.02)
    eaten = []
    while name == "hungry":
        eaten.append(b"x" * 2**23)
        time.sleep(0.001)
    if name in ("leaving", "refusing"):
        os._exit(7 if name == "refusing" else 0)
    if name == "garbled":
        os.write(3, b"no JSON\n[1]\n\xff\xfe\n")
    if name == "slow":
        time.sleep(0.2)
    poisoned = poisoned or name == "poisonous"


def run_group(job):
    source, voxelizer = load(job["case"], job["require_data"]), job["voxelizer"]
    place = {"case": source, "resolution": job["resolution"]}
    rows = [job["head"] | place | {"variant": variant | {"options": ""}} for variant in job["variants"]]
    for row in rows:
        send(planned=row)
    if voxelizer and voxelizer["name"] == "crashing":
        os.abort()
    for row in rows:
        name = row["variant"]["name"]
        send(at=row["variant"]["label"])
        misbehave(name)
        row |= {"voxelization": voxelizer and voxelizer | {"options": ""}, "triangle_count": 12,
                "digest": digest_of(source, row["variant"], job["threads"] if name == "unsteady" else 0)}
        row |= {"broken": ["closed (3 boundary edges)"]} if name == "broken" else {}
    for row in rows:
        send(row=row)


def measure(job):
    """Makes rows "a" to "e"; at the third the process ends as long as the file TOY_TRAP exists."""
    columns = [{"name": "digest", "header": "digest", "meaning": ""}]
    for label in "abcde":
        if f"letters/{label}" in job["done"] or job["filter"] not in f"letters/letters/{label}":
            continue
        if label == "c" and pathlib.Path(os.environ.get("TOY_TRAP", "/none")).exists():
            os.abort()
        send(row=job["head"] | {"measurement": {"name": "letters", "parameters": "", "seed": job["seed"]},
                                "inputs": [load("box", False)], "case": {"name": "letters"},
                                "variant": {"name": label, "label": label}, "table": {"columns": columns},
                                "values": {"digest": digest_of(label)}})


job = json.loads(sys.stdin.readline())
if job["kind"] == "input":
    send(input=load(job["case"], job["require_data"]))
else:
    (measure if job["kind"] == "measurement" else run_group)(job)
send(note="a toy was at work")
send(done=True)
