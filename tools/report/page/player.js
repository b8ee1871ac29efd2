// The frames of a run: packed as tools/report/src/player.cpp packs them, drawn with three.js.
"use strict";

const kTorn = "#c0392b", kSelected = "#ffb000";
const kCrease = Math.cos(40 * Math.PI / 180);  // faces that meet at more keep an edge

async function inflate(text) {
  const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/// Points of a frame [m], 3N.
function unpackPoints(bytes, count, low, high) {
  const points = new Float32Array(3 * count);
  for (let k = 0; k < 3; ++k) {
    const at = 2 * k * count, scale = (high[k] - low[k]) / 65535;
    for (let i = 0, sum = 0; i < count; ++i) {
      sum = (sum + bytes[at + i] + 256 * bytes[at + count + i]) & 65535;
      points[3 * i + k] = low[k] + sum * scale;
    }
  }
  return points;
}

function unpackTopology(bytes, points, triangles) {
  const m = triangles, corners = 3 * m, indices = new Uint32Array(corners);
  for (let i = 0, last = 0; i < corners; ++i) {
    const z = (bytes[i] | bytes[corners + i] << 8 | bytes[2 * corners + i] << 16 | bytes[3 * corners + i] << 24) >>> 0;
    last += (z >>> 1) ^ -(z & 1);
    indices[i] = last;
  }
  let at = 4 * corners;
  const fragment = new Uint16Array(m);
  for (let t = 0; t < m; ++t) fragment[t] = bytes[at + t] | bytes[at + m + t] << 8;
  at += 2 * m;
  const torn = bytes.subarray(at, at + m), material = bytes.subarray(at + m, at + 2 * m);
  return {indices, fragment, torn, material, ...facesOf(indices, points)};
}

/// The triangles at each point: those of point p are faces[first[p]] ... faces[first[p + 1] - 1].
function facesOf(indices, points) {
  const first = new Uint32Array(points + 1), faces = new Uint32Array(indices.length);
  for (const p of indices) ++first[p + 1];
  for (let p = 0; p < points; ++p) first[p + 1] += first[p];
  const next = first.slice();
  indices.forEach((p, i) => { faces[next[p]++] = Math.floor(i / 3); });
  return {first, faces};
}

/// Area-weighted normals of all triangles, and their lengths.
function faceNormals(indices, points, out) {
  for (let t = 0; t < indices.length; t += 3) {
    const a = 3 * indices[t], b = 3 * indices[t + 1], c = 3 * indices[t + 2];
    const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1], uz = points[b + 2] - points[a + 2];
    const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1], vz = points[c + 2] - points[a + 2];
    out[t] = uy * vz - uz * vy, out[t + 1] = uz * vx - ux * vz, out[t + 2] = ux * vy - uy * vx;
  }
}

/// Normals of all corners: smooth, but for creases and the rims of torn faces.
function cornerNormals(topology, normals, out) {
  const {indices, torn, first, faces} = topology;
  const size = Float32Array.from(torn, (_, t) => Math.hypot(normals[3 * t], normals[3 * t + 1], normals[3 * t + 2]));
  for (let i = 0; i < indices.length; ++i) {
    const t = Math.floor(i / 3), p = indices[i], x = normals[3 * t], y = normals[3 * t + 1], z = normals[3 * t + 2];
    let sx = 0, sy = 0, sz = 0;
    for (let j = first[p]; j < first[p + 1]; ++j) {
      const f = faces[j], nx = normals[3 * f], ny = normals[3 * f + 1], nz = normals[3 * f + 2];
      if (torn[f] !== torn[t] || nx * x + ny * y + nz * z < kCrease * size[f] * size[t]) continue;
      sx += nx, sy += ny, sz += nz;
    }
    const length = Math.hypot(sx, sy, sz) || 1;
    out[3 * i] = sx / length, out[3 * i + 1] = sy / length, out[3 * i + 2] = sz / length;
  }
}

/// Far apart from each other for neighbouring numbers.
function fragmentColour(id) { return new THREE3D.Color().setHSL(id * .61803399 % 1, .45, .55); }

/// From dark over violet and orange to light, as brightness rises evenly; `t` in [0, 1].
const kRamp = ["#0d0887", "#6a00a8", "#b12a90", "#e16462", "#fca636", "#f0f921"];
function rampColour(t) {
  const at = Math.min(Math.max(t, 0), 1) * (kRamp.length - 1), low = Math.min(Math.floor(at), kRamp.length - 2);
  return new THREE3D.Color(kRamp[low]).lerp(new THREE3D.Color(kRamp[low + 1]), at - low);
}

class Player {
  constructor(data, canvas, onFrame, onSelect) {
    Object.assign(this, {data, canvas, onFrame, onSelect, frame: -1, selected: null, mode: "material"});
    this.topologies = new Map(), this.points = new Map();
    this.renderer = new THREE3D.WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: true, alpha: true});
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE3D.Scene();
    this.camera = new THREE3D.PerspectiveCamera(32, 1, 1, 10);
    this.geometry = null, this.shown = -1;
    this.mesh = new THREE3D.Mesh(undefined, new THREE3D.MeshLambertMaterial({vertexColors: true, side: THREE3D.DoubleSide}));
    this.mesh.frustumCulled = false;
    this.scene.add(this.mesh, new THREE3D.HemisphereLight(0xffffff, 0x8c8478, 1.6));
    const key = new THREE3D.DirectionalLight(0xffffff, 1.9);
    key.position.set(-.5, .9, .6), this.camera.add(key), this.scene.add(this.camera);
    this.controls = new THREE3D.OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.look();
    new ResizeObserver(() => this.resize()).observe(canvas);
    let down = null;
    canvas.addEventListener("pointerdown", e => { down = [e.clientX, e.clientY]; });
    canvas.addEventListener("pointerup", e => {
      if (down && Math.hypot(e.clientX - down[0], e.clientY - down[1]) < 4) this.pick(e.clientX, e.clientY);
    });
  }

  /// The camera where it sees the whole run.
  look() {
    const {low, high} = this.data, v = a => new THREE3D.Vector3(...a);
    const centre = v(low).add(v(high)).multiplyScalar(.5), radius = Math.max(v(high).distanceTo(v(low)) / 2, 1e-9);
    const distance = 1.08 * radius / Math.sin(this.camera.fov * Math.PI / 360);
    this.camera.position.copy(centre).add(v([.52, .34, .78]).normalize().multiplyScalar(distance));
    this.camera.near = distance / 100, this.camera.far = distance * 20;
    this.controls.target.copy(centre), this.controls.update();
  }

  resize() {
    const {clientWidth: w, clientHeight: h} = this.canvas;
    if (!w || !h) return;
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() { if (this.geometry) this.renderer.render(this.scene, this.camera); }

  async topology(i) {
    const t = this.data.topologies[i];
    if (!this.topologies.has(i)) this.topologies.set(i, unpackTopology(await inflate(t.data), t.points, t.triangles));
    return this.topologies.get(i);
  }

  async pointsOf(i) {
    const {data, topology} = this.data.frames[i];
    return unpackPoints(await inflate(data), this.data.topologies[topology].points, this.data.low, this.data.high);
  }

  /// Only the last of several that are asked for meanwhile is drawn.
  async show(i) {
    const asked = this.asked = {};
    const place = this.data.frames[i].topology, topology = await this.topology(place), points = await this.pointsOf(i);
    if (asked !== this.asked) return;
    this.frame = i;
    if (this.shown !== place) this.use(place, topology);
    const position = this.geometry.attributes.position.array, {indices} = topology;
    for (let c = 0; c < indices.length; ++c)
      for (let k = 0; k < 3; ++k) position[3 * c + k] = points[3 * indices[c] + k];
    const normals = new Float32Array(indices.length);
    faceNormals(indices, points, normals);
    cornerNormals(topology, normals, this.geometry.attributes.normal.array);
    this.geometry.attributes.position.needsUpdate = this.geometry.attributes.normal.needsUpdate = true;
    this.geometry.boundingSphere = null, this.geometry.boundingBox = null;
    if (this.shownValue() >= 0) await this.colourByValue(i);
    this.draw();
    this.onFrame(i);
  }

  use(place, topology) {
    this.geometry?.dispose();
    this.geometry = this.mesh.geometry = new THREE3D.BufferGeometry();
    for (const name of ["position", "normal", "color"])
      this.geometry.setAttribute(name, new THREE3D.BufferAttribute(new Float32Array(3 * topology.indices.length), 3));
    this.shown = place;
    this.colour();
  }

  async colour() {
    if (this.shown < 0) return;
    if (this.shownValue() >= 0) {
      if (this.frame >= 0) await this.colourByValue(this.frame);
      return this.draw();
    }
    const {fragment, torn, material} = this.topologies.get(this.shown), colours = this.geometry.attributes.color.array;
    const hues = this.data.materials.map(m => new THREE3D.Color(m)), ofFragment = new Map();
    const red = new THREE3D.Color(kTorn), chosen = new THREE3D.Color(kSelected);
    for (let t = 0; t < fragment.length; ++t) {
      const id = fragment[t];
      if (!ofFragment.has(id)) ofFragment.set(id, fragmentColour(id));
      let c = this.mode === "fragment" ? ofFragment.get(id) : this.mode === "torn" && torn[t] ? red : hues[material[t]];
      if (id === this.selected) c = c.clone().lerp(chosen, .6);
      for (let k = 0; k < 9; k += 3) colours[9 * t + k] = c.r, colours[9 * t + k + 1] = c.g, colours[9 * t + k + 2] = c.b;
    }
    this.geometry.attributes.color.needsUpdate = true;
    this.draw();
  }

  /// Which of data.values the mode is, or -1.
  shownValue() { return (this.data.values || []).findIndex(v => v.name === this.mode); }

  /// Each corner has the colour of its point's value; grey where there is none.
  async colourByValue(i) {
    const codes = await inflate(this.data.frames[i].values[this.shownValue()]);
    if (this.frame !== i) return;
    const {indices, fragment} = this.topologies.get(this.shown), colours = this.geometry.attributes.color.array;
    const table = Array.from({length: 256}, (_, c) => c === 0 ? new THREE3D.Color("#8a8a86") : rampColour((c - 1) / 254));
    const chosen = new THREE3D.Color(kSelected), lit = table.map(c => c.clone().lerp(chosen, .6));
    for (let c = 0; c < indices.length; ++c) {
      const of = (fragment[Math.floor(c / 3)] === this.selected ? lit : table)[codes[indices[c]]];
      colours[3 * c] = of.r, colours[3 * c + 1] = of.g, colours[3 * c + 2] = of.b;
    }
    this.geometry.attributes.color.needsUpdate = true;
  }

  async setMode(mode) {
    this.mode = mode;
    await this.colour();
  }

  select(id) {
    this.selected = id;
    this.colour();
    this.onSelect(id);
  }

  /// Selects the fragment at a place of the window, or none.
  pick(x, y) {
    const box = this.canvas.getBoundingClientRect(), ray = new THREE3D.Raycaster();
    ray.setFromCamera(new THREE3D.Vector2((x - box.left) / box.width * 2 - 1, 1 - (y - box.top) / box.height * 2), this.camera);
    const hit = ray.intersectObject(this.mesh)[0];
    this.select(hit ? this.topologies.get(this.shown).fragment[hit.faceIndex] : null);
    return this.selected;
  }
}
