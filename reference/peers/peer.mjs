// What the peers in JavaScript share: OBJ files as arrays, and what they say of their time and memory.
import { readFileSync, writeFileSync } from "node:fs";

/** Loads a package, or ends with the exit code by which the harness knows that something is not installed. */
export async function load(name) {
  try {
    return await import(name);
  } catch (missing) {
    if (missing.code !== "ERR_MODULE_NOT_FOUND") throw missing;
    console.log(`the npm package ${name} is not installed; reference/peers/install_peers.sh does that`);
    process.exit(77);
  }
}

/** Points as Float32Array, 3 a point, and triangles as Uint32Array; a face of more corners becomes a fan. */
export function readObj(path) {
  const points = [], triangles = [];
  for (const line of readFileSync(path, "latin1").split("\n")) {
    const words = line.trim().split(/\s+/);
    if (words[0] === "v") points.push(+words[1], +words[2], +words[3]);
    if (words[0] === "f") {
      const corners = words.slice(1).map((word) => parseInt(word, 10) - 1);
      for (let i = 2; i < corners.length; ++i) triangles.push(corners[0], corners[i - 1], corners[i]);
    }
  }
  return { points: new Float32Array(points), triangles: new Uint32Array(triangles) };
}

export function writeObj(path, points, triangles, stride = 3) {
  const lines = [];
  for (let i = 0; i < points.length; i += stride) lines.push(`v ${points[i]} ${points[i + 1]} ${points[i + 2]}`);
  for (let i = 0; i < triangles.length; i += 3) lines.push(`f ${triangles[i] + 1} ${triangles[i + 1] + 1} ${triangles[i + 2] + 1}`);
  writeFileSync(path, lines.join("\n") + "\n");
}

const statusBytes = (key) => 1024 * Number(new RegExp(`${key}:\\s*(\\d+)`).exec(readFileSync("/proc/self/status", "latin1"))[1]);

/** Does the work and says how long it took, and how far the peak of resident memory rose; returns what it returns. */
export function measured(work) {
  writeFileSync("/proc/self/clear_refs", "5");
  const before = statusBytes("VmRSS"), start = performance.now();
  const result = work();
  console.log(`seconds ${(performance.now() - start) / 1000}`);
  console.log(`bytes ${Math.max(0, statusBytes("VmHWM") - before)}`);
  return result;
}
