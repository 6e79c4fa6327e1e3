"""What the peers in Python share: OBJ files as arrays, and what they say of their time and memory."""
import sys
import time


def absent(reason):
    """Ends with the exit code by which the harness knows that something is not installed."""
    print(reason)
    sys.exit(77)


def read_obj(path):
    """Points (n × 3) and triangles (m × 3) of a file whose faces are triangles."""
    import numpy
    points, triangles = [], []
    with open(path) as file:
        for line in file:
            words = line.split()
            if words and words[0] == "v":
                points.append([float(word) for word in words[1:4]])
            elif words and words[0] == "f":
                corners = [int(word.split("/")[0]) - 1 for word in words[1:]]
                triangles += [[corners[0], corners[i - 1], corners[i]] for i in range(2, len(corners))]
    return numpy.array(points), numpy.array(triangles, dtype=numpy.int32)


def write_obj(path, points, triangles):
    with open(path, "w") as file:
        file.writelines("v %.9g %.9g %.9g\n" % tuple(point) for point in points)
        file.writelines("f %d %d %d\n" % tuple(corner + 1 for corner in triangle) for triangle in triangles)


def status_bytes(key):
    with open("/proc/self/status") as file:
        return next(1024 * int(line.split()[1]) for line in file if line.startswith(key + ":"))


def measured(work):
    """Does the work and says how long it took, and how far the peak of resident memory rose; returns what it returns."""
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    before, start = status_bytes("VmRSS"), time.perf_counter()
    result = work()
    print("seconds", time.perf_counter() - start)
    print("bytes", max(0, status_bytes("VmHWM") - before))
    return result
