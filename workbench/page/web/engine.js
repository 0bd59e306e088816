// A worker with the engine. One that is stopped or broken is replaced by the next request.

export class Stopped extends Error {}

export class Engine {
  #worker = null;
  #number = 0;
  #waiting = new Map();
  #progress;

  constructor(progress = () => {}) {
    this.#progress = progress;
  }

  ask(what, request) {
    this.#worker ??= this.#begun();
    const number = ++this.#number;
    return new Promise((resolve, reject) => {
      this.#waiting.set(number, { resolve, reject });
      this.#worker.postMessage({ number, what, request });
    });
  }

  stop(error = new Stopped()) {
    this.#worker?.terminate();
    this.#worker = null;
    for (const { reject } of this.#waiting.values()) reject(error);
    this.#waiting.clear();
  }

  #begun() {
    const worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
    worker.onmessage = ({ data }) => this.#heard(data);
    worker.onerror = ({ message }) => this.stop(new Error(`The engine cannot be loaded${message ? ` (${message})` : ""}; load the page again, or try a newer browser`));
    return worker;
  }

  #heard({ number, value, error, fatal, progress }) {
    if (progress) return this.#progress(progress);
    const asked = this.#waiting.get(number);
    this.#waiting.delete(number);
    if (error === undefined) return asked?.resolve(value);
    asked?.reject(new Error(error));
    if (fatal) this.stop(new Error(error));
  }
}
