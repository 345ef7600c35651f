/* What the command trueaxis, compiled for `wasm32-wasip1`, asks of its system: files in memory, two streams, a clock.
   https://github.com/WebAssembly/WASI/blob/main/legacy/preview1/docs.md */
const runCommand = (() => {
  "use strict";

  const [OK, BAD_FILE, EXISTS, IO, IS_FOLDER, NOT_FOUND, NOT_SUPPORTED] = [0, 8, 20, 29, 31, 44, 58];
  const [DEVICE, FOLDER, FILE] = [2, 3, 4];
  const [CREATE, MUST_BE_FOLDER, MUST_BE_NEW, TRUNCATE] = [1, 2, 4, 8];
  /** Written by the command to show how far it is. */
  const PROGRESS = "progress";
  /** The port of a controller, if one is connected. */
  const SERIAL = "serial";
  /** Milliseconds after which reading from the port ends without bytes. */
  const PATIENCE = 50;
  /** The folder that all files are in. */
  const ROOT = 3;

  class Ended extends Error {
    constructor(code) {
      super(`exit ${code}`);
      this.code = code;
    }
  }

  /** Bytes that grow. */
  class Bytes {
    constructor(bytes = new Uint8Array()) {
      this.bytes = bytes;
      this.length = bytes.length;
      this.isWritten = false;
    }

    write(at, piece) {
      const end = at + piece.length;
      if (end > this.bytes.length) {
        const larger = new Uint8Array(Math.max(end, 2 * this.bytes.length, 1024));
        larger.set(this.bytes.subarray(0, this.length));
        this.bytes = larger;
      }
      this.bytes.set(piece, at);
      this.isWritten = true;
      this.length = Math.max(this.length, end);
    }

    content() {
      return this.bytes.slice(0, this.length);
    }
  }

  const encode = (text) => new TextEncoder().encode(text);
  const decode = (bytes) => new TextDecoder().decode(bytes);

  /**
   * Runs `trueaxis` with arguments and files (names to bytes). Returns its exit code, what it printed to both streams,
   * and the files that it has written. `progress` gets "done total stage", and
   * `print` what is printed to standard output, when it is. `serial`, if there is one, is a port: `read(most, patience)`
   * and `write(bytes)` return promises, for which the command is suspended (the browser must have `WebAssembly.Suspending`);
   * they are rejected once the port is gone.
   */
  return async (module, args, inputs, progress, print, serial = null) => {
    const files = new Map(Object.entries(inputs).map(([name, bytes]) => [name, new Bytes(bytes)]));
    const streams = [null, new Bytes(), new Bytes()];
    // Open files: what they are, and where they are read and written.
    const open = new Map([[ROOT, { kind: FOLDER }]]);
    let next = ROOT + 1;
    let memory = null;

    const view = () => new DataView(memory.buffer);
    const bytes = (at, length) => new Uint8Array(memory.buffer, at, length);
    const text = (at, length) => decode(bytes(at, length));
    /** A name without its folder, of which there is one; "" is this folder. */
    const name = (at, length) => text(at, length).replace(/^(\.?\/)+/, "").replace(/^\.$/, "");
    const words = ["trueaxis", ...args].map((word) => encode(`${word}\0`));

    function pieces(at, count) {
      const data = view();
      return Array.from({ length: count }, (_, k) =>
        bytes(data.getUint32(at + 8 * k, true), data.getUint32(at + 8 * k + 4, true)),
      );
    }

    function status(at, kind, size) {
      const data = view();
      bytes(at, 64).fill(0);
      data.setUint8(at + 16, kind);
      data.setBigUint64(at + 24, 1n, true);
      data.setBigUint64(at + 32, BigInt(size), true);
      return OK;
    }

    async function receive(port, at, count, read) {
      const [into] = pieces(at, count);
      try {
        const got = into.length ? await port.read(into.length, PATIENCE) : [];
        into.set(got);
        view().setUint32(read, got.length, true);
        return OK;
      } catch {
        return IO;
      }
    }

    async function send(port, at, count, written) {
      const all = pieces(at, count);
      try {
        for (const piece of all) await port.write(piece.slice());
      } catch {
        return IO;
      }
      view().setUint32(written, all.reduce((sum, piece) => sum + piece.length, 0), true);
      return OK;
    }

    const wasi = {
      args_sizes_get(count, size) {
        view().setUint32(count, words.length, true);
        view().setUint32(
          size,
          words.reduce((sum, word) => sum + word.length, 0),
          true,
        );
        return OK;
      },
      args_get(pointers, at) {
        words.forEach((word, k) => {
          view().setUint32(pointers + 4 * k, at, true);
          bytes(at, word.length).set(word);
          at += word.length;
        });
        return OK;
      },
      environ_sizes_get(count, size) {
        view().setUint32(count, 0, true);
        view().setUint32(size, 0, true);
        return OK;
      },
      environ_get: () => OK,
      /** The first clock is that of the calendar. */
      clock_time_get(clock, _precision, at) {
        const now = clock === 0 ? Date.now() : performance.now();
        view().setBigUint64(at, BigInt(Math.round(now * 1e6)), true);
        return OK;
      },
      random_get(at, length) {
        crypto.getRandomValues(bytes(at, length));
        return OK;
      },
      sched_yield: () => OK,
      /** Sleeps: a clock is all that the command waits for. */
      poll_oneoff(asked, happened, count, events) {
        const data = view();
        if (!serial || count !== 1 || data.getUint8(asked + 8) !== 0) return NOT_SUPPORTED;
        const time = Number(data.getBigUint64(asked + 24, true)) / 1e6;
        const now = data.getUint16(asked + 40, true) & 1 ? performance.now() : 0;
        bytes(happened, 32).fill(0);
        bytes(happened, 8).set(bytes(asked, 8));
        data.setUint32(events, 1, true);
        return new Promise((resolve) => setTimeout(() => resolve(OK), Math.max(0, time - now)));
      },
      proc_exit(code) {
        throw new Ended(code);
      },
      fd_prestat_get(fd, at) {
        if (fd !== ROOT) return BAD_FILE;
        view().setUint32(at, 0, true);
        view().setUint32(at + 4, 1, true);
        return OK;
      },
      fd_prestat_dir_name(fd, at) {
        if (fd !== ROOT) return BAD_FILE;
        bytes(at, 1).set(encode("/"));
        return OK;
      },
      fd_fdstat_get(fd, at) {
        const kind = fd < ROOT ? DEVICE : open.get(fd)?.kind;
        if (kind === undefined) return BAD_FILE;
        bytes(at, 24).fill(0);
        // A file in place of a terminal: no colours.
        view().setUint8(at, fd < ROOT ? FILE : kind);
        view().setBigUint64(at + 8, 0x1fffffffn, true);
        view().setBigUint64(at + 16, 0x1fffffffn, true);
        return OK;
      },
      fd_filestat_get(fd, at) {
        if (fd < ROOT) return status(at, DEVICE, 0);
        const file = open.get(fd);
        return file ? status(at, file.kind, file.bytes?.length ?? 0) : BAD_FILE;
      },
      path_filestat_get(_fd, _flags, path, length, at) {
        const wanted = name(path, length);
        if (wanted === "") return status(at, FOLDER, 0);
        const file = files.get(wanted);
        return file ? status(at, FILE, file.length) : NOT_FOUND;
      },
      path_open(_fd, _links, path, length, how, _rights, _inherited, _flags, at) {
        const wanted = name(path, length);
        let opened = { kind: FOLDER };
        if (wanted === SERIAL && serial) opened = { kind: DEVICE, serial };
        else if (wanted !== "") {
          if (how & MUST_BE_FOLDER) return NOT_FOUND;
          if (files.has(wanted) && how & MUST_BE_NEW) return EXISTS;
          if (!files.has(wanted)) {
            if (!(how & CREATE) || wanted.includes("/")) return NOT_FOUND;
            files.set(wanted, new Bytes());
          }
          const file = files.get(wanted);
          if (how & TRUNCATE) file.length = 0;
          opened = { kind: FILE, bytes: file, at: 0, name: wanted };
        }
        open.set(next, opened);
        view().setUint32(at, next++, true);
        return OK;
      },
      path_rename(_from, path, length, _to, newPath, newLength) {
        const [from, to] = [name(path, length), name(newPath, newLength)];
        if (!files.has(from)) return NOT_FOUND;
        files.set(to, files.get(from));
        files.delete(from);
        return OK;
      },
      path_unlink_file: (_fd, path, length) => (files.delete(name(path, length)) ? OK : NOT_FOUND),
      path_create_directory: () => NOT_SUPPORTED,
      path_readlink: () => NOT_SUPPORTED,
      fd_sync: () => OK,
      fd_close(fd) {
        const file = open.get(fd);
        if (file?.name === PROGRESS) {
          progress(decode(file.bytes.content()));
          files.delete(PROGRESS);
        }
        return open.delete(fd) ? OK : BAD_FILE;
      },
      fd_seek(fd, offset, from, at) {
        const file = open.get(fd);
        if (!file?.bytes) return BAD_FILE;
        file.at = Number(offset) + [0, file.at, file.bytes.length][from];
        view().setBigUint64(at, BigInt(file.at), true);
        return OK;
      },
      fd_read(fd, at, count, read) {
        let sum = 0;
        if (fd !== 0) {
          const file = open.get(fd);
          if (!file) return BAD_FILE;
          if (file.serial) return receive(file.serial, at, count, read);
          if (!file.bytes) return IS_FOLDER;
          for (const piece of pieces(at, count)) {
            const part = file.bytes.bytes.subarray(file.at, Math.min(file.bytes.length, file.at + piece.length));
            piece.set(part);
            file.at += part.length;
            sum += part.length;
          }
        }
        view().setUint32(read, sum, true);
        return OK;
      },
      fd_write(fd, at, count, written) {
        const file = fd < ROOT ? { bytes: streams[fd], at: streams[fd]?.length } : open.get(fd);
        if (file?.serial) return send(file.serial, at, count, written);
        if (!file?.bytes) return BAD_FILE;
        let sum = 0;
        for (const piece of pieces(at, count)) {
          file.bytes.write(file.at, piece);
          if (fd === 1) print(decode(piece));
          file.at += piece.length;
          sum += piece.length;
        }
        view().setUint32(written, sum, true);
        return OK;
      },
    };

    if (serial)
      for (const name of ["fd_read", "fd_write", "poll_oneoff"]) wasi[name] = new WebAssembly.Suspending(wasi[name]);
    const instance = await WebAssembly.instantiate(module, { wasi_snapshot_preview1: wasi });
    memory = instance.exports.memory;
    let code = 0;
    try {
      if (serial) await WebAssembly.promising(instance.exports._start)();
      else instance.exports._start();
    } catch (error) {
      code = error.code ?? 101;
      if (!(error instanceof Ended)) streams[2].write(streams[2].length, encode(`error: ${error.message}\n`));
    }
    return {
      code,
      out: decode(streams[1].content()),
      err: decode(streams[2].content()),
      files: Object.fromEntries(
        [...files].filter(([, { isWritten }]) => isWritten).map(([file, bytes]) => [file, bytes.content()]),
      ),
    };
  };
})();
