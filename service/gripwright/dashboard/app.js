"use strict";

const REFRESH_MS = 4000;
const FOLLOWED_MAX = 3; // a browser opens six connections to one host; reading must stay possible
const FINAL = new Set(["succeeded", "failed", "cancelled"]);

const cards = new Map(); // job id -> card element
const streams = new Map(); // job id -> AbortController of its stream of events
const shownResults = new Map(); // job id -> attempt whose result is shown

let shownProducts = "";

const when = (text) => new Date(text).toLocaleString();

async function call(path, options) {
  const answer = await request(path, options);
  return answer.status === 204 ? null : answer.json();
}

function notify(message) {
  byId("notice").textContent = message;
  byId("notice").hidden = !message;
}

async function guarded(action) {
  try {
    await action();
    notify("");
  } catch (error) {
    notify(error.message);
  }
}

function element(tag, text, attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

function duration(job) {
  if (!job.started_at || !job.finished_at) return "";
  return `, took ${((new Date(job.finished_at) - new Date(job.started_at)) / 1000).toFixed(1)} s`;
}

function newCard(job) {
  const card = byId("design-card").content.firstElementChild.cloneNode(true);
  card.querySelector("h3").textContent = `${job.part_number} ${job.revision}`.trim();
  card.querySelector("progress").setAttribute("aria-label", `Progress of the design of ${job.part_number}`);
  card.querySelector(".cancel").addEventListener("click", () => steer(job.id, "cancel"));
  card.querySelector(".retry").addEventListener("click", () => steer(job.id, "retry"));
  cards.set(job.id, card);
  return card;
}

function steer(id, verb) {
  guarded(async () => {
    await call(`${API}/jobs/${id}/${verb}`, { method: "POST" });
    await refreshDesigns();
  });
}

function showState(id, state, outcome) {
  const card = cards.get(id);
  const status = state.status === "succeeded" && outcome ? outcome : state.status;
  const isOver = FINAL.has(state.status);
  const badge = card.querySelector(".badge");
  badge.textContent = status;
  badge.className = `badge ${status}`;
  card.querySelector(".bar").hidden = isOver;
  card.querySelector("progress").value = state.progress.fraction;
  const percent = `${Math.round(100 * state.progress.fraction)} %`;
  card.querySelector("output").textContent = [percent, state.progress.stage, state.progress.message].filter(Boolean).join(" · ");
  card.querySelector(".cancel").hidden = isOver;
  card.querySelector(".retry").hidden = !(status === "failed" || status === "cancelled");
  const summary = card.querySelector(".summary");
  summary.hidden = !state.problem;
  summary.textContent = state.problem ? state.problem.detail : "";
}

async function showResult(job) {
  if (!job.outcome || shownResults.get(job.id) === job.attempt) return;
  shownResults.set(job.id, job.attempt);
  const card = cards.get(job.id);
  const view = await call(job.design);
  const document_ = view.design;
  const covered = document_.operations.filter((operation) => operation.status === "covered").length;
  const summary = card.querySelector(".summary");
  const proof = document_.optimum?.proven ? ", proven to be the fewest" : "";
  summary.textContent =
    `${document_.grippers.length} grippers for ${covered} of ${document_.operations.length} operations${proof}`;
  summary.hidden = false;
  const reasons = card.querySelector(".reasons");
  reasons.replaceChildren(
    ...document_.operations
      .filter((operation) => operation.status !== "covered")
      .map((operation) => element("li", `${operation.id}: ${operation.detail}`)),
  );
  reasons.hidden = reasons.children.length === 0;
  showLinks(card, job, view.files);
}

function showLinks(card, job, files) {
  const links = card.querySelector(".links");
  const report = files.find((file) => file.path === "report.html");
  const table = files.find((file) => file.path === "bom.csv");
  links.replaceChildren(
    ...[
      report && element("a", "Report", { href: report.href }),
      table && element("a", "BOM (CSV)", { href: table.href }),
      element("a", "design.json", { href: `${job.design}/files/design.json` }),
      element("a", "All files (.zip)", { href: `${job.design}/package.zip` }),
    ].filter(Boolean),
  );
  links.hidden = false;
  const details = card.querySelector(".files");
  details.querySelector("summary").textContent = `${files.length} files`;
  details.querySelector("ul").replaceChildren(
    ...files.map((file) => {
      const item = document.createElement("li");
      item.append(element("a", file.path, { href: file.href }), ` ${(file.size / 1024).toFixed(1)} kB`);
      return item;
    }),
  );
  details.hidden = false;
}

function follow(job) {
  if (streams.has(job.id) || FINAL.has(job.status) || streams.size >= FOLLOWED_MAX) return;
  const abort = new AbortController();
  streams.set(job.id, abort);
  const receive = (state) => {
    if (state.attempt < job.attempt) return;
    if (FINAL.has(state.status)) abort.abort();
    else showState(job.id, state, null);
  };
  readEvents(job.id, abort.signal, receive)
    .catch(() => {}) // the next refresh says what is wrong, or follows again
    .finally(() => {
      streams.delete(job.id);
      if (abort.signal.aborted) refreshDesigns().catch((error) => notify(error.message));
    });
}

async function refreshDesigns() {
  const page = await call(`${API}/jobs?limit=50`);
  byId("no-designs").hidden = page.items.length > 0;
  for (const job of page.items) {
    const card = cards.get(job.id) ?? newCard(job);
    card.querySelector(".when").textContent = `requested ${when(job.created_at)}${duration(job)}`;
    if (!streams.has(job.id)) showState(job.id, job, job.outcome);
    follow(job);
    await showResult(job);
  }
  const order = page.items.map((job) => cards.get(job.id));
  const list = byId("designs");
  if (order.some((card, place) => list.children[place] !== card) || list.children.length !== order.length) {
    list.replaceChildren(...order);
  }
}

async function refreshProducts() {
  const page = await call(`${API}/products?limit=200`);
  const version = JSON.stringify(page);
  if (version === shownProducts) return; // rows that stay keep their focus
  shownProducts = version;
  byId("no-products").hidden = page.items.length > 0;
  byId("products").replaceChildren(
    ...page.items.toReversed().map((product) => {
      const row = document.createElement("tr");
      const name = element("th", "", { scope: "row" });
      name.append(element("a", product.part_number, { href: `${API}/products/${product.id}` }));
      const button = element("button", "Design grippers", { type: "button" });
      button.disabled = product.operations === 0;
      button.title = product.operations === 0 ? "PUT its operations first" : "";
      button.addEventListener("click", () => requestDesign(product.id));
      const options = element("button", "Options…", { type: "button" });
      options.disabled = button.disabled;
      options.addEventListener("click", () => guarded(() => openOptions(product.id)));
      const action = document.createElement("td");
      action.append(button, " ", options);
      row.append(
        name,
        element("td", product.revision),
        element("td", product.name),
        element("td", product.components, { class: "number" }),
        element("td", product.operations, { class: "number" }),
        element("td", when(product.created_at)),
        action,
      );
      return row;
    }),
  );
}

async function postDesign(productId, options) {
  await call(`${API}/products/${productId}/designs`, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ options }),
  });
  await refreshDesigns();
}

function requestDesign(productId) {
  guarded(() => postDesign(productId, {}));
}

byId("upload").addEventListener("submit", (event) => {
  event.preventDefault();
  const form = event.target;
  const button = form.querySelector("button");
  button.disabled = true;
  guarded(async () => {
    await call(`${API}/products`, { method: "POST", body: new FormData(form) });
    form.reset();
    await refreshProducts();
  }).finally(() => {
    button.disabled = false;
  });
});

async function show() {
  await refreshDesigns();
  await refreshProducts();
}

async function refresh() {
  const isSignedOut = !byId("sign-in").hidden;
  try {
    if (!isSignedOut) await show();
  } catch (error) {
    if (error.status !== 401) notify(`the service does not answer: ${error.message}`);
  }
  setTimeout(refresh, REFRESH_MS);
}

refresh();
