// The meshes in 3D, with WebGL 2 and no library. pack_mesh() in page.py describes how they are packed.
'use strict';

// --- unpacking ---

async function inflated(base64) {
  const text = atob(base64.trim()),
    packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/// Returns vertices about the centre of the box in units of its longest side, and distances from 0 to 1.
async function unpackMesh(head, base64) {
  const bytes = await inflated(base64);
  let at = 0,
    before = 0;
  const next = () => {
    // Seven bits a byte, by multiplication, since shifts have 32 bits.
    let value = 0,
      scale = 1,
      byte;
    do {
      byte = bytes[at++];
      value += (byte & 127) * scale;
      scale *= 128;
    } while (byte & 128);
    before += value % 2 ? -(value + 1) / 2 : value / 2;
    return before;
  };
  const count = head.points,
    steps = new Float64Array(3 * count),
    highest = [0, 0, 0];
  for (let axis = 0; axis < 3; ++axis) {
    before = 0;
    for (let i = 0; i < count; ++i) {
      const step = next();
      steps[3 * i + axis] = step;
      if (step > highest[axis]) highest[axis] = step;
    }
  }
  const longest = Math.max(...highest, 1),
    points = new Float32Array(3 * count);
  for (let i = 0; i < 3 * count; ++i) points[i] = (steps[i] - highest[i % 3] / 2) / longest;
  before = 0;
  const triangles = new Uint32Array(3 * head.triangles + 6 * head.quads),
    quads = new Uint32Array(4 * head.quads);
  for (let i = 0; i < 3 * head.triangles; ++i) triangles[i] = next();
  for (let i = 0; i < quads.length; ++i) quads[i] = next();
  for (let i = 0, to = 3 * head.triangles; i < quads.length; i += 4, to += 6)
    triangles.set([quads[i], quads[i + 1], quads[i + 2], quads[i], quads[i + 2], quads[i + 3]], to);
  let levels = null;
  if (head.largest !== null) {
    levels = new Float32Array(count);
    for (let i = 0; i < count; ++i) levels[i] = (bytes[at + i] * 256 + bytes[at + count + i]) / 65535;
  }
  const size = longest * head.step;
  const centre = head.lower.map((low, axis) => low + (highest[axis] * head.step) / 2);
  return {
    head,
    points,
    triangles,
    quads,
    levels,
    place: (world) => world.map((c, axis) => (c - centre[axis]) / size),
    size,
    half: highest.map((h) => h / longest / 2),
  };
}

function edgesOf(mesh) {
  const own = 3 * mesh.head.triangles,
    edges = new Uint32Array(2 * own + 2 * mesh.quads.length);
  let to = 0;
  const add = (corners, first, count) => {
    for (let k = 0; k < count; ++k) {
      edges[to++] = corners[first + k];
      edges[to++] = corners[first + ((k + 1) % count)];
    }
  };
  for (let i = 0; i < own; i += 3) add(mesh.triangles, i, 3);
  for (let i = 0; i < mesh.quads.length; i += 4) add(mesh.quads, i, 4);
  return edges;
}

/// Returns the sum of the normals of each vertex's triangles, weighted by area.
function normalsOf({points, triangles}) {
  const sums = new Float32Array(points.length);
  for (let i = 0; i < triangles.length; i += 3) {
    const a = 3 * triangles[i],
      b = 3 * triangles[i + 1],
      c = 3 * triangles[i + 2];
    const ux = points[b] - points[a],
      uy = points[b + 1] - points[a + 1],
      uz = points[b + 2] - points[a + 2];
    const vx = points[c] - points[a],
      vy = points[c + 1] - points[a + 1],
      vz = points[c + 2] - points[a + 2];
    const x = uy * vz - uz * vy,
      y = uz * vx - ux * vz,
      z = ux * vy - uy * vx;
    for (const p of [a, b, c]) {
      sums[p] += x;
      sums[p + 1] += y;
      sums[p + 2] += z;
    }
  }
  return sums;
}

// --- colours of the distance: from light to dark, so that the colour-blind can read them, and light for
// small distances, so that shading shows the shape there ---

const kScale = [
  '#e6ebf1',
  '#f3e6b3',
  '#f8cf6b',
  '#f2a33c',
  '#df6f2f',
  '#b93e3c',
  '#862457',
  '#521b5e',
  '#241246',
];

const kVertexShader = `#version 300 es
in vec3 point; in vec3 normal; in float level;
uniform mat4 view; uniform mat4 projection;
out vec3 seen; out vec3 turned; out float height;
void main() {
  vec4 at = view * vec4(point, 1.0);
  seen = at.xyz; turned = mat3(view) * normal; height = level;
  gl_Position = projection * at;
}`;
const kFragmentShader = `#version 300 es
precision highp float;
in vec3 seen; in vec3 turned; in float height;
uniform bool flatShading; uniform bool coloured; uniform float limit; uniform vec3 solid;
uniform vec3 scale[${kScale.length}];
uniform bool line; uniform vec3 ink;
out vec4 colour;
void main() {
  if (line) { colour = vec4(ink, 0.5); return; }
  vec3 n = flatShading ? cross(dFdx(seen), dFdy(seen)) : turned;
  n = dot(n, n) > 0.0 ? normalize(n) : vec3(0.0, 0.0, 1.0);
  if (dot(n, seen) > 0.0) n = -n;
  vec3 base = solid;
  if (coloured) {
    float at = clamp(height / limit, 0.0, 1.0) * ${(kScale.length - 1).toFixed(1)};
    int low = min(int(at), ${kScale.length - 2});
    base = mix(scale[low], scale[low + 1], at - float(low));
  }
  float light = 0.32 + 0.62 * max(dot(n, normalize(vec3(-0.35, 0.55, 0.75))), 0.0)
    + 0.16 * max(dot(n, normalize(vec3(0.7, -0.2, 0.4))), 0.0);
  colour = vec4(base * min(light, 1.05), 1.0);
}`;

const rgbOf = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

// --- the camera, which turns about a centre; matrices are stored by columns ---

class Camera {
  constructor() {
    this.reset();
  }
  /// `half` has half the length of each side of the box, whose longest side is 1.
  reset(half = this.half || [0.5, 0.5, 0.5]) {
    this.half = half;
    this.turn = -0.6;
    this.tilt = 0.35;
    this.distance = 2.5 * Math.hypot(...half);
    this.centre = [0, 0, 0];
  }
  /// Looks at a place, from the side to which the direction points.
  lookAt(place, direction, distance) {
    this.centre = [...place];
    this.distance = distance;
    this.turn = Math.atan2(direction[0], direction[2]);
    this.tilt = Math.atan2(direction[1], Math.hypot(direction[0], direction[2]));
  }
  rotation() {
    const c = Math.cos(this.turn),
      s = Math.sin(this.turn),
      d = Math.cos(this.tilt),
      t = Math.sin(this.tilt);
    return [
      [c, 0, -s],
      [-s * t, d, -c * t],
      [s * d, t, c * d],
    ]; // rows: right, up, towards the eye
  }
  view() {
    const r = this.rotation(),
      move = r.map((row) => -row.reduce((sum, v, i) => sum + v * this.centre[i], 0));
    return new Float32Array([
      r[0][0],
      r[1][0],
      r[2][0],
      0,
      r[0][1],
      r[1][1],
      r[2][1],
      0,
      r[0][2],
      r[1][2],
      r[2][2],
      0,
      move[0],
      move[1],
      move[2] - this.distance,
      1,
    ]);
  }
  projection(aspect) {
    const f = 1 / Math.tan(0.35),
      near = Math.max(0.002, this.distance - 1.6),
      far = this.distance + 2.5;
    return new Float32Array([
      f / aspect,
      0,
      0,
      0,
      0,
      f,
      0,
      0,
      0,
      0,
      (far + near) / (near - far),
      -1,
      0,
      0,
      (2 * far * near) / (near - far),
      0,
    ]);
  }
  pan(x, y) {
    const r = this.rotation();
    for (let i = 0; i < 3; ++i) this.centre[i] -= (r[0][i] * x - r[1][i] * y) * this.distance * 0.7;
  }
  zoom(factor) {
    this.distance = Math.min(8, Math.max(0.01, this.distance * factor));
  }
  orbit(x, y) {
    this.turn -= x;
    this.tilt = Math.min(1.57, Math.max(-1.57, this.tilt + y));
  }
}

class Scene {
  constructor(canvas, onDraw) {
    this.canvas = canvas;
    this.onDraw = onDraw;
    this.camera = new Camera();
    this.options = {flat: true, wires: false, coloured: true, limit: 1};
    this.gl = canvas.getContext('webgl2', {antialias: true, preserveDrawingBuffer: true});
    if (!this.gl) return;
    const gl = this.gl,
      program = gl.createProgram();
    for (const [type, source] of [
      [gl.VERTEX_SHADER, kVertexShader],
      [gl.FRAGMENT_SHADER, kFragmentShader],
    ]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    ['point', 'normal', 'level'].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    this.at = (name) => gl.getUniformLocation(program, name);
    gl.uniform3fv(this.at('scale'), kScale.flatMap(rgbOf));
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.buffers = {};
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
    canvas.addEventListener('webglcontextlost', () => {
      this.gl = null;
    });
  }
  upload(name, target, array) {
    const gl = this.gl;
    if (this.buffers[name]) gl.deleteBuffer(this.buffers[name]);
    this.buffers[name] = gl.createBuffer();
    gl.bindBuffer(target, this.buffers[name]);
    gl.bufferData(target, array, gl.STATIC_DRAW);
  }
  show(mesh) {
    const gl = this.gl;
    // The camera stays where it is between meshes with the same box, so that they can be compared.
    if (!this.mesh || this.mesh.half.some((h, axis) => Math.abs(h - mesh.half[axis]) > 0.05))
      this.camera.reset(mesh.half);
    this.mesh = mesh;
    mesh.normals = normalsOf(mesh);
    [
      ['point', mesh.points, 3],
      ['normal', mesh.normals, 3],
      ['level', mesh.levels || new Float32Array(mesh.head.points), 1],
    ].forEach(([name, array, size], i) => {
      this.upload(name, gl.ARRAY_BUFFER, array);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, size, gl.FLOAT, false, 0, 0);
    });
    this.upload('triangles', gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
    if (this.buffers.edges) {
      gl.deleteBuffer(this.buffers.edges);
      this.buffers.edges = null;
    }
    this.draw();
  }
  /// Draws once before the next frame, however often it is called.
  draw() {
    if (this.asked || !this.gl || !this.mesh) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.drawNow();
    });
  }
  colour(name) {
    return rgbOf(getComputedStyle(this.canvas).getPropertyValue(name).trim());
  }
  drawNow() {
    const gl = this.gl,
      canvas = this.canvas,
      ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)),
      height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    gl.viewport(0, 0, width, height);
    gl.clearColor(...this.colour('--scene'), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const view = this.camera.view(),
      projection = this.camera.projection(width / height);
    gl.uniformMatrix4fv(this.at('view'), false, view);
    gl.uniformMatrix4fv(this.at('projection'), false, projection);
    gl.uniform1i(this.at('flatShading'), this.options.flat);
    gl.uniform1i(this.at('coloured'), this.options.coloured && this.mesh.levels !== null);
    gl.uniform1f(this.at('limit'), this.options.limit);
    gl.uniform3fv(this.at('solid'), this.colour('--solid'));
    gl.uniform3fv(this.at('ink'), this.colour('--text'));
    gl.uniform1i(this.at('line'), 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.triangles);
    gl.drawElements(gl.TRIANGLES, this.mesh.triangles.length, gl.UNSIGNED_INT, 0);
    if (this.options.wires) {
      const edges = 2 * (3 * this.mesh.head.triangles + this.mesh.quads.length);
      if (!this.buffers.edges) this.upload('edges', gl.ELEMENT_ARRAY_BUFFER, edgesOf(this.mesh));
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.edges);
      gl.uniform1i(this.at('line'), 1);
      gl.enable(gl.BLEND);
      gl.drawElements(gl.LINES, edges, gl.UNSIGNED_INT, 0);
      gl.disable(gl.BLEND);
    }
    this.onDraw((p) => {
      const v = [0, 1, 2, 3].map(
        (i) => view[i] * p[0] + view[4 + i] * p[1] + view[8 + i] * p[2] + view[12 + i],
      );
      if (v[2] > -1e-3) return null;
      return [((projection[0] * v[0]) / -v[2] + 1) / 2, (1 - (projection[5] * v[1]) / -v[2]) / 2];
    });
  }
}

function listenToPointer(canvas, scene) {
  const down = new Map();
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.focus({preventScroll: true});
  });
  for (const end of ['pointerup', 'pointercancel'])
    canvas.addEventListener(end, (event) => down.delete(event.pointerId));
  canvas.addEventListener('pointermove', (event) => {
    const from = down.get(event.pointerId);
    if (!from) return;
    const x = event.clientX - from[0],
      y = event.clientY - from[1],
      size = canvas.clientHeight;
    if (down.size === 2) {
      // With two fingers, their distance zooms and their centre moves.
      const other = [...down.entries()].find(([id]) => id !== event.pointerId)[1];
      const apart = (px, py) => Math.hypot(px - other[0], py - other[1]) + 1;
      scene.camera.zoom(apart(...from) / apart(event.clientX, event.clientY));
      scene.camera.pan(x / size / 2, y / size / 2);
    } else if (event.shiftKey || event.buttons & 6) scene.camera.pan(x / size, y / size);
    else scene.camera.orbit((4 * x) / size, (4 * y) / size);
    down.set(event.pointerId, [event.clientX, event.clientY]);
    scene.draw();
  });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  // The wheel scrolls the page until the picture has been clicked.
  canvas.addEventListener(
    'wheel',
    (event) => {
      if (document.activeElement !== canvas && !event.ctrlKey) return;
      event.preventDefault();
      scene.camera.zoom(Math.exp(Math.max(-0.5, Math.min(0.5, event.deltaY * 0.0015))));
      scene.draw();
    },
    {passive: false},
  );
  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const ways = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
    if (ways && event.shiftKey) scene.camera.pan(ways[0] * 0.05, ways[1] * 0.05);
    else if (ways) scene.camera.orbit(ways[0] * 0.12, ways[1] * 0.12);
    else if (event.key === '+' || event.key === '=') scene.camera.zoom(0.85);
    else if (event.key === '-') scene.camera.zoom(1 / 0.85);
    else if (event.key === '0') scene.camera.reset();
    else return;
    event.preventDefault();
    scene.draw();
  });
}

/// Returns the normal of the vertex nearest to a place, which is the side to look at it from.
function normalNear({points, normals}, place) {
  let best = Infinity,
    nearest = 0;
  for (let i = 0; i < points.length; i += 3) {
    const square =
      (points[i] - place[0]) ** 2 + (points[i + 1] - place[1]) ** 2 + (points[i + 2] - place[2]) ** 2;
    if (square < best) {
      best = square;
      nearest = i;
    }
  }
  return [normals[nearest], normals[nearest + 1], normals[nearest + 2]];
}

/// Returns the level below which this share of the vertices lies.
function quantile(levels, share) {
  const sorted = Float32Array.from(levels).sort();
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
}

function buildViewer(heads, {rowHref, rows}) {
  if (heads.length === 0) return;
  document.getElementById('meshes').hidden = false;
  const place = document.getElementById('viewer');
  const field = (label, control) =>
    element('div', {class: 'field'}, element('label', {for: control.id}, label), control);
  const check = (id, label, on) => {
    const input = element('input', {type: 'checkbox', id, checked: on});
    return [input, element('div', {class: 'field check'}, input, element('label', {for: id}, label))];
  };
  const select = element('select', {id: 'mesh-select'});
  // The methods that a table compares follow one another, by the name of the table.
  let group = null;
  heads.forEach((head, i) => {
    if (!group || group.label !== head.group) {
      group = element('optgroup', {label: head.group});
      select.append(group);
    }
    const triangles = readable(head.triangles + 2 * head.quads);
    group.append(element('option', {value: i}, `${head.label} (${triangles} triangles)`));
  });
  const [wires, wiresField] = check('mesh-wires', 'Wireframe', false),
    [flat, flatField] = check('mesh-flat', 'Flat shading', true);
  const [coloured, colouredField] = check('mesh-coloured', 'Distance to the input as colour', true);
  const limits = element('select', {id: 'mesh-limit'});
  for (const [value, text] of [
    ['0.95', '95 % of the vertices'],
    ['0.99', '99 % of the vertices'],
    ['1', 'the largest distance'],
    ['v0.01', '0.01 voxel'],
    ['v0.1', '0.1 voxel'],
    ['v0.5', 'half a voxel'],
    ['v1', 'a voxel'],
  ])
    limits.append(element('option', {value}, text));
  limits.value = '0.99';
  const limitField = field('Darkest colour at', limits);
  const reset = element('button', {type: 'button'}, 'Whole mesh');
  const said = element('p', {role: 'status', id: 'mesh-status'}),
    facts = element('p', {class: 'soft'});
  const canvas = element('canvas', {
    tabindex: 0,
    role: 'application',
    'aria-label': 'The mesh in 3D',
    'aria-describedby': 'mesh-keys',
  });
  const stage = element('div', {class: 'stage'}, canvas);
  const bar = element('div', {
    class: 'bar',
    role: 'img',
    'aria-label': 'Scale of colours, from light at distance 0 over yellow and red to dark violet',
  });
  bar.style.background = `linear-gradient(to right, ${kScale.join(', ')})`;
  const highest = element('span', {}),
    scale = element('div', {class: 'scale'}, element('span', {}, '0 voxel'), bar, highest);
  const places = element('div', {class: 'controls'});
  place.append(
    element(
      'div',
      {class: 'controls'},
      field('Mesh', select),
      wiresField,
      flatField,
      colouredField,
      limitField,
      reset,
    ),
    said,
    stage,
    scale,
    places,
    facts,
    element(
      'p',
      {class: 'soft', id: 'mesh-keys'},
      'Drag to turn, drag with Shift or the right button to move, turn the wheel after a click to zoom. ' +
        'Keys: arrows turn, with Shift they move, + and − zoom, 0 shows the whole mesh.',
    ),
  );

  let mesh = null,
    worst = [];
  const scene = new Scene(canvas, (project) => {
    for (const one of worst) {
      const at = project(one.at);
      one.ring.hidden = !at || at.some((v) => v < 0 || v > 1);
      if (one.ring.hidden) continue;
      one.ring.style.left = `${100 * at[0]}%`;
      one.ring.style.top = `${at[1] * canvas.clientHeight}px`;
      one.ring.classList.toggle('left-side', at[0] > 0.6);
    }
  });
  if (!scene.gl) {
    said.textContent =
      'This browser has no WebGL 2, so meshes cannot be shown; they are in the directory meshes.';
    stage.hidden = scale.hidden = true;
    return;
  }
  const apply = () => {
    const has = mesh && mesh.levels !== null;
    scene.options.wires = wires.checked;
    scene.options.flat = flat.checked;
    scene.options.coloured = coloured.checked;
    coloured.disabled = !has;
    scale.hidden = limitField.hidden = !has || !coloured.checked;
    if (has) {
      const chosen = limits.value;
      const limit = chosen.startsWith('v')
        ? Number(chosen.slice(1)) / (mesh.head.largest || 1)
        : chosen === '1'
          ? 1
          : quantile(mesh.levels, Number(chosen));
      scene.options.limit = Math.max(limit, 1e-9);
      const most = readable(scene.options.limit * mesh.head.largest);
      highest.textContent = `${most} voxel${limit < 1 ? ' and more' : ''}`;
    }
    scene.draw();
  };
  const addPlace = (name, distances, voxel) => {
    if (!distances || !distances.worst) return;
    const text = `${name}: ${readable(distances.max / voxel)} voxel`;
    const ring = element('div', {class: 'place'}, element('span', {}, text));
    const button = element('button', {type: 'button'}, `Show the ${text}`);
    const at = mesh.place(distances.worst);
    button.addEventListener('click', () => {
      scene.camera.lookAt(at, normalNear(mesh, at), Math.max(0.02, Math.min(0.5, (30 * voxel) / mesh.size)));
      canvas.scrollIntoView({block: 'nearest'});
      scene.draw();
    });
    stage.append(ring);
    places.append(button);
    worst.push({at, ring});
  };
  let asked = 0;
  const show = async () => {
    const number = Number(select.value),
      head = heads[number],
      name = `${head.group}: ${head.label}`,
      ticket = ++asked;
    said.textContent = `Unpacking ${name} …`;
    await new Promise((done) => setTimeout(done, 0));
    try {
      const unpacked = await unpackMesh(head, document.getElementById(`mesh-${number}`).textContent);
      if (ticket !== asked) return;
      mesh = unpacked;
      for (const one of worst) one.ring.remove();
      worst = [];
      places.replaceChildren();
      facts.replaceChildren();
      const row = head.row === null ? null : rows[head.row];
      if (row && row.report && head.voxel_size) {
        addPlace('place of the mesh farthest from the input', row.report.to_reference, head.voxel_size);
        addPlace('place of the input farthest from the mesh', row.report.from_reference, head.voxel_size);
      }
      facts.append(
        `${head.file}; `,
        row ? element('a', {href: rowHref(head.row)}, 'its row') : 'no row is of it',
        '.',
      );
      scene.show(mesh);
      apply();
      const quads = head.quads ? `, ${readable(head.quads)} quads as two each` : '';
      said.textContent =
        `${name}: ${readable(head.triangles + 2 * head.quads)} triangles${quads}, ` +
        `${readable(head.points)} vertices. ` +
        (head.sentence
          ? `No colours: ${head.sentence}.`
          : `Its vertices are at most ${readable(head.largest)} voxel from the input. ` +
            'Colours are those of the vertices; between them the mesh may be farther away.');
      canvas.dataset.shown = String(number);
    } catch (error) {
      said.textContent = `${name} cannot be shown: ${error.message}`;
    }
  };
  select.addEventListener('change', show);
  for (const control of [wires, flat, coloured, limits]) control.addEventListener('change', apply);
  reset.addEventListener('click', () => {
    scene.camera.reset();
    scene.draw();
  });
  listenToPointer(canvas, scene);
  // The first mesh is unpacked when the viewer comes near the window.
  const near = new IntersectionObserver(
    (entries) => {
      if (entries.some((entry) => entry.isIntersecting)) {
        near.disconnect();
        show();
      }
    },
    {rootMargin: '300px'},
  );
  near.observe(stage);
}
