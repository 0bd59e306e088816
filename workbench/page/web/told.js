// What the engine tells while it works, in the worker. The engine has no clock of its own.

// Candidates are tried faster than anybody reads.
const EVERY_MS = 100;
let [tried, last] = [0, 0];
let panic = "";

export const now = () => performance.now();

export function progress(text) {
  if (!text) tried++;
  if (!text && now() - last < EVERY_MS) return;
  last = now();
  postMessage({ progress: { tried, text } });
}

export const broken = (text) => (panic = text);

// A trap says nothing; the panic before it does.
export const cause = (error) => (panic ? `The engine has a defect: ${panic}` : (error?.message ?? String(error)));
