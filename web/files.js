/* Files: what they are for, which are not for this page, and how they are written into an address. */
const Files = (() => {
  "use strict";

  const encode = (text) => new TextEncoder().encode(text);
  const decode = (bytes) => new TextDecoder().decode(bytes);

  /** What a file is for, by what is in it. */
  function roleOf(name, bytes) {
    const head = decode(bytes.subarray(0, 100e3));
    if (/\.toml$/i.test(name)) {
      if (/^\s*\[\[axis\]\]/m.test(head)) return "machine";
      if (/^\s*\[(\[ball\]|\[bar\]|stylus\])/m.test(head)) return "artefact";
      return /^\s*\[(parameters|tabulated|thermal)/m.test(head) ? "errors" : "setup";
    }
    if (/\.csv$/i.test(name)) {
      if (/^\s*#\s*(reads|reads_along|axis)\b/m.test(head)) return "runs";
      return /^\s*ball\s*,/m.test(head) ? "probings" : "data";
    }
    return /\.(ngc|nc|mpf|spf|tap|cnc|gcode|txt)$/i.test(name) ? "program" : "data";
  }

  /** Why a file cannot be read, and what to do; `null` if it may be one of those that are known. */
  function unreadable(name, bytes) {
    const [a, b] = bytes;
    if (/\.(xlsx?|xlsm|ods|numbers)$/i.test(name) || (a === 0x50 && b === 0x4b) || (a === 0xd0 && b === 0xcf))
      return `error: ${name} is a workbook of a spreadsheet program\nhelp: save the sheet as CSV, separated by commas and with decimal points, and open that file`;
    if (!/\.(csv|txt|tsv)$/i.test(name)) return null;
    const lines = decode(bytes.subarray(0, 20e3)).split(/\r?\n/);
    const rows = lines.map((text, k) => ({ text, line: k + 1 })).filter(({ text }) => text.trim() && !/^\s*#/.test(text));
    const where = ({ line, text }) => `  --> ${name}:${line}:1\n   |  ${text.slice(0, 70)}`;
    const semicolons = rows.find(({ text }) => /;.*;/.test(text));
    // Where the names of columns are separated by commas, so are integers.
    const german = !rows[0]?.text.includes(",") && rows.find(({ text }) => /(^|[;\t ])[-+]?\d+,\d+([;\t ]|$)/.test(text));
    if (semicolons)
      return `error: ${name} separates its columns by semicolons${german ? " and writes 0,5 for 0.5" : ""}\n${where(german || semicolons)}\nhelp: save it with commas between the columns and points in the numbers (in a spreadsheet program: CSV in English (US) format)`;
    if (german)
      return `error: ${name} writes numbers with a decimal comma\n${where(german)}\nhelp: write 0.5, not 0,5; commas separate columns`;
    return null;
  }

  async function through(bytes, stream) {
    return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
  }

  /** A text as the fragment of an address. */
  async function pack(whole) {
    const bytes = await through(encode(whole), new CompressionStream("deflate-raw"));
    const text = btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join(""));
    return `#1.${text.replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "")}`;
  }

  /** The text of such a fragment; rejected if it is damaged. */
  async function unpack(fragment) {
    const text = atob(fragment.slice(3).replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(text, (c) => c.charCodeAt(0));
    return decode(await through(bytes, new DecompressionStream("deflate-raw")));
  }

  return { encode, decode, roleOf, unreadable, pack, unpack };
})();
