// The page: files in, what the engine sees, the search, the verdict.
import * as columns from "./columns.js";
import * as curves from "./curves.js";
import { by, list, make, say, settled, short } from "./dom.js";
import { Engine, Stopped } from "./engine.js";
import * as form from "./form.js";
import * as result from "./result.js";

// What is looked at answers while a search runs.
const looking = new Engine();
const searching = new Engine(progress);
const state = { log: null, held: [], model: { name: "model.toml", text: "" }, readable: false, modelled: false, proposed: false, acceptData: false };
let began = 0;
let ticking;

const bytesOf = async (file) => ({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) });

// ---- the log

async function openLog(file) {
  Object.assign(state, { log: await bytesOf(file), readable: false, proposed: false, acceptData: false });
  [by("columns").value, by("from").value, by("to").value] = ["", "", ""];
  curves.mark(null, null);
  list(by("guessed").querySelector("ul"), []);
  await look();
}

let asked = 0;
async function look() {
  if (!state.log) return;
  const mine = ++asked;
  try {
    const seen = await looking.ask("look", { log: state.log, columns: by("columns").value, model: state.model.text });
    if (mine === asked) showLog(seen);
  } catch (error) {
    if (mine !== asked || error instanceof Stopped) return;
    state.readable = false;
    say(by("log-error"), error.message);
    ready();
  }
}

function showLog(seen) {
  propose(seen);
  state.readable = !seen.refused;
  say(by("log-error"), seen.refused);
  by("seen").hidden = false;
  by("written").textContent = fact(seen);
  columns.show(by("columns").value, seen.columns);
  table(seen.columns);
  list(by("log-notes"), seen.notes);
  by("next-time").hidden = seen.ask.length === 0;
  list(by("next-time").querySelector("ul"), seen.ask);
  curves.draw(seen.curves, crop);
  ready();
}

function fact({ file, rows, written, time }) {
  const lasts = time ? `, ${short(time.seconds)} s at ${short(+time.rate_hz.toPrecision(3))} rows a second` : "";
  const records = time?.records > 1 ? ` in ${time.records} records` : "";
  return `${file}: ${rows.toLocaleString("en")} rows${lasts}${records}; ${written}.`;
}

// What is guessed of columns is written where the user sees it, once: a line of the user's own stays.
function propose(seen) {
  if (by("columns").value || state.proposed) return (by("guessed").hidden = !state.proposed);
  state.proposed = seen.columns_argument !== "";
  by("columns").value = seen.columns_argument;
  list(by("guessed").querySelector("ul"), seen.guessed);
  by("guessed").hidden = !state.proposed;
}

function table(seen) {
  const cell = (text, className = "") => make("td", { className }, text);
  const read = ({ seems, state }) => (!seems ? "not used" : state === "unused" ? `not used (${seems})` : state === "proposed" ? `${seems}, guessed` : seems);
  const row = (it) => make("tr", {}, make("th", { scope: "row" }, it.name + (it.empty ? ` (${it.empty} empty)` : "")), cell(read(it)), ...[it.min, it.max, it.step].map((value) => cell(short(value), "figure")));
  by("file-columns").tBodies[0].replaceChildren(...seen.map(row));
}

function crop(from, to) {
  [by("from").value, by("to").value] = [from, to].map((value) => value ?? "");
  curves.mark(from, to);
}

const seconds = (id) => (by(id).value === "" ? null : Number(by(id).value));

async function example() {
  const fetched = async (name) => {
    const response = await fetch(`example/${name}`);
    if (!response.ok) throw new Error(`example/${name} cannot be loaded (${response.status})`);
    return new File([await response.blob()], name);
  };
  try {
    const [model, log, held] = await Promise.all(["model.toml", "log.csv", "holdout.csv"].map(fetched));
    state.held = [await bytesOf(held)];
    showHeld();
    await openModel(model);
    await openLog(log);
    by("example-about").hidden = false;
    by("status").textContent = "The example is loaded.";
  } catch (error) {
    say(by("log-error"), error.message);
  }
}

// ---- the model

async function openModel(file) {
  by("model-text").value = await file.text();
  state.model.name = file.name;
  await examine();
}

async function examine() {
  const text = by("model-text").value;
  const changed = text !== state.model.text;
  state.model.text = text;
  state.modelled = false;
  try {
    const open = text.trim() ? await looking.ask("unknown", state.model) : null;
    state.modelled = open !== null;
    say(by("model-error"), "");
    by("model-state").textContent = !open ? "" : open.length ? `fitted to the log: ${open.join(", ")}` : "complete";
  } catch (error) {
    by("model-state").textContent = "";
    say(by("model-error"), error.message);
  }
  ready();
  if (changed) await look();
}

// ---- logs held out

function showHeld() {
  const line = ({ name, bytes }, k) => {
    const remove = make("button", { type: "button", className: "quiet", ariaLabel: `Remove ${name}` }, "Remove");
    remove.addEventListener("click", () => (state.held.splice(k, 1), showHeld()));
    return make("li", {}, make("span", {}, `${name} (${Math.ceil(bytes.length / 1024).toLocaleString("en")} kB)`), remove);
  };
  by("held-list").replaceChildren(...state.held.map(line));
}

async function addHeld(files) {
  state.held.push(...(await Promise.all([...files].map(bytesOf))));
  showHeld();
}

// ---- the search

function ready() {
  const lacks = [state.readable ? "" : "a log that can be read", state.modelled ? "" : "a model"].filter(Boolean);
  by("run").disabled = lacks.length > 0;
  by("run-hint").textContent = lacks.length ? `Needs ${lacks.join(" and ")}.` : "Seconds to minutes, in this tab.";
}

let tried = 0;
function progress(told) {
  tried = told.tried;
  if (told.text) by("status").textContent = told.text;
  tick();
}

function tick() {
  by("clock").textContent = `${Math.floor((performance.now() - began) / 1000)} s, ${tried} candidates tried`;
}

function running(yes) {
  [by("run").hidden, by("stop").hidden, by("progress").hidden] = [yes, !yes, !yes];
  clearInterval(ticking);
  if (!yes) return;
  [began, tried] = [performance.now(), 0];
  ticking = setInterval(tick, 1000);
  tick();
}

async function compare() {
  const request = { model: state.model, log: state.log, columns: by("columns").value, from: seconds("from"), to: seconds("to"), holdouts: state.held, acceptData: state.acceptData };
  say(by("run-error"), "");
  by("result").hidden = true;
  by("status").textContent = "Searching.";
  running(true);
  by("stop").focus();
  try {
    const answer = await searching.ask("compare", request);
    by("status").textContent = `Done in ${((performance.now() - began) / 1000).toFixed(1)} s. Verdict: ${answer.grade}.`;
    running(false);
    result.show(answer);
  } catch (error) {
    running(false);
    by("status").textContent = error instanceof Stopped ? "Cancelled." : "";
    say(by("run-error"), error instanceof Stopped ? "" : error.message);
    by("run").focus();
  }
}

// ---- what is heard

function files(id, take) {
  const input = by(id);
  const zone = document.querySelector(`[data-for="${id}"]`);
  input.addEventListener("change", () => (input.files.length && take(input.files), (input.value = "")));
  zone.addEventListener("dragover", () => zone.classList.add("over"));
  zone.addEventListener("dragleave", () => zone.classList.remove("over"));
  zone.addEventListener("drop", ({ dataTransfer }) => (zone.classList.remove("over"), dataTransfer.files.length && take(dataTransfer.files)));
}

// A file that misses its place must not replace the page.
for (const name of ["dragover", "drop"]) addEventListener(name, (event) => event.preventDefault());
files("log-file", ([file]) => ((by("example-about").hidden = true), openLog(file)));
files("model-file", ([file]) => openModel(file));
files("held-files", addHeld);
columns.begin((line) => ((by("columns").value = line), look()));
form.begin((text) => ((by("model-text").value = text), (state.model.name = "model.toml"), examine()));
by("columns").addEventListener("input", settled(look));
by("model-text").addEventListener("input", settled(examine));
for (const id of ["from", "to"]) by(id).addEventListener("input", () => curves.mark(seconds("from"), seconds("to")));
by("whole").addEventListener("click", () => crop(null, null));
by("example").addEventListener("click", example);
by("run").addEventListener("click", () => ((state.acceptData = false), compare()));
by("accept-data").addEventListener("click", () => ((state.acceptData = true), compare()));
by("stop").addEventListener("click", () => searching.stop());
ready();
