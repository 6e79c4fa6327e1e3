// meshoptimizer: node meshoptimizer_peer.mjs simplify|update IN.obj OUT.obj TOLERANCE, or remesh IN.obj OUT.obj VOXEL
// `simplify` keeps a part of the points, `update` moves them as well; the tolerance is in world units.
import { load, measured, readObj, writeObj } from "./peer.mjs";

const { MeshoptSimplifier: simplifier } = await load("meshoptimizer");
await simplifier.ready;
const [method, source, target, text] = process.argv.slice(2);
const { points, triangles } = readObj(source);

if (method === "remesh") {
  // The resolution is that of the longest side, and at most 256. It gives corners of triangles, three points each.
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  points.forEach((x, i) => { low[i % 3] = Math.min(low[i % 3], x); high[i % 3] = Math.max(high[i % 3], x); });
  const resolution = Math.min(256, Math.round(Math.max(...high.map((x, i) => x - low[i])) / Number(text)));
  const corners = measured(() => simplifier.remesh(triangles, points, 3, resolution, ["Solve"]));
  // Equal points are welded, as a reader of the file would.
  const numbers = new Map(), welded = [], indices = [];
  for (let i = 0; i < corners.length; i += 3) {
    const key = `${corners[i]} ${corners[i + 1]} ${corners[i + 2]}`;
    if (!numbers.has(key)) {
      numbers.set(key, numbers.size);
      welded.push(corners[i], corners[i + 1], corners[i + 2]);
    }
    indices.push(numbers.get(key));
  }
  writeObj(target, welded, indices);
} else {
  // The README's advice: points are welded, the error is absolute, components smaller than the error go.
  const flags = ["ErrorAbsolute", "Prune"];
  const tolerance = Number(text);
  let kept;
  if (method === "simplify")
    kept = measured(() => simplifier.simplify(triangles, points, 3, 0, tolerance, flags)[0]);
  else if (method === "update")
    kept = measured(() => {
      const [count] = simplifier.simplifyWithUpdate(triangles, points, 3, new Float32Array(0), 0, [], null, 0, tolerance, flags);
      return triangles.subarray(0, count);
    });
  else throw new Error(`meshoptimizer_peer knows no method ${method}`);
  const [remap, unique] = simplifier.compactMesh(kept);
  const compact = new Float32Array(3 * unique);
  remap.forEach((to, from) => to !== 0xffffffff && compact.set(points.subarray(3 * from, 3 * from + 3), 3 * to));
  writeObj(target, compact, kept);
}
