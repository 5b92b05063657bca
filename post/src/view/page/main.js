// Brings data, scene and panel together. `agimpView` lets other scripts set what the panel sets.

const PAPER = { light: [250, 250, 248], dark: [22, 24, 28] };

class Viewer {
  constructor() {
    this.scene = new Scene(element("scene"));
    this.labels = new Labels(element("overlay"));
    this.camera = new Camera();
    const colourable = meta.columns.findIndex((column) => column.kind !== "id");
    const strain = meta.columns.findIndex((column) => column.name === "plastic_strain" && column.range[1] > 0);
    const speed = meta.columns.findIndex((column) => column.name === "speed");
    this.state = {
      frame: meta.frames.length - 1, field: [strain, speed, colourable].find((i) => i >= 0), range: [0, 1], map: "viridis",
      logarithmic: false, onlyRange: false, cutAxis: "", cutAt: 0.5, cutFlip: false, leaves: "", size: 1, axes: true,
      perspective: this.camera.perspective, dark: matchMedia("(prefers-color-scheme: dark)").matches, rate: 5, playing: false,
    };
    const most = Math.max(...meta.frames.map((frame) => frame.particles));
    this.frames = new Store(readFrame, most * (8 + 2 * meta.columns.length));
    this.trees = new Store(readTree, 20 * Math.max(...meta.frames.map((frame) => frame.leaves)));
    this.part = 1;
    this.fitted = true; // until the reader moves the camera, it follows the size of the window
    connect(this.state, (what) => this.changed(what), {
      look: (view) => { this.camera.look(view); this.fit(); },
      fit: () => this.fit(), save: () => this.save(), play: () => this.play(), range: (kind) => this.setRange(kind),
    });
    handle(element("overlay"), this.camera, () => this.moved(), (x, y) => this.pick(x, y));
    addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.resize()).observe(element("scene"));
    const shade = new Float32Array([0.55, 0.55, 0.55]);
    this.scene.setBoxes(this.scene.domain, new Float32Array(LOW), new Float32Array(EXTENT), shade);
  }

  async start() {
    this.resize();
    this.setRange("usual");
    this.fit();
    await this.changed("frame");
  }

  // Does what a change of the state asks for; a later change overtakes an earlier one that waits for data.
  async changed(what) {
    const { state, scene } = this;
    if (what === "field") {
      this.setRange("usual");
      // The legend of another field may be wider.
      if (this.fitted) this.fit();
    }
    if (what === "frame" || what === "field") {
      const wanted = state.frame;
      const frame = await this.frames.get(wanted);
      if (wanted !== state.frame) return;
      if (this.frame !== frame) {
        this.follow(frame);
        this.frame = frame;
        scene.setFrame(frame, state.field);
      } else if (what === "field") {
        scene.setColumn(frame, state.field);
      }
      if (meta.frames.length > 1) this.frames.get((wanted + 1) % meta.frames.length);
    }
    if (what === "table" || what === "field" || !this.hasTable) {
      scene.setTable(colourTable(meta.columns[state.field], state));
      this.hasTable = true;
    }
    if (what === "leaves" || what === "frame") await this.setTree();
    this.camera.perspective = state.perspective;
    this.redraw();
  }

  async setTree() {
    const { state, scene } = this;
    const of = meta.frames[state.frame];
    if (!state.leaves || !of.leaves || this.shownTree === of.tree) return;
    const tree = await this.trees.get(state.frame);
    if (meta.frames[state.frame].tree !== tree.tree) return;
    const [sizes, tints] = [new Float32Array(3 * tree.count), new Float32Array(3 * tree.count)];
    for (let i = 0; i < tree.count; i++) {
      sizes.fill(tree.edges[i], 3 * i, 3 * i + meta.dimension);
      tints.set(classColour(tree.levels[i]).map((x) => x / 255), 3 * i);
    }
    scene.setBoxes(scene.tree, tree.corners, sizes, tints);
    this.shownTree = of.tree;
    this.levels = [...new Set(tree.levels)].sort((a, b) => a - b);
  }

  setRange(kind) {
    const { state } = this;
    const column = meta.columns[state.field];
    state.range = [...(kind === "usual" ? column.usual : column.range)];
    if (kind === "now" && this.frame) {
      const levels = this.frame.columns[state.field];
      const [low, high] = levels.reduce(([low, high], x) => [Math.min(low, x), Math.max(high, x)], [65535, 0]);
      state.range = [valueOf(column, low), valueOf(column, high)];
    }
    if (this.frame) this.changed("table");
  }

  // Keeps a particle marked through time if its identifier is known.
  follow(frame) {
    const column = meta.columns.findIndex((column) => column.kind === "id");
    const id = this.state.picked && column >= 0 ? this.frame.columns[column][this.state.picked.index] : undefined;
    const index = id === undefined ? -1 : frame.columns[column].indexOf(id);
    this.state.picked = index < 0 ? undefined : this.describe(frame, index);
  }

  describe(frame, index) {
    const place = [0, 1, 2].map((axis) => frame.place[4 * index + axis] * meta.resolution);
    const axes = [..."xyz"].slice(0, meta.dimension);
    const rows = axes.map((name, axis) => [`${name} [m]`, text(meta.bounds[0][axis] + place[axis], 5)]);
    meta.columns.forEach((column, i) => {
      rows.push([named(column), meaning(column, valueOf(column, frame.columns[i][index]))]);
    });
    return { index, place, rows };
  }

  pick(x, y) {
    const ratio = this.state.ratio;
    const index = this.frame && this.scene.pick(this.view(), this.look(), x * ratio, y * ratio);
    this.state.picked = index === undefined ? undefined : this.describe(this.frame, index);
    this.redraw();
    return this.state.picked;
  }

  view() {
    return this.camera.matrix(this.scene.canvas.width, this.scene.canvas.height);
  }

  // What labels show.
  shown() {
    return { ...this.state, column: meta.columns[this.state.field], shown: this.part, levels: this.levels };
  }

  // The box whose edges carry numbers: what fitted, and of a plane that is seen from the front what is in the window.
  box(view) {
    const { box, ratio } = this.state;
    const { camera } = this;
    if (meta.dimension === 3 || camera.yaw || camera.pitch || this.fitted) return box;
    const [start, end] = [[0, 0, 0], [1, 1, 0]].map((place) => view.project(place));
    const { left, top } = this.labels.room(this.shown(), this.scene.canvas.clientWidth);
    const { width, height } = this.scene.canvas;
    const seen = {
      low: [((left + 75) * ratio - start.x) / (end.x - start.x), (height - 45 * ratio - start.y) / (end.y - start.y), 0],
      high: [(width - 25 * ratio - start.x) / (end.x - start.x), (top * ratio - start.y) / (end.y - start.y), 0],
    };
    const low = LOW.map((x, axis) => Math.max(x, seen.low[axis]));
    const high = HIGH.map((x, axis) => Math.min(x, seen.high[axis]));
    return low[0] < high[0] && low[1] < high[1] ? { low, high } : box;
  }

  look() {
    const { state } = this;
    const axis = "xyz".indexOf(state.cutAxis);
    let cut = NO_CUT;
    if (state.cutAxis) {
      const at = LOW[axis] + state.cutAt * EXTENT[axis];
      const sign = state.cutFlip ? -1 : 1;
      cut = [0, 0, 0, sign * at].with(axis, sign);
    }
    return {
      paper: state.dark ? PAPER.dark : PAPER.light, size: state.size, cut, showTree: state.leaves !== "", showDomain: state.axes, part: this.part,
    };
  }

  fit() {
    const { clientWidth, clientHeight } = this.scene.canvas;
    // The domain, or less of it where the particles fill but a little.
    const reach = meta.bounds[1].map((x, axis) => (axis < meta.dimension ? x - meta.bounds[0][axis] : 0));
    const room = 0.25 * Math.max(...reach);
    const low = LOW.map((x, axis) => Math.max(x, -room * (axis < meta.dimension)));
    const high = HIGH.map((x, axis) => Math.min(x, reach[axis] + room * (axis < meta.dimension)));
    this.state.box = { low, high };
    // Legend and title, and the numbers of the axes, have places of their own.
    const { left, top } = this.labels.room(this.shown(), clientWidth);
    const numbers = this.state.axes ? 55 : 15;
    const wide = this.state.axes ? 75 : 15;
    this.camera.fit(low, high, clientWidth, clientHeight, [left + wide, 25, top, numbers]);
    this.camera.depth = Math.hypot(...EXTENT);
    this.fitted = true;
    this.redraw();
  }

  resize() {
    const ratio = Math.min(devicePixelRatio || 1, 2);
    for (const canvas of [element("scene"), element("overlay")]) {
      canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
      canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    }
    this.state.ratio = ratio;
    if (this.fitted) this.fit();
    this.drawNow();
  }

  redraw() {
    this.waiting ??= requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    this.waiting = undefined;
    const view = this.view();
    const start = performance.now();
    this.scene.draw(view, this.look());
    if (this.moving) {
      this.scene.wait();
      const factor = Math.min(Math.max(50 / (performance.now() - start), 0.25), 1.5);
      this.fluent = Math.min(Math.max(this.part * factor, 1 / 64), 1);
    }
    this.pictures = (this.pictures ?? 0) + 1;
    this.labels.draw(view, { ...this.shown(), box: this.box(view) });
    reflect(this.state);
  }

  // While the reader turns, only as many particles are drawn as take a twentieth of a second.
  moved() {
    this.fitted = false;
    this.moving = true;
    this.part = this.fluent ?? 1;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      this.moving = false;
      this.part = 1;
      this.redraw();
    }, 250);
    this.redraw();
  }

  async play() {
    const { state } = this;
    state.playing = !state.playing;
    this.redraw();
    while (state.playing) {
      const start = performance.now();
      state.frame = (state.frame + 1) % meta.frames.length;
      await this.changed("frame");
      await new Promise((done) => setTimeout(done, Math.max(0, 1000 / state.rate - (performance.now() - start))));
    }
  }

  go(frame) {
    this.state.frame = Math.min(Math.max(frame, 0), meta.frames.length - 1);
    return this.changed("frame");
  }

  key(event) {
    if (/^(INPUT|SELECT|BUTTON)$/.test(event.target.tagName) || event.ctrlKey || event.metaKey) return;
    const { state } = this;
    if (event.key === " ") this.play();
    else if (event.key === "ArrowRight") this.go(state.frame + 1);
    else if (event.key === "ArrowLeft") this.go(state.frame - 1);
    else if (event.key === "f") this.fit();
    else return;
    event.preventDefault();
  }

  save() {
    this.part = 1;
    this.drawNow();
    const { width, height } = this.scene.canvas;
    const picture = Object.assign(document.createElement("canvas"), { width, height });
    const context = picture.getContext("2d");
    context.drawImage(this.scene.canvas, 0, 0);
    context.drawImage(this.labels.canvas, 0, 0);
    picture.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${meta.frames[this.state.frame].file.replace(/\.[^.]*$/, "")}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }
}

function fail(error) {
  element("message").textContent = error?.message ?? String(error);
  element("message").hidden = false;
  document.documentElement.dataset.state = "failed";
}
addEventListener("error", (event) => fail(event.error ?? event.message));
addEventListener("unhandledrejection", (event) => fail(event.reason));

if (typeof DecompressionStream === "undefined") {
  fail("This browser is too old for this page. Firefox from 115 and Chromium from 110 on can show it.");
} else {
  const viewer = new Viewer();
  window.agimpView = viewer;
  viewer.start().then(() => {
    document.documentElement.dataset.state ??= "ready";
    document.documentElement.dataset.milliseconds = Math.round(performance.now());
  });
}
