/* The controls of the page: sliders move the machine; drawings, figures and the error field follow. */
(() => {
  "use strict";
  const { figure } = Field;
  const { element, inUnit } = Sliders;
  /** What the error field shows. */
  const KINDS = ["before", "after", "difference"];
  const $ = (id) => document.getElementById(id);
  const machine = new Engine.Machine(JSON.parse($("model-data").textContent));
  /** Where the program has found the tip farthest off. */
  const { worst: places } = JSON.parse($("report-data").textContent);
  const { model } = machine;
  const drawing = new Drawing(machine);
  const field = new Field(machine);
  const state = structuredClone(drawing.home);
  const sliders = new Sliders(drawing, state, () => redraw());
  const wrong = model.checks.some((c) => c.before.tip_mm > 0 || c.before.direction_rad > 0);
  let exaggeration = drawing.suited(model.checks);
  let shown = "before";

  /* What the page computes is compared with what the program wrote. */

  function agreement() {
    const far = Engine.compare(machine);
    const where = $("agreement");
    const numbers = `${far.mm.toExponential(1)} mm and ${far.rad.toExponential(1)} rad`;
    if (far.agrees) {
      const same = model.tables && far.corrections === 0 ? ", corrections to the bit" : "";
      where.textContent = `The drawings are computed in this page. At ${far.positions} positions they agree with the program${same}.`;
      return;
    }
    where.textContent =
      `This page computes something else than the program: at ${far.positions} positions they differ by up ` +
      `to ${numbers}, more than ${Engine.LIMIT.mm} mm or ${Engine.LIMIT.rad} rad. Do not rely on the drawing ` +
      "and the error field.";
    where.className = "disagreement";
    where.setAttribute("role", "alert");
    document.querySelector("main").prepend(where);
  }

  /* Drawings. */

  function canvas(id, { azimuth, elevation, height, margin }, words) {
    const holder = $(id);
    const svg = holder.querySelector("svg");
    svg.setAttribute("aria-label", words);
    const view = new Scene.View({ azimuth, elevation, margin });
    const resize = () => {
      const width = Math.max(260, Math.round(holder.clientWidth));
      view.size = [width, Math.round(Math.min(height, Math.max(300, 0.82 * width)))];
      svg.setAttribute("viewBox", `0 0 ${view.size[0]} ${view.size[1]}`);
      redraw();
    };
    let held = null;
    svg.addEventListener("pointerdown", (e) => {
      held = [e.clientX, e.clientY];
      svg.setPointerCapture(e.pointerId);
    });
    svg.addEventListener("pointermove", (e) => {
      if (!held) return;
      view.turn(-0.008 * (e.clientX - held[0]), 0.008 * (e.clientY - held[1]));
      held = [e.clientX, e.clientY];
      redraw();
    });
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => (held = null));
    const keys = {
      ArrowLeft: () => view.turn(0.1, 0),
      ArrowRight: () => view.turn(-0.1, 0),
      ArrowUp: () => view.turn(0, -0.1),
      ArrowDown: () => view.turn(0, 0.1),
      "+": () => (view.zoom *= 1.15),
      "-": () => (view.zoom /= 1.15),
      Home: () => view.reset(),
    };
    svg.addEventListener("keydown", (e) => {
      if (!keys[e.key]) return;
      keys[e.key]();
      e.preventDefault();
      redraw();
    });
    const buttons = element("p", { class: "view-buttons screen-only" });
    for (const [label, does] of [
      ["Reset view", () => view.reset()],
      ["From the front", () => Object.assign(view, { azimuth: 0, elevation: 0 })],
      ["From the right", () => Object.assign(view, { azimuth: Math.PI / 2, elevation: 0 })],
      ["From above", () => Object.assign(view, { azimuth: 0, elevation: Math.PI / 2 })],
    ]) {
      const button = element("button", { type: "button" }, label);
      button.addEventListener("click", () => {
        does();
        redraw();
      });
      buttons.append(button);
    }
    holder.after(buttons);
    return { view, svg, resize };
  }

  let pending = false;
  /** Draws once before the next picture of the screen. */
  function redraw() {
    if (pending) return;
    pending = true;
    requestAnimationFrame(() => {
      pending = false;
      draw();
    });
  }

  function draw() {
    machinePicture.svg.innerHTML = drawing.draw(machinePicture.view, state, exaggeration);
    $("exaggeration-note").textContent = !wrong
      ? "All errors are zero: the machine is drawn as it is described."
      : `Errors are drawn ${exaggeration.toLocaleString("en")} times as large` +
        `${drawing.cut ? ", the largest of them no larger than can be shown" : ""}.`;
    figuresHere();
    drawField();
  }

  /* Figures beside the machine. */

  function figuresHere() {
    const { before, after, added } = machine.both(state);
    const rows = [["before", before]];
    if (after) rows.push(["after", after]);
    const cells = (left) => [...left.way.map((v) => 1e3 * v), 1e3 * left.tip, 1e6 * left.direction].map(figure);
    const body = rows.map(([name, left]) =>
      row(name === "after" ? "with the tables" : "before", cells(left), name),
    );
    if (after) {
      const change = (k) => 1e3 * (after.way[k] - before.way[k]);
      body.push(
        row(
          "difference",
          [
            change(0),
            change(1),
            change(2),
            1e3 * (after.tip - before.tip),
            1e6 * (after.direction - before.direction),
          ].map(figure),
          "",
        ),
      );
    }
    $("here-errors").replaceChildren(...body);
    const nominal = machine.nominal(state);
    const [x, y, z] = [3, 7, 11].map((k) => nominal[k].toFixed(3).replace("-", "−"));
    $("here-tip").textContent = `Tool tip in the workpiece frame: x ${x}, y ${y}, z ${z} mm.`;
    const adds = (axis, value) =>
      axis.rotary
        ? `${axis.letter} ${figure((1e6 * value * Math.PI) / 180)} µrad`
        : `${axis.letter} ${figure(1e3 * value)} µm`;
    $("here-correction").textContent = added
      ? `The tables add ${model.axes.map((axis, i) => adds(axis, added[i])).join(", ")}.`
      : "There are no tables: errors are shown as they are.";
  }

  function row(name, cells, style) {
    const line = element("tr", {}, element("th", { scope: "row", class: style }, name));
    line.append(...cells.map((c) => element("td", {}, c)));
    return line;
  }

  /* The error field. */

  function drawField() {
    const nodes = field.lattice(state);
    const { svg, most, scale } = field.draw(fieldPicture.view, nodes, shown, state);
    fieldPicture.svg.innerHTML = svg;
    const rotary = model.axes.map((a, i) => [a, i]).filter(([a]) => a.rotary);
    const at = rotary.length
      ? ` at ${rotary.map(([a, i]) => `${a.letter} ${inUnit(a, state.position[i])}`).join(", ")}`
      : "";
    const what = { before: "before", after: "with the tables", difference: "what the tables change" }[shown];
    $("field-caption").textContent =
      `Error of the tip over the linear travel (X, Y, Z in mm), ${what}${at}, seen from the workpiece`.replace(
        "X, Y, Z",
        field.axes.map((a) => a.letter).join(", "),
      );
    const kinds =
      shown === "difference"
        ? ["before", "after", "difference"]
        : model.tables
          ? ["before", "after"]
          : ["before"];
    $("field-figures").replaceChildren(
      ...kinds.map((kind) => {
        const { um, urad } = field.summary(nodes, kind);
        const name = { before: "before", after: "with the tables", difference: "difference" }[kind];
        return row(name, [um.mean, um.max, urad.mean, urad.max].map(figure), kind);
      }),
    );
    legend(1e3 * most, 1e3 * scale);
  }

  function legend(most, scale) {
    const holder = $("field-legend");
    if (most === 0) {
      holder.textContent = "The error is zero at all of these positions: there is nothing to draw.";
      return;
    }
    const steps = Array.from({ length: Field.COLOURS }, (_, k) => {
      const swatch = element("span", { class: `swatch colour${k}`, "aria-hidden": "true" });
      const range =
        k === 0
          ? `to ${figure(scale / Field.COLOURS)}`
          : `${figure((scale * k) / Field.COLOURS)} to ${figure((scale * (k + 1)) / Field.COLOURS)}`;
      return element("li", {}, swatch, range);
    });
    holder.replaceChildren(
      element("span", {}, "Length of the error (µm):"),
      element("ul", {}, ...steps),
      element("span", {}, `The longest arrow is ${figure(most)} µm${scale > most ? `, on the scale of ${figure(scale)} µm before` : ""}. The ring is where the sliders are.`),
    );
  }

  function worst() {
    const list = $("worst-list");
    const which = shown === "after" ? "after" : "before";
    $("worst-title").textContent =
      which === "after" ? "Worst positions with the tables" : "Worst positions before";
    if (!wrong) {
      list.replaceChildren(element("li", {}, "All errors are zero: no position is worse than another."));
      return;
    }
    list.replaceChildren(
      ...places[which].map(({ position, direction, auxiliaries, tip_um: um, direction_urad: urad }) => {
        const came = (i) => ["from above", "", "from below"][direction[i] + 1];
        const at = (axis, i) => `${axis.letter} ${inUnit(axis, position[i])} ${came(i)}`.trim();
        const place = [...model.axes.map(at), ...sliders.auxiliaries(auxiliaries)].join(", ");
        const button = element(
          "button",
          { type: "button", class: "place" },
          element("b", { class: which }, `${figure(um)} µm, ${figure(urad)} µrad`),
          ` at ${place}`,
        );
        button.addEventListener("click", () => sliders.goTo({ position, direction, auxiliaries }));
        return element("li", {}, button);
      }),
    );
  }

  /* Controls. */

  function controls() {
    $("axis-sliders").append(...sliders.all());
    const exaggerated = {
      id: "exaggeration-slider",
      name: "Errors drawn",
      words: "larger (times)",
      range: [0, 4],
      read: () => Math.log10(exaggeration),
      write: (v) => (exaggeration = Number((10 ** v).toPrecision(2))),
      say: () => `${exaggeration.toLocaleString("en")} ×`,
    };
    const note = element("small", { id: "exaggeration-slider-note" }, "1 to 10 000 times, in equal ratios");
    const home = element("button", { type: "button" }, "All axes to where they were");
    home.addEventListener("click", () => sliders.goTo(drawing.home));
    $("exaggeration").append(sliders.make(exaggerated, note), element("p", {}, home));
    for (const kind of KINDS) {
      const button = $(`show-${kind}`);
      button.hidden = kind !== "before" && !model.tables;
      button.addEventListener("click", () => {
        shown = kind;
        for (const other of KINDS) $(`show-${other}`).setAttribute("aria-pressed", String(other === kind));
        worst();
        redraw();
      });
    }
  }

  agreement();
  const machinePicture = canvas(
    "machine-drawing",
    { azimuth: -0.55, elevation: 0.42, height: 560, margin: [46, 26] },
    "The machine in three dimensions. Arrow keys turn it, + and − change its size, Home resets the view.",
  );
  const fieldPicture = canvas(
    "field-drawing",
    { azimuth: -0.6, elevation: 0.38, height: 520, margin: [62, 44] },
    "The error field in three dimensions. Arrow keys turn it, + and − change its size, Home resets the view.",
  );
  machinePicture.view.fit(drawing.extent());
  controls();
  const resize = () => {
    machinePicture.resize();
    fieldPicture.resize();
  };
  window.addEventListener("resize", resize);
  window.addEventListener("afterprint", resize);
  resize();
  draw();
  worst();

  /** For tests: what the page computes and shows. */
  window.trueaxis = { machine, drawing, state, redraw: draw, showSliders: () => sliders.show() };
})();
