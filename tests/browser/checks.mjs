// Requirements for a page. Functions without a parameter run in the page and return the violations.

/** Contrast of text at least 4.5 : 1 (WCAG 2, 1.4.3), from computed colours. */
export function contrast() {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (colour) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = colour;
    canvas.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const luminance = ([r, g, b]) => {
    const of = (v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
    return 0.2126 * of(r) + 0.7152 * of(g) + 0.0722 * of(b);
  };
  const over = (top, below) => top.slice(0, 3).map((v, k) => v * top[3] + below[k] * (1 - top[3]));
  const background = (element) => {
    const layers = [];
    for (let e = element; e; e = e.parentElement) {
      const layer = rgba(getComputedStyle(e).backgroundColor);
      layers.push(layer);
      if (layer[3] === 1) break;
    }
    return layers.reverse().reduce((below, top) => over(top, below), [255, 255, 255]);
  };
  const faults = new Set();
  let least = Infinity;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let text = walker.nextNode(); text; text = walker.nextNode()) {
    const element = text.parentElement;
    if (
      !text.data.trim() ||
      element.closest("script, style, noscript, title, desc, defs") ||
      !element.getClientRects().length
    )
      continue;
    const style = getComputedStyle(element);
    if (style.visibility === "hidden") continue;
    const below = background(element);
    const ink = rgba(element.closest("svg") ? style.fill : style.color);
    let opacity = 1;
    for (let e = element; e; e = e.parentElement) opacity *= Number(getComputedStyle(e).opacity);
    const [a, b] = [luminance(over([...ink.slice(0, 3), ink[3] * opacity], below)), luminance(below)];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    least = Math.min(least, ratio);
    if (ratio < 4.5)
      faults.add(
        `contrast ${ratio.toFixed(2)} of <${element.tagName} class="${element.getAttribute("class") ?? ""}"> “${text.data.trim().slice(0, 30)}”`,
      );
  }
  return { faults: [...faults], least };
}

/** Violations of accessibility that axe finds: `source` is its script, `evaluate` runs a text in the page. */
export async function accessible(evaluate, source) {
  await evaluate(source);
  const found = await evaluate(
    "axe.run().then(({ violations, passes }) => [passes.length, violations.map((v) => `axe, ${v.id}: ${v.help}: ${v.nodes.map((n) => n.target.join(' ')).join(', ')}`)])",
  );
  const [passed, faults] = found;
  return passed < 10 ? [`axe checks ${passed} rules only`] : faults;
}

/** Nothing extends beyond the window, and no word beyond its picture. */
export function overflow() {
  const faults = [];
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > width)
    faults.push(`the page is ${document.documentElement.scrollWidth} px wide`);
  for (const element of document.querySelectorAll("main *:not(svg *)")) {
    const box = element.getBoundingClientRect();
    if (!box.width || element.closest(".scroll")) continue;
    if (box.right > width + 1 || box.left < -1)
      faults.push(
        `<${element.tagName} class="${element.className}"> reaches from ${box.left} to ${box.right} px`,
      );
  }
  // Content that would need horizontal scrolling; scrollable regions may, if the keyboard can scroll them.
  for (const scroll of document.querySelectorAll(".scroll:not([tabindex])")) {
    if (scroll.scrollWidth > scroll.clientWidth + 1)
      faults.push(
        `a table of ${scroll.scrollWidth} px has ${scroll.clientWidth} px: ${scroll.textContent.trim().slice(0, 40)}`,
      );
  }
  for (const svg of document.querySelectorAll("figure svg")) {
    const room = svg.getBoundingClientRect();
    for (const text of svg.querySelectorAll("text")) {
      const box = text.getBoundingClientRect();
      const out = Math.max(
        room.left - box.left,
        box.right - room.right,
        room.top - box.top,
        box.bottom - room.bottom,
      );
      if (out > 1.5)
        faults.push(
          `“${text.textContent}” sticks out of its picture by ${out.toFixed(1)} px (${svg.closest("figure").querySelector("figcaption")?.textContent.slice(0, 40)})`,
        );
    }
  }
  return faults;
}

/** Every figure states its subject, its units, and the meaning of its marks. */
export function figures() {
  const faults = [];
  const unit = /µm|µrad|mm\b|\bdeg|degree|°|\bkB\b|bytes|mm\/s|\bK\b|\(1\)|%/;
  const all = [...document.querySelectorAll("figure")];
  if (all.length < 2) faults.push("there are no figures");
  for (const figure of all) {
    const caption = figure.querySelector("figcaption");
    const name = caption?.textContent.trim().slice(0, 50);
    if (!name) {
      faults.push("a figure has no caption");
      continue;
    }
    const svg = figure.querySelector("svg");
    if (!svg) {
      faults.push(`“${name}” has no picture`);
      continue;
    }
    const words = svg.textContent;
    if (!unit.test(words) && !unit.test(caption.textContent)) faults.push(`“${name}” has no unit`);
    if (svg.querySelectorAll("text").length < 2) faults.push(`“${name}” has no axes`);
    const named =
      svg.getAttribute("aria-label") || svg.getAttribute("aria-labelledby") || svg.querySelector("title");
    if (!named) faults.push(`“${name}”: its picture has no name for who cannot see it`);
    // A drawing has its legend beside it, a chart with more than one mark in it.
    if (figure.classList.contains("drawing") && !figure.querySelector(".key")?.textContent.trim())
      faults.push(`“${name}” has no legend`);
  }
  return faults;
}

/** No content of a file was executed or parsed as markup. */
export function hostile() {
  const faults = [];
  if (window.ran !== undefined) faults.push("something from a file was run");
  for (const element of document.querySelectorAll("img, iframe, object, embed, link, base, form, i"))
    faults.push(`there is <${element.tagName}>`);
  for (const element of document.querySelectorAll("*")) {
    for (const { name, value } of element.attributes) {
      if (/^on/i.test(name)) faults.push(`<${element.tagName} ${name}>`);
      if (/^(href|src|action|xlink:href)$/i.test(name) && !value.startsWith("#"))
        faults.push(`an address: ${value}`);
    }
  }
  return faults;
}

/** Tab reaches every control, and each shows its focus. */
export async function keyboard(page, fault) {
  const wanted = await page.evaluate(() => {
    const controls = [...document.querySelectorAll("button, input, select, a[href], summary, [tabindex='0']")];
    const seen = controls.filter((e) => e.checkVisibility() && !e.disabled);
    seen.forEach((e, k) => (e.dataset.control = k));
    document.activeElement?.blur();
    window.scrollTo(0, 0);
    return seen.length;
  });
  const reached = new Set();
  for (let k = 0; k < wanted + 5 && reached.size < wanted; k++) {
    await page.keyboard.press("Tab");
    const at = await page.evaluate(() => {
      const e = document.activeElement;
      const style = getComputedStyle(e);
      return {
        control: e.dataset.control,
        outline: style.outlineStyle !== "none" ? parseFloat(style.outlineWidth) : 0,
        name: e.id || e.textContent.slice(0, 20),
        label: e.getAttribute("aria-label") || e.labels?.[0]?.textContent || e.textContent.trim(),
      };
    });
    if (at.control === undefined) continue;
    reached.add(at.control);
    if (at.outline < 2) fault(`focus on ${at.name} is not seen`);
    if (!at.label) fault(`control ${at.name} has no name`);
  }
  if (reached.size < wanted) fault(`the keyboard reaches ${reached.size} of ${wanted} controls`);
}

const drawn = (page) =>
  page.evaluate(
    () =>
      new Promise((done) =>
        requestAnimationFrame(() =>
          requestAnimationFrame(() =>
            done({
              picture: document.querySelector("#machine-drawing svg").innerHTML,
              figures:
                document.querySelector("#here-errors").textContent +
                document.querySelector("#here-tip").textContent,
              note: document.querySelector("#exaggeration-note").textContent,
            }),
          ),
        ),
      ),
  );

/** Every slider, moved with the keyboard, changes the picture and the figures beside it. */
export async function sliders(page, fault) {
  const ids = await page.$$eval("#machine input[type=range]", (all) => all.map((e) => e.id));
  if (ids.length < 4) fault(`there are only ${ids.length} sliders`);
  const errors = await page.evaluate(() =>
    window.trueaxis.machine.model.checks.some((c) => c.before.tip_mm > 0),
  );
  // Except where turning has no effect.
  for (const id of ids.filter((id) => id.startsWith("axis-"))) {
    await page.focus(`#${id}`);
    for (let k = 0; k < 3; k++) await page.keyboard.press("ArrowRight");
  }
  for (const id of ids) {
    const before = await drawn(page);
    await page.focus(`#${id}`);
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowRight");
    const after = await drawn(page);
    const isExaggeration = id === "exaggeration-slider";
    if (isExaggeration && !errors) continue;
    // A sensor of one position may have no effect at another; a tool length moves the tip.
    if (before.picture === after.picture) fault(`slider ${id} does not change the picture`);
    const figures = isExaggeration ? before.note !== after.note : before.figures !== after.figures;
    if (!figures) fault(`slider ${id} does not change the figures beside it`);
    const spoken = await page.getAttribute(`#${id}`, "aria-valuetext");
    if (!/\d/.test(spoken ?? "")) fault(`slider ${id} says nothing: ${spoken}`);
  }
  // The picture turns with the keys, with a drag, and back.
  const start = await drawn(page);
  await page.focus("#machine-drawing svg");
  await page.keyboard.press("ArrowLeft");
  const turned = await drawn(page);
  if (start.picture === turned.picture) fault("keys do not turn the machine");
  const box = await (await page.$("#machine-drawing svg")).boundingBox();
  await page.mouse.move(box.x + 100, box.y + 100);
  await page.mouse.down();
  await page.mouse.move(box.x + 160, box.y + 120, { steps: 3 });
  await page.mouse.up();
  if ((await drawn(page)).picture === turned.picture) fault("a drag does not turn the machine");
  await page.click("#machine >> text=Reset view");
  if ((await drawn(page)).picture !== start.picture) fault("the view is not reset");
}

/** The field shows what its buttons select, and the worst positions move the sliders. */
export async function field(page, fault) {
  const picture = () =>
    page.evaluate(
      () =>
        new Promise((done) =>
          requestAnimationFrame(() =>
            requestAnimationFrame(() => done(document.querySelector("#field-drawing svg").innerHTML)),
          ),
        ),
    );
  const { tables, errors } = await page.evaluate(() => ({
    tables: !!window.trueaxis.machine.model.tables,
    errors: window.trueaxis.machine.model.checks.some((c) => c.before.tip_mm > 0),
  }));
  const shown = [await picture()];
  for (const kind of ["after", "difference"]) {
    if ((await page.isVisible(`#show-${kind}`)) !== tables)
      fault(`the button ${kind} is there without tables, or not with them`);
    if (!tables) continue;
    await page.click(`#show-${kind}`);
    shown.push(await picture());
    if ((await page.getAttribute(`#show-${kind}`, "aria-pressed")) !== "true")
      fault(`the button ${kind} is not pressed`);
  }
  if (new Set(shown).size !== shown.length) fault("before, after and difference look alike");
  if (tables) await page.click("#show-before");
  if (!errors) {
    if (!/zero/.test(await page.textContent("#field"))) fault("it does not say that all errors are zero");
    return;
  }
  const places = await page.$$("#worst-list button");
  if (places.length < 3) fault(`only ${places.length} worst positions are listed`);
  for (const place of places.slice(0, 2)) {
    const said = (await place.textContent()).match(/^([\d.]+) µm/)[1];
    await place.click();
    await drawn(page);
    const there = await page.evaluate(() => {
      const { machine, state } = window.trueaxis;
      const sliders = machine.model.axes.map((a) => Number(document.getElementById(`axis-${a.letter}`).value));
      return {
        um: Field.figure(1e3 * machine.before(state).tip),
        far: Math.max(...sliders.map((v, k) => Math.abs(v - state.position[k]))),
      };
    });
    if (there.um !== said) fault(`a worst position of ${said} µm has ${there.um} µm`);
    if (!(there.far < 1e-9)) fault(`sliders are ${there.far} away from the position that was chosen`);
  }
  // The largest number in the table is the worst position, and the lattice shows nothing worse.
  const { most, max, first } = await page.evaluate(() => {
    const { volumetric, worst } = JSON.parse(document.getElementById("report-data").textContent);
    const { machine, state } = window.trueaxis;
    const lattice = new Field(machine).lattice(state).map((node) => 1e3 * node.before.tip);
    return {
      most: Math.max(...lattice),
      max: volumetric.before.translation_um.max,
      first: worst.before[0].tip_um,
    };
  });
  // The program's search rounds ends of travels to f32: 1e-5 mm, times errors of several µm per mm.
  if (Math.abs(max - first) > 1e-6) fault(`the largest error is ${max} µm, the worst position that is listed ${first} µm`);
  if (most > first + 1e-4) fault(`the field has ${most} µm, the worst position that is listed ${first} µm`);
}

/** With reduced motion both ends are shown in turn. */
export async function calm(page, fault) {
  const letter = await page.evaluate(() => window.trueaxis.machine.model.axes[0].letter);
  const seen = await page.evaluate(
    (id) =>
      new Promise((done) => {
        const slider = document.getElementById(id);
        const seen = new Set();
        slider.closest(".slider").querySelector(".play").click();
        const from = performance.now();
        const look = () => {
          seen.add(slider.value);
          if (performance.now() - from > 2200) done(seen.size);
          else requestAnimationFrame(look);
        };
        look();
      }),
    `axis-${letter}`,
  );
  if (seen < 2 || seen > 3) fault(`without motion, an axis is played over ${seen} positions`);
}

/** The same page with another number in one of the positions that the program wrote. */
export function falsified(html) {
  const from = html.indexOf(">", html.indexOf('id="model-data"')) + 1;
  const to = html.indexOf("</script>", from);
  const model = JSON.parse(html.slice(from, to));
  model.checks[50].actual[3] += 2e-6;
  return html.slice(0, from) + JSON.stringify(model).replaceAll("<", "\\u003c") + html.slice(to);
}

/** A page that computes other values says so in red, at the top, with the numbers. */
export async function alarm(page, fault) {
  const said = await page.evaluate(() => {
    const first = document.querySelector("main").firstElementChild;
    const probe = document.createElement("span");
    probe.style.color = "var(--alarm)";
    document.body.append(probe);
    return {
      words: first.textContent,
      seen: first.getClientRects().length > 0,
      ground: getComputedStyle(first).backgroundColor,
      red: getComputedStyle(probe).color,
    };
  });
  if (!said.seen || said.ground !== said.red || !/2\.0e-6 mm/.test(said.words))
    fault(`a page that is wrong by 2e-6 mm begins with “${said.words.slice(0, 80)}” on ${said.ground}`);
}
