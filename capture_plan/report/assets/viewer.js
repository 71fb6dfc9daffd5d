/* The 3D head: draws a CapturePlan.Head with its markers, their names, and a camera that turns around it.
 *
 * Names are shown by HTML elements above the canvas. A name is hidden when its marker is behind the head: after each
 * picture the depth of the head is drawn small and read back, and a marker that lies deeper is out of sight.
 */
"use strict";

const HAIR = { color: "#3a2a22", roughness: 0.8, transparent: true, opacity: 0.35, depthWrite: false };
const EYE = { color: "#f4f1ec", roughness: 0.16 };
const TONGUE = { color: "#c06a64", roughness: 0.5 };
const CLAY = { color: "#b9a99f", roughness: 0.8 };
CapturePlan.LOOK = { // of the kinds in capture_plan/rig/parts.py; the rest is of clay
  skin: { color: "#dfc9ba", roughness: 0.66 },
  eye: EYE,
  iris: EYE,
  lash: HAIR,
  "eye line": HAIR,
  hair: HAIR,
  brow: { color: "#4a3528", roughness: 0.9 },
  clear: { color: "#ffffff", roughness: 0.1, transparent: true, opacity: 0.04, depthWrite: false },
  teeth: { color: "#f2ece0", roughness: 0.3 },
  tongue: TONGUE,
  gums: TONGUE,
};
const EYES = ["eye", "iris"]; // painted with an iris and a pupil
CapturePlan.HEAT = ["#dbdbd9", "#fad473", "#f28538", "#c72933", "#5c0a38"]; // still to moving most, as on the printed pages
CapturePlan.VIEWS = { front: [0, 0], left: [50, 4], right: [-50, 4], chin: [0, -42] }; // degrees around and above
const MARKER_MM = 2.0; // drawn radius
const DEPTH_PIXELS = 320; // width of the small depth picture

CapturePlan.Viewer = class {
  /* stage: the element to fill; head: CapturePlan.Head; landmarks: as packed by the page; onSelect(number or -1). */
  constructor(stage, head, landmarks, onSelect) {
    Object.assign(this, { stage, head, landmarks, onSelect });
    this.selected = -1;
    this.highlighted = null; // set of landmarks to keep bright, or null for all
    this.heat = false;
    this.showNames = true;
    this.calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
    const canvas = this.renderer.domElement;
    canvas.setAttribute("aria-hidden", "true");
    stage.prepend(canvas);
    this.buildScene();
    this.buildMarkers();
    this.buildNames();
    this.control(canvas);
    this.setPose([]);
    new ResizeObserver(() => this.resize()).observe(stage);
    this.resize();
    this.view("front", true);
  }

  buildScene() {
    this.scene = new THREE.Scene();
    this.focus = this.face();
    this.camera = new THREE.PerspectiveCamera(24, 1, 0.1 * this.head.radius, 40 * this.head.radius);
    this.camera.position.set(0, this.focus.y, this.wholeHead());
    this.scene.add(new THREE.HemisphereLight("#f4f6ff", "#c9b3a6", 1.9)); // the room: light from above, warm from below
    for (const [intensity, colour, x, y, z] of [[2.0, "#fff3e6", -0.75, 0.85, 1], [0.8, "#e4ecff", 1, 0, 0.8], [0.5, "#ffffff", 0.3, 0.9, -0.6]]) {
      const light = new THREE.DirectionalLight(colour, intensity);
      light.position.set(x, y, z).multiplyScalar(1000);
      this.camera.add(light, light.target); // lights follow the eye: the face is well lit from every side
    }
    this.scene.add(this.camera);

    const { head } = this;
    const order = Array.from(head.materials.keys()).sort((a, b) => head.materials[a] - head.materials[b] || a - b);
    const index = new Uint32Array(head.triangles.length);
    order.forEach((f, i) => index.set(head.triangles.subarray(3 * f, 3 * f + 3), 3 * i));
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setIndex(new THREE.BufferAttribute(index, 1));
    const v = head.S.start.length - 1;
    for (const name of ["position", "normal", "color", "rest"]) this.geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(3 * v), 3));
    this.geometry.attributes.rest.array.set(this.eyeDirections());
    let from = 0;
    const materials = head.materialNames.map((name, m) => {
      const count = head.materials.reduce((n, other) => n + (other === m), 0);
      this.geometry.addGroup(3 * from, 3 * count, m);
      from += count;
      const material = new THREE.MeshStandardMaterial({ vertexColors: true, metalness: 0, side: 2, ...(CapturePlan.LOOK[name] ?? CLAY) });
      if (EYES.includes(name)) material.onBeforeCompile = CapturePlan.paintIris;
      return material;
    });
    this.skin = materials[head.materialNames.indexOf("skin")];
    this.mesh = new THREE.Mesh(this.geometry, materials);
    this.mesh.frustumCulled = false;
    this.scene.add(this.mesh);
    this.depthMaterial = new THREE.ShaderMaterial({
      side: 2,
      uniforms: { near: { value: 0 }, far: { value: 1 } },
      vertexShader: "varying float z; void main() { vec4 p = modelViewMatrix * vec4(position, 1.0); z = -p.z; gl_Position = projectionMatrix * p; }",
      fragmentShader: "varying float z; uniform float near, far; void main() { float d = clamp((z - near) / (far - near), 0.0, 1.0) * 255.0; gl_FragColor = vec4(floor(d) / 255.0, fract(d), 0.0, 1.0); }",
    });
  }

  /* What the camera frames: the height of the markers' middle, and a radius that takes in the whole face around them.
   * A rig may be a bust, so its own extent says little. */
  face() {
    const heights = this.landmarks.map((landmark) => this.head.neutral[3 * landmark.corners[0] + 1]);
    const low = Math.min(...heights), high = Math.max(...heights);
    const half = (high - low) / 2;
    if (!(half > 0.2 * this.head.radius)) return { y: 0, radius: this.head.radius };
    const radius = Math.min(this.head.radius, 1.85 * half);
    return { y: (low + high) / 2 + 0.2 * half, radius }; // skulls reach further up than chins reach down
  }

  /* Where on its eyeball each eye vertex lies at rest, as a direction from the eyeball's middle; zero elsewhere. */
  eyeDirections() {
    const { head } = this;
    const rest = head.pose([]).points;
    const out = new Float32Array(rest.length);
    const eyes = EYES.map((name) => head.materialNames.indexOf(name));
    for (const side of [-1, 1]) {
      const own = new Set();
      head.materials.forEach((m, f) => {
        if (eyes.includes(m)) for (let a = 0; a < 3; a++) if (Math.sign(rest[3 * head.triangles[3 * f + a]]) === side) own.add(head.triangles[3 * f + a]);
      });
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (const i of own) for (let a = 0; a < 3; a++) {
        low[a] = Math.min(low[a], rest[3 * i + a]);
        high[a] = Math.max(high[a], rest[3 * i + a]);
      }
      const radius = (high[0] - low[0]) / 2;
      for (const i of own) for (let a = 0; a < 3; a++) out[3 * i + a] = (rest[3 * i + a] - (low[a] + high[a]) / 2) / radius;
    }
    return out;
  }

  buildMarkers() {
    const n = this.landmarks.length;
    this.dots = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 20, 14), new THREE.MeshStandardMaterial({ roughness: 0.4 }), Math.max(n, 1));
    this.dots.count = n;
    this.dots.frustumCulled = false;
    this.scene.add(this.dots);
    this.seen = this.landmarks.map(() => false);
    this.places = this.landmarks.map(() => ({ point: new THREE.Vector3(), normal: new THREE.Vector3() }));
  }

  buildNames() {
    this.layer = document.createElement("div");
    this.layer.className = "layer";
    this.stage.append(this.layer);
    this.tags = this.landmarks.map((landmark, m) => {
      const tag = document.createElement("button");
      tag.type = "button";
      tag.tabIndex = -1; // the table beside it is the way for the keyboard
      tag.className = "tag";
      tag.style.setProperty("--region", landmark.colour);
      tag.setAttribute("aria-label", `${landmark.name}, ${landmark.label}`);
      const text = document.createElement("span");
      text.textContent = landmark.name;
      tag.append(text);
      tag.addEventListener("click", () => this.onSelect(m));
      tag.addEventListener("pointerenter", (event) => event.pointerType === "mouse" && this.onSelect(m, true));
      tag.addEventListener("pointerleave", (event) => event.pointerType === "mouse" && this.onSelect(-1, true));
      this.layer.append(tag);
      return tag;
    });
    this.sides = [["Actor’s left", 1], ["Actor’s right", -1]].map(([text, side]) => {
      const element = document.createElement("div");
      element.className = "side";
      element.textContent = text;
      this.layer.append(element);
      return { element, point: new THREE.Vector3(side * this.focus.radius * 0.72, this.focus.y - this.focus.radius * 0.72, 0) };
    });
  }

  control(canvas) {
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { enableDamping: !this.calm, dampingFactor: 0.12, enablePan: false, rotateSpeed: 0.75 });
    this.controls.target.set(0, this.focus.y, 0);
    Object.assign(this.controls, { minDistance: this.head.radius * 1.6, maxDistance: this.head.radius * 9 });
    this.controls.addEventListener("change", () => this.draw());
    canvas.style.touchAction = ""; // the style sheet decides: on phones a vertical swipe scrolls the page
    // The wheel zooms only after the head was touched, so that nobody gets stuck on it while scrolling.
    this.stage.addEventListener("wheel", (event) => {
      if (!this.stage.contains(document.activeElement)) event.stopPropagation();
    }, { capture: true, passive: true });
    canvas.addEventListener("pointerdown", () => { this.motion = null; this.stage.focus({ preventScroll: true }); });
    this.stage.addEventListener("keydown", (event) => {
      const turn = { ArrowLeft: [-10, 0], ArrowRight: [10, 0], ArrowUp: [0, 10], ArrowDown: [0, -10] }[event.key];
      const zoom = { "+": 0.85, "=": 0.85, "-": 1 / 0.85 }[event.key];
      if (event.key === "Home" || event.key === "0") this.view("front");
      else if (turn) this.fly(this.goal().around + turn[0], this.goal().above + turn[1], this.goal().distance);
      else if (zoom) this.zoom(zoom);
      else return;
      event.preventDefault();
    });
  }

  /* Degrees around the head (0 front, positive towards the actor's left) and above the horizon. */
  angle() {
    const p = this.camera.position.clone().sub(this.controls.target);
    return { around: Math.atan2(p.x, p.z) * 180 / Math.PI, above: Math.asin(p.y / p.length()) * 180 / Math.PI };
  }

  /* Where the camera is on its way to, so that keys pressed quickly add up. */
  goal() { return this.motion ? this.motion.goal : { ...this.angle(), distance: this.distance() }; }

  distance() { return this.camera.position.distanceTo(this.controls.target); }

  /* Far enough for the whole head at this shape of the stage. */
  wholeHead() {
    const half = Math.tan(this.camera.fov * Math.PI / 360);
    return this.focus.radius * 1.12 * Math.max(1, 0.82 / this.camera.aspect) / half;
  }

  view(name, now = false) {
    const [around, above] = CapturePlan.VIEWS[name];
    this.fly(around, above, this.wholeHead(), now);
  }

  zoom(factor) {
    const { around, above, distance } = this.goal();
    this.fly(around, above, Math.min(this.controls.maxDistance, Math.max(this.controls.minDistance, distance * factor)));
  }

  /* Move the camera on an arc, in about half a second. */
  fly(around, above, distance, now = false) {
    const from = { ...this.angle(), distance: this.distance() };
    const short = ((around - from.around + 540) % 360) - 180;
    const start = performance.now();
    const place = (s) => {
      const a = (from.around + s * short) * Math.PI / 180;
      const b = Math.max(-80, Math.min(80, from.above + s * (above - from.above))) * Math.PI / 180;
      const d = from.distance + s * (distance - from.distance);
      this.camera.position.set(Math.sin(a) * Math.cos(b), Math.sin(b), Math.cos(a) * Math.cos(b)).multiplyScalar(d).add(this.controls.target);
    };
    const step = (time) => {
      const t = now || this.calm ? 1 : Math.min(1, Math.max(0, (time - start) / 480));
      place(t < 1 ? 1 - (1 - t) ** 3 : 1);
      if (t === 1) this.motion = null;
    };
    this.motion = { step, goal: { around, above, distance } };
    if (now) step(start);
    this.draw();
  }

  lookAt(m) {
    const { normal } = this.places[m];
    const around = Math.atan2(normal.x, Math.max(normal.z, 0.15)) * 180 / Math.PI;
    const above = Math.asin(Math.max(-1, Math.min(1, normal.y))) * 180 / Math.PI;
    this.fly(Math.max(-100, Math.min(100, around * 0.85)), Math.max(-45, Math.min(45, above * 0.6)), Math.min(this.distance(), this.wholeHead() * 0.85));
  }

  setPose(weights) {
    const { points, normals } = this.head.pose(weights);
    const { position, normal } = this.geometry.attributes;
    position.array.set(points);
    normal.array.set(normals);
    position.needsUpdate = normal.needsUpdate = true;
    this.rest = this.rest || points;
    this.landmarks.forEach((landmark, m) => {
      const { point, normal: direction } = this.places[m];
      point.set(0, 0, 0);
      direction.set(0, 0, 0);
      landmark.corners.forEach((corner, i) => {
        const w = landmark.barycentric[i];
        point.add(new THREE.Vector3().fromArray(points, 3 * corner).multiplyScalar(w));
        direction.add(new THREE.Vector3().fromArray(normals, 3 * corner).multiplyScalar(w));
      });
      direction.normalize();
    });
    this.placeMarkers();
    this.draw();
  }

  /* Colours of the surface: lit clay, or how far each point moves in the pose `weights`, millimetres. Gives the largest. */
  setColours(weights) {
    const { color } = this.geometry.attributes;
    const moved = weights ? this.head.pose(weights).points : this.rest;
    const distance = new Float32Array(moved.length / 3);
    let most = 0;
    for (let i = 0; i < distance.length; i++) {
      distance[i] = Math.hypot(...[0, 1, 2].map((a) => moved[3 * i + a] - this.rest[3 * i + a]));
      most = Math.max(most, distance[i]);
    }
    const ramp = CapturePlan.HEAT.map((hex) => new THREE.Color(hex));
    const mixed = new THREE.Color();
    for (let i = 0; i < distance.length; i++) {
      const dark = 0.35 + 0.65 * this.head.shade[i];
      if (weights && most > 0) {
        const at = distance[i] / most * (ramp.length - 1);
        const step = Math.min(ramp.length - 2, Math.floor(at));
        mixed.copy(ramp[step]).lerp(ramp[step + 1], at - step);
      } else mixed.setRGB(1, 1, 1);
      color.array.set([mixed.r * dark, mixed.g * dark, mixed.b * dark], 3 * i);
    }
    color.needsUpdate = true;
    if (this.skin) this.skin.color.set(weights ? "#ffffff" : CapturePlan.LOOK.skin.color);
    this.draw();
    return most;
  }

  select(m) { this.selected = m; this.placeMarkers(); this.draw(); }

  highlight(set) { this.highlighted = set; this.placeMarkers(); this.draw(); }

  bright(m) { return !this.highlighted || this.highlighted.has(m) || m === this.selected; }

  /* Dots lie flat on the skin like stickers. */
  placeMarkers() {
    const up = new THREE.Vector3(0, 1, 0);
    const turn = new THREE.Quaternion();
    const matrix = new THREE.Matrix4();
    this.places.forEach(({ point, normal }, m) => {
      const r = MARKER_MM * this.scale() * (m === this.selected ? 1.6 : this.bright(m) ? 1 : 0.6);
      matrix.compose(point, turn.setFromUnitVectors(up, normal), new THREE.Vector3(r, 0.45 * r, r));
      this.dots.setMatrixAt(m, matrix);
      this.dots.setColorAt(m, new THREE.Color(this.bright(m) ? this.landmarks[m].colour : "#a39a94"));
    });
    this.dots.instanceMatrix.needsUpdate = true;
    if (this.dots.instanceColor) this.dots.instanceColor.needsUpdate = true;
  }

  scale() { return this.focus.radius / 120; } // 120 mm: half the height of an adult head

  resize() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (!width || !height) return;
    const whole = this.distance() / this.wholeHead();
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height, false);
    if (this.depth) this.depth.dispose();
    this.depth = new THREE.WebGLRenderTarget(DEPTH_PIXELS, Math.max(1, Math.round(DEPTH_PIXELS * height / width)));
    this.fly(this.angle().around, this.angle().above, whole * this.wholeHead(), true);
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((time) => {
      this.waiting = false;
      if (this.motion) { this.motion.step(time); this.draw(); }
      this.controls.update();
      this.renderer.render(this.scene, this.camera);
      this.placeNames();
      this.look();
    });
  }

  /* Draws the head's depth small; resolves to a function of the place on the screen (0 to 1, y up) that gives it in
   * millimetres from the camera. Reading back without waiting keeps turning smooth. */
  async readDepth() {
    const { uniforms } = this.depthMaterial;
    const near = Math.max(1, this.distance() - 2 * this.head.radius), far = this.distance() + 2 * this.head.radius;
    uniforms.near.value = near;
    uniforms.far.value = far;
    this.dots.visible = false;
    this.scene.overrideMaterial = this.depthMaterial;
    this.renderer.setRenderTarget(this.depth);
    this.renderer.setClearColor(0xffffff, 1);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    this.renderer.setRenderTarget(null);
    this.renderer.setClearColor(0x000000, 0);
    this.scene.overrideMaterial = null;
    this.dots.visible = true;
    const { width, height } = this.depth;
    const pixels = new Uint8Array(4 * width * height);
    await this.renderer.readRenderTargetPixelsAsync(this.depth, 0, 0, width, height, pixels);
    const within = (share, size) => Math.min(size - 1, Math.max(0, Math.floor(share * size)));
    return (x, y) => {
      const i = 4 * (within(y, height) * width + within(x, width));
      return near + (far - near) * (pixels[i] + pixels[i + 1] / 255) / 255;
    };
  }

  /* Which markers can be seen from where the camera stands. One reading at a time; a newer one is answered afterwards. */
  async look() {
    if (this.looking) { this.lookAgain = true; return; }
    this.looking = true;
    const camera = this.camera.clone();
    const depthAt = await this.readDepth();
    const seen = this.places.map(({ point, normal }) => {
      const screen = point.clone().addScaledVector(normal, 1.5 * this.scale()).project(camera);
      const depth = -point.clone().applyMatrix4(camera.matrixWorldInverse).z;
      const facing = normal.dot(camera.position.clone().sub(point).normalize()) > 0.06;
      return facing && depth < depthAt((screen.x + 1) / 2, (screen.y + 1) / 2) + 4 * this.scale();
    });
    this.looking = false;
    const changed = seen.some((visible, m) => visible !== this.seen[m]);
    this.seen = seen;
    if (changed) this.placeNames();
    if (this.lookAgain) { this.lookAgain = false; this.look(); }
  }

  /* Put every visible marker's name beside it where it covers no other name. */
  placeNames() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    const taken = [];
    const items = this.places.map(({ point, normal }, m) => {
      const screen = point.clone().addScaledVector(normal, 1.5 * this.scale()).project(this.camera);
      const depth = -point.clone().applyMatrix4(this.camera.matrixWorldInverse).z;
      return { m, x: (screen.x + 1) / 2 * width, y: (1 - screen.y) / 2 * height, depth, visible: this.seen[m] };
    });
    for (const { x, y, visible } of items) if (visible) taken.push([x - 5, y - 5, x + 5, y + 5]);
    const first = (item) => (item.m === this.selected ? -1e9 : this.bright(item.m) ? 0 : 1e9) + item.depth;
    for (const item of items.sort((a, b) => first(a) - first(b))) {
      const tag = this.tags[item.m];
      tag.hidden = !item.visible;
      if (!item.visible) continue;
      const text = tag.firstChild;
      const w = 7.2 * this.landmarks[item.m].name.length + 8, h = 17;
      const outwards = item.x < width / 2 ? -1 : 1;
      const places = [[outwards * (w / 2 + 9), 0], [-outwards * (w / 2 + 9), 0], [0, -16], [0, 16], [outwards * (w / 2 + 6), -13], [outwards * (w / 2 + 6), 13]];
      const free = places.find(([dx, dy]) => {
        const box = [item.x + dx - w / 2, item.y + dy - h / 2, item.x + dx + w / 2, item.y + dy + h / 2];
        return taken.every((other) => box[0] > other[2] || box[2] < other[0] || box[1] > other[3] || box[3] < other[1]);
      });
      const shown = this.showNames && (free || item.m === this.selected);
      text.hidden = !shown;
      tag.classList.toggle("selected", item.m === this.selected);
      tag.classList.toggle("pale", !this.bright(item.m));
      tag.style.transform = `translate(${item.x.toFixed(1)}px, ${item.y.toFixed(1)}px)`;
      if (!shown) continue;
      const [dx, dy] = free || places[0];
      text.style.transform = `translate(-50%, -50%) translate(${dx.toFixed(1)}px, ${dy.toFixed(1)}px)`;
      taken.push([item.x + dx - w / 2, item.y + dy - h / 2, item.x + dx + w / 2, item.y + dy + h / 2]);
    }
    for (const { element, point } of this.sides) {
      const screen = point.clone().project(this.camera);
      const x = Math.max(52, Math.min(width - 52, (screen.x + 1) / 2 * width)); // 52 px: half of the words
      element.style.transform = `translate(${x.toFixed(1)}px, ${((1 - screen.y) / 2 * height).toFixed(1)}px) translate(-50%, -50%)`;
      element.hidden = point.clone().applyMatrix4(this.camera.matrixWorldInverse).z < -this.distance() - this.head.radius * 0.35;
    }
  }
};

/* Iris and pupil by the angle from straight ahead, sharp at every zoom and on the coarsest eyeball. */
CapturePlan.paintIris = function (shader) {
  shader.vertexShader = shader.vertexShader
    .replace("#include <common>", "#include <common>\nattribute vec3 rest; varying vec3 vRest;")
    .replace("#include <begin_vertex>", "#include <begin_vertex>\nvRest = rest;");
  shader.fragmentShader = shader.fragmentShader
    .replace("#include <common>", "#include <common>\nvarying vec3 vRest;")
    .replace("#include <color_fragment>", `#include <color_fragment>
      vec3 eye = normalize(vRest + vec3(0.0, 0.0, 1e-6));
      float off = length(eye.xy) + step(eye.z, 0.0);
      float soft = fwidth(off) + 0.012;
      float fibre = 0.5 + 0.5 * sin(atan(eye.y, eye.x) * 46.0);
      vec3 iris = mix(vec3(0.20, 0.13, 0.08), vec3(0.34, 0.23, 0.14), smoothstep(0.18, 0.44, off) * (0.6 + 0.4 * fibre));
      iris *= 1.0 - 0.55 * smoothstep(0.38, 0.46, off);
      diffuseColor.rgb = mix(iris, diffuseColor.rgb, smoothstep(0.46 - soft, 0.46 + soft, off));
      diffuseColor.rgb = mix(vec3(0.012), diffuseColor.rgb, smoothstep(0.18 - soft, 0.18 + soft, off));`);
};
