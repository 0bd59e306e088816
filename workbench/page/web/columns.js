// Which column is which quantity: a choice for each quantity writes the line of `--columns`, and the line sets the choices.
import { by, make } from "./dom.js";

// The names of the format, docs/log.md: label, names with their units, and whether it is asked for at first.
const QUANTITIES = [
  ["Time", { t_s: "s", t_ms: "ms", t_us: "µs", t_ns: "ns" }, true],
  ["Voltage at the motor", { u_v: "V", u_mv: "mV" }, true],
  ["Duty of the drive", { duty: "−1 … 1", duty_percent: "%" }, true],
  ["Supply voltage", { vbus_v: "V", vbus_mv: "mV" }, true],
  ["Speed", { omega_rad_s: "rad/s", omega_rpm: "rpm", omega_deg_s: "°/s", omega_rev_s: "turns/s" }, true],
  ["Angle", { theta_rad: "rad", theta_deg: "°", theta_rev: "turns" }, true],
  ["Measured current", { i_a: "A", i_ma: "mA" }, true],
  ["Separate records", { run: "number" }, true],
  ["Current held by a loop", { current_a: "A", current_ma: "mA" }],
  ["Torque applied", { torque_nm: "N m", torque_mnm: "mN m" }],
  ["Force applied", { force_n: "N" }],
  ["Speed along a line", { v_m_s: "m/s", v_cm_s: "cm/s", v_mm_s: "mm/s" }],
  ["Position along a line", { q_m: "m", q_cm: "cm", q_mm: "mm" }],
  ["State of the bridge", { bridge: "0, 1, 2" }],
];
// Other names of the same quantities.
const ALIASES = { time_s: "t_s", voltage_v: "u_v", tau_nm: "torque_nm", q_rad: "theta_rad", w_rad_s: "omega_rad_s", speed_rpm: "omega_rpm" };
const known = (name) => ALIASES[name.toLowerCase()] ?? name.toLowerCase();

// Items between commas, those in quotes and in parentheses apart.
export function items(line) {
  const parts = line.match(/(?:"[^"]*"|'[^']*'|\((?:[^()]|\([^()]*\))*\)|[^,"'(])+/g) ?? [];
  const pairs = parts.map((part) => part.trim().split(/=(.*)/s)).filter(([ours]) => ours);
  return pairs.map(([ours, theirs = ""]) => [ours.trim(), theirs.trim()]);
}

export const written = (pairs) => pairs.map((pair) => pair.join("=")).join(",");

const quoted = (name) => (/^[A-Za-z_]\w*$/.test(name) ? name : name.includes('"') ? `'${name}'` : `"${name}"`);
const unquoted = (text) => text.replace(/^(["'])(.*)\1$/s, "$2");

const rows = [];

function row([label, units, usual], k, changed) {
  const column = make("select", { id: `column-${k}` });
  const unit = make("select", { id: `unit-${k}`, ariaLabel: `${label}: unit` }, ...Object.entries(units).map(([name, text]) => make("option", { value: name }, text)));
  unit.disabled = Object.keys(units).length === 1;
  const place = by(usual ? "quantities" : "rarer-quantities");
  place.append(make("label", { htmlFor: column.id }, label), column, unit);
  column.addEventListener("change", changed);
  unit.addEventListener("change", changed);
  rows.push({ units, column, unit });
}

export function begin(changed) {
  QUANTITIES.forEach((quantity, k) => row(quantity, k, () => changed(line())));
}

// The line that the choices say. A choice that is left to the name is no item.
function line() {
  const said = rows.filter(({ column }) => column.value).map(({ column, unit }) => {
    const [kind, theirs] = [column.value[0], column.value.slice(1)];
    return [unit.value, kind === "c" ? quoted(theirs) : theirs];
  });
  return written(said);
}

// What a column is read as without a word of the user's.
function byName(units, columns) {
  const read = columns.find(({ seems, state }) => state === "read" && seems && known(seems) in units);
  return read ?? null;
}

function choices(names, item, auto) {
  const option = (value, text) => make("option", { value }, text);
  const own = item && item !== "none" && !names.includes(unquoted(item)) ? [option("e" + item, item)] : [];
  const columns = names.map((name) => option("c" + name, name));
  return [option("", auto ? `${auto.name} (by its name)` : "–"), option("enone", "leave out"), ...own, ...columns];
}

// Sets the choices to a line and to what the engine sees in the file.
export function show(text, columns) {
  const names = columns.map(({ name }) => name);
  const said = items(text);
  for (const { units, column, unit } of rows) {
    const [ours, item] = said.find(([ours]) => known(ours) in units) ?? [];
    const auto = item === undefined ? byName(units, columns) : null;
    column.replaceChildren(...choices(names, item, auto));
    column.value = item === undefined ? "" : names.includes(unquoted(item)) ? "c" + unquoted(item) : "e" + item;
    unit.value = known(ours ?? auto?.seems ?? Object.keys(units)[0]);
    column.classList.toggle("used", item !== undefined || auto !== null);
  }
  by("rarer").open ||= rows.some(({ column }, k) => column.value && !QUANTITIES[k][2]);
}
