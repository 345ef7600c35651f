/* The first view: the machine on its way round a circle, the circle that it cuts, and one sentence about it.
   Everything is computed from the model by the engine of the report. */
const Stage = (() => {
  "use strict";
  const { sub, dot, unit } = Scene;
  const { element } = Sliders;

  /** Points of a circle; half a point beside the axes, the diagonals are among them, where an ellipse of an angle is longest. */
  const POINTS = 148;
  /** Seconds of one turn, and in which tables come and go. */
  const [TURN, FADE] = [7, 0.5];
  /** Radius of the drawn circle, and how far from it the largest error is drawn (parts of it). */
  const [RADIUS, LARGEST] = [150, 0.26];
  /** Errors below this (µm) are not told apart. */
  const FINEST = 0.01;

  /** The largest of 1, 2, 5 times a power of ten that is not above a value. */
  function below(value) {
    const power = 10 ** Math.floor(Math.log10(value));
    return [5, 2, 1].map((k) => k * power).find((k) => k <= value * (1 + 1e-9));
  }

  /** A length for people, in µm: as many digits as matter. */
  function um(value) {
    const size = Math.abs(value);
    if (size < FINEST) return "less than 0.01 µm";
    const digits = size >= 9.95 ? 0 : size >= 0.995 ? 1 : 2;
    return `${value.toFixed(digits).replace("-", "−")} µm`;
  }

  class Stage {
    /** `machine`, `circle`: where it is drawn. */
    constructor(machine, circle) {
      Object.assign(this, { machinePicture: machine, circlePicture: circle });
      this.view = new Scene.View({ azimuth: -0.55, elevation: 0.42, margin: [34, 22] });
      this.turn = 0.12;
      // How far the tables act, from 0 to 1, and where that is going.
      this.acts = this.wanted = 0;
      this.isPaused = this.calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
      this.isSeen = true;
      this.last = null;
      this.turnable();
      new ResizeObserver(() => this.resize()).observe(machine.parentElement);
      new IntersectionObserver(([entry]) => {
        this.isSeen = entry.isIntersecting;
        this.go();
      }).observe(machine.parentElement);
      document.addEventListener("visibilitychange", () => this.go());
    }

    /** What makes two models the same machine, whatever its errors. */
    static shapeOf(model) {
      return JSON.stringify([model.axes.map(({ motions, calibrated, ...axis }) => axis), model.spindle, model.tip]);
    }

    /** Shows a model. Where the machine is another one, the view starts anew. */
    show(model) {
      const shape = Stage.shapeOf(model);
      const machine = new Engine.Machine(model);
      if (shape === this.shape) this.drawing.machine = machine;
      else {
        this.drawing = new Drawing(machine);
        this.view.fit(this.drawing.extent());
        this.shape = shape;
        this.circle();
      }
      this.machine = machine;
      if (!model.tables) this.acts = this.wanted = 0;
      this.changed();
    }

    /** The circle: its axes, centre and radius, within the travel. */
    circle() {
      const { axes, home } = this.drawing;
      const linear = axes.filter((a) => !a.rotary);
      const named = (letter, component) =>
        linear.find((a) => a.letter === letter) ?? linear.find((a) => a.component === component) ?? linear[component];
      this.pair = [named("X", 0), named("Y", 1)];
      const range = ({ travel: [low, high] }) => high - low;
      this.radius = below(0.25 * Math.min(...this.pair.map(range)));
      this.centre = structuredClone(home);
      for (const { index, travel: [low, high] } of this.pair)
        this.centre.position[index] = Math.max(low + this.radius, Math.min(high - this.radius, home.position[index]));
      const at = (state) => [3, 7, 11].map((k) => this.drawing.machine.nominal(state)[k]);
      this.origin = at(this.centre);
      this.plane = this.pair.map(({ index }) => {
        const position = [...this.centre.position];
        position[index] += 1;
        return unit(sub(at({ ...this.centre, position }), this.origin));
      });
    }

    /** The command at a part of a turn. */
    at(turn) {
      const position = [...this.centre.position];
      const direction = [...this.centre.direction];
      const [c, s] = [Math.cos(2 * Math.PI * turn), Math.sin(2 * Math.PI * turn)];
      this.pair.forEach(({ index }, k) => {
        position[index] += this.radius * (k ? s : c);
        direction[index] = Math.sign(k ? c : -s);
      });
      return { ...this.centre, position, direction };
    }

    /** What the tables add, as far as they act; `null` without tables. */
    added(state, acts = this.acts) {
      const added = acts && this.machine.correction(state);
      return added ? added.map((d) => d * acts) : null;
    }

    /** The way of the tip, by points: where it should be, how far it is off there, and both in the plane (mm). */
    trace(acts) {
      return Array.from({ length: POINTS }, (_, k) => {
        // Where an axis reverses, it has no direction: half a point beside that.
        const state = this.at((k + 0.5) / POINTS);
        const { at, way, tip } = this.machine.left(state, this.added(state, acts));
        return { at, way, tip, place: this.flat(sub(at, this.origin)), off: this.flat(way) };
      });
    }

    flat(v) {
      return this.plane.map((axis) => dot(v, axis));
    }

    /** Figures of a circle (µm): out of round, too large in diameter, farthest from its path. */
    figures(trace) {
      const radial = trace.map(({ place: [x, y], off }) => (x * off[0] + y * off[1]) / Math.hypot(x, y));
      const mean = radial.reduce((sum, v) => sum + v, 0) / POINTS;
      // Without what a shift of the whole circle makes.
      const part = (along) => (2 / POINTS) * trace.reduce((sum, p, k) => sum + radial[k] * along(p), 0);
      const [x, y] = [0, 1].map((k) => part((p) => p.place[k] / this.radius));
      const round = trace.map((p, k) => radial[k] - (x * p.place[0] + y * p.place[1]) / this.radius);
      return {
        round: 1e3 * (Math.max(...round) - Math.min(...round)),
        large: 2e3 * mean,
        most: 1e3 * Math.max(...trace.map(({ tip }) => tip)),
      };
    }

    /** After a change of the errors; while one is dragged (`held`), the scale stays. */
    changed(held = false) {
      this.before = this.trace(0);
      const most = Math.max(...this.before.map(({ off }) => Math.hypot(...off)), 1e-6);
      const least = this.expected ?? 0;
      if (!held || most > 2 * this.largest) this.largest = Math.max(most, least);
      this.times = Math.max(1, below((LARGEST * this.radius) / this.largest));
      this.draw();
      this.go();
    }

    /** Switches the tables; they fade in and out as in a controller. */
    act(on) {
      this.wanted = on ? 1 : 0;
      if (this.calm) this.acts = this.wanted;
      this.draw();
      this.go();
    }

    pause(paused) {
      this.isPaused = paused;
      this.go();
    }

    /** Runs while something moves and is seen. */
    go() {
      if (this.isGoing || !this.moves()) return;
      this.isGoing = true;
      this.last = null;
      requestAnimationFrame((now) => this.step(now));
    }

    moves() {
      return this.machine && this.isSeen && !document.hidden && (!this.isPaused || this.acts !== this.wanted);
    }

    step(now) {
      const passed = Math.min(0.1, (now - (this.last ?? now)) / 1e3);
      this.last = now;
      if (!this.isPaused) this.turn = (this.turn + passed / TURN) % 1;
      const way = this.wanted - this.acts;
      this.acts += Math.sign(way) * Math.min(Math.abs(way), passed / FADE);
      this.draw();
      this.isGoing = this.moves();
      if (this.isGoing) requestAnimationFrame((next) => this.step(next));
    }

    resize() {
      const box = this.machinePicture.parentElement;
      this.view.size = [Math.max(150, box.clientWidth), Math.max(150, box.clientHeight)];
      this.view.margin = this.view.size[0] < 300 ? [16, 12] : [34, 22];
      this.machinePicture.setAttribute("viewBox", `0 0 ${this.view.size.join(" ")}`);
      if (this.machine) this.draw();
    }

    turnable() {
      const { view, machinePicture: svg } = this;
      let held = null;
      svg.addEventListener("pointerdown", (e) => {
        held = [e.clientX, e.clientY];
        svg.setPointerCapture(e.pointerId);
      });
      svg.addEventListener("pointermove", (e) => {
        if (!held) return;
        view.turn(-0.008 * (e.clientX - held[0]), 0.008 * (e.clientY - held[1]));
        held = [e.clientX, e.clientY];
        this.draw();
      });
      for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => (held = null));
      const keys = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
      svg.addEventListener("keydown", (e) => {
        if (!keys[e.key]) return;
        view.turn(...keys[e.key]);
        e.preventDefault();
        this.draw();
      });
    }

    draw() {
      if (!this.machine) return;
      const trace = this.acts ? this.trace(this.acts) : this.before;
      const state = this.at(this.turn);
      const added = this.added(state);
      this.machinePicture.innerHTML = this.drawing.draw(this.view, state, this.times, {
        added: added && added.map((d) => d * this.times),
        over: (picture, { workpiece }) => {
          const line = (points) => [...points, points[0]].map((p) => Engine.point(workpiece, p));
          picture.above(line(trace.map(({ at }) => at)), "path ideal");
          picture.above(line(trace.map(({ at, way }) => Scene.add(at, way, this.times))), `path ${this.style()}`);
        },
      });
      this.circlePicture.innerHTML = this.flatPicture(trace);
    }

    style() {
      return this.acts > 0.5 ? "after" : "before";
    }

    /** The circle from above, with what is off it so many times as large. */
    flatPicture(trace) {
      const scale = RADIUS / this.radius;
      const n = (v) => v.toFixed(1);
      const point = ({ place, off }) => [0, 1].map((k) => 200 + (k ? -1 : 1) * scale * (place[k] + this.times * off[k])).map(n);
      const path = (all) => `M${all.map((p) => point(p).join(",")).join("L")}Z`;
      const state = this.at(this.turn);
      const { at, way } = this.machine.left(state, this.added(state));
      const dot = point({ place: this.flat(sub(at, this.origin)), off: this.flat(way) });
      const [x, y] = this.pair.map(({ letter }) => letter);
      // A length on the scale of the errors.
      const shown = below((60 * 1e3) / (scale * this.times));
      const long = (shown * scale * this.times) / 1e3;
      return (
        `<circle class="ideal" cx="200" cy="200" r="${RADIUS}"/>` +
        `<path class="cross" d="M194,200H206M200,194V206"/>` +
        (this.acts ? `<path class="ghost" d="${path(this.before)}"/>` : "") +
        `<path class="cut ${this.style()}" d="${path(trace)}"/>` +
        `<circle class="tool" cx="${dot[0]}" cy="${dot[1]}" r="6"/>` +
        `<text x="390" y="205" text-anchor="end">${x}</text><text x="200" y="16" text-anchor="middle">${y}</text>` +
        `<path class="scale" d="M12,384v6h${n(long)}v-6"/>` +
        `<text x="${n(20 + long)}" y="392">${shown} µm of error</text>`
      );
    }

    /** What is to be said, in a sentence, and beside it. `cause`: the words of the only error, if there is but one; `isStale`: the
     * tables are those of older errors. */
    words(cause, count, isStale) {
      const before = this.figures(this.before);
      const size = `${Number((2 * this.radius).toPrecision(3))} mm`;
      const times = `Errors are drawn ${this.times.toLocaleString("en")} times as large.`;
      if (before.most < FINEST)
        return { strong: "A perfect circle.", rest: " No error is set. Drag the slider: no machine is this square.", facts: "" };
      if (this.wanted) {
        const after = this.figures(this.trace(1));
        if (isStale && after.round >= FINEST)
          return {
            strong: `${um(after.round)} out of round with the old tables.`,
            rest: ` Without tables it is ${um(before.round)}. Tables for these errors are being computed.`,
            facts: times,
          };
        return {
          strong: after.round < FINEST ? "Round to 0.01 µm." : `Round to ${um(after.round)}.`,
          rest: ` It was ${um(before.round)} out of round. The tables shift the axes a little as they move, so the tool is where it should be.`,
          facts: `If the errors are as entered. At most ${um(after.most).replace("less than ", "")} off its path, ${um(before.most)} without tables. ${times}`,
        };
      }
      const large = Math.abs(before.large) >= 1 ? ` and ${um(Math.abs(before.large))} too ${before.large > 0 ? "large" : "small"}` : "";
      const why = cause ?? (count === 1 ? "its one error" : `its ${count} errors`);
      return {
        strong: `${um(before.round)} out of round${large}.`,
        rest: cause ? ` A circle of ${size} becomes an ellipse, because ${why}.` : ` That is what ${why} make of a circle of ${size}.`,
        facts: `The tool is up to ${um(before.most)} off its path. ${times}`,
      };
    }

    /** Both pictures and the sentence as one SVG, with the colours of the page. */
    picture(words) {
      const NAMES = ["fill", "stroke", "stroke-width", "stroke-dasharray", "opacity", "paint-order", "stroke-linecap", "stroke-linejoin", "font-size", "font-weight", "font-style"];
      const copy = (svg) => {
        const made = svg.cloneNode(true);
        const [from, to] = [svg, made].map((e) => [...e.querySelectorAll("*")]);
        from.forEach((e, k) => {
          const style = getComputedStyle(e);
          to[k].setAttribute("style", NAMES.map((name) => `${name}:${style.getPropertyValue(name)}`).join(";"));
          to[k].removeAttribute("class");
        });
        return made.innerHTML;
      };
      const [w, h] = this.view.size;
      const style = getComputedStyle(document.body);
      const escape = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
      const text = (y, size, weight, said) =>
        `<text x="20" y="${y}" font-size="${size}" font-weight="${weight}" fill="${style.color}">${escape(said)}</text>`;
      const lines = [];
      for (const word of words.rest.trim().split(" "))
        if (!lines.length || `${lines.at(-1)} ${word}`.length > (w + 400) / 9) lines.push(word);
        else lines.push(`${lines.pop()} ${word}`);
      const high = Math.max(h, 400) + 60 + 24 * lines.length;
      return (
        `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${w + 400} ${high}" width="${w + 400}" height="${high}" font-family="system-ui, sans-serif">` +
        `<rect width="100%" height="100%" fill="${style.backgroundColor}"/>` +
        `<svg width="${w}" height="${h}" viewBox="0 0 ${w} ${h}">${copy(this.machinePicture)}</svg>` +
        `<svg x="${w}" width="400" height="400" viewBox="0 0 400 400">${copy(this.circlePicture)}</svg>` +
        text(Math.max(h, 400) + 28, 22, 600, words.strong) +
        lines.map((line, k) => text(Math.max(h, 400) + 56 + 24 * k, 17, 400, line)).join("") +
        "</svg>"
      );
    }
  }

  return Object.assign(Stage, { below, um, element });
})();
