"use strict";

// The form of a design's options, drawn from the JSON Schemas of the service: what is installed tomorrow needs no new page.
// Only what was changed is sent. What a form cannot show, such as grippers at hand, is left to the API.

const NUMERIC = new Set(["number", "integer"]);

let known = null; // { plan: JSON Schema, items: [plug-ins] }, once the form is drawn
let productOfForm = "";

const dialog = byId("options");
const resolved = (schema, root) => (schema.$ref ? root.$defs[schema.$ref.split("/").pop()] : schema);

function limits(schema) {
  const parts = [];
  if (schema.minimum !== undefined) parts.push(`at least ${schema.minimum}`);
  if (schema.exclusiveMinimum !== undefined) parts.push(`more than ${schema.exclusiveMinimum}`);
  if (schema.maximum !== undefined) parts.push(`at most ${schema.maximum}`);
  if (schema.exclusiveMaximum !== undefined) parts.push(`less than ${schema.exclusiveMaximum}`);
  return parts.join(", ");
}

function worded(value) {
  if (Array.isArray(value)) return value.join(", ");
  return value === null || value === undefined ? "" : String(value);
}

// What an input holds, as JSON
function valueOf(input) {
  switch (input.dataset.type) {
    case "boolean":
      return input.checked;
    case "number":
    case "integer":
      return input.value === "" ? null : input.valueAsNumber;
    case "strings":
      return input.value.split(",").map((word) => word.trim()).filter(Boolean);
    case "any":
      try {
        return input.value === "" ? null : JSON.parse(input.value);
      } catch {
        return input.value;
      }
    default:
      return input.value;
  }
}

function typeOf(schema, root) {
  if (schema.enum || NUMERIC.has(schema.type) || schema.type === "boolean" || schema.type === "string") return schema.type ?? "string";
  if (schema.type === "array") return resolved(schema.items ?? {}, root).type === "string" ? "strings" : null;
  const kinds = schema.anyOf?.map((one) => resolved(one, root));
  return kinds?.every((one) => one.const !== undefined || one.enum || one.type !== "array" && one.type !== "object") ? "any" : null;
}

function inputOf(name, schema, root) {
  const type = typeOf(schema, root);
  if (type === null) return null;
  let input = element("input", "", { type: "text", autocomplete: "off", spellcheck: "false" });
  if (schema.enum) {
    input = document.createElement("select");
    input.append(...schema.enum.map((word) => element("option", word, { value: word })));
  } else if (NUMERIC.has(type)) {
    input = element("input", "", { type: "number", step: type === "integer" ? "1" : "any" });
    const [low, high] = [schema.minimum ?? schema.exclusiveMinimum, schema.maximum ?? schema.exclusiveMaximum];
    if (low !== undefined) input.min = low;
    if (high !== undefined) input.max = high;
  } else if (type === "boolean") {
    input = element("input", "", { type: "checkbox" });
    input.checked = schema.default === true;
  }
  if (type !== "boolean") input.value = worded(schema.default);
  input.name = name;
  input.dataset.type = type;
  input.dataset.initial = JSON.stringify(valueOf(input));
  return input;
}

// A label, its input, and what the schema says of it
function fieldOf(name, schema, root, input = inputOf(name, schema, root)) {
  if (input === null) return [];
  const label = element("label", name, {});
  input.id = `option-${name}`;
  label.htmlFor = input.id;
  const help = element("small", [schema.description?.replace(/\.$/, ""), limits(schema)].filter(Boolean).join("; "), { id: `help-${name}` });
  input.setAttribute("aria-describedby", help.id);
  const row = element("div", "", { class: "field" });
  row.append(label, input, help);
  return [row];
}

function fieldsOf(prefix, schema, root) {
  return Object.entries(schema.properties ?? {}).flatMap(([name, given]) => {
    const inner = resolved(given, root);
    if (inner.type === "object" && inner.properties) return fieldsOf(`${prefix}${name}.`, inner, root);
    return fieldOf(`${prefix}${name}`, { ...inner, ...given }, root);
  });
}

// Which plug-ins of a kind: one of them by its key, or any of them
function choiceOf(name, schema, plugins) {
  if (schema.type !== "array" && !schema.anyOf?.some((one) => one.type === "array")) {
    const keys = element("datalist", "", { id: `keys-${name}` });
    keys.append(...plugins.map((plugin) => element("option", plugin.summary, { value: plugin.name })));
    const input = inputOf(name, { type: "string", default: schema.default }, schema);
    input.setAttribute("list", keys.id);
    input.dataset.chooses = schema["x-plugins"];
    return [...fieldOf(name, schema, schema, input), keys];
  }
  const initial = [schema.default].flat();
  const group = element("fieldset", "", { "data-name": name, "data-initial": JSON.stringify(initial) });
  group.append(element("legend", name), element("small", schema.description ?? ""));
  const preferred = (plugin) => (initial.includes(plugin.name) ? initial.indexOf(plugin.name) : initial.length);
  for (const plugin of plugins.toSorted((one, other) => preferred(one) - preferred(other))) {
    const box = element("input", "", { type: "checkbox", value: plugin.name, "data-chooses": schema["x-plugins"] });
    box.checked = initial.includes(plugin.name);
    const label = element("label", "", { title: plugin.summary });
    label.append(box, ` ${plugin.name}`);
    group.append(label);
  }
  return [group];
}

// The parameters of every plug-in; those of plug-ins that are not chosen are hidden, and not sent
function parametersOf(plugin) {
  const fields = fieldsOf(`${plugin.name}.`, plugin.options, plugin.options);
  if (fields.length === 0) return [];
  const section = element("details", "", { "data-kind": plugin.kind, "data-key": plugin.name });
  section.append(element("summary", `${plugin.kind} ${plugin.name}`), element("p", plugin.summary), ...fields);
  return [section];
}

function showChosen() {
  const chosen = new Set();
  const all = new Set(); // kinds of which some other word than a key was given, that stands for several
  for (const input of dialog.querySelectorAll("[data-chooses]")) {
    const kind = input.dataset.chooses;
    if (input.type !== "checkbox" && !known.items.some((plugin) => plugin.kind === kind && plugin.name === input.value)) all.add(kind);
    if (input.type !== "checkbox" || input.checked) chosen.add(`${kind}/${input.value}`);
  }
  for (const section of dialog.querySelectorAll("[data-key]")) {
    section.hidden = !all.has(section.dataset.kind) && !chosen.has(`${section.dataset.kind}/${section.dataset.key}`);
  }
}

async function openOptions(productId) {
  if (known === null) {
    known = await call(`${API}/plugins`);
    const { plan } = known;
    const choices = Object.entries(plan.properties).filter(([, schema]) => schema["x-plugins"]);
    const others = { ...plan, properties: Object.fromEntries(Object.entries(plan.properties).filter(([, schema]) => !schema["x-plugins"])) };
    byId("options-fields").replaceChildren(
      element("h3", "Plug-ins"),
      ...choices.flatMap(([name, schema]) => choiceOf(name, schema, known.items.filter((plugin) => plugin.kind === schema["x-plugins"]))),
      element("h3", "Plan"),
      ...fieldsOf("", others, plan),
      element("h3", "Parameters"),
      ...known.items.flatMap(parametersOf),
    );
  }
  productOfForm = productId;
  byId("options-problem").hidden = true;
  showChosen();
  dialog.showModal();
}

// The options that differ from what they were
function changedOptions() {
  const options = {};
  for (const group of dialog.querySelectorAll("fieldset[data-name]")) {
    const keys = [...group.querySelectorAll("input:checked")].map((box) => box.value);
    if (JSON.stringify(keys) !== group.dataset.initial) options[group.dataset.name] = keys;
  }
  for (const input of dialog.querySelectorAll("[data-type]")) {
    if (input.closest("[hidden]")) continue;
    const value = valueOf(input);
    if (JSON.stringify(value) !== input.dataset.initial) options[input.name] = value;
  }
  return options;
}

// What is wrong with the options, at its field where it has one
function showProblem(error) {
  byId("options-problem").textContent = error.message;
  byId("options-problem").hidden = false;
  for (const { pointer, message } of error.faults ?? []) {
    const name = pointer.replace("/options/", "").replaceAll("/", ".");
    const input = byId("options-form").elements.namedItem(name);
    if (!input) continue;
    input.closest("details")?.setAttribute("open", "");
    input.setCustomValidity(message);
    input.reportValidity();
    return;
  }
}

dialog.addEventListener("input", (event) => {
  event.target.setCustomValidity?.("");
  showChosen();
});

byId("options-close").addEventListener("click", () => dialog.close());

byId("options-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  try {
    await postDesign(productOfForm, changedOptions());
    dialog.close();
  } catch (error) {
    showProblem(error);
  }
});
