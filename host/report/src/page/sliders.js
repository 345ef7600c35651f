/* Sliders of the axes, of a tool length and of temperatures: each with its name, unit and value in words, each for
   the keyboard too. */
const Sliders = (() => {
  "use strict";

  /** Milliseconds in which an axis is moved from one limit to the other, and is left there. */
  const [WAY, REST] = [2500, 700];

  /** An element with attributes and children; words are never read as markup. */
  function element(name, attributes, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  }

  /** A number as it is printed. */
  const minus = (text) => text.replace(/-(?=[\d.])/g, "−");

  const inUnit = (axis, value) => minus(axis.rotary ? `${value.toFixed(1)}°` : `${value.toFixed(1)} mm`);

  class Sliders {
    /** `state` is what they move; `changed` is called after that. */
    constructor(drawing, state, changed) {
      Object.assign(this, { drawing, machine: drawing.machine, state, changed });
      this.shows = [];
      // Grows with whatever ends a movement.
      this.playing = 0;
      this.calm = window.matchMedia("(prefers-reduced-motion: reduce)");
    }

    /** A slider with its name, its value in words, and what else belongs to it. */
    make({ id, name, words, range: [low, high], read, write, say }, ...others) {
      const input = element("input", { type: "range", id, min: low, max: high, step: "any" });
      input.setAttribute("aria-describedby", `${id}-note`);
      const output = element("output", { for: id });
      const tell = () => {
        output.textContent = say(read());
        input.setAttribute("aria-valuetext", say(read()));
      };
      const show = () => {
        input.value = read();
        tell();
      };
      input.addEventListener("input", () => {
        this.playing++;
        write(Number(input.value));
        tell();
        this.changed();
      });
      this.shows.push(show);
      show();
      const label = element("label", { for: id }, element("b", {}, name), ` ${words}`);
      return element("div", { class: "slider" }, label, output, input, ...others);
    }

    /** Puts all of them where the state is. */
    show() {
      for (const show of this.shows) show();
    }

    /** Moves everything to another state. */
    goTo(state) {
      this.playing++;
      Object.assign(this.state, structuredClone(state));
      this.show();
      this.changed();
    }

    /** All inputs of the machine. */
    all() {
      const { axes, length_range: length, sensors } = this.machine.model;
      const made = axes.map((axis, index) => this.axis(axis, index));
      if (length) {
        made.push(this.auxiliary(0, "tool-length", { name: "Tool length", words: "(mm)", unit: "mm" }, length));
      }
      sensors.forEach((sensor, k) => {
        const words = { name: sensor.name, words: "(K from its reference)", unit: "K" };
        made.push(this.auxiliary(k + (length ? 1 : 0), `sensor-${k}`, words, sensor.range_kelvin));
      });
      return made;
    }

    /** A tool length and temperatures in words, as far as the machine has them. */
    auxiliaries(values) {
      const { length_range: length, sensors } = this.machine.model;
      const all = [...(length ? [["tool length", "mm"]] : []), ...sensors.map(({ name }) => [name, "K"])];
      return all.map(([name, unit], k) => minus(`${name} ${values[k].toFixed(1)} ${unit}`));
    }

    axis(axis, index) {
      const { state } = this;
      const id = `axis-${axis.letter}`;
      const words = `Move ${axis.letter} from its lower to its upper limit`;
      const button = element("button", {
        type: "button",
        class: "play",
        "aria-pressed": "false",
        "aria-label": words,
      });
      button.append("▶");
      button.addEventListener("click", () => this.play(index, button));
      const range = `${axis.travel.join(" to ")} ${axis.rotary ? "deg" : "mm"}${axis.endless ? ", endless" : ""}`;
      const note = element("small", { id: `${id}-note` }, minus(`${range}. ${this.sense(axis, index)}.`));
      const came = () => ["↓", "", "↑"][state.direction[index] + 1];
      const slider = {
        id,
        name: axis.letter,
        words: axis.rotary ? "(deg)" : "(mm)",
        range: axis.travel,
        read: () => state.position[index],
        write: (q) => this.move(index, q),
        say: (q) => `${inUnit(axis, q)} ${came()}`.trim(),
      };
      return this.make(slider, button, note);
    }

    auxiliary(k, id, { name, words, unit }, range) {
      const { state } = this;
      const slider = {
        id,
        name,
        words,
        range,
        read: () => state.auxiliaries[k],
        write: (value) => (state.auxiliaries[k] = value),
        say: (value) => minus(`${value.toFixed(1)} ${unit}`),
      };
      return this.make(slider, element("small", { id: `${id}-note` }, minus(`${range.join(" to ")} ${unit}`)));
    }

    /** A command to one axis, which comes from where it was. */
    move(index, q) {
      const { position, direction } = this.state;
      direction[index] = Math.sign(q - position[index]) || direction[index];
      position[index] = q;
    }

    /** Where a positive command leads, in words. */
    sense(axis, index) {
      const along = (v) => {
        const k = v.findIndex((x) => Math.abs(x) > 0.9999);
        return k < 0 ? `(${v.map((x) => x.toFixed(2)).join(", ")})` : `${v[k] > 0 ? "+" : "−"}${"xyz"[k]}`;
      };
      const carried = axis.carries === "workpiece" ? "the workpiece" : "the tool";
      const direction = along(this.drawing.axes[index].direction);
      if (axis.rotary) return `+ turns ${carried} about ${direction} (right-handed)`;
      const { home } = this.drawing;
      const step = home.position[index] < axis.travel[1] ? 1 : -1;
      const position = home.position.map((q, i) => (i === index ? q + step : q));
      const [from, to] = [home, { ...home, position }].map((state) => this.machine.nominal(state));
      const tip = [3, 7, 11].map((k) => step * (to[k] - from[k]));
      return `+ moves ${carried} along ${direction}; the tip goes ${along(tip)} of the workpiece`;
    }

    /** Moves an axis from its lower to its upper limit and back to where it was. */
    play(index, button) {
      const mine = ++this.playing;
      const [low, high] = this.machine.model.axes[index].travel;
      const start = this.state.position[index];
      const set = (q) => {
        if (this.playing !== mine) return false;
        this.move(index, q);
        this.show();
        this.changed();
        return true;
      };
      const done = () => {
        set(start);
        button.setAttribute("aria-pressed", "false");
      };
      button.setAttribute("aria-pressed", "true");
      set(low);
      if (this.calm.matches) {
        // Without motion: the two ends, one after the other.
        setTimeout(() => set(high), REST);
        setTimeout(done, 2 * REST);
        return;
      }
      const from = performance.now();
      const step = (now) => {
        const way = Math.min(1, Math.max(0, (now - from) / WAY));
        if (set(low + (high - low) * way) && way < 1) requestAnimationFrame(step);
        else setTimeout(done, REST);
      };
      requestAnimationFrame(step);
    }
  }

  return Object.assign(Sliders, { element, inUnit });
})();
