// The log as curves. A drag chooses the part that is used.
/* global uPlot */
import { by, short } from "./dom.js";

const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const HEIGHT = 190;
let charts = [];
let [part, chosen] = [[null, null], () => {}];

// What is left out lies in the shade.
function shade(u) {
  const [{ ctx }, { left, top, width, height }] = [u, u.bbox];
  const at = (value, otherwise) => (value == null ? otherwise : Math.min(Math.max(u.valToPos(value, "x", true), left), left + width));
  const [from, to] = [at(part[0], left), at(part[1], left + width)];
  ctx.save();
  ctx.fillStyle = ink("shade");
  ctx.fillRect(left, top, from - left, height);
  ctx.fillRect(to, top, left + width - to, height);
  ctx.restore();
}

function selected(u) {
  const { left, width } = u.select;
  if (width < 3) return;
  const [from, to] = [left, left + width].map((place) => u.posToVal(place, "x"));
  u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  chosen(+from.toPrecision(5), +to.toPrecision(5));
}

function axis(label, size) {
  const line = { stroke: () => ink("line"), width: 1 };
  const values = (_, splits) => splits.map(short);
  return { label, size, values, labelSize: 20, labelFont: "13px sans-serif", font: "12px sans-serif", stroke: () => ink("ink"), grid: line, ticks: line };
}

function options([xLabel, yLabel], count, colour, width, dots) {
  const points = { show: dots, size: 6 };
  const series = { label: yLabel, stroke: () => ink(colour), width: 1.5, points, ...(dots && { paths: () => null }) };
  return {
    width, height: HEIGHT,
    scales: { x: { time: false } },
    axes: [axis(xLabel, 40), axis(yLabel, 62)],
    series: [{ label: xLabel }, ...Array(count).fill(series).map((it) => ({ ...it }))],
    legend: { show: false },
    cursor: { sync: { key: "log" }, drag: { x: !dots, y: false, setScale: false }, points: { show: false } },
    hooks: { draw: [shade], setSelect: [selected] },
  };
}

// Every run is a series over its own time.
function runs({ x, starts }, values) {
  const ends = [...starts.slice(1), x.length];
  const piece = (k) => [x.subarray(starts[k], ends[k]), values.subarray(starts[k], ends[k])];
  const tables = ends.map((_, k) => piece(k));
  return tables.length === 1 ? tables[0] : uPlot.join(tables.map((table) => table.map((it) => Array.from(it))), tables.map(() => [2, 2]));
}

function chart(place, labels, data, colour, dots) {
  place.setAttribute("role", "img");
  place.setAttribute("aria-label", `${labels[1]} over ${labels[0]}, ${data.length - 1} records`);
  const u = new uPlot(options(labels, data.length - 1, colour, place.clientWidth || 300, dots), data, place);
  const watch = new ResizeObserver(() => u.setSize({ width: place.clientWidth, height: HEIGHT }));
  watch.observe(place);
  charts.push({ u, watch });
}

// A table of steady states is drawn as dots, and has no part.
function sorted({ x, output }) {
  const order = [...x.keys()].sort((a, b) => x[a] - x[b]);
  return [order.map((k) => x[k]), order.map((k) => output[k])];
}

export function draw(curves, onChosen) {
  charts.forEach(({ u, watch }) => (watch.disconnect(), u.destroy()));
  [charts, chosen] = [[], onChosen];
  const { x, input, output, labels } = curves;
  const table = x.length > 0 && input.length === 0;
  by("curves").hidden = x.length === 0;
  by("curve-input").parentElement.hidden = table;
  by("crop").hidden = table || x.length === 0;
  if (x.length === 0) return;
  if (table) return chart(by("curve-output"), [labels[0], labels[2]], sorted(curves), "accent", true);
  chart(by("curve-input"), [labels[0], labels[1]], runs(curves, input), "given", false);
  chart(by("curve-output"), [labels[0], labels[2]], runs(curves, output), "accent", false);
}

export function mark(from, to) {
  part = [from, to];
  charts.forEach(({ u }) => u.redraw());
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach(({ u }) => u.redraw()));
