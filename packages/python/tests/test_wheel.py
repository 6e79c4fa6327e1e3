"""Two wheels of one build have the same bytes, whatever the times and modes of the files: test_wheel.py COMMAND...
where COMMAND makes the wheel, with --out."""

import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

command = sys.argv[1:]
package = pathlib.Path(command[command.index("--package") + 1])
digests = []
with tempfile.TemporaryDirectory() as folder:
    for number, (time, mode) in enumerate(((1_000_000_000, 0o600), (1_700_000_000, 0o644))):
        copy = pathlib.Path(folder, str(number), "hermesh")
        shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
        for file in copy.iterdir():
            os.utime(file, (time, time))
            file.chmod(mode)
        wheel = copy.parent / "wheel.whl"
        replaced = {command.index("--package") + 1: str(copy), command.index("--out") + 1: str(wheel)}
        subprocess.run([replaced.get(i, word) for i, word in enumerate(command)], check=True,
                       stdout=subprocess.DEVNULL, umask=0o077 if number else 0o022)
        digests.append(hashlib.sha256(wheel.read_bytes()).hexdigest())
print(*digests)
sys.exit(digests[0] != digests[1])
