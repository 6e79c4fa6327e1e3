// Manifold's simplification: node manifold_peer.mjs IN.obj OUT.obj TOLERANCE, in world units
// Its Boolean operations: node manifold_peer.mjs IN.obj OUT.obj union|intersection|difference SECOND.obj
import { load, measured, readObj, writeObj } from "./peer.mjs";

const { default: Module } = await load("manifold-3d");
const library = await Module();
library.setup();
const [source, target, text, other] = process.argv.slice(2);
const read = (path) => {
  const { points, triangles } = readObj(path);
  return new library.Manifold(new library.Mesh({ numProp: 3, vertProperties: points, triVerts: triangles }));
};
const solid = read(source), second = other && read(other);
const operation = { union: "add", intersection: "intersect", difference: "subtract" }[text];
const made = measured(() => {
  const result = other ? solid[operation](second) : solid.simplify(Number(text));
  result.numTri();  // which makes it do the work
  return result;
});
const mesh = made.getMesh();
writeObj(target, mesh.vertProperties, mesh.triVerts, mesh.numProp);
