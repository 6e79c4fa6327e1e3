// Manifold's simplification: node manifold_peer.mjs IN.obj OUT.obj TOLERANCE, in world units
// Its Boolean operations: node manifold_peer.mjs IN.obj OUT.obj union|intersection|difference SECOND.obj
// Its splitByPlane, which writes each piece to a file: node manifold_peer.mjs IN.obj DIRECTORY cut PLANES
// with nx,ny,nz,d of the points x with n·x = d, separated by semicolons
import { load, measured, readObj, writeObj } from "./peer.mjs";

const { default: Module } = await load("manifold-3d");
const library = await Module();
library.setup();
const [source, target, text, other] = process.argv.slice(2);
const read = (path) => {
  const { points, triangles } = readObj(path);
  return new library.Manifold(new library.Mesh({ numProp: 3, vertProperties: points, triVerts: triangles }));
};
const solid = read(source);
if (text === "cut") {
  const planes = other.split(";").map((plane) => plane.split(",").map(Number));
  const pieces = measured(() => planes.reduce((parts, [x, y, z, d]) =>
    parts.flatMap((part) => part.splitByPlane([x, y, z], d)).filter((part) => !part.isEmpty()), [solid]));
  for (const [i, piece] of pieces.entries()) {
    const { vertProperties, triVerts, numProp } = piece.getMesh();
    writeObj(`${target}/${i + 1}.obj`, vertProperties, triVerts, numProp);
  }
  process.exit(0);
}
const second = other && read(other);
const operation = { union: "add", intersection: "intersect", difference: "subtract" }[text];
const made = measured(() => {
  const result = other ? solid[operation](second) : solid.simplify(Number(text));
  result.numTri();  // which makes it do the work
  return result;
});
const mesh = made.getMesh();
writeObj(target, mesh.vertProperties, mesh.triVerts, mesh.numProp);
