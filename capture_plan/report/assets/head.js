/* The head as numbers: unpack, refine, pose. No drawing, no page.
 *
 * Letters as in the Python rooms: v vertices, f triangles, k blendshapes. Lengths in millimetres around the head's middle.
 * Pose       p = v0 + sum_k w_k d_k                  (delta blendshapes)
 * Surface    s = S p                                 (one step of Loop subdivision where the mesh is coarse)
 */
"use strict";
const CapturePlan = {};

CapturePlan.SMOOTH_BELOW = 20000; // triangles; finer heads already look smooth
CapturePlan.ROUGH = new Set(["lashes", "brows", "clear"]); // strips and shells that subdivision would pull out of place

/* Typed arrays of the packed blob, by name. */
CapturePlan.unpack = async function (head) {
  const packed = Uint8Array.from(atob(head.blob), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = await new Response(stream).arrayBuffer();
  const types = { int16: Int16Array, uint8: Uint8Array, uint32: Uint32Array, int32: Int32Array };
  const arrays = {};
  let offset = 0;
  for (const [name, type, size] of head.arrays) {
    const length = size * types[type].BYTES_PER_ELEMENT;
    arrays[name] = new types[type](bytes.slice(offset, offset + length));
    offset += length;
  }
  return arrays;
};

/* Coordinates that lie as xx..yy..zz.. in steps, as xyzxyz.. in millimetres. */
CapturePlan.interleaved = function (planar, unit) {
  const n = planar.length / 3;
  const out = new Float32Array(planar.length);
  for (let i = 0; i < n; i++) for (let a = 0; a < 3; a++) out[3 * i + a] = planar[a * n + i] * unit;
  return out;
};

/* One step of Loop subdivision (Loop 1987): the rows of S as (start, index, weight), and the finer triangles.
 * Triangles with smooth[f] = 0 stay as they are, and so do the corners that only they use. */
CapturePlan.subdivide = function (v, triangles, smooth) {
  const edges = new Map(); // smaller * v + larger -> [number, corner opposite, corner opposite]
  const neighbours = new Map(); // vertex -> set of vertices
  const link = (a, b) => (neighbours.get(a) || neighbours.set(a, new Set()).get(a)).add(b);
  const key = (a, b) => (a < b ? a * v + b : b * v + a);
  const fine = [];
  const source = []; // coarse triangle of each fine one
  for (let f = 0; f < smooth.length; f++) {
    const t = [triangles[3 * f], triangles[3 * f + 1], triangles[3 * f + 2]];
    if (!smooth[f]) {
      fine.push(...t);
      source.push(f);
      continue;
    }
    const middle = t.map((a, i) => {
      const b = t[(i + 1) % 3];
      const edge = edges.get(key(a, b)) || edges.set(key(a, b), [v + edges.size]).get(key(a, b));
      edge.push(t[(i + 2) % 3]);
      link(a, b);
      link(b, a);
      return edge[0];
    });
    fine.push(t[0], middle[0], middle[2], t[1], middle[1], middle[0], t[2], middle[2], middle[1], ...middle);
    source.push(f, f, f, f);
  }
  const rim = new Map(); // vertex -> its neighbours along open edges
  for (const [k, edge] of edges) {
    if (edge.length === 3) continue;
    const [a, b] = [Math.floor(k / v), k % v];
    (rim.get(a) || rim.set(a, []).get(a)).push(b);
    (rim.get(b) || rim.set(b, []).get(b)).push(a);
  }
  const start = [0], index = [], weight = [];
  const row = (pairs) => {
    for (const [i, w] of pairs) { index.push(i); weight.push(w); }
    start.push(index.length);
  };
  for (let a = 0; a < v; a++) {
    const around = neighbours.get(a);
    const open = rim.get(a);
    if (!around || (open && open.length !== 2)) row([[a, 1]]);
    else if (open) row([[a, 3 / 4], [open[0], 1 / 8], [open[1], 1 / 8]]);
    else {
      const beta = around.size === 3 ? 3 / 16 : 3 / (8 * around.size);
      row([[a, 1 - around.size * beta], ...[...around].map((b) => [b, beta])]);
    }
  }
  for (const [k, edge] of edges) {
    const [a, b] = [Math.floor(k / v), k % v];
    if (edge.length === 3) row([[a, 3 / 8], [b, 3 / 8], [edge[1], 1 / 8], [edge[2], 1 / 8]]);
    else row([[a, 1 / 2], [b, 1 / 2]]);
  }
  return {
    start: Uint32Array.from(start), index: Uint32Array.from(index), weight: Float32Array.from(weight),
    triangles: Uint32Array.from(fine), source: Uint32Array.from(source),
  };
};

/* S p for `width` numbers per vertex. */
CapturePlan.refine = function (S, p, width) {
  const rows = S.start.length - 1;
  const out = new Float32Array(width * rows);
  for (let r = 0; r < rows; r++) {
    for (let j = S.start[r]; j < S.start[r + 1]; j++) {
      for (let a = 0; a < width; a++) out[width * r + a] += S.weight[j] * p[width * S.index[j] + a];
    }
  }
  return out;
};

/* Area-weighted unit normals, xyzxyz.. */
CapturePlan.normals = function (p, triangles) {
  const n = new Float32Array(p.length);
  for (let f = 0; f < triangles.length; f += 3) {
    const a = 3 * triangles[f], b = 3 * triangles[f + 1], c = 3 * triangles[f + 2];
    const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
    const wx = p[c] - p[a], wy = p[c + 1] - p[a + 1], wz = p[c + 2] - p[a + 2];
    const x = uy * wz - uz * wy, y = uz * wx - ux * wz, z = ux * wy - uy * wx;
    for (const i of [a, b, c]) { n[i] += x; n[i + 1] += y; n[i + 2] += z; }
  }
  for (let i = 0; i < n.length; i += 3) {
    const length = Math.hypot(n[i], n[i + 1], n[i + 2]) || 1;
    n[i] /= length; n[i + 1] /= length; n[i + 2] /= length;
  }
  return n;
};

/* A head that can be posed: `pose(weights)` gives points, normals and displacement of its surface. */
CapturePlan.Head = class {
  constructor(head, arrays) {
    this.names = head.blendshapes;
    this.materialNames = head.materials;
    this.neutral = CapturePlan.interleaved(arrays.positions, head.unit);
    const v = this.neutral.length / 3;
    const f = arrays.materials.length;
    const coarse = new Uint32Array(3 * f);
    for (let i = 0; i < f; i++) for (let a = 0; a < 3; a++) coarse[3 * i + a] = arrays.triangles[a * f + i];
    const smooth = Array.from(arrays.materials, (m) =>
      f < CapturePlan.SMOOTH_BELOW && !CapturePlan.ROUGH.has(head.materials[m]) ? 1 : 0);
    this.S = CapturePlan.subdivide(v, coarse, smooth);
    this.triangles = this.S.triangles;
    this.materials = Uint8Array.from(this.S.source, (i) => arrays.materials[i]);
    this.shade = CapturePlan.refine(this.S, Float32Array.from(arrays.shade, (s) => s / 255), 1);
    this.deltas = this.sparse(arrays, head.step);
    this.radius = Math.max(...[0, 1, 2].map((a) => this.neutral.reduce((m, x, i) => (i % 3 === a ? Math.max(m, Math.abs(x)) : m), 0)));
  }

  /* Per blendshape: the vertices that move and how far, xyzxyz.. */
  sparse(arrays, step) {
    const all = CapturePlan.interleaved(arrays.delta_steps, step);
    const deltas = [];
    let from = 0, vertex = 0;
    for (const count of arrays.delta_counts) {
      const vertices = new Uint32Array(count);
      for (let i = 0; i < count; i++) vertices[i] = vertex += arrays.delta_vertices[from + i];
      deltas.push({ vertices, xyz: all.subarray(3 * from, 3 * (from + count)) });
      from += count;
    }
    return deltas;
  }

  /* weights: pairs [blendshape number, weight]. */
  pose(weights) {
    const coarse = this.neutral.slice();
    for (const [k, w] of weights) {
      const { vertices, xyz } = this.deltas[k];
      for (let i = 0; i < vertices.length; i++) for (let a = 0; a < 3; a++) coarse[3 * vertices[i] + a] += w * xyz[3 * i + a];
    }
    const points = CapturePlan.refine(this.S, coarse, 3);
    return { points, normals: CapturePlan.normals(points, this.triangles) };
  }
};
