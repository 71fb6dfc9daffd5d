/* What stands beside the 3D head: the expression stepper and the card of a marker. Names enter as text, never as HTML. */
"use strict";

/* An element with text and children; `attributes` are set as they are. */
CapturePlan.element = function (tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
};

CapturePlan.Panel = class {
  /* root: the element with the stage and the controls; data: what the page embeds; viewer: may be null without WebGL. */
  constructor(root, data, viewer) {
    Object.assign(this, { root, data, viewer });
    this.find = (name) => root.querySelector(`[data-role="${name}"]`);
    this.current = -1; // expression; -1 is the neutral face
    this.single = null; // name of a blendshape shown alone
    this.strength = 1;
    this.numbers = new Map(data.head.blendshapes.map((name, k) => [name, k]));
    const on = (name, type, act) => this.find(name) && this.find(name).addEventListener(type, act);
    on("previous", "click", () => { this.stop(); this.show(this.current - 1); });
    on("next", "click", () => { this.stop(); this.show(this.current + 1); });
    on("play", "click", () => (this.playing ? this.stop() : this.play()));
    on("strength", "input", (event) => { this.stop(); this.setStrength(event.target.value / 100); });
    on("heat", "change", () => this.colour());
    on("names", "change", (event) => { viewer.showNames = event.target.checked; viewer.draw(); });
    on("choice", "change", (event) => { this.stop(); this.show(Number(event.target.value)); });
    for (const button of root.querySelectorAll("[data-view]")) button.addEventListener("click", () => viewer.view(button.dataset.view));
    on("closer", "click", () => viewer.zoom(0.8));
    on("farther", "click", () => viewer.zoom(1.25));
    this.show(-1);
    this.showMarker(-1);
  }

  get expressions() { return this.data.expressions; }

  /* The pose at full strength, as [blendshape number, weight]. */
  weights() {
    if (this.single !== null) return [[this.numbers.get(this.single), 1]];
    return this.current < 0 ? [] : this.expressions[this.current].weights;
  }

  setStrength(strength) {
    this.strength = strength;
    const slider = this.find("strength");
    if (slider) {
      slider.value = Math.round(100 * strength);
      slider.style.setProperty("--value", `${slider.value}%`);
      this.find("strength-text").textContent = `${slider.value} %`;
    }
    this.viewer.setPose(this.weights().map(([k, w]) => [k, w * strength]));
  }

  /* Colour by movement, where that is switched on and something moves. */
  colour() {
    const heat = this.find("heat");
    const on = Boolean(heat && heat.checked && this.weights().length);
    const most = this.viewer.setColours(on ? this.weights() : null);
    const scale = this.find("scale");
    if (!scale) return;
    scale.hidden = !on;
    this.find("most").textContent = `${most.toFixed(1)} mm`;
  }

  /* Show expression e, or the neutral face for -1; `from` is the strength to start from. */
  show(e) {
    const n = this.expressions.length;
    this.single = null;
    this.current = e < -1 ? n - 1 : e >= n ? -1 : e;
    const neutral = this.current < 0;
    const expression = this.expressions[this.current];
    if (this.find("choice")) {
      this.find("choice").value = this.current;
      this.find("count").textContent = neutral ? `Neutral face, before ${n} expressions` : expression.title;
      this.find("title").textContent = neutral ? "Neutral" : expression.sentence;
      this.find("sentence").textContent = neutral ? "Relax the whole face, lips lightly closed, eyes straight ahead." : "";
      this.find("strength").disabled = neutral;
      this.fillShapes(neutral ? [] : expression.blendshapes);
    }
    this.colour();
    this.rise();
  }

  /* One blendshape alone, and the markers that stand for it. */
  showBlendshape(name) {
    if (!this.numbers.has(name)) return;
    this.stop();
    this.current = -1;
    this.single = name;
    const markers = this.data.landmarks.flatMap((landmark, m) => (landmark.blendshapes.includes(name) ? [m] : []));
    if (this.find("choice")) {
      this.find("count").textContent = "One blendshape";
      this.find("title").textContent = name;
      this.find("sentence").textContent = markers.length ? `Seen by ${markers.map((m) => this.data.landmarks[m].name).join(", ")}.` : "No marker stands for it.";
      this.find("strength").disabled = false;
      this.fillShapes([]);
    }
    this.viewer.highlight(new Set(markers));
    this.colour();
    this.rise();
  }

  fillShapes(names) {
    this.find("shapes").replaceChildren(...names.map((name) => this.shapeButton(name)));
    if (this.viewer.highlighted) this.viewer.highlight(null);
  }

  shapeButton(name) {
    const button = CapturePlan.element("button", { type: "button", class: "chip", title: "Show this blendshape alone" }, name);
    button.addEventListener("click", () => this.showBlendshape(name));
    return button;
  }

  /* From neutral to full strength in a third of a second. */
  rise() {
    const turn = (this.turn = (this.turn || 0) + 1);
    if (this.viewer.calm || !this.weights().length) return this.setStrength(1);
    const start = performance.now();
    const step = (time) => {
      if (turn !== this.turn) return;
      const t = Math.min(1, Math.max(0, (time - start) / 320));
      this.setStrength(t * t * (3 - 2 * t));
      if (t < 1) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  play() {
    this.find("play").setAttribute("aria-pressed", "true");
    this.find("play").setAttribute("aria-label", "Stop");
    const next = () => { this.show(this.current + 1); };
    this.playing = setInterval(next, 1800);
    next();
  }

  stop() {
    this.turn = (this.turn || 0) + 1;
    if (!this.playing) return;
    clearInterval(this.playing);
    this.playing = null;
    this.find("play").setAttribute("aria-pressed", "false");
    this.find("play").setAttribute("aria-label", "Play");
  }

  /* The card of marker m; -1 shows how to get one. */
  showMarker(m) {
    const card = this.find("marker");
    if (!card) return;
    if (m < 0) {
      card.replaceChildren(CapturePlan.element("p", { class: "quiet" }, "Point at a marker to see where it goes and what it is for."));
      return;
    }
    const landmark = this.data.landmarks[m];
    const name = CapturePlan.element("strong", {}, landmark.name);
    const dot = CapturePlan.element("span", { class: "dot" });
    dot.style.setProperty("--region", landmark.colour);
    const facts = CapturePlan.element("dl", { class: "facts" });
    for (const [term, value] of landmark.facts) facts.append(CapturePlan.element("dt", {}, term), CapturePlan.element("dd", {}, value));
    card.replaceChildren(
      CapturePlan.element("h3", {}, dot, name, " ", landmark.label),
      facts,
      CapturePlan.element("p", { class: "quiet" }, landmark.blendshapes.length ? "Stands for" : "Stands for no blendshape of its own."),
      CapturePlan.element("div", { class: "chips" }, ...landmark.blendshapes.map((shape) => this.shapeButton(shape))),
    );
  }
};

/* Start the head inside `root`; resolves to {viewer, panel}, or null where the browser cannot draw in 3D. */
CapturePlan.start = async function (root, data) {
  const stage = root.querySelector('[data-role="stage"]');
  try {
    const head = new CapturePlan.Head(data.head, await CapturePlan.unpack(data.head));
    let panel = null, pinned = -1;
    const viewer = new CapturePlan.Viewer(stage, head, data.landmarks, (m, hover = false) => {
      if (!hover) pinned = pinned === m ? -1 : m; // a second click lets go
      const shown = m >= 0 ? m : pinned;
      viewer.select(shown);
      panel.showMarker(shown);
      root.dispatchEvent(new CustomEvent("marker", { detail: { marker: shown, hover } }));
    });
    panel = new CapturePlan.Panel(root, data, viewer);
    root.classList.add("ready");
    return { viewer, panel };
  } catch (error) {
    root.classList.add("no-webgl");
    return null;
  }
};
