/* The error field: how far the tip is off all over the linear travel. */
const Field = (() => {
  "use strict";
  const { add, sub, length } = Scene;

  /** Steps of the colour scale. */
  const COLOURS = 6;
  /** Positions along each linear axis. */
  const LATTICE = 5;

  /** What an arrow shows: a way of the tip (mm), seen from the workpiece. */
  const SHOWN = {
    before: ({ before }) => before.way,
    after: ({ after }) => after.way,
    difference: ({ before, after }) => sub(after.way, before.way),
  };
  const ANGLE = {
    before: ({ before }) => before.direction,
    after: ({ after }) => after.direction,
    difference: ({ before, after }) => after.direction - before.direction,
  };

  /** A number in few digits, for people. */
  function figure(v) {
    const size = Math.abs(v);
    if (size < 5e-5) return "0";
    if (size < 0.00995) return "below 0.01";
    const digits = size >= 99.95 ? 0 : size >= 9.995 ? 1 : 2;
    return v.toFixed(digits).replace("-", "−");
  }

  class Field {
    constructor(machine) {
      this.machine = machine;
      // Three of them span space; a further one stays where its slider is.
      this.axes = machine.model.axes.map((axis, index) => ({ ...axis, index })).filter((a) => !a.rotary);
      this.axes = this.axes
        .filter((a, _, all) => all.find((b) => b.component === a.component) === a)
        .slice(0, 3);
    }

    /** Errors on a lattice of the linear axes, the others as in a state. */
    lattice(state, count = LATTICE) {
      const nodes = [];
      const visit = (k, position) => {
        if (k === this.axes.length) {
          nodes.push({ position, ...this.machine.both({ ...state, position }) });
          return;
        }
        const {
          index,
          travel: [low, high],
        } = this.axes[k];
        for (let i = 0; i < count; i++) {
          const next = [...position];
          next[index] = low + ((high - low) * i) / (count - 1);
          visit(k + 1, next);
        }
      };
      visit(0, state.position);
      return nodes;
    }

    /** Mean and maximum of what is shown (µm, µrad). */
    summary(nodes, shown) {
      const of = (values) => ({
        mean: values.reduce((s, v) => s + v, 0) / values.length,
        max: Math.max(...values),
      });
      return {
        um: of(nodes.map((n) => 1e3 * length(SHOWN[shown](n)))),
        urad: of(nodes.map((n) => 1e6 * Math.abs(ANGLE[shown](n)))),
      };
    }

    /** The picture of a field, on one scale before and after. `scale` (mm) is the longest error before, `most` the longest that
     * is shown. */
    draw(view, nodes, shown, state) {
      const places = nodes.map((n) => n.before.at);
      view.fit(places);
      const longest = (kind) => Math.max(...nodes.map((n) => length(SHOWN[kind](n))));
      const most = longest(shown);
      const scale = Math.max(longest("before"), most);
      const picture = new Scene.Picture(view);
      const count = LATTICE;
      const corner = (bits) => places[this.axes.reduce((k, _, i) => k * count + (bits[i] ? count - 1 : 0), 0)];
      const cell = Math.min(...this.axes.map((a) => a.travel[1] - a.travel[0])) / (count - 1);
      this.edges(picture, corner, view);
      for (const node of nodes) {
        const way = SHOWN[shown](node);
        const size = length(way);
        const colour = scale > 0 ? Math.min(COLOURS - 1, Math.floor((COLOURS * size) / scale)) : 0;
        const [x, y, depth] = view.project(node.before.at);
        picture.parts.push([
          depth + 1e-6,
          `<circle class="node" cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="1.3"/>`,
        ]);
        if (most === 0) continue;
        const arrow = [node.before.at, add(node.before.at, way, Math.max(1.1 * cell, 34 / view.scale) / scale)];
        picture.arrow(arrow, `flow colour${colour}`, 8, true);
      }
      const here = this.machine.nominal(state);
      picture.dot([here[3], here[7], here[11]], 4.5, "here");
      return { svg: picture.svg(), most, scale };
    }

    /** The box of the travel, with a scale along one edge of each axis. */
    edges(picture, corner, view) {
      const axes = this.axes.length;
      const centre = view.project(view.centre);
      this.axes.forEach((axis, k) => {
        const edges = [];
        for (let bits = 0; bits < 1 << axes; bits++) {
          if ((bits >> k) & 1) continue;
          const low = Array.from({ length: axes }, (_, i) => (bits >> i) & 1);
          const high = low.map((b, i) => (i === k ? 1 : b));
          edges.push([corner(low), corner(high)]);
        }
        for (const [a, b] of edges) picture.line([a, add(a, sub(b, a), 0.5), b], "edge");
        // The scale stands at the outermost edge: low ones before high ones, left before right.
        const outermost = edges
          .map(([a, b]) => {
            const [p, q] = [view.project(a), view.project(b)];
            const middle = [0.5 * (p[0] + q[0]) - centre[0], 0.5 * (p[1] + q[1]) - centre[1]];
            return { a, b, far: Math.hypot(...middle) + 0.25 * middle[1] - 0.1 * middle[0] };
          })
          .sort((x, y) => y.far - x.far)[0];
        const { a, b } = outermost;
        const middle = add(a, sub(b, a), 0.5);
        // Away from the middle of the box, across the edge.
        const [p, q, m] = [a, b, middle].map((v) => view.project(v));
        const d = [q[0] - p[0], q[1] - p[1]];
        const size = Math.hypot(...d) || 1;
        let across = [-d[1] / size, d[0] / size];
        if (across[0] * (m[0] - centre[0]) + across[1] * (m[1] - centre[1]) < 0) across = across.map((v) => -v);
        const words = (at, text, style, distance) => {
          const anchor = across[0] > 0.35 ? "start" : across[0] < -0.35 ? "end" : "middle";
          picture.write([at[0] + distance * across[0], at[1] + distance * across[1] + 4], text, style, anchor);
        };
        picture.above([a, b], "scale");
        const [low, high] = axis.travel;
        words([p[0] + 0.08 * d[0], p[1] + 0.08 * d[1]], String(low), "limit", 12);
        words([p[0] + 0.92 * d[0], p[1] + 0.92 * d[1]], String(high), "limit", 12);
        const title = `${axis.letter} (mm)`;
        const upright = Math.abs(d[1]) > 2 * Math.abs(d[0]);
        const top = p[1] < q[1] ? p : q;
        // Beside a scale that stands upright there is little room.
        if (upright) picture.write([top[0], top[1] - 14], title, "letter", "middle");
        else words(m, title, "letter", 26);
      });
    }
  }

  return Object.assign(Field, { COLOURS, figure });
})();
