// Manifold's simplification: node manifold_peer.mjs IN.obj OUT.obj TOLERANCE, in world units
import { load, measured, readObj, writeObj } from "./peer.mjs";

const { default: Module } = await load("manifold-3d");
const library = await Module();
library.setup();
const [source, target, text] = process.argv.slice(2);
const { points, triangles } = readObj(source);
const solid = new library.Manifold(new library.Mesh({ numProp: 3, vertProperties: points, triVerts: triangles }));
const made = measured(() => {
  const simple = solid.simplify(Number(text));
  simple.numTri();  // which makes it do the work
  return simple;
});
const mesh = made.getMesh();
writeObj(target, mesh.vertProperties, mesh.triVerts, mesh.numProp);
