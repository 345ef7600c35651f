/* Three dimensions on a flat page: an orthographic view that can be turned, faces drawn from far to near, and
   arrows and labels over them. Everything becomes SVG with classes; colours are the style's. */
const Scene = (() => {
  "use strict";

  const add = (a, b, k = 1) => a.map((v, i) => v + k * b[i]);
  const sub = (a, b) => a.map((v, i) => v - b[i]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const length = (a) => Math.hypot(a[0], a[1], a[2]);
  const unit = (a) => a.map((v) => v / (length(a) || 1));
  /** Two directions across one, and across each other. */
  function across(a) {
    const k = a.map(Math.abs).indexOf(Math.min(...a.map(Math.abs)));
    const u = unit(
      cross(
        a,
        [0, 1, 2].map((i) => (i === k ? 1 : 0)),
      ),
    );
    return [u, cross(a, u)];
  }

  const text = (s) => String(s).replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
  const n = (v) => v.toFixed(1);

  /* Shapes: faces (lists of points, seen from outside counterclockwise) and lines. */

  const face = (points, style) => ({ points, style });

  /** A box along `way` from a to b, w wide, cut into pieces so that far and near can be told. */
  function beam(a, b, w, style, piece) {
    const whole = sub(b, a);
    if (length(whole) < 1e-9) return [];
    const [u, v] = across(unit(whole)).map((d) => d.map((x) => x * w * 0.5));
    const pieces = Math.max(1, Math.min(12, Math.round(length(whole) / piece)));
    const ring = (k) => {
      const at = add(a, whole, k / pieces);
      return [
        [1, 1],
        [-1, 1],
        [-1, -1],
        [1, -1],
      ].map(([i, j]) => add(add(at, u, i), v, j));
    };
    const faces = [face(ring(0).reverse(), style), face(ring(pieces), style)];
    for (let k = 0; k < pieces; k++) {
      const [p, q] = [ring(k), ring(k + 1)];
      for (let i = 0; i < 4; i++) faces.push(face([p[i], p[(i + 1) % 4], q[(i + 1) % 4], q[i]], style));
    }
    return faces;
  }

  /** A box around a centre with half edges along three directions. */
  function box(c, [x, y, z], style) {
    const at = (i, j, k) => add(add(add(c, x, i), y, j), z, k);
    const right = dot(cross(x, y), z) > 0;
    const faces = [
      [at(1, -1, -1), at(1, 1, -1), at(1, 1, 1), at(1, -1, 1)],
      [at(-1, -1, -1), at(-1, -1, 1), at(-1, 1, 1), at(-1, 1, -1)],
      [at(-1, 1, -1), at(-1, 1, 1), at(1, 1, 1), at(1, 1, -1)],
      [at(-1, -1, -1), at(1, -1, -1), at(1, -1, 1), at(-1, -1, 1)],
      [at(-1, -1, 1), at(1, -1, 1), at(1, 1, 1), at(-1, 1, 1)],
      [at(-1, -1, -1), at(-1, 1, -1), at(1, 1, -1), at(1, -1, -1)],
    ];
    return faces.map((p) => face(right ? p : p.reverse(), style));
  }

  function ring(c, a, r, count, from = 0, turn = 2 * Math.PI) {
    const [u, v] = across(a);
    return Array.from({ length: count }, (_, i) => {
      const t = from + (turn * i) / (turn === 2 * Math.PI ? count : count - 1);
      return add(add(c, u, r * Math.cos(t)), v, r * Math.sin(t));
    });
  }

  /** A round part along `a` from its base, r0 there and r1 at its end. */
  function cone(base, a, r0, r1, height, style, count = 20) {
    const end = add(base, a, height);
    const [p, q] = [ring(base, a, r0, count), ring(end, a, r1, count)];
    const faces = [face([...p].reverse(), style), face(q, style)];
    for (let i = 0; i < count; i++) {
      const j = (i + 1) % count;
      faces.push(face([p[i], p[j], q[j], q[i]], style));
    }
    return faces;
  }

  /** The view of one picture. */
  class View {
    constructor({ azimuth, elevation, margin = [46, 26] }) {
      this.start = { azimuth, elevation };
      // What is left free at the sides, and above and below.
      this.margin = margin;
      this.extreme = [[0, 0, 0]];
      this.size = [640, 460];
      this.reset();
    }

    reset() {
      Object.assign(this, this.start, { zoom: 1 });
    }

    turn(azimuth, elevation) {
      this.azimuth += azimuth;
      this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + elevation));
    }

    /** Everything that ought to be in the picture, from wherever it is seen. */
    fit(points) {
      const [from, to] = [-1, 1];
      const ways = [];
      for (let x = from; x <= to; x++)
        for (let y = from; y <= to; y++) for (let z = from; z <= to; z++) ways.push([x, y, z]);
      const last = (way) => points.reduce((best, p) => (dot(p, way) > dot(best, way) ? p : best));
      this.extreme = ways.map(last);
    }

    begin() {
      const [ca, sa, ce, se] = [
        Math.cos(this.azimuth),
        Math.sin(this.azimuth),
        Math.cos(this.elevation),
        Math.sin(this.elevation),
      ];
      this.right = [ca, sa, 0];
      this.up = [-sa * se, ca * se, ce];
      this.away = [-sa * ce, ca * ce, -se];
      const range = (way) => {
        const at = this.extreme.map((p) => dot(p, way));
        return [Math.min(...at), Math.max(...at)];
      };
      const [across, high, deep] = [this.right, this.up, this.away].map(range);
      const room = [this.size[0] - 2 * this.margin[0], this.size[1] - 2 * this.margin[1]];
      this.scale =
        this.zoom * Math.min(room[0] / (across[1] - across[0] || 1), room[1] / (high[1] - high[0] || 1));
      const middle = [across, high, deep].map(([low, top]) => 0.5 * (low + top));
      this.centre = [0, 1, 2].map(
        (k) => middle[0] * this.right[k] + middle[1] * this.up[k] + middle[2] * this.away[k],
      );
    }

    /** On the page: right, down, and away from the eye. */
    project(p) {
      const d = sub(p, this.centre);
      return [
        0.5 * this.size[0] + dot(d, this.right) * this.scale,
        0.5 * this.size[1] - dot(d, this.up) * this.scale,
        dot(d, this.away),
      ];
    }
  }

  /** Parts of a picture, from far to near, then what lies over them. */
  class Picture {
    constructor(view) {
      this.view = view;
      view.begin();
      this.parts = [];
      this.over = [];
    }

    /** Faces, moved by a function of points. */
    solid(faces, move = (p) => p) {
      for (const { points, style, isFloor } of faces) {
        const p = points.map((q) => this.view.project(move(q)));
        let area = 0;
        p.forEach((a, i) => {
          const b = p[(i + 1) % p.length];
          area += a[0] * b[1] - b[0] * a[1];
        });
        if (area >= 0) continue;
        // Brightness by how it faces up and the eye.
        const m = points.map(move);
        const normal = unit(cross(sub(m[1], m[0]), sub(m[2], m[1])));
        const light = 0.5 + 0.35 * normal[2] - 0.15 * dot(normal, this.view.away);
        const shade = Math.max(0, Math.min(3, Math.floor(4 * light)));
        const depth = isFloor ? Math.max(...p.map((q) => q[2])) : p.reduce((s, q) => s + q[2], 0) / p.length;
        this.parts.push([
          depth,
          `<polygon class="${style} shade${shade}" points="${p.map((q) => `${n(q[0])},${n(q[1])}`).join(" ")}"/>`,
        ]);
      }
    }

    /** Outlines of what is seen of faces. */
    outline(faces, move, style) {
      for (const { points } of faces) {
        const p = points.map((q) => this.view.project(move(q)));
        let area = 0;
        p.forEach((a, i) => {
          const b = p[(i + 1) % p.length];
          area += a[0] * b[1] - b[0] * a[1];
        });
        if (area >= 0) continue;
        this.over.push(
          `<polygon class="${style}" points="${p.map((q) => `${n(q[0])},${n(q[1])}`).join(" ")}"/>`,
        );
      }
    }

    /** A line among the faces, piece by piece. */
    line(points, style) {
      const p = points.map((q) => this.view.project(q));
      for (let i = 1; i < p.length; i++) {
        const depth = 0.5 * (p[i - 1][2] + p[i][2]) - 1 / this.view.scale;
        this.parts.push([
          depth,
          `<path class="${style}" d="M${n(p[i - 1][0])},${n(p[i - 1][1])}L${n(p[i][0])},${n(p[i][1])}"/>`,
        ]);
      }
    }

    /** A line over everything. */
    above(points, style) {
      this.over.push(
        `<path class="${style}" d="M${points
          .map((q) => this.view.project(q))
          .map((q) => `${n(q[0])},${n(q[1])}`)
          .join("L")}"/>`,
      );
    }

    /** The same with a head at its end; `among` the faces or over them. */
    arrow(points, style, head = 9, among = false) {
      const p = points.map((q) => this.view.project(q));
      const [a, b] = [p[p.length - 2], p[p.length - 1]];
      const d = [b[0] - a[0], b[1] - a[1]];
      const size = Math.hypot(...d);
      let svg = `<path class="${style}" d="M${p.map((q) => `${n(q[0])},${n(q[1])}`).join("L")}"/>`;
      if (size > 0.5) {
        const [x, y] = [d[0] / size, d[1] / size];
        const h = among ? Math.min(head, 1.2 * size) : head;
        const at = (k, s) =>
          `${n(b[0] - k * h * x + s * h * 0.42 * -y)},${n(b[1] - k * h * y + s * h * 0.42 * x)}`;
        svg += `<polygon class="${style} head" points="${at(-0.25, 0)} ${at(0.85, 1)} ${at(0.85, -1)}"/>`;
      }
      if (among) this.parts.push([0.5 * (a[2] + b[2]), svg]);
      else this.over.push(svg);
    }

    /** Words beside a point; `from`, another point, tells on which side. */
    label(at, words, style, from = null, distance = 11) {
      const [x, y] = this.view.project(at);
      let [dx, dy, anchor] = [0, 4, "middle"];
      if (from) {
        const [u, v] = this.view.project(from);
        const size = Math.hypot(x - u, y - v) || 1;
        [dx, dy] = [(distance * (x - u)) / size, (distance * (y - v)) / size + 4];
        anchor = dx > 5 ? "start" : dx < -5 ? "end" : "middle";
      }
      const half = words.length * 4;
      const shift = anchor === "start" ? 2 * half : anchor === "end" ? -2 * half : half;
      // Words stay in the picture.
      const left = Math.min(x + dx, x + dx + (anchor === "middle" ? -half : shift));
      const right = Math.max(x + dx, x + dx + (anchor === "middle" ? half : shift));
      const inside =
        (left < 2 ? 2 - left : 0) - (right > this.view.size[0] - 2 ? right - this.view.size[0] + 2 : 0);
      const down = Math.max(12, Math.min(this.view.size[1] - 4, y + dy));
      this.write([x + dx + inside, down], words, style, anchor);
    }

    /** Words at a place of the page. */
    write([x, y], words, style, anchor) {
      const place = `x="${n(x)}" y="${n(y)}" text-anchor="${anchor}"`;
      this.over.push(`<text class="${style}" ${place}>${text(words)}</text>`);
    }

    dot(at, r, style) {
      const [x, y] = this.view.project(at);
      this.over.push(`<circle class="${style}" cx="${n(x)}" cy="${n(y)}" r="${r}"/>`);
    }

    svg() {
      this.parts.sort((a, b) => b[0] - a[0]);
      return this.parts.map((p) => p[1]).join("") + this.over.join("");
    }
  }

  return { View, Picture, add, sub, dot, cross, length, unit, across, face, beam, box, cone, ring };
})();
