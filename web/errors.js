/* Error parameters for people: their units, their ranges on a machine, and the text of the error file. Names, signs and
   values in the file are those of the manual (mm, rad). */
const Errors = (() => {
  "use strict";

  const COMPONENTS = "XYZABC";
  const ENTRY = /^([ \t]*)(E[XYZABC][0-9XYZABCUVWS][0-9XYZABCUVWcsb]+)([ \t]*=[ \t]*)([-+0-9.eE_]+)([^\n]*\n?)/gm;
  const ARCSEC = (180 * 3600) / Math.PI;
  /** What the largest value of a new slider does at the tip (mm). */
  const EFFECT = 0.2;

  /** The section of parameters in the text of an error file: from where to where. */
  function section(text) {
    const head = /^[ \t]*\[parameters\].*$/m.exec(text);
    if (!head) return [text.length, text.length];
    const start = head.index + head[0].length;
    const end = text.slice(start).search(/^[ \t]*\[/m);
    return [start, end < 0 ? text.length : start + end];
  }

  /** The parameters in a text: names and values. */
  function read(text) {
    const all = text.slice(...section(text)).matchAll(ENTRY);
    return [...all].map((m) => [m[2], Number(m[4].replaceAll("_", ""))]);
  }

  /** The text with what `change(name, line)` makes of each line of a parameter. */
  function rewrite(text, change) {
    const [start, end] = section(text);
    const inside = text.slice(start, end).replace(ENTRY, (line, space, name, equals, value, rest) => {
      const now = change(name, line);
      return typeof now === "number" ? `${space}${name}${equals}${now === 0 ? "0.0" : now.toExponential()}${rest}` : now;
    });
    return text.slice(0, start) + inside + text.slice(end);
  }

  /** The text with a value; added at the end of the section if the parameter is new. */
  function write(text, name, value) {
    if (read(text).some(([found]) => found === name)) return rewrite(text, (found, line) => (found === name ? value : line));
    const [, end] = section(text);
    const head = /^[ \t]*\[parameters\]/m.test(text) ? "" : "\n[parameters]\n";
    const before = text.slice(0, end).trimEnd();
    const after = text.slice(end);
    return `${before}\n${head}${name} = ${value === 0 ? "0.0" : value.toExponential()}\n${after ? `\n${after}` : ""}`;
  }

  /** The text without a parameter and its uncertainty. */
  const remove = (text, name) => text.replaceAll(ENTRY, (line, _, found) => (found === name ? "" : line));

  /** The parts of a name; `null` if it is none of this model. */
  function parts(model, name) {
    const component = COMPONENTS.indexOf(name[1]);
    const index = (letter) => model.axes.findIndex((axis) => axis.letter === letter);
    if (name[2] === "0") {
      const axis = name[3] === "S" ? model.axes.length : index(name[3]);
      return axis < 0 ? null : { component, axis, kind: "location" };
    }
    const axis = index(name[2]);
    const [, kind, degree] = /^([csb]?)(\d*)$/.exec(name.slice(3)) ?? [];
    if (axis < 0 || kind === undefined || (kind !== "b") === (degree === "")) return null;
    return { component, axis, kind: { "": "degree", c: "cosine", s: "sine", b: "backlash" }[kind], k: Number(degree) };
  }

  /** Puts an error into the model of the drawing. */
  function set(model, name, value) {
    const found = parts(model, name);
    if (!found) return;
    const { component, axis, kind, k } = found;
    if (kind === "location") {
      model.locations[axis][component] = value;
      return;
    }
    const motion = (model.axes[axis].motions[component] ??= {
      coefficients: [],
      harmonics: [],
      backlash: 0,
      tabulated: null,
      per_kelvin: [],
      holds: false,
    });
    if (kind === "backlash") motion.backlash = value;
    else if (kind === "degree") {
      while (motion.coefficients.length <= k) motion.coefficients.push(0);
      motion.coefficients[k] = value;
      motion.holds ||= k >= 2;
    } else {
      while (motion.harmonics.length < k) motion.harmonics.push([0, 0]);
      motion.harmonics[k - 1][kind === "cosine" ? 0 : 1] = value;
    }
  }

  /** How a person sets it: the factor from the file to that, its unit, and where that holds. */
  function unit(model, name, inArcsec) {
    const { component, axis, kind, k } = parts(model, name);
    const isAngle = component > 2;
    const angle = inArcsec ? [ARCSEC, "arcsec"] : [1e6, "µm/m"];
    const [factor, words] = isAngle ? angle : [1e3, "µm"];
    if (kind !== "degree" || k === 0) return { factor, unit: words };
    const { letter, rotary, travel } = model.axes[axis];
    if (k === 1 && !isAngle && !rotary) return { factor: 1e6, unit: "µm/m" };
    const [low, high] = travel;
    const end = Math.abs(low) > Math.abs(high) ? low : high;
    const reach = rotary ? (end * Math.PI) / 180 : end;
    return {
      factor: factor * reach ** k,
      unit: words,
      where: ` at ${letter} ${end}${rotary ? "°" : " mm"}`.replace("-", "−"),
    };
  }

  /** The largest value of its slider, in that unit: what matters on a machine of this size (mm), and the value itself. */
  function most(model, name, size, value, inArcsec) {
    const { factor, unit: words } = unit(model, name, inArcsec);
    const effect = words === "µm" ? 1e3 * EFFECT : (EFFECT / size) * (words === "arcsec" ? ARCSEC : 1e6);
    const wanted = Math.max(effect, 1.6 * Math.abs(value * factor));
    const power = 10 ** Math.floor(Math.log10(wanted));
    return [1, 2, 5, 10].map((m) => m * power).find((m) => m >= wanted * (1 - 1e-9));
  }

  /** The squareness that the first slider changes: of the later of two axes on one branch, otherwise of X. */
  function squareness(model, [x, y], known) {
    const names = [x, y].map(({ letter }) => `EC0${letter}`);
    const found = names.find((name) => known.includes(name));
    if (found) return found;
    const isLater = y.index > x.index && model.axes[x.index].carries === model.axes[y.index].carries;
    return names[isLater ? 1 : 0];
  }

  return { read, write, remove, rewrite, parts, set, unit, most, squareness };
})();
