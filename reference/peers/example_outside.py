"""Anybody's method as an example: clusters the points of a mesh by the cells of a lattice, and keeps each cell's mean."""
import sys

source, target, size = sys.argv[1], sys.argv[2], float(sys.argv[3])
cells, cell_of, faces = {}, [], set()
with open(source) as file:
    for line in file:
        words = line.split()
        if words and words[0] == "v":
            point = [float(word) for word in words[1:4]]
            key = tuple(int(x // size) for x in point)
            number, total = cells.setdefault(key, (len(cells), [0, 0, 0, 0]))
            for i, x in enumerate(point + [1]):
                total[i] += x
            cell_of.append(number)
        elif words and words[0] == "f":
            corners = [cell_of[int(word.split("/")[0]) - 1] for word in words[1:]]
            for i in range(2, len(corners)):
                face = (corners[0], corners[i - 1], corners[i])
                turn = face.index(min(face))
                if len(set(face)) == 3:
                    faces.add(face[turn:] + face[:turn])
with open(target, "w") as file:
    for _, (x, y, z, n) in cells.values():
        file.write(f"v {x / n} {y / n} {z / n}\n")
    for face in sorted(faces):
        file.write("f %d %d %d\n" % tuple(corner + 1 for corner in face))
