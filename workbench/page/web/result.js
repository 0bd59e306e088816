// The result: verdict, names, downloads, and the report in a frame.
import { by, make } from "./dom.js";

// The report brings its scripts and styles inside, which this page's policy forbids: it gets the same ones as files.
const OF_THE_REPORT = { styles: ["report/uPlot.min.css", "report/style.css"], scripts: ["report/uPlot.iife.min.js", "report/charts.js"] };
let links = [];

function framed(report) {
  const page = new DOMParser().parseFromString(report, "text/html");
  page.querySelectorAll("style, script:not([type]), meta[http-equiv]").forEach((part) => part.remove());
  for (const href of OF_THE_REPORT.styles) page.head.append(Object.assign(page.createElement("link"), { rel: "stylesheet", href }));
  for (const src of OF_THE_REPORT.scripts) page.body.append(Object.assign(page.createElement("script"), { src }));
  return "<!doctype html>" + page.documentElement.outerHTML;
}

// As high as what is in it.
function frame(report) {
  const frame = make("iframe", { id: "report", title: "Report", srcdoc: framed(report) });
  frame.addEventListener("load", () => {
    const { documentElement: inside, body } = frame.contentDocument;
    const fit = () => (frame.style.height = `${Math.ceil(body.getBoundingClientRect().height) + 2}px`);
    new ResizeObserver(fit).observe(body);
    inside.style.overflowY = "hidden";
  });
  by("report-place").replaceChildren(frame);
}

function offer(id, text, type) {
  const url = URL.createObjectURL(new Blob([text], { type }));
  links.push(url);
  by(id).href = url;
}

function offered({ json, report, model, tested }) {
  links.forEach((url) => URL.revokeObjectURL(url));
  links = [];
  offer("get-json", json, "application/json");
  offer("get-report", report, "text/html");
  offer("get-model", model, "application/toml");
  by("get-model").hidden = !tested;
}

function told({ verdict, grade, headline, faults, ties, tested, signal, fit_before, fit_after }) {
  const fit = tested ? [make("p", { className: "fit" }, `Fit on held-out data (${signal}): `, make("span", { className: "before" }, fit_before), " → ", make("strong", {}, fit_after))] : [];
  const wrong = faults.flatMap(([what, remedy]) => [make("p", {}, what), make("p", { className: "remedy" }, "To mend it: ", make("strong", {}, remedy))]);
  const tied = ties.map((text) => make("p", { className: "tie" }, `Equally good: ${text}`));
  by("verdict").className = `verdict ${verdict.replaceAll(" ", "-")}`;
  by("verdict").replaceChildren(make("p", { className: "word" }, grade), make("p", { className: "headline" }, headline), ...wrong, ...tied, ...fit);
}

function effect({ name, numbers, evidence }) {
  const each = numbers.map(([key, value]) => make("li", {}, make("code", {}, key), make("span", { className: "figure" }, value)));
  const values = each.length ? [make("ul", { className: "values" }, ...each)] : [];
  return make("li", {}, make("code", { className: "name" }, name), ...values, make("p", {}, evidence));
}

export function show(answer) {
  told(answer);
  by("names").replaceChildren(...(answer.effects.length ? [make("ol", { className: "effects" }, ...answer.effects.map(effect))] : []));
  by("accept").hidden = answer.faults.length === 0;
  by("command").textContent = answer.command;
  offered(answer);
  by("result").hidden = false;
  frame(answer.report);
  by("result-title").focus({ preventScroll: true });
  by("result-title").scrollIntoView({ block: "start" });
}
