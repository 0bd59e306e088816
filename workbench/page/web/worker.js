// The engine in its own thread: a request in, a result or a sentence out.
import init, { Task, look, unknown } from "./truing_page.js";
import { cause } from "./told.js";

const ready = init();

function looked({ log, columns, model }) {
  const { json, x, starts, input, output, labels } = look(log.name, log.bytes, columns, model);
  return { ...JSON.parse(json), curves: { x, starts, input, output, labels } };
}

function compared({ model, log, columns, from, to, holdouts, acceptData }) {
  const task = new Task(model.name, model.text, log.name, log.bytes);
  task.columns(columns);
  task.crop(from ?? undefined, to ?? undefined);
  for (const { name, bytes } of holdouts) task.holdout(name, bytes);
  if (acceptData) task.accept_data();
  const answer = task.run();
  return { ...JSON.parse(answer.told), json: answer.json, report: answer.report, model: answer.model };
}

const work = { look: looked, compare: compared, unknown: ({ name, text }) => unknown(name, text) };

onmessage = async ({ data: { number, what, request } }) => {
  try {
    await ready;
    postMessage({ number, value: work[what](request) });
  } catch (error) {
    postMessage({ number, error: cause(error), fatal: error instanceof WebAssembly.RuntimeError });
  }
};
