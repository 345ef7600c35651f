/* The machine as its description has it, drawn: slides, rotary axes, spindle, tool, table and workpiece.

   Where the tool, the workpiece and the rotary axes are is true; how slides look and where beside them they stand
   is made up, for a description says nothing about that. */
const Drawing = (() => {
  "use strict";
  const { add, sub, dot, unit, across, length, beam, box, cone, ring } = Scene;
  const { inverse, times, ofError, point, turned } = Engine;

  /** Largest errors that are drawn: a part of the machine's size, and rad. */
  const LARGEST = { length: 0.3, angle: 0.5 };

  const corners = (ranges) => ranges.reduce((all, range) => all.flatMap((c) => range.map((v) => [...c, v])), [[]]);

  class Drawing {
    constructor(machine) {
      this.machine = machine;
      const model = machine.model;
      this.axes = model.axes.map((axis, index) => {
        const direction = turned(axis.frame, [0, 1, 2].map((k) => (k === axis.component ? axis.sense : 0)));
        return { ...axis, index, direction, origin: [3, 7, 11].map((k) => axis.frame[k]) };
      });
      const column = (frame, k) => [frame[k], frame[4 + k], frame[8 + k]];
      const side = model.tip[model.tool_axis] > 0 ? -1 : 1;
      this.up = column(model.spindle, model.tool_axis).map((v) => v * side);
      const linear = this.axes.filter((a) => !a.rotary);
      this.size = Math.max(...linear.map((a) => a.travel[1] - a.travel[0]));
      this.reach();
      this.layOut();
      this.goHome();
    }

    /** Puts the tip a little above a table that turns, as far as the travel goes. */
    goHome() {
      if (!this.axes.some((a) => a.rotary && a.carries === "workpiece")) return;
      const { model } = this.machine;
      const tip = (position) => point(model.workpiece, [3, 7, 11].map((k) => this.machine.nominal({ ...this.home, position })[k]));
      const wanted = add(this.table, this.up, 0.14 * this.size);
      for (const { index, travel: [low, high] } of [...this.axes, ...this.axes].filter((a) => !a.rotary)) {
        const { position } = this.home;
        const now = tip(position);
        const way = sub(tip(position.map((q, k) => (k === index ? q + 1 : q))), now);
        const q = position[index] + dot(sub(wanted, now), way);
        position[index] = Math.round(Math.max(low, Math.min(high, q)) * 10) / 10;
      }
    }

    /** Where the axes are at first, linear ones halfway, and all corners that the tip reaches from there. */
    reach() {
      const { model } = this.machine;
      const at = model.axes.map(({ rotary, travel: [low, high] }) => (rotary ? Math.max(low, Math.min(high, 0)) : 0.5 * (low + high)));
      const auxiliaries = (model.length_range ? [Math.abs(model.tip[model.tool_axis])] : []).concat(model.sensors.map(() => 0));
      const linear = this.axes.filter((a) => !a.rotary);
      this.home = { position: at, direction: at.map(() => 0), auxiliaries };
      this.tips = corners(linear.map((a) => a.travel)).map((ends) => {
        const position = [...at];
        linear.forEach((a, k) => (position[a.index] = ends[k]));
        return point(model.workpiece, [3, 7, 11].map((k) => this.machine.nominal({ ...this.home, position })[k]));
      });
    }

    /** Shapes as they are in the foundation frame at zero; of which part each of them is, is said with them. */
    layOut() {
      const { up, size } = this;
      const { model } = this.machine;
      const w = 0.035 * size;
      const step = 0.085 * size;
      const piece = 0.12 * size;
      const parts = [];
      /** Part of `body`: the frame `before` or `after` an axis, or an end of the chain. */
      const put = (body, faces) => parts.push({ body, faces });
      this.rails = [];
      this.turns = [];
      const horizontal = Math.abs(up[1]) < 0.9 ? [0, 1, 0] : [0, 0, 1];
      const back = unit(add(horizontal, up, -dot(horizontal, up)));
      const along = (a, b) => Math.abs(dot(a, b));

      const table = this.axes.filter((a) => a.carries === "workpiece");
      const tool = this.axes.filter((a) => a.carries === "tool");
      const turning = table.filter((a) => a.rotary);
      const heights = this.tips.map((p) => dot(p, up));
      const middle = [0, 1, 2].map((k) => 0.5 * (Math.min(...this.tips.map((p) => p[k])) + Math.max(...this.tips.map((p) => p[k]))));
      const flat = (p, height) => add(p, up, height - dot(p, up));

      /* The table: a disc on the last rotary axis, or a plate under all that the tool reaches. */
      const end = "workpiece";
      const disc = turning.length ? turning[turning.length - 1] : null;
      const radius = Math.min(0.2 * size, 0.6 * this.spread());
      this.table = disc ? disc.origin : flat(middle, Math.min(...heights) - 0.01 * size);
      const [u, v] = across(up);
      if (disc) {
        const a = along(disc.direction, up) > 0.3 ? disc.direction.map((x) => x * Math.sign(dot(disc.direction, up))) : up;
        put(end, cone(add(this.table, a, -0.8 * w), a, radius, radius, 0.8 * w, "workpiece", 28));
        const [p, q] = across(a);
        put(end, box(add(this.table, a, 0.04 * size), [p.map((x) => x * 0.07 * size), q.map((x) => x * 0.05 * size), a.map((x) => x * 0.04 * size)], "piece"));
        put(end, box(add(add(this.table, a, 0.02 * size), p, 0.1 * size), [p.map((x) => x * 0.03 * size), q.map((x) => x * 0.02 * size), a.map((x) => x * 0.02 * size)], "piece"));
      } else {
        const half = [u, v].map((d) => d.map((x) => x * 0.5 * Math.max(0.1 * size, Math.max(...this.tips.map((p) => dot(p, d))) - Math.min(...this.tips.map((p) => dot(p, d))))));
        put(end, box(add(this.table, up, -0.5 * w), [...half, up.map((x) => x * 0.5 * w)], "workpiece"));
        put(end, box(add(this.table, up, 0.04 * size), [u.map((x) => x * 0.09 * size), v.map((x) => x * 0.06 * size), up.map((x) => x * 0.04 * size)], "piece"));
      }

      /* Spindle and tool. */
      const nose = [3, 7, 11].map((k) => model.spindle[k]);
      const tip = point(model.spindle, model.tip);
      const reaches = length(sub(tip, nose));
      put("spindle", cone(nose, up, 0.045 * size, 0.045 * size, 0.13 * size, "tool"));
      if (reaches > 0) {
        const down = unit(sub(tip, nose));
        put("spindle", cone(nose, down, 0.02 * size, 0.014 * size, 0.75 * reaches, "cutter", 14));
        put("spindle", cone(add(nose, down, 0.75 * reaches), down, 0.014 * size, 0, 0.25 * reaches, "cutter", 14));
      }

      /* Axes, from the ends to the foundation: each is placed beside the one that it carries. `held` is where what
         it carries is fastened to it. */
      const chain = (axes, style, anchor, outwards) => {
        let held = anchor;
        let place = anchor;
        for (const axis of [...axes].reverse()) {
          const own = ["after", axis.index];
          const before = ["before", axis.index];
          if (axis.rotary) {
            const tilt = along(axis.direction, up);
            const isDisc = axis === disc;
            const r = axis.carries === "workpiece" ? radius : 0.07 * size;
            let centre;
            if (tilt > 0.9) {
              centre = isDisc ? add(axis.origin, up, -0.8 * w) : flat(axis.origin, dot(place, up) + outwards * step * 0.6);
              const a = axis.direction.map((x) => x * Math.sign(dot(axis.direction, up)));
              if (!isDisc) {
                put(own, cone(add(centre, a, -0.3 * w), a, 0.9 * r, 0.9 * r, 0.6 * w, style, 24));
                put(own, beam(centre, held, w, style, piece));
              }
              const foot = add(centre, a, outwards * 0.9 * w);
              put(before, cone(add(foot, a, -0.45 * w), a, 0.62 * r, 0.62 * r, 0.9 * w, style, 24));
              this.turns.push({ axis, centre: isDisc ? add(axis.origin, up, 0.1 * w) : centre, radius: isDisc ? 0.86 * r : 1.25 * r, head: back.map((x) => -x) });
              held = foot;
              place = add(foot, up, outwards * 0.5 * w);
            } else {
              // A trunnion or a fork: bearings on both sides, a bridge between them.
              const arm = (axis.carries === "workpiece" ? 1.3 : 1.5) * r;
              const ends = [1, -1].map((s) => add(axis.origin, axis.direction, s * arm));
              const bridge = axis.carries === "workpiece" ? -1 : 1;
              for (const e of ends) {
                const inwards = unit(sub(axis.origin, e));
                put(own, cone(add(e, inwards, 0.05 * size), inwards, 0.045 * size, 0.045 * size, -0.05 * size, style, 16).map((x) => ({ ...x, points: [...x.points].reverse() })));
                if (axis.carries === "workpiece") {
                  const low = add(add(e, inwards, 0.03 * size), up, bridge * Math.max(step * 0.9, dot(sub(e, held), up) + 0.4 * w));
                  put(own, beam(add(e, inwards, 0.03 * size), low, w, style, piece));
                  put(own, beam(low, flat(held, dot(low, up)), w, style, piece));
                } else {
                  put(own, beam(add(e, inwards, 0.02 * size), held, w, style, piece));
                }
              }
              const outer = ends.map((e) => add(e, unit(sub(e, axis.origin)), 0.7 * w));
              const level = axis.carries === "workpiece" ? Math.min(...outer.map((e) => dot(e, up)), dot(held, up)) - 1.9 * step : Math.max(dot(place, up), ...outer.map((e) => dot(e, up))) + 1.6 * step;
              const feet = outer.map((e) => flat(e, level));
              outer.forEach((e, k) => {
                put(before, box(e, [axis.direction.map((x) => x * 0.35 * w), ...across(axis.direction).map((d) => d.map((x) => x * 1.5 * w))], style));
                put(before, beam(e, feet[k], 1.1 * w, style, piece));
              });
              put(before, beam(feet[0], feet[1], 1.1 * w, style, piece));
              this.turns.push({ axis, centre: ends[0], radius: 0.1 * size, head: up });
              held = add(feet[0], sub(feet[1], feet[0]), 0.5);
              place = held;
            }
            continue;
          }
          // A slide: its rail beside what it carries, its carriage on it.
          const isUp = along(axis.direction, up) > 0.7;
          const isBack = along(axis.direction, back) > 0.7;
          const way = axis.carries === "workpiece" ? (isUp ? back : up.map((x) => -x)) : isBack ? up : back;
          const far = axis.carries === "workpiece" && isUp ? radius + step : step;
          place = add(place, way, far);
          if (axis.carries === "workpiece" && !isUp && !turning.length && axis === axes[axes.length - 1]) place = add(place, way, 0.3 * step);
          const [x, y] = [axis.direction, unit(Scene.cross(axis.direction, way))];
          put(own, box(place, [x.map((d) => d * 0.055 * size), y.map((d) => d * 0.045 * size), way.map((d) => d * 0.02 * size)], style));
          put(own, beam(add(place, way, -0.02 * size), held, w, style, piece));
          const rail = add(place, way, 0.022 * size);
          this.rails.push({ axis, place: rail, centre: place, side: y.map((d) => d * 0.035 * size), style });
          // What carries the rail holds it where the axis is halfway.
          const [low, high] = axis.travel;
          held = add(rail, axis.direction, 0.5 * (low + high));
          place = rail;
        }
        return held;
      };
      const bedTable = chain(table, "workpiece", add(this.table, up, -0.5 * w), -1);
      const bedTool = chain(tool, "tool", add(nose, up, 0.1 * size), 1);

      /* The bed, and the column that carries the tool branch. */
      const lowest = Math.min(dot(bedTable, up), dot(this.table, up)) - 0.05 * size;
      const foot = flat(bedTool, lowest);
      put("base", beam(flat(bedTable, lowest), foot, 0.07 * size, "bed", piece));
      put("base", beam(foot, bedTool, 0.06 * size, "bed", piece));
      put("base", beam(flat(bedTable, lowest), bedTable, 0.05 * size, "bed", piece));
      this.parts = parts;
    }

    /** Size of what the tool reaches, across the tool. */
    spread() {
      return Math.max(...[0, 1, 2].map((k) => Math.max(...this.tips.map((p) => p[k])) - Math.min(...this.tips.map((p) => p[k]))));
    }

    /** Poses that move shapes from where they are at zero. */
    moves(frames) {
      const { model } = this.machine;
      const from = (now, zero) => times(now, inverse(zero));
      return {
        base: Engine.IDENTITY,
        workpiece: from(frames.workpiece, model.workpiece),
        spindle: from(frames.spindle, model.spindle),
        before: frames.before.map((f, k) => from(f, model.axes[k].frame)),
        after: frames.after.map((f, k) => from(f, model.axes[k].frame)),
      };
    }

    /** Errors, so many times as large, but not more than can be drawn. */
    exaggerate(times) {
      const most = [LARGEST.length * this.size, LARGEST.angle];
      this.cut = false;
      return (error) => error.map((e, k) => {
        const limit = most[k < 3 ? 0 : 1];
        if (Math.abs(e * times) > limit) this.cut = true;
        return Math.max(-limit, Math.min(limit, e * times));
      });
    }

    /** How many times errors are first drawn: so that the tip goes a quarter of the machine's size. */
    suited(states) {
      const most = Math.max(...states.map((s) => this.machine.before(s).tip));
      const angle = Math.max(...states.map((s) => this.machine.before(s).twist.slice(3).reduce((m, v) => Math.max(m, Math.abs(v)), 0)));
      const fits = Math.min(0.25 * this.size / most, 0.35 / angle, 5000);
      const power = 10 ** Math.floor(Math.log10(fits));
      const rounded = [5, 2, 1].map((k) => k * power).find((k) => k <= fits);
      return Number.isFinite(rounded) ? Math.max(1, rounded) : 1;
    }

    /** Points that the picture ought to hold, wherever axes are. */
    extent() {
      const linear = this.axes.filter((a) => !a.rotary);
      const states = corners(linear.map((a) => a.travel)).map((ends) => {
        const position = [...this.home.position];
        linear.forEach((a, k) => (position[a.index] = ends[k]));
        return { ...this.home, position };
      });
      return states.flatMap((state) => {
        const moves = this.moves(this.machine.frames(state, null));
        const shapes = this.parts.flatMap(({ body, faces }) => faces.flatMap((f) => f.points.map((p) => point(this.of(moves, body), p))));
        const rails = this.rails.flatMap(({ axis, place }) => axis.travel.map((q) => point(this.of(moves, ["before", axis.index]), add(place, axis.direction, q))));
        return [...shapes, ...rails];
      });
    }

    of(moves, body) {
      return Array.isArray(body) ? moves[body[0]][body[1]] : moves[body];
    }

    /** The picture of a state, with errors so many times as large. */
    draw(view, state, exaggeration) {
      const picture = new Scene.Picture(view);
      const { machine, size } = this;
      const wrong = this.exaggerate(exaggeration);
      const kelvin = machine.kelvin(state);
      const right = machine.frames(state, null);
      const ideal = this.moves(right);
      const actual = this.moves(machine.frames(state, wrong));
      const apart = machine.model.checks.some((c) => c.before.tip_mm > 0 || c.before.direction_rad > 0);

      for (const { body, faces } of this.parts) {
        if (apart && body !== "base") picture.outline(faces, (p) => point(this.of(ideal, body), p), "ideal");
      }
      picture.parts.push(...picture.over.splice(0).map((svg) => [Infinity, svg]));
      for (const { body, faces } of this.parts) {
        const pose = this.of(actual, body);
        // The tool has the length that it is set to.
        picture.solid(faces, (p) => point(pose, body === "spindle" ? this.lengthened(p, state) : p));
      }
      for (const { axis, place, side, style, centre } of this.rails) {
        const before = this.of(actual, ["before", axis.index]);
        const [low, high] = axis.travel;
        // The way of the carriage with its error motions.
        const at = (k) => {
          const q = low + ((high - low) * k) / 24;
          const frame = times(axis.frame, machine.moved(axis, q));
          const error = ofError(wrong(machine.intra(axis.index, q, state.direction[axis.index], kelvin)));
          return times(times(before, times(frame, error)), inverse(axis.frame));
        };
        for (const s of [-1, 1]) {
          picture.line(Array.from({ length: 25 }, (_, k) => point(at(k), add(place, side, s))), `rail ${style}`);
        }
        [low, high].forEach((value, k) => {
          const ends = [at(0), at(24)].map((pose) => point(pose, place));
          picture.label(ends[k], `${axis.letter} ${value}`, "limit", ends[1 - k], 8);
        });
        const carriage = this.of(actual, ["after", axis.index]);
        const arrow = [0.07, 0.24].map((k) => point(carriage, add(centre, axis.direction, k * size)));
        picture.arrow(arrow, `sense ${style}`, 10);
        picture.label(arrow[1], `+${axis.letter}`, `letter ${style}`, arrow[0], 13);
      }
      for (const { axis, centre, radius, head } of this.turns) {
        const before = this.of(actual, ["before", axis.index]);
        const move = (p) => point(before, p);
        const arm = axis.rotary && add(axis.origin, axis.direction, -0.3 * size);
        picture.above([arm, add(axis.origin, axis.direction, 0.3 * size)].map(move), "centre-line");
        const style = axis.carries;
        const [x, y] = across(axis.direction).map((d) => dot(d, head));
        const [end, turn] = [Math.atan2(y, x), 4.3];
        const arc = ring(centre, axis.direction, radius, 22, end - turn, turn).map(move);
        picture.arrow(arc, `sense ${style}`, 10);
        picture.label(arc[21], `+${axis.letter}`, `letter ${style}`, move(centre), 14);
        const turnedBy = this.of(actual, ["after", axis.index]);
        const [u] = across(axis.direction);
        picture.above([centre, add(centre, u, radius)].map((p) => point(turnedBy, p)), `mark ${style}`);
      }
      const piece = this.of(actual, "workpiece");
      const origin = [3, 7, 11].map((k) => machine.model.workpiece[k]);
      ["x", "y", "z"].forEach((name, k) => {
        const column = [machine.model.workpiece[k], machine.model.workpiece[4 + k], machine.model.workpiece[8 + k]];
        const arrow = [origin, add(origin, column, 0.13 * size)].map((p) => point(piece, p));
        picture.arrow(arrow, "frame", 6);
        picture.label(arrow[1], name, "frame", arrow[0], 8);
      });
      this.error(picture, state, right, exaggeration);
      return picture.svg();
    }

    /** A point of the tool below the spindle, where a tool of the set length has it. */
    lengthened(p, state) {
      const { model } = this.machine;
      if (!model.length_range) return p;
      const k = model.tool_axis;
      const inside = point(inverse(model.spindle), p);
      const below = inside[k] * model.tip[k];
      if (below > 0) inside[k] *= Math.abs(this.machine.tip(state)[k] / model.tip[k]);
      return point(model.spindle, inside);
    }

    /** Where the tip goes wrong, seen from the workpiece, at the ideal tip. */
    error(picture, state, frames, exaggeration) {
      const tip = point(frames.spindle, this.machine.tip(state));
      const { before, after } = this.machine.both(state);
      for (const [left, style] of [[before, "before"], [after, "after"]]) {
        if (!left) continue;
        const way = turned(frames.workpiece, left.way).map((v) => v * exaggeration);
        const size = length(way);
        const shown = size > LARGEST.length * this.size ? way.map((v) => (v * LARGEST.length * this.size) / size) : way;
        if (shown !== way) this.cut = true;
        if (length(shown) * picture.view.scale > 1.5) picture.arrow([tip, add(tip, shown)], `off ${style}`, 8);
      }
      picture.dot(tip, 3, "tip");
    }
  }

  return Drawing;
})();
