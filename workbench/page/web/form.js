// A model from what is known of a motor: what is left empty is written as unknown, which the engine fits to the log.
import { by, make } from "./dom.js";

// Keys of docs/model.md: section, key, label, unit.
const KINDS = {
  dc_motor: ["DC motor", [
    ["motor", "R_ohm", "Resistance between the terminals", "Ω"],
    ["motor", "Kt_nm_per_a", "Torque constant (= back-EMF constant, V s/rad)", "N m/A"],
    ["motor", "J_kgm2", "Inertia of rotor, gear and load", "kg m²"],
  ]],
  first_order: ["First order: gain and time constant", [
    ["model", "gain_rad_s_per_v", "Steady speed per volt", "rad/s/V"],
    ["model", "time_constant_s", "Time constant of the speed", "s"],
  ]],
  inertia: ["Driven by a torque", [["motor", "inertia_kgm2", "Inertia that moves", "kg m²"]]],
};
const BESIDES = [
  ["supply", "nominal_v", "Supply", "V"],
  ["encoder", "counts_per_rev", "Encoder: counts per turn, after ×4 decoding", "1"],
];
// A label gives two digits, and motors of one type differ by a tenth.
const TOLERANCE = "0.1";

function field([section, key, label, unit]) {
  const input = make("input", { id: `form-${key}`, name: key, type: "text", inputMode: "decimal", placeholder: "unknown" });
  input.dataset.section = section;
  return [make("label", { htmlFor: input.id }, label), input, make("span", { className: "unit" }, unit === "1" ? "" : unit)];
}

function fields(kind) {
  const select = make("select", { id: "form-kind" }, ...Object.entries(KINDS).map(([value, [label]]) => make("option", { value }, label)));
  select.value = kind;
  select.addEventListener("change", () => (fields(select.value), by("form-kind").focus()));
  const rows = [...KINDS[kind][1], ...BESIDES].map(field).flat();
  by("fields").replaceChildren(make("label", { htmlFor: select.id }, "Kind of model"), select, make("span"), ...rows);
}

// A decimal comma is one; everything else is for the engine to refuse.
const number = (text) => text.trim().replace(",", ".");

function lines(section, kind, inputs) {
  const base = KINDS[kind][1].filter(([of]) => of === section).map(([, key]) => key);
  return inputs.filter((input) => input.dataset.section === section).flatMap(({ name, value }) => {
    if (value.trim()) return `${name} = ${number(value)}`;
    return base.includes(name) ? `${name} = "unknown"  # fitted to the log` : [];
  });
}

function text() {
  const kind = by("form-kind").value;
  const inputs = [...by("fields").querySelectorAll("input")];
  const sections = { model: [`kind = "${kind}"`], motor: [], tolerance: [`default = ${TOLERANCE}  # relative, one standard deviation`], supply: [], encoder: [] };
  const blocks = Object.entries(sections).map(([section, first]) => [section, [...first, ...lines(section, kind, inputs)]]);
  const filled = blocks.filter(([, block]) => block.length).map(([section, block]) => `[${section}]\n${block.join("\n")}\n`);
  return `# Every key: docs/model.md of Truing\nschema = "truing-model/1"\n\n${filled.join("\n")}`;
}

export function begin(write) {
  fields("dc_motor");
  by("form").addEventListener("submit", (event) => (event.preventDefault(), write(text())));
}
