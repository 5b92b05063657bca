// The panel and the line of times: what the reader sets goes into `state`, and `changed` is told what has changed.

const element = (id) => document.getElementById(id);

function options(select, entries) {
  select.replaceChildren(...entries.map(([value, words]) => new Option(words, value)));
}

function connect(state, changed, actions) {
  options(element("field"), meta.columns.map((column, i) => [i, column.name.replaceAll("_", " ")]).filter(([i]) => meta.columns[i].kind !== "id"));
  options(element("map"), Object.keys(MAPS).map((name) => [name, name]));
  if (meta.dimension === 2) element("cut").lastElementChild.remove();
  element("leaves").disabled = !meta.frames.some((frame) => frame.leaves);
  element("time").max = meta.frames.length - 1;
  element("timeline").hidden = meta.frames.length === 1;
  element("views").replaceChildren(
    ...Object.keys(VIEWS).map((name) => {
      const button = document.createElement("button");
      button.textContent = name;
      button.onclick = () => actions.look(name);
      return button;
    }),
  );

  // Elements whose value is a part of the state, with what to do about it.
  const bind = (id, name, read, what) => {
    element(id).addEventListener("input", ({ target }) => {
      state[name] = read(target);
      changed(what);
    });
  };
  bind("field", "field", (e) => Number(e.value), "field");
  bind("map", "map", (e) => e.value, "table");
  bind("logarithmic", "logarithmic", (e) => e.checked, "table");
  bind("only-range", "onlyRange", (e) => e.checked, "table");
  bind("cut", "cutAxis", (e) => e.value, "view");
  bind("cut-at", "cutAt", (e) => e.value / 1000, "view");
  bind("cut-flip", "cutFlip", (e) => e.checked, "view");
  bind("leaves", "leaves", (e) => e.value, "leaves");
  bind("size", "size", (e) => e.value / 100, "view");
  bind("axes", "axes", (e) => e.checked, "view");
  bind("perspective", "perspective", (e) => e.checked, "view");
  bind("dark", "dark", (e) => e.checked, "view");
  bind("time", "frame", (e) => Number(e.value), "frame");
  bind("rate", "rate", (e) => Number(e.value), "rate");
  for (const [id, end] of [["low", 0], ["high", 1]]) {
    element(id).addEventListener("change", ({ target }) => {
      const value = Number(target.value.replace(",", "."));
      if (target.value.trim() && Number.isFinite(value)) state.range[end] = value;
      changed("table");
    });
  }
  element("range-usual").onclick = () => actions.range("usual");
  element("range-all").onclick = () => actions.range("all");
  element("range-now").onclick = () => actions.range("now");
  element("fit").onclick = actions.fit;
  element("save").onclick = actions.save;
  element("play").onclick = actions.play;
}

// Shows the state in the panel.
function reflect(state) {
  element("field").value = state.field;
  element("low").value = text(state.range[0], 5);
  element("high").value = text(state.range[1], 5);
  const classes = meta.columns[state.field].kind === "integer";
  for (const id of ["low", "high", "range-usual", "range-all", "range-now", "map", "logarithmic"]) element(id).disabled = classes;
  element("map").value = state.map;
  element("cut").value = state.cutAxis;
  element("cut-at").disabled = element("cut-flip").disabled = !state.cutAxis;
  element("leaves").value = state.leaves;
  element("perspective").checked = state.perspective;
  element("dark").checked = state.dark;
  document.documentElement.classList.toggle("dark", state.dark);
  element("time").value = state.frame;
  element("now").textContent = `${state.frame + 1} of ${meta.frames.length}: ${text(meta.frames[state.frame].time, 5)} s`;
  element("play").textContent = state.playing ? "❚❚" : "▶";
  element("picked").hidden = !state.picked;
  if (state.picked) {
    element("picked").querySelector("table").replaceChildren(
      ...state.picked.rows.map((cells) => {
        const row = document.createElement("tr");
        for (const cell of cells) row.insertCell().textContent = cell;
        return row;
      }),
    );
  }
}

// Turning, moving, zooming and picking with mouse, pen or fingers on an element.
function handle(canvas, camera, moved, picked) {
  const fingers = new Map();
  let travelled = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    canvas.classList.add("turning");
    fingers.set(event.pointerId, event);
    if (fingers.size === 1) travelled = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    travelled += Math.abs(dx) + Math.abs(dy);
    const height = canvas.clientHeight;
    if (fingers.size > 1) {
      const others = [...fingers.values()].filter((finger) => finger.pointerId !== event.pointerId);
      const apart = (finger) => Math.hypot(finger.clientX - others[0].clientX, finger.clientY - others[0].clientY);
      camera.zoom(apart(before) / Math.max(apart(event), 1));
      camera.move(dx / height / 2, dy / height / 2);
    } else if (event.buttons === 1 && !event.shiftKey && !event.ctrlKey) {
      camera.turn((dx * 3) / height, (dy * 3) / height);
    } else {
      camera.move(dx / height, dy / height);
    }
    fingers.set(event.pointerId, event);
    moved();
  });
  const lift = (event) => {
    const wasDown = fingers.delete(event.pointerId);
    canvas.classList.toggle("turning", fingers.size > 0);
    if (wasDown && event.type === "pointerup" && event.button === 0 && travelled < 4) picked(event.offsetX, event.offsetY);
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    // Lines count as 16 pixels.
    camera.zoom(Math.exp(event.deltaY * (event.deltaMode === 1 ? 16 : 1) * 0.0012));
    moved();
  }, { passive: false });
}
